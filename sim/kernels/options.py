"""How the kernels are compiled, and where what was compiled is kept."""

import hashlib
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, Literal, cast

import numba

_config: Any = numba.config
_njit: Any = numba.njit  # whose stubs leave out what is private


def kernels_in(folder: Path) -> Callable[..., Callable[[Callable[..., Any]], Any]]:
    """The decorator `kernel` for the kernels of a folder, which may call one another, but use nothing of ours beyond it."""
    # Compiled code holds the functions that it calls and the numbers that it names. Numba compiles anew when the file of a
    # function has changed, but does not look at those of what it calls: kept by all sources, code is never older than any of
    # them. What kernels take from our other modules stands in none of these files, so they take nothing from there.
    files = sorted({*folder.glob("*.py"), Path(__file__)})
    sources = hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:16]
    kept = str(Path(_config.CACHE_DIR or folder / "__pycache__") / sources)

    def kernel(
        *, fastmath: Collection[str] = (), inline: Literal["never", "always"] = "never", allocates: bool = False
    ) -> Callable[[Callable[..., Any]], Any]:
        """Compile a function, and keep the compiled code for the next process.

        Args:
            fastmath: floating-point freedoms.
            inline: "always" for what is called for each robot or shape: a call hands over at least seven numbers for each
                array.
            allocates: whether it makes arrays or returns any, or calls what does. For all others Numba need not count
                references to their arrays, which it does atomically and at every call: a good part of the time of what is
                called that often.
        """

        def compiled(function: Callable[..., Any]) -> Any:
            usual, _config.CACHE_DIR = _config.CACHE_DIR, kept
            try:
                return _njit(
                    function,
                    cache=True,
                    nogil=True,
                    error_model="numpy",
                    fastmath=set(fastmath),
                    inline=inline,
                    _nrt=allocates,
                )
            finally:
                _config.CACHE_DIR = usual

        return compiled

    return kernel


def bound(function: Any, *arguments: object) -> Callable[..., Any]:
    """A kernel's code for arguments of the types of these, without the look at them that every call of a kernel begins with.

    Where bundles of arrays are handed over that look takes three to five microseconds, as long as a step of ten robots.
    Nothing is checked any more: whoever calls what this returns hands over arrays of the same types, numbers of dimensions
    and orders in memory.
    """
    if _config.DISABLE_JIT:
        return cast("Callable[..., Any]", function)
    compiled: Callable[..., Any] = function.compile(tuple(function.typeof_pyval(argument) for argument in arguments))
    return compiled


kernel = kernels_in(Path(__file__).parent)
