"""Recorded references: what compiled code gave, bit for bit, on the kinds of machines where it was recorded.

Compiled code may round otherwise on another processor (wider vectors sum in another order), under another compiler or with
another BLAS. A reference is therefore kept for each kind of machine, and a test that meets another kind does not pass in
silence: it holds what it gets against the plain twin of the same code, within that test's tolerance, warns that it did so,
and says how to record this kind:

    RECORD_REFERENCES=1 python -m pytest tests/sim/test_references.py tests/workers/test_references.py

Record only what a commit gives that is known to be right: one that passes on a kind that is recorded already.
"""

import hashlib
import json
import os
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path

import llvmlite
import llvmlite.binding
import numba
import numpy as np
import torch
from numpy.typing import NDArray
from threadpoolctl import threadpool_info

_DIGITS = 12  # of each hash: enough that no other numbers have it by chance


def machine() -> str:
    """The kind of machine: all that the rounding of compiled code depends on."""
    features = llvmlite.binding.get_host_cpu_features().flatten()
    blas = sorted({f"{one['prefix']} {one['version']} {one.get('architecture')}" for one in threadpool_info()})
    software = f"numba {numba.__version__}, llvmlite {llvmlite.__version__}, torch {torch.__version__}, {'; '.join(blas)}"
    digest = hashlib.sha256(f"{features} {software} {torch.backends.cpu.get_cpu_capability()}".encode()).hexdigest()
    return f"{llvmlite.binding.get_host_cpu_name()} {digest[:_DIGITS]}"


def digest(arrays: Iterable[NDArray[np.generic]]) -> str:
    """A hash of the bits of arrays."""
    total = hashlib.sha256()
    for array in arrays:
        total.update(f"{array.dtype.str}{array.shape}".encode())
        total.update(np.ascontiguousarray(array).tobytes())
    return total.hexdigest()[:_DIGITS]


def check(file: Path, name: str, hashes: list[str], plain: Callable[[], None]) -> None:
    """Hold hashes, one for each part in order, against those recorded; elsewhere let `plain` hold the code against its twin.

    Args:
        file: of the references, beside the test.
        name: of the case.
        hashes: what was found.
        plain: asserts that the code agrees with the plain twin.
    """
    recorded = json.loads(file.read_text()) if file.exists() else {}
    here = recorded.setdefault(machine(), {})
    if os.environ.get("RECORD_REFERENCES"):
        here[name] = hashes
        file.write_text(json.dumps(recorded, indent=1, sort_keys=True) + "\n")
    elif not here:
        warnings.warn(
            f"{file.name} has no references of this kind of machine ({machine()}): {name} is only held against its plain "
            "twin, within a tolerance. Record it with RECORD_REFERENCES=1, see tests/references.py",
            stacklevel=2,
        )
        plain()
        return
    assert name in here, f"{file.name} has no reference {name!r} for this kind of machine: record it (tests/references.py)"
    differing = [part for part, (found, expected) in enumerate(zip(hashes, here[name], strict=True)) if found != expected]
    assert not differing, f"{name}: parts {differing} of {len(hashes)} are not, bit for bit, what they were"
