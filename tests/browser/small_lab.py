"""A service with one of everything, for tests that look at many pages."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, BrowserContext

from benchmarks.dashboard.addresses import SMALL, addresses
from benchmarks.dashboard.data import Sizes, make
from tests.browser.conftest import logged_in, running

Addresses = dict[str, tuple[str, str]]
"""By the name of a page its address, and what is there once it is whole."""


@contextmanager
def small_lab(directory: Path, browser: Browser) -> Iterator[tuple[Addresses, BrowserContext]]:
    """The addresses of its pages, and a browser that stands still and is logged in; nobody trains."""
    found = addresses(make(directory, Sizes(**SMALL)))
    with (
        running([sys.executable, "-m", "server"], directory, workers=0) as address,
        logged_in(browser, address) as context,
    ):
        yield found, context
