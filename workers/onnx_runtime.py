"""ONNX Runtime, on one thread, as whoever runs a file here calls it.

Since 1.29 its builds for Linux and macOS report what they run to their maker, and keep an identifier of the machine in the
user's home, unless they are told not to before they are loaded. Here they are: what a lab runs is nobody else's business.
"""

import os
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from onnxruntime import InferenceSession


def load() -> ModuleType:
    """The library, silent: the only way to it."""
    os.environ["ORT_DISABLE_TELEMETRY"] = "1"
    import onnxruntime

    module: ModuleType = onnxruntime
    return module


def session(graph: bytes) -> "InferenceSession":
    """An ONNX file, ready to run.

    Raises:
        Exception: it is none that ONNX Runtime runs; its errors share no base but this.
    """
    library = load()
    options = library.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3
    return library.InferenceSession(graph, options, providers=["CPUExecutionProvider"])
