"""What a server does once it answers, so that no single request pays for it later."""

import gc
import importlib
import threading

# What intervals take (`workers.statistics.intervals`): half a second that a start need not wait for, nor the first page.
_WANTED_SOON = ("scipy.special",)


def settle_in_background() -> None:
    """Settle on a thread of its own, which ends with the process."""
    threading.Thread(target=settle, name="settling", daemon=True).start()


def settle() -> None:
    """Import what pages will want, and leave all that is there by then out of the collector's sight.

    The modules, routes and models of a server live as long as it does. A look through all of them for garbage takes a fifth
    of a second, in which nothing is answered.
    """
    for name in _WANTED_SOON:
        importlib.import_module(name)
    gc.freeze()
