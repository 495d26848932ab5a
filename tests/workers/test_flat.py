"""Parameters in one vector behave as they did in their layers, and our Adam steps as torch's."""

import pytest
import torch
from torch import nn

from workers.algorithms.flat import FlatAdam, FlatParameters


def make_network() -> nn.Sequential:
    torch.manual_seed(0)
    return nn.Sequential(nn.Linear(3, 8), nn.Tanh(), nn.Linear(8, 2))


@pytest.mark.parametrize("path", ["compiled", "tensors"])
def test_adam_steps_as_torchs(path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = make_network(), make_network()
    adam = FlatAdam(ours, learning_rate=1e-2)
    if path == "tensors":  # as on any other device than a CPU
        monkeypatch.setattr(adam, "_compiled", None)
    reference = torch.optim.Adam(theirs.parameters(), lr=1e-2)
    for step in range(50):
        inputs = torch.randn(16, 3, generator=torch.Generator().manual_seed(step))
        adam.learning_rate = reference.param_groups[0]["lr"] = 1e-2 * (1 - step / 50)
        adam.descend(ours(inputs).square().sum())
        reference.zero_grad()
        theirs(inputs).square().sum().backward()
        reference.step()
    for mine, other in zip(ours.parameters(), theirs.parameters(), strict=True):
        assert torch.allclose(mine, other, rtol=0, atol=1e-6)


def test_a_step_by_tensors_is_that_by_numbers() -> None:
    """A recorded graph reads its rates from tensors."""
    by_numbers, by_tensors = (FlatAdam(make_network(), learning_rate=1e-2) for _ in range(2))
    for adam in (by_numbers, by_tensors):
        adam.gradients.copy_(torch.linspace(-1.0, 1.0, len(adam.gradients)))
    for _ in range(3):
        by_numbers.step_by(*by_numbers.next_rates())
        rate, epsilon = by_tensors.next_rates()
        by_tensors.step_by(torch.tensor(rate), torch.tensor(epsilon))
    assert torch.allclose(by_numbers.values, by_tensors.values, rtol=0, atol=1e-8)


def test_values_and_gradients_are_the_modules_own() -> None:
    network = make_network()
    before = [parameter.clone() for parameter in network.parameters()]
    parameters = FlatParameters(network)
    assert all(torch.equal(a, b) for a, b in zip(before, network.parameters(), strict=True))
    parameters.values.mul_(2.0)
    assert all(torch.equal(2.0 * a, b) for a, b in zip(before, network.parameters(), strict=True))
    parameters.differentiate(network(torch.ones(1, 3)).sum())
    assert torch.equal(parameters.gradients[-2:], torch.ones(2))  # the last bias adds to the sum as it is


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf")])
def test_what_is_not_finite_is_seen(number: float) -> None:
    parameters = FlatParameters(make_network())
    assert parameters.finite
    parameters.values[5] = number
    assert not parameters.finite


def test_numbers_whose_sum_is_not_finite_are() -> None:
    parameters = FlatParameters(make_network())
    parameters.values.fill_(3e38)
    assert parameters.finite


def test_nan_in_a_gradient_is_not_clipped_away() -> None:
    adam = FlatAdam(make_network(), learning_rate=1e-2)
    adam.gradients[5] = float("nan")
    adam.clip_gradients(0.5)
    adam.step()
    assert not adam.finite


@pytest.mark.parametrize("norm", [0.1, 10.0])
def test_clipping_only_ever_shrinks(norm: float) -> None:
    parameters = FlatParameters(nn.Linear(1, 1), nn.Linear(1, 1))
    parameters.gradients.copy_(torch.tensor([3.0, 4.0, 0.3, 0.4]))
    parameters.clip_gradients(norm)
    for part, length in ((parameters.gradients[:2], 5.0), (parameters.gradients[2:], 0.5)):
        assert part.norm().item() == pytest.approx(min(norm, length), rel=1e-4)
