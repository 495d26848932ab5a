"""Which settings are best? Ranges given in the form, trials trained by workers, looked at, stopped and resumed."""

import re

import pytest
from playwright.sync_api import BrowserContext, expect

pytestmark = pytest.mark.browser
TRAINED = 120_000


def test_a_range_in_the_form_is_a_study_of_real_trainings(context: BrowserContext) -> None:
    page = context.new_page()
    page.goto("/new")
    page.get_by_label("Name").fill("Which step size?")
    page.get_by_label("Steps", exact=True).fill("2000")
    page.get_by_role("button", name="Advanced").click()
    page.get_by_role("textbox", name="Search these settings").fill("learning rate")
    page.get_by_role("button", name="Try a range: Learning rate", exact=True).click()
    page.get_by_role("textbox", name="Learning rate, to").fill("0.02")
    page.get_by_role("textbox", name="Search these settings").fill("")
    page.get_by_role("button", name="Try a range: Collision, weight").click()
    page.get_by_role("button", name="Try several: Hidden layers").click()
    page.get_by_role("textbox", name="Hidden layers, choice 3").fill("32")
    # So many that it is far from its end when it is stopped.
    page.get_by_label("Trials", exact=True).fill("100")
    page.get_by_label("Trials at once").fill("1")
    launch = page.get_by_role("button", name="Launch the study")
    launch.click()

    page.wait_for_url("**/studies/*")
    trials = page.get_by_test_id("trial")
    first = trials.filter(has=page.get_by_role("link", name="Trial 1", exact=True))
    expect(first).to_have_attribute("data-state", "complete", timeout=TRAINED)
    expect(trials.filter(has_text="Trial 2")).to_be_visible()
    expect(page.get_by_text(re.compile(r"Best by its tuning seeds: trial \d+"))).to_be_visible()
    for title in ("Collision, weight", "Hidden layers"):
        expect(page.get_by_role("columnheader", name=title)).to_be_visible()
        expect(page.get_by_role("img", name=f"Success by {title}")).to_be_visible()
    expect(page.get_by_role("img", name="Success of each trial, and the best until then")).to_be_visible()

    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_test_id("study-state")).to_have_text("Stopped")
    expect(page.locator("[data-testid=trial][data-state=running]")).to_have_count(0)
    page.get_by_role("link", name="Train the best").click()
    expect(page.get_by_label("Name")).to_have_value(re.compile(r"Which step size\?, trial \d+ \(copy\)"))

    page.goto("/studies")
    expect(page.get_by_test_id("study")).to_contain_text("Which step size?")
