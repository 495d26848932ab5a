"""Whether an ONNX file can be a task's policy, found out in a process that nobody misses.

`python -m workers.onnx_check` reads a line with the task as JSON and then the file, and writes why it can't, or nothing.
"""

import resource
import sys

from sim.config import TaskConfig
from workers.errors import ForeignPolicyError
from workers.onnx_policy import OnnxPolicy

MEMORY_BYTES = 3 * 2**30
"""That the process may have of its own."""
CPU_SECONDS = 60
"""After which it is ended."""


def problem(graph: bytes, task: TaskConfig) -> str:
    """What is wrong with a file; "" where ONNX Runtime takes it and its shapes are the task's."""
    try:
        OnnxPolicy(graph, task)
    except ForeignPolicyError as error:
        return str(error)
    except MemoryError:
        return "it takes too much memory"
    return ""


def main() -> None:
    """Reads, looks, tells."""
    for kind, most in ((resource.RLIMIT_DATA, MEMORY_BYTES), (resource.RLIMIT_CPU, CPU_SECONDS)):
        _, hard = resource.getrlimit(kind)
        resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    task = TaskConfig.model_validate_json(sys.stdin.buffer.readline())
    sys.stdout.write(problem(sys.stdin.buffer.read(), task))


if __name__ == "__main__":
    main()
