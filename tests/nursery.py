"""One nursery for all tests that have trainers or jobs forked: its imports take seconds."""

import functools

from workers.runtime.nursery_keeper import NurseryKeeper


@functools.cache
def keeper() -> NurseryKeeper:
    """Lasts as long as the tests. Ask for it on the first thread."""
    keeper = NurseryKeeper()
    keeper.keep_running()
    return keeper
