"""Pictures of every page, light and dark, for docs: a made lab is served, and each page drawn once it is whole.

python -m benchmarks.pictures                 all of docs/images/pages: some minutes
python -m benchmarks.pictures run compare     some of them
"""

import contextlib
import io
import sqlite3
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, sync_playwright

from benchmarks.dashboard.addresses import SMALL, addresses
from benchmarks.dashboard.data import Sizes, make
from benchmarks.dashboard.server import ROOT, Server, serving
from benchmarks.pages import chromium

PICTURES = ROOT / "docs/images/pages"
SCHEMES = ("light", "dark")
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


def draw(browser: Browser, server: Server, wanted: dict[str, tuple[str, str]], scheme: str) -> None:
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


def main() -> None:
    """Draw the pages that are named, or all."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as directory:
        found = addresses(make(Path(directory), Sizes(**SMALL)))
        as_quick_as_real_ones(Path(directory))
        wanted = {name: page for name, page in found.items() if not sys.argv[1:] or name in sys.argv[1:]}
        with serving(Path(directory)) as server, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium(), args=list(_FLAGS))
            for scheme in SCHEMES:
                draw(browser, server, wanted, scheme)
            browser.close()


if __name__ == "__main__":
    main()
