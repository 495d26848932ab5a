"""Opens pages in headless Chromium, each in a profile that has seen nothing, and measures what they cost."""

import json
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

from benchmarks.dashboard.server import Server

_FLAGS = ("--no-sandbox", "--no-first-run", "--disable-background-networking", "--disable-component-update")
PATIENCE_SECONDS = 120.0
# A page is at rest once it has asked nothing for so long; what shows runs that report never is, and is given up soon.
_REST_SECONDS = 1.0
_RESTLESS_SECONDS = 5.0
_VIEWPORT = {"width": 1280, "height": 900}

# Runs in the page before anything of its own: notes the longest task and when the page was first as it should be.
_WATCH = """
window.__longest = 0; window.__drawn = null; window.__seen = [];
new PerformanceObserver((list) => {
  for (const entry of list.getEntries()) window.__longest = Math.max(window.__longest, entry.duration)
}).observe({ type: 'longtask', buffered: true });
const whenReady = () => {
  if (!window.__drawn && document.body && (READY)) { window.__drawn = performance.now() }
  if (!window.__drawn) requestAnimationFrame(whenReady)
};
// The frames within a page, as the one of the robots in 3D, are never ready, and would have it drawn sixty times a second.
if (window === top) requestAnimationFrame(whenReady);
let last = '';
const follow = () => {
  const steps = [...document.querySelectorAll('[data-testid=vitals] dt')].find((dt) => dt.textContent === 'Steps');
  const vitals = steps ? Number(steps.nextSibling.textContent.split(' of ')[0].replace(/\\D/g, '')) : 0;
  const curve = Number(document.querySelector('[data-testid=chart]')?.dataset.step ?? 0);
  if (`${vitals} ${curve}` !== last) { last = `${vitals} ${curve}`; window.__seen.push([Date.now() / 1000, vitals, curve]) }
};
if (window === top) setInterval(follow, 50);
"""


@dataclass(frozen=True)
class Cost:
    """What a page cost from its address to its rest.

    Attributes:
        server_ms: processor time of the server.
        drawn_ms: until everything was there that a person came for.
        longest_ms: the longest time in which the page answered nobody.
        tab_mb: memory of the tab's process that it shares with nobody.
        kb: that came over the network.
    """

    server_ms: float
    drawn_ms: float
    longest_ms: float
    tab_mb: float
    kb: float


class Tabs:
    """A Chromium that is logged in to a server.

    Args:
        browser: the Chromium.
        server: whose pages it opens.
        patience: seconds within which a page is drawn, or given up.
    """

    def __init__(self, browser: Browser, server: Server, patience: float = PATIENCE_SECONDS) -> None:
        self._browser = browser
        self._server = server
        self._patience = patience
        self._cdp = browser.new_browser_cdp_session()
        context = browser.new_context()
        page = context.new_page()
        page.set_default_navigation_timeout(1000 * patience)
        page.goto(f"{server.origin}/?token={server.token}")
        self._login = context.storage_state()
        context.close()

    def open(self, path: str, ready: str) -> Page:
        """A page in a profile of its own, as it is being loaded."""
        page = self._blank(ready)
        page.goto(f"{self._server.origin}{path}", wait_until="commit")
        return page

    def _blank(self, ready: str) -> Page:
        context = self._browser.new_context(viewport=_VIEWPORT, storage_state=self._login)  # type: ignore[arg-type]
        # The robots in 3D have a benchmark of their own (watching_overhead).
        context.route("**/live/**", lambda route: route.abort())
        page = context.new_page()
        page.set_default_navigation_timeout(1000 * self._patience)
        page.add_init_script(_WATCH.replace("READY", ready))
        return page

    def visit(self, path: str, ready: str) -> Cost:
        """Open a page, wait until it is at rest, and close it."""
        before = self._server.cpu_ms()
        sent = self._renderers()
        page = self._blank(ready)
        received = _Received(page.context, page)
        try:
            page.goto(f"{self._server.origin}{path}", wait_until="commit")
            drawn, _ = self.drawn(page)
            received.wait_for_rest()
            longest = page.evaluate("window.__longest")
            return Cost(
                server_ms=self._server.cpu_ms() - before,
                drawn_ms=drawn,
                longest_ms=longest,
                tab_mb=max((_private_mb(pid) for pid in self._renderers() - sent), default=0.0),
                kb=received.bytes / 1000,
            )
        finally:
            page.context.close()

    def drawn(self, page: Page) -> tuple[float, float]:
        """When the page was drawn, and its longest task so far, milliseconds.

        Raises:
            TimeoutError: it was given up.
        """
        # Not Playwright's own waiting, which the pages' content security policy forbids.
        deadline = time.monotonic() + self._patience
        while not page.evaluate("window.__drawn"):
            if time.monotonic() > deadline:
                raise TimeoutError(f"{page.url} was not drawn within {self._patience:g} s")
            page.wait_for_timeout(20)
        return page.evaluate("window.__drawn"), page.evaluate("window.__longest")

    def _renderers(self) -> set[int]:
        processes = self._cdp.send("SystemInfo.getProcessInfo")["processInfo"]
        return {process["id"] for process in processes if process["type"] == "renderer"}


