"""Which simulator drives episodes again: what another one drove is not shown as the work of this one."""

import functools
import hashlib
from importlib.metadata import version

from server.processes import ROOT

# What rounds, beside our own code.
_PACKAGES = ("numba", "numpy", "pymunk", "torch")


@functools.cache
def simulator() -> str:
    """16 hexadecimal digits of everything that decides how an episode goes: our sources, and the packages that compute."""
    digest = hashlib.sha256(" ".join(version(package) for package in _PACKAGES).encode())
    for path in sorted(path for package in ("sim", "workers") for path in (ROOT / package).rglob("*.py")):
        digest.update(f"\n{path.relative_to(ROOT)}\n".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
