"""Pictures of every page, light and dark, for docs: a made lab is served, and each page drawn once it is whole.

python -m benchmarks.pictures                 all of docs/images/pages: some minutes
python -m benchmarks.pictures run compare     some of them
"""

import contextlib
import io
import sqlite3
import sys
import tempfile
import time
from http import HTTPStatus
from pathlib import Path
from typing import TypeVar

from PIL import Image
from playwright.sync_api import Browser, sync_playwright

from benchmarks.dashboard.addresses import SMALL, addresses
from benchmarks.dashboard.data import Sizes, make
from benchmarks.dashboard.server import ROOT, Server, serving
from benchmarks.pages import chromium
from tests.workers.robot_bags import as_mcap, messages, simulated
from tests.workers.test_bags import task

PICTURES = ROOT / "docs/images/pages"
SCHEMES = ("light", "dark")
RECORDINGS = ("recordings", "recording")
"""Pages for which a worker reads what a robot recorded."""
_VIEWPORT = {"width": 1280, "height": 800}
# As wide as a page of documentation shows them.
_SIZE = (960, 600)
_QUALITY = 60
_PATIENCE_MS = 60_000
_SETTLE_MS = 700
_FLAGS = ("--no-sandbox", "--no-first-run", "--disable-background-networking")


def as_quick_as_real_ones(directory: Path) -> None:
    """Give the made runs the speed of real ones, from which the launch form tells how long a training takes."""
    with contextlib.closing(sqlite3.connect(directory / "mapless.db")) as database, database:
        database.execute("UPDATE latest_metrics SET value = 12000 WHERE name = 'time/steps_per_second'")


_Named = TypeVar("_Named")


def asked(pages: dict[str, _Named]) -> dict[str, _Named]:
    """Those that are named on the command line, or all."""
    return {name: page for name, page in pages.items() if not sys.argv[1:] or name in sys.argv[1:]}


def draw(browser: Browser, server: Server, wanted: dict[str, tuple[str, str]]) -> None:
    """Write the picture of each page in each scheme of colours."""
    for scheme in SCHEMES if wanted else ():
        draw_in(browser, server, wanted, scheme)


def draw_in(browser: Browser, server: Server, wanted: dict[str, tuple[str, str]], scheme: str) -> None:
    """Write the picture of each page in one scheme of colours."""
    context = browser.new_context(
        viewport=_VIEWPORT,  # type: ignore[arg-type]
        color_scheme=scheme,  # type: ignore[arg-type]
        reduced_motion="reduce",
    )
    page = context.new_page()
    page.goto(f"{server.origin}/?token={server.token}")
    for name, (path, whole) in wanted.items():
        page.goto(f"{server.origin}{path}")
        page.locator(whole).first.wait_for(timeout=_PATIENCE_MS)
        page.wait_for_timeout(_SETTLE_MS)
        picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB").resize(_SIZE, Image.Resampling.LANCZOS)
        picture.save(PICTURES / f"{name}-{scheme}.webp", quality=_QUALITY, method=6)
    context.close()


def recorded(server: Server) -> dict[str, tuple[str, str]]:
    """Upload what a robot recorded in the simulator; the pages that show it, beside a policy."""
    drive = as_mcap(messages(simulated(seed=3, seconds=40.0, jitter=0.002, speed_noise=0.01, **task())))
    with server.client() as client:
        answer = client.post("/api/recordings", params={"name": "corridor.mcap"}, content=drive)
        found = answer.raise_for_status().json()["id"]
        # The page asks a second time, and is answered at once. Until a worker is there, the service says when to come again.
        for what in ("reading", "beside?shipped=complex"):
            while (answer := client.get(f"/api/recordings/{found}/{what}")).status_code == HTTPStatus.SERVICE_UNAVAILABLE:
                time.sleep(float(answer.headers["Retry-After"]))
            answer.raise_for_status()
    return {
        "recordings": ("/recordings", "text=corridor.mcap"),
        "recording": (f"/recordings/{found}?policy=shipped:complex", "[aria-label='Where they part most'] button"),
    }


def main() -> None:
    """Draw the pages that are named, or all."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as directory:
        lab, robot = Path(directory) / "lab", Path(directory) / "robot"
        found = addresses(make(lab, Sizes(**SMALL)))
        as_quick_as_real_ones(lab)
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium(), args=list(_FLAGS))
            with serving(lab) as server:
                draw(browser, server, asked({name: page for name, page in found.items() if name != "recordings"}))
            if asked(dict.fromkeys(RECORDINGS)):
                # A recording is read by a worker.
                with serving(robot, workers=1) as server:
                    draw(browser, server, asked(recorded(server)))
            browser.close()


if __name__ == "__main__":
    main()
