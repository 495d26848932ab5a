"""The queue is put into order by dragging its rows, and by the keyboard alone."""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from server.database import tables
from server.database.engine import Database
from server.database.migrate import upgrade
from server.ids import new_id
from tests.browser.conftest import logged_in, running
from workers.config import TrainingConfig

pytestmark = pytest.mark.browser


@pytest.fixture
def page(browser: Browser, tmp_path: Path) -> Iterator[Page]:
    """The page *Queue* of a service without workers, with four runs that wait, first to fourth."""
    database = Database(f"sqlite:///{tmp_path / 'mapless.db'}")
    upgrade(database)
    now, training = time.time(), TrainingConfig().model_dump(mode="json")
    with database.write() as session:
        for place, name in enumerate(("first", "second", "third", "fourth")):
            run = tables.Run(id=new_id(), seed=0, queued_at=now - 60 + place)
            session.add(tables.Experiment(id=new_id(), name=name, training=training, runs=[run]))
    database.dispose()
    service = [sys.executable, "-m", "server"]
    with running(service, tmp_path, workers=0) as address, logged_in(browser, address) as context:
        page = context.new_page()
        page.goto("/queue")
        in_order(page, "first", "second", "third", "fourth")
        yield page


def in_order(page: Page, *names: str) -> None:
    rows = page.get_by_test_id("waiting-run")
    expect(rows).to_have_count(len(names))
    for place, name in enumerate(names):
        expect(rows.nth(place)).to_contain_text(f"{name}, seed 0")


def drag(page: Page, name: str, beside: str, share: float) -> None:
    """By its handle to a height of another row, 0 its upper edge and 1 its lower."""
    handle = page.get_by_role("button", name=f"{name}, seed 0: move in the queue").bounding_box()
    row = page.get_by_test_id("waiting-run").filter(has_text=f"{beside}, seed 0").bounding_box()
    assert handle is not None
    assert row is not None
    page.mouse.move(handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2)
    page.mouse.down()
    page.mouse.move(row["x"] + 200, row["y"] + share * row["height"], steps=5)
    dropped = page.locator("[data-drop]")
    expect(dropped).to_contain_text(f"{beside}, seed 0")
    page.mouse.up()
    expect(dropped).to_have_count(0)


def test_by_mouse(page: Page) -> None:
    drag(page, "fourth", "second", 0.2)
    in_order(page, "first", "fourth", "second", "third")
    drag(page, "first", "third", 0.8)
    in_order(page, "fourth", "second", "third", "first")
    page.reload()
    in_order(page, "fourth", "second", "third", "first")


def test_by_keyboard(page: Page) -> None:
    handle = page.get_by_role("button", name="third, seed 0: move in the queue")
    handle.focus()
    page.keyboard.press("Alt+ArrowUp")
    in_order(page, "first", "third", "second", "fourth")
    expect(handle).to_be_focused()
    page.keyboard.press("Alt+ArrowUp")
    in_order(page, "third", "first", "second", "fourth")
    expect(handle).to_be_focused()
    page.keyboard.press("Alt+ArrowDown")
    in_order(page, "first", "third", "second", "fourth")
    # At the end there is nowhere to go.
    last = page.get_by_role("button", name="fourth, seed 0: move in the queue")
    last.focus()
    page.keyboard.press("Alt+ArrowDown")
    in_order(page, "first", "third", "second", "fourth")
