"""The real stack and a real Chromium: `mapless up` in a directory of its own, driven by Playwright."""

import os
import re
import selectors
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, BrowserContext, expect, sync_playwright

ROOT = Path(__file__).parents[2]
# A browser that draws 3D in software, beside trainings, on two busy cores: what is slow there isn't wrong.
PATIENCE = 60_000
# Software rendering of WebGL, and none of the background connections of a desktop browser.
CHROMIUM_FLAGS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-unsafe-swiftshader",
]


def read_url(process: "subprocess.Popen[str]", seconds: float) -> str:
    """The address that `mapless up` prints once it answers."""
    assert process.stdout is not None
    selector = selectors.DefaultSelector()
    selector.register(process.stdout, selectors.EVENT_READ)
    seen = ""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if not selector.select(timeout=1.0):
            continue
        line = process.stdout.readline()
        if not line:
            break
        seen += line
        if match := re.search(r"http://\S+token=\S+", line):
            return match.group()
    raise AssertionError(f"mapless up printed no address:\n{seen}")


@contextmanager
def running(
    mapless: list[str], directory: Path, workers: int, *, port: int = 0, env: dict[str, str] | None = None
) -> Iterator[str]:
    """The address, with its login token, of a service that runs meanwhile.

    Args:
        mapless: the command.
        directory: where it keeps its data.
        workers: how many it has.
        port: to listen on; any free one if not given.
        env: the environment; this one if not given.
    """
    command = [*mapless, "up", "--port", str(port), "--workers", str(workers), "--data-dir", str(directory)]
    process = subprocess.Popen(command, cwd=ROOT, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield read_url(process, 60.0)
    finally:
        process.send_signal(signal.SIGINT)
        # How soon is asked in tests/services, where no browser has the cores.
        assert process.wait(60) == 0, "Ctrl-C must end the service cleanly"


@pytest.fixture(scope="package")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address, with its login token, of a service with two workers that runs until the last of these tests has ended."""
    with running([sys.executable, "-m", "server"], tmp_path_factory.mktemp("data"), workers=2) as address:
        yield address


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """Debian's Chromium, or any that is on the path."""
    executable = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if executable is None:
        if os.environ.get("REQUIRE_CHROMIUM"):
            pytest.fail("no Chromium on the path, and REQUIRE_CHROMIUM is set")
        pytest.skip("no Chromium on the path")
    expect.set_options(timeout=PATIENCE)
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=executable, args=CHROMIUM_FLAGS)
        yield chromium
        chromium.close()


@contextmanager
def logged_in(browser: Browser, address: str) -> Iterator[BrowserContext]:
    """A browser profile of its own, 1280 x 900, in which a service's page has been opened by its address."""
    origin = "{0.scheme}://{0.netloc}".format(urlsplit(address))
    context = browser.new_context(base_url=origin, viewport={"width": 1280, "height": 900}, accept_downloads=True)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    page.goto(address)
    page.close()
    yield context
    context.close()


@pytest.fixture
def context(browser: Browser, stack: str) -> Iterator[BrowserContext]:
    """A profile that is logged in to `stack`."""
    with logged_in(browser, stack) as context:
        yield context
