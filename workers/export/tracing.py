"""The ONNX graph of a network that only its module knows, as PyTorch exports it."""

import tempfile
import warnings
from pathlib import Path

import torch

from workers.errors import ExportError
from workers.networks.modules import fresh_network
from workers.policy import Policy

# As `workers.export.graph` writes it.
_OPSET = 17


def trace(policy: Policy) -> bytes:
    """A policy's network from (n, size) to (n, outputs) as an ONNX file.

    Raises:
        ExportError: PyTorch cannot export the module.
    """
    module = fresh_network(policy.network, policy.inputs, policy.actions.size)
    module.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in policy.weights.items()})
    with tempfile.TemporaryDirectory() as directory, warnings.catch_warnings():
        file = Path(directory) / "network.onnx"
        # The newer exporter needs one more package, and the older one says that there is a newer one.
        warnings.simplefilter("ignore")
        try:
            torch.onnx.export(
                module.eval(),
                (torch.zeros(2, policy.inputs.size),),
                file,
                input_names=["x"],
                output_names=["y"],
                dynamic_axes={"x": {0: "n"}, "y": {0: "n"}},
                opset_version=_OPSET,
                dynamo=False,
            )
        except (RuntimeError, torch.onnx.errors.OnnxExporterError) as error:
            raise ExportError(f"PyTorch cannot export the network {policy.network.name!r}: {error}") from error
        return file.read_bytes()
