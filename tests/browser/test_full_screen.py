"""A view in full screen keeps its controls: by mouse, by touch, by keyboard one changes them, and leaves."""

import re

import pytest
from playwright.sync_api import BrowserContext, Locator, Page, ViewportSize, expect

from tests.browser.hand import PHONE, Hand

pytestmark = pytest.mark.browser

# Milliseconds: two busy cores, and rendering in software.
SOON = 90_000
# A picture in 3D that fills a desk's screen is drawn in software once a second, and the page with it.
SMALL: ViewportSize = {"width": 760, "height": 560}


def fill(page: Page) -> Locator:
    """The view is as large as the screen; what there is in it."""
    page.wait_for_function("document.fullscreenElement !== null")
    whole = page.get_by_test_id("whole-screen")
    width, height = page.evaluate("[innerWidth, innerHeight]")
    for part in (page.get_by_test_id("live-view"), whole.locator("fieldset")):
        box = part.bounding_box()
        assert box is not None
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width + 1
        assert box["y"] + box["height"] <= height + 1
    return whole


def left(page: Page) -> None:
    page.wait_for_function("document.fullscreenElement === null")
    expect(page.get_by_role("button", name="Full screen", exact=True)).to_be_visible()


def settings(page: Page, address: str, **wanted: object) -> None:
    """Wait until the service has these settings of a view."""
    page.wait_for_function(
        "async ([address, wanted]) => { const now = await (await fetch(address)).json();"
        " return Object.entries(wanted).every(([name, value]) => now[name] === value) }",
        arg=[address, wanted],
    )


def test_a_policys_view_is_steered_in_full_screen_by_mouse_touch_and_keyboard(context: BrowserContext) -> None:
    page = context.new_page()
    page.set_viewport_size(SMALL)
    page.goto("/policies/simple")
    live = "/api/policies/simple/live"
    page.get_by_role("button", name="Watch it drive").click()
    expect(page.get_by_test_id("live-view")).to_have_attribute("data-receiving", "true", timeout=SOON)

    # By mouse.
    page.get_by_role("button", name="Full screen", exact=True).click()
    whole = fill(page)
    whole.get_by_text("5×", exact=True).click()
    whole.get_by_role("combobox", name="Follow").click()
    whole.get_by_role("option", name="Robot 2").click()
    whole.get_by_role("combobox", name="LiDAR rays").click()
    whole.get_by_role("option", name="Rays of all").click()
    settings(page, live, speed=5, follow=1, rays=True, ray_robots="all")
    whole.get_by_role("button", name="Leave full screen").click()
    left(page)

    # By keyboard.
    opener = page.get_by_role("button", name="Full screen", exact=True)
    opener.focus()
    page.keyboard.press("Enter")
    whole = fill(page)
    whole.get_by_role("radiogroup", name="Speed").locator("input:checked").focus()
    page.keyboard.press("ArrowLeft")
    whole.get_by_role("combobox", name="Follow").focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    settings(page, live, speed=2, follow=2)
    whole.get_by_role("button", name="Leave full screen").focus()
    page.keyboard.press("Enter")
    left(page)

    # By a finger, on a phone.
    hand = Hand(page)
    page.get_by_role("button", name="Full screen", exact=True).scroll_into_view_if_needed()
    hand.tap(page.get_by_role("button", name="Full screen", exact=True))
    whole = fill(page)
    assert page.viewport_size == PHONE
    hand.tap(whole.get_by_text("10×", exact=True))
    hand.tap(whole.get_by_role("combobox", name="Follow"))
    option = whole.get_by_role("option", name="Follow none")
    expect(option).to_be_visible()
    hand.tap(option)
    settings(page, live, speed=10, follow=None)
    hand.tap(whole.get_by_role("button", name="Leave full screen"))
    left(page)


def test_a_playground_keeps_what_time_does_in_full_screen(context: BrowserContext) -> None:
    page = context.new_page()
    page.set_viewport_size(SMALL)
    page.goto("/playground?policy=shipped:simple")
    page.get_by_role("button", name="Let it drive").click()
    expect(page.get_by_test_id("outcome")).to_contain_text("It", timeout=SOON)
    page.get_by_role("button", name="Full screen", exact=True).click()
    whole = fill(page)
    whole.get_by_role("button", name="Pause").click()
    whole.get_by_role("button", name="One step").click()
    expect(whole.get_by_role("button", name=re.compile("Go on"))).to_be_visible()
    whole.get_by_role("button", name="Leave full screen").click()
    left(page)
