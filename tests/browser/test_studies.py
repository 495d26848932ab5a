"""Which settings are best? Ranges given in the form, trials trained by workers, looked at, stopped and resumed."""

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
    page.get_by_label("Trials", exact=True).fill("2")
    page.get_by_label("Trials at once").fill("1")
    launch = page.get_by_role("button", name="Launch the study")
    launch.click()

    page.wait_for_url("**/studies/*")
    trials = page.get_by_test_id("trial")
    expect(trials.filter(has_text="Trial 1")).to_have_attribute("data-state", "complete", timeout=TRAINED)
    expect(trials.filter(has_text="Trial 2")).to_have_attribute("data-state", "running")
    expect(page.get_by_text("Best by its tuning seeds: trial 1")).to_be_visible()
    expect(page.get_by_role("img", name="Success of each trial, and the best until then")).to_be_visible()

    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_test_id("study-state")).to_have_text("Stopped")
    expect(trials.filter(has_text="Trial 2")).to_have_attribute("data-state", "stopped")
    page.get_by_role("link", name="Train the best").click()
    expect(page.get_by_label("Name")).to_have_value("Which step size?, trial 1 (copy)")

    page.goto("/studies")
    expect(page.get_by_test_id("study")).to_contain_text("Which step size?")
