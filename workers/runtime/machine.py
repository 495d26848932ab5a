"""What this machine is like and how busy it is, for the people who look at the queue."""

import os
import shutil
import subprocess
import time

from workers.protocol import Gpu, Machine

# nvidia-smi takes a good part of a second.
_GPU_SECONDS = 30.0
_GPU_QUERY = ("nvidia-smi", "--query-gpu=name,memory.total,memory.used,utilization.gpu", "--format=csv,noheader,nounits")
_MEBIBYTE = 2**20


class MachineWatch:
    """Looks at the machine whenever it is asked.

    Args:
        gpu: whether its graphics card matters.
    """

    def __init__(self, *, gpu: bool) -> None:
        self._gpu = gpu and shutil.which(_GPU_QUERY[0]) is not None
        self._gpu_seen: tuple[float, Gpu | None] | None = None

    def look(self) -> Machine:
        """As it is now; what the system does not tell is None."""
        memory = _memory()
        return Machine(
            host=os.uname().nodename[:120],
            cores=os.cpu_count() or 1,
            load=os.getloadavg()[0],
            memory_bytes=memory.get("MemTotal"),
            memory_used_bytes=memory["MemTotal"] - memory["MemAvailable"] if "MemAvailable" in memory else None,
            gpu=self._look_at_gpu() if self._gpu else None,
        )

    def _look_at_gpu(self) -> Gpu | None:
        now = time.monotonic()
        if self._gpu_seen is None or now - self._gpu_seen[0] > _GPU_SECONDS:
            self._gpu_seen = now, _first_gpu()
        return self._gpu_seen[1]


def _memory() -> dict[str, int]:
    """Bytes by the kernel's own names; empty where it is not Linux."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:  # noqa: PTH123 (procfs)
            rows = [line.split() for line in file]
    except OSError:
        return {}
    return {row[0].rstrip(":"): int(row[1]) * 1024 for row in rows if len(row) == 3}


def _first_gpu() -> Gpu | None:
    try:
        answer = subprocess.run(_GPU_QUERY, capture_output=True, text=True, timeout=10.0, check=True)
        name, total, used, busy = (part.strip() for part in answer.stdout.splitlines()[0].rsplit(",", 3))
        return Gpu(
            name=name[:80], memory_bytes=int(total) * _MEBIBYTE, used_bytes=int(used) * _MEBIBYTE, busy=int(busy) / 100
        )
    except (OSError, subprocess.SubprocessError, ValueError, IndexError):
        return None