class _Received:
    """Counts what a page receives, and when it was last asked or answered."""

    def __init__(self, context: BrowserContext, page: Page) -> None:
        self.bytes = 0
        self._page = page
        self._open: dict[str, bool] = {}
        self._last = time.monotonic()
        session = context.new_cdp_session(page)
        session.send("Network.enable")
        session.on("Network.requestWillBeSent", self._asked)
        session.on("Network.loadingFinished", self._answered)
        session.on("Network.loadingFailed", self._answered)

    def wait_for_rest(self) -> None:
        """Until nothing is under way, and nothing was for a while, or it is plain that there will be no rest."""
        deadline = time.monotonic() + _RESTLESS_SECONDS
        while time.monotonic() < deadline:
            self._page.wait_for_timeout(100)
            if not self._open and time.monotonic() - self._last > _REST_SECONDS:
                return

    def _asked(self, event: Mapping[str, object]) -> None:
        request = event["request"]
        assert isinstance(request, Mapping)
        # The change stream never ends, and the status is asked for every few seconds.
        if urlsplit(str(request["url"])).path not in ("/api/events", "/api/status"):
            self._open[str(event["requestId"])] = True
            self._last = time.monotonic()

    def _answered(self, event: Mapping[str, object]) -> None:
        length = event.get("encodedDataLength", 0)
        self.bytes += int(length) if isinstance(length, int | float) else 0
        if self._open.pop(str(event["requestId"]), False):
            self._last = time.monotonic()


@contextmanager
def tabs(server: Server, patience: float = PATIENCE_SECONDS) -> Iterator[Tabs]:
    """Debian's Chromium, or any that is on the path, logged in.

    Args:
        server: whose pages it opens.
        patience: seconds within which a page is drawn, or given up.

    Raises:
        RuntimeError: there is none.
    """
    executable = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if executable is None:
        raise RuntimeError("no Chromium on the path: install it (Debian, Ubuntu: apt install chromium)")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=list(_FLAGS))
        yield Tabs(browser, server, patience)
        browser.close()


def seen(page: Page) -> list[tuple[float, int, int]]:
    """What a run's page has shown: seconds since the epoch, the step in its figures, and that of its first curve."""
    return [(at, int(step), int(curve)) for at, step, curve in json.loads(page.evaluate("JSON.stringify(window.__seen)"))]


def _private_mb(pid: int) -> float:
    """Memory that a process shares with nobody, MB; 0 where it is gone."""
    try:
        rollup = Path(f"/proc/{pid}/smaps_rollup").read_text()
    except OSError:
        return 0.0
    return sum(int(line.split()[1]) for line in rollup.splitlines() if line.startswith("Private_")) * 1024 / 1e6
