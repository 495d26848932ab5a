"""Convolutions along a scan: as one matrix product where it is short, as a scan in batches is.

A matrix that is zero beside the kernel's places has length / kernel size times the arithmetic, of which a processor does
many times as much in the same time: convolutions of so few channels keep it waiting.
"""

from functools import lru_cache

import torch
from torch import Tensor
from torch.nn import functional

LONGEST = 3
"""Kernels that fit into a scan side by side, at most, for it to be a matrix product.

With 1,024 rows, forward and back: twice to three times as quick at 2 kernels, as quick at 4 to 6, half as quick at 12.
"""


def convolve(values: Tensor, weight: Tensor, bias: Tensor, stride: int, padding: int) -> Tensor:
    """A convolution, as `torch.nn.functional.conv1d` means it.

    Args:
        values: (n, channels, length).
        weight: (outputs, channels, kernel).
        bias: (outputs,).
        stride: of the kernel's places.
        padding: zeros at each end.

    Returns:
        (n, outputs, places).
    """
    rows, channels, length = values.shape
    outputs, _, kernel = weight.shape
    if length > LONGEST * kernel:
        return functional.conv1d(values, weight, bias, stride, padding)
    places = (length + 2 * padding - kernel) // stride + 1
    spread = weight.reshape(-1, kernel) @ _selection(kernel, length, places, stride, padding, weight.device)
    matrix = spread.view(outputs, channels, length, places).permute(1, 2, 0, 3).reshape(channels * length, outputs * places)
    biases = bias[:, None].expand(outputs, places).reshape(-1)
    return torch.addmm(biases, values.flatten(1), matrix).view(rows, outputs, places)


@lru_cache(maxsize=64)
def _selection(kernel: int, length: int, places: int, stride: int, padding: int, device: torch.device) -> Tensor:
    """(kernel, length * places): 1 where that number of the kernel, at that place, meets that number of the scan."""
    met = torch.arange(length)[:, None] - stride * torch.arange(places) + padding
    return (met == torch.arange(kernel)[:, None, None]).float().flatten(1).to(device)
