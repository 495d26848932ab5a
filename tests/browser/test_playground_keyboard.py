"""Everything that one does in a playground, by keyboard alone: each stop is reached by Tab."""

import re
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from playwright.sync_api import BrowserContext, Locator, Page, expect

pytestmark = pytest.mark.browser

# Milliseconds: two busy cores, and rendering in software.
SOON = 90_000
# More than the page has to stop at, those of the picture in 3D among them.
STOPS = 200


def reach(page: Page, wanted: Locator) -> None:
    """Tab, until the focus is there."""
    # What is drawn as a segment is a radio button of no size.
    wanted.wait_for(state="attached")
    for _ in range(STOPS):
        if wanted.evaluate("element => element === document.activeElement"):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"Tab does not come to {wanted}")


def choose(page: Page, name: str, wanted: str) -> None:
    """Takes one of a list's, by typing a part of it."""
    field = page.get_by_role("combobox", name=name)
    reach(page, field)
    page.keyboard.press("Control+A")
    page.keyboard.type(wanted)
    expect(page.get_by_role("option", name=wanted, exact=True)).to_be_visible()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect(field).to_have_value(wanted)


def press(page: Page, name: str) -> None:
    reach(page, page.get_by_role("button", name=name, exact=True))
    page.keyboard.press("Enter")


def write(page: Page, label: str, value: str) -> None:
    reach(page, page.get_by_role("textbox", name=re.compile(f"^{label}")))
    page.keyboard.press("Control+A")
    page.keyboard.type(value)


class Asked:
    """What the service says of the playground."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._address = f"/api/playgrounds/{page.url.rsplit('/', 1)[1]}"

    def now(self) -> dict[str, Any]:
        found: dict[str, Any] = self._page.request.get(self._address).json()
        return found

    def until(self, holds: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        deadline = time.monotonic() + SOON / 1000
        while not holds(found := self.now()):
            assert time.monotonic() < deadline, found
            self._page.wait_for_timeout(50)
        return found


def near(place: dict[str, float], **wanted: float) -> bool:
    return all(abs(place[name] - value) < 0.01 for name, value in wanted.items())


def elsewhere(before: dict[str, float], now: dict[str, Any]) -> bool:
    return not near(now["robot"], x=before["x"], y=before["y"])


def turned(name: str, wanted: float, now: dict[str, Any]) -> bool:
    return bool(abs(now["settings"][name] - wanted) < 1e-9)


@pytest.mark.timeout(600)
def test_everything_in_a_playground_is_done_by_keyboard_alone(context: BrowserContext) -> None:
    page = context.new_page()
    page.goto("/playground")
    choose(page, "Policy", "Through crowds")
    press(page, "Let it drive")
    expect(page.get_by_test_id("outcome")).to_contain_text("It", timeout=SOON)

    # Somebody who walks about in its own arena.
    press(page, "Pause")
    Asked(page).until(lambda now: now["settings"]["paused"])
    choose(page, "Handles on", "Moving 1")
    write(page, "x", "0.5")
    Asked(page).until(lambda now: abs(now["movers"][0]["x"] - 0.5) < 0.01)
    reach(page, page.get_by_role("link", name="Another one"))
    page.keyboard.press("Enter")

    choose(page, "Policy", "Through crowds")
    choose(page, "Arena", "Simple")
    press(page, "Let it drive")
    expect(page.get_by_test_id("outcome")).to_contain_text("It", timeout=SOON)
    asked = Asked(page)

    # Time.
    press(page, "Pause")
    before = asked.until(lambda now: now["settings"]["paused"] and not now["outdated"])
    expect(page.get_by_role("button", name="Go on")).to_be_focused()
    press(page, "One step")
    after = asked.until(lambda now: now["sim_time"] > before["sim_time"])
    assert after["sim_time"] - before["sim_time"] < 0.5
    reach(page, page.get_by_role("radiogroup", name="Speed").locator("input:checked"))
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowLeft")
    asked.until(lambda now: now["settings"]["speed"] == 0.1)

    # Where things stand.
    choose(page, "Handles on", "Robot")
    for label, value in (("x", "-2"), ("y", "0"), ("Heading", "90")):
        write(page, label, value)
    asked.until(lambda now: near(now["robot"], x=-2.0, y=0.0, heading=90.0))
    choose(page, "Handles on", "Target")
    for label, value in (("x", "1.5"), ("y", "1")):
        write(page, label, value)
    asked.until(lambda now: near(now["target"], x=1.5, y=1.0))
    discs = len(asked.now()["geometry"]["circles"])
    press(page, "Add a disc")
    asked.until(lambda now: len(now["geometry"]["circles"]) == discs + 1)
    expect(page.get_by_role("combobox", name="Handles on")).to_have_value(f"Disc {discs + 1}")
    for label, typed in (("x", "-1"), ("y", "1.5"), ("Radius", "0.4")):
        write(page, label, typed)
    asked.until(lambda now: near(now["geometry"]["circles"][discs], x=-1.0, y=1.5, radius=0.4))
    press(page, "Remove it")
    asked.until(lambda now: len(now["geometry"]["circles"]) == discs)
    # The button has gone: the focus is not lost with it.
    expect(page.get_by_role("combobox", name="Handles on")).to_be_focused()
    page.keyboard.press("Escape")
    for name in ("left", "right", "back"):
        at = asked.now()["robot"]
        press(page, f"Push it {name}")
        asked.until(partial(elsewhere, at))

    # What it perceives: no press of a key is lost, however quick one is.
    for label, name, presses, more in (
        ("LiDAR noise", "noise", 5, 0.05),
        ("LiDAR dropout", "dropout", 4, 0.2),
        ("Delay", "delay", 3, 3),
        ("Blind sector", "blind_width", 6, 30),
        ("Its middle", "blind_direction", 2, 10),
    ):
        slider = page.get_by_role("slider", name=label)
        reach(page, slider)
        began = asked.now()["settings"][name] or 0
        for _ in range(presses):
            page.keyboard.press("ArrowRight")
        asked.until(partial(turned, name, began + more))

    # The moment is kept, and measured on.
    write(page, "Name", "Kept by keys")
    reach(page, page.get_by_role("button", name="Keep", exact=True))
    page.keyboard.press("Enter")
    reach(page, page.get_by_role("link", name="Train on it"))
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1)).to_contain_text("New training")
