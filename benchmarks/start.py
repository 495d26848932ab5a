"""What it takes to start the service, and what it holds once it waits for work, by the number of its workers.

Each time an installation of its own is started (`mapless up`) and looked at until its processes have nothing left to do:
the seconds until then, their processor time, how many they are, and their memory, where a page that several share counts
once (PSS). Another version's checkout (`--before`) is started by turns with this one, with its caches of compiled code.

    python -m benchmarks.start --workers 1 2 8 --repeats 3 --check
"""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import NamedTuple

import psutil

from benchmarks.processes import free_port, tree
from benchmarks.report import finish, parser

ROOT = Path(__file__).resolve().parents[1]
_LOOK_SECONDS = 0.5
# Who waits uses less of a core than this for so many looks.
_IDLE_SHARE = 0.08
_IDLE_LOOKS = 6
_PATIENCE_SECONDS = 300.0
# A worker more costs little beside the first: its trainers come from the same process.
MAX_MB_A_WORKER = 60.0


class Start(NamedTuple):
    """What a start took, and what it left."""

    seconds: float
    cpu_seconds: float
    processes: int
    megabytes: float


@contextlib.contextmanager
def _service(root: Path, workers: int, directory: Path) -> Iterator[int]:
    process = subprocess.Popen(
        [
            *(sys.executable, "-c", "from server.cli import main; main()", "up", "--workers", str(workers)),
            *("--port", str(free_port()), "--data-dir", str(directory)),
        ],
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield process.pid
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60)


def start(root: Path, workers: int) -> Start:
    """Start an installation, and look at it until it waits.

    Raises:
        TimeoutError: it did not come to rest.
    """
    with TemporaryDirectory() as directory, _service(root, workers, Path(directory)) as pid:
        begun = time.monotonic()
        spent: dict[int, float] = {}
        before, at_rest, ready = 0.0, 0, 0.0
        while at_rest < _IDLE_LOOKS:
            time.sleep(_LOOK_SECONDS)
            now = time.monotonic() - begun
            if now > _PATIENCE_SECONDS:
                raise TimeoutError(f"{workers} workers still had something to do after {now:.0f} s")
            for process in tree(pid):
                with contextlib.suppress(psutil.NoSuchProcess):
                    times = process.cpu_times()
                    spent[process.pid] = times.user + times.system
            idle = sum(spent.values()) - before < _IDLE_SHARE * _LOOK_SECONDS
            before = sum(spent.values())
            at_rest, ready = (at_rest + 1, ready) if idle else (0, now)
        members = tree(pid)
        return Start(ready, before, len(members), sum(_pss(process) for process in members) / 1e6)


def _pss(process: psutil.Process) -> float:
    with contextlib.suppress(psutil.NoSuchProcess):
        return float(process.memory_full_info().pss)
    return 0.0


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, and print a line for each start."""
    known = parser(__doc__)
    known.add_argument("--workers", type=int, nargs="+", default=[1, 2, 8])
    known.add_argument("--repeats", type=int, default=3)
    known.add_argument("--before", type=Path, help="another checkout, started by turns with this one")
    options = known.parse_args(arguments)
    roots = {"now": ROOT, **({"before": options.before.resolve()} if options.before else {})}
    found: dict[tuple[str, int], list[Start]] = {}
    for _ in range(options.repeats):
        for workers in options.workers:
            for name, root in roots.items():
                found.setdefault((name, workers), []).append(start(root, workers))
                print(name, workers, found[name, workers][-1], flush=True)
    figures: dict[str, object] = {
        f"{field}_{workers}_{name}": round(median(getattr(each, field) for each in starts), 1)
        for (name, workers), starts in found.items()
        for field in Start._fields
    }
    least, most = min(options.workers), max(options.workers)
    targets = {}
    if most > least:
        more = [float(str(figures[f"megabytes_{workers}_now"])) for workers in (least, most)]
        figures["megabytes_a_worker"] = round((more[1] - more[0]) / (most - least), 1)
        targets = {"megabytes_a_worker": MAX_MB_A_WORKER}
    finish("start", figures, at_most=targets, check=options.check)


if __name__ == "__main__":
    main()
