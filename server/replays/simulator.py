"""Which simulator drives episodes again: what another one drove is not shown as the work of this one."""

import functools
import hashlib
from importlib.metadata import PackageNotFoundError, version

from server.settings import PROJECT_ROOT

# What rounds, beside our own code.
_PACKAGES = ("numba", "numpy", "pymunk", "torch")


@functools.cache
def simulator() -> str:
    """16 hexadecimal digits of what decides how an episode goes: our sources, and the packages that compute.

    A server that is installed without those packages leaves them to its workers.
    """
    digest = hashlib.sha256(" ".join(_version(package) for package in _PACKAGES).encode())
    for path in sorted(path for package in ("sim", "workers") for path in (PROJECT_ROOT / package).rglob("*.py")):
        digest.update(f"\n{path.relative_to(PROJECT_ROOT)}\n".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "elsewhere"
