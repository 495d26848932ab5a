"""A run that has reported once: each of its curves is one point."""

import pytest
from playwright.sync_api import BrowserContext, expect

pytestmark = pytest.mark.browser
TRAINED = 120_000


def test_charts_of_one_point_are_drawn_and_the_page_goes_on(context: BrowserContext) -> None:
    page = context.new_page()
    launched = context.request.post(
        "/api/experiments", data={"name": "One report", "seeds": [0], "training": {"steps": 1_000}}, timeout=TRAINED
    )
    assert launched.ok, launched.text()
    run_id = launched.json()["runs"][0]["id"]
    page.goto(f"/runs/{run_id}")
    expect(page.get_by_text("Completed", exact=True).first).to_be_visible(timeout=TRAINED)

    page.reload()
    chart = page.get_by_test_id("chart").first
    expect(chart.locator("canvas")).to_be_visible()
    assert chart.get_attribute("data-points") == "1"
    # The marks of its axes had no end: the tab answered nobody until its memory was full.
    page.get_by_role("link", name="Compare").first.click()
    expect(page.get_by_role("heading", name="Compare")).to_be_visible()
