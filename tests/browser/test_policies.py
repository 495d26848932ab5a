"""What a newcomer sees before training anything: a policy that ships drives, and a training like it is one click away."""

import re

import pytest
from playwright.sync_api import BrowserContext, expect

pytestmark = pytest.mark.browser

# Milliseconds: two busy cores, and rendering in software.
SOON = 90_000


def test_a_good_robot_can_be_watched_before_anything_is_trained(context: BrowserContext) -> None:
    policy = context.request.get("/api/policies/complex").json()
    page = context.new_page()
    page.goto("/policies")
    page.get_by_role("link", name=f"Watch {policy['title']}").click()
    frame = page.frame_locator("[data-testid=live-frame]")
    display = frame.locator("#display")
    expect(display).to_contain_text(re.compile("Best policy.*1× real time"), timeout=SOON)
    display.evaluate("display => { display.style.visibility = 'hidden' }")
    canvas = frame.locator("canvas").first
    first = canvas.screenshot(timeout=SOON)
    page.wait_for_timeout(1_500)
    assert canvas.screenshot(timeout=SOON) != first

    # Its pace is anybody's choice, as in any live view.
    page.get_by_text("10×", exact=True).click()
    expect(display).to_contain_text("10× real time", timeout=SOON)

    page.get_by_role("link", name=f"Train one like it: {policy['title']}").click()
    expect(page.get_by_label("Name", exact=True)).to_have_value(f"Like “{policy['title']}”")
    steps = page.get_by_role("textbox", name=re.compile("^Steps"))
    expect(steps).to_have_value(re.compile(r"\D?".join(f"{policy['training']['steps']:,}".split(","))))
