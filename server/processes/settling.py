"""How a server's process keeps its memory, and what it does once it answers, so that no single request pays for it later."""

import ctypes
import gc
import importlib
import threading

# What intervals take (`workers.statistics.intervals`): half a second that a start need not wait for, nor the first page.
_WANTED_SOON = ("scipy.special",)

# Of a hundred reporting runs, their views and streams, 75,000 objects are alive; by Python's own thresholds (700, 10, 10)
# the newest are looked through fifty times a second and all of them every two seconds, which took a sixth of its core.
_GARBAGE = 10_000, 10, 10
# `M_ARENA_MAX` of glibc's malloc.h, and how many.
_ARENA_MAX, _ARENAS = -8, 2


def share_memory() -> None:
    """Let all threads allocate from two arenas; to be called before there are threads.

    glibc gives each thread one of its own, up to eight for each core, and what an answer needed for a moment stays in the
    arena of the thread that made it: a server whose forty threads answer in turn grew by 5 % a minute, with two by nothing.
    Where there is no glibc nothing is done.
    """
    if (mallopt := getattr(ctypes.CDLL(None), "mallopt", None)) is not None:
        mallopt(_ARENA_MAX, _ARENAS)


def settle_in_background() -> None:
    """Settle on a thread of its own, which ends with the process."""
    threading.Thread(target=settle, name="settling", daemon=True).start()


def settle() -> None:
    """Import what pages will want, and leave all that is there by then out of the collector's sight.

    The modules, routes and models of a server live as long as it does. A look through all of them for garbage takes a fifth
    of a second, in which nothing is answered. What comes later is looked through more seldom.
    """
    for name in _WANTED_SOON:
        importlib.import_module(name)
    gc.freeze()
    gc.set_threshold(*_GARBAGE)
