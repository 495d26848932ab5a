"""What is compiled: that it is never older than what it was compiled from."""

import hashlib
from pathlib import Path

import sim.kernels
from sim.kernels.movers import move_movers
from sim.kernels.sensing import scan_poses
from sim.kernels.step import step_robots


def test_compiled_code_is_kept_by_the_sources_of_all_kernels() -> None:
    # Numba alone would go on with a `step_robots` that was compiled with yesterday's `sense`.
    (folder,) = sim.kernels.__path__
    sources = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(Path(folder).glob("*.py")))).hexdigest()
    for kernel in (step_robots, move_movers, scan_poses):
        assert Path(kernel.stats.cache_path).parent.name == sources[:16]
