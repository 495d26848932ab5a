"""What a newcomer does, in a real browser against the real stack: launch, watch, download, compare."""

import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import BrowserContext, Page, expect

from sim.suites import run_suite, suite_for
from workers.checkpoints import read_policy

pytestmark = pytest.mark.browser

# Milliseconds: trainings run on the same two cores as everything else here.
SOON, TRAINED = 90_000, 240_000


def open_form(context: BrowserContext, name: str) -> Page:
    page = context.new_page()
    page.goto("/new")
    page.get_by_label("Name", exact=True).fill(name)
    return page


def choose(page: Page, option: str) -> None:
    """Click one option of a segmented control."""
    page.get_by_text(option, exact=True).click()


def set_steps(page: Page, steps: int) -> None:
    page.get_by_role("textbox", name=re.compile("^Steps")).fill(str(steps))


def launch(page: Page) -> None:
    page.get_by_role("button", name="Launch").click()
    page.wait_for_url("**/runs/*", timeout=SOON)


def points(page: Page) -> int:
    """Points of the success curve that is drawn now."""
    return int(page.get_by_test_id("main-curves").get_by_test_id("chart").first.get_attribute("data-points") or 0)


def test_a_training_is_launched_watched_stopped_resumed_and_deleted(context: BrowserContext) -> None:
    # ResBlock PPO on the simple arena, from the form; far more steps than anybody waits for here.
    page = open_form(context, "Long one")
    choose(page, "ResBlock")
    set_steps(page, 50_000_000)
    launch(page)
    expect(page.get_by_test_id("state").first).to_have_attribute("data-state", "running", timeout=SOON)
    expect(page.get_by_test_id("vitals")).to_contain_text("Time left", timeout=SOON)

    # The curve grows while the training runs.
    expect(page.get_by_test_id("main-curves").get_by_test_id("chart").first).to_be_visible(timeout=SOON)
    before = points(page)
    page.wait_for_function(
        "before => Number(document.querySelector('[data-testid=main-curves] [data-testid=chart]').dataset.points) > before",
        arg=before,
        timeout=SOON,
    )

    # The robots move: two pictures of the 3D canvas differ.
    expect(page.get_by_test_id("live-view")).to_have_attribute("data-receiving", "true", timeout=SOON)
    frame = page.frame_locator("[data-testid=live-frame]")
    canvas = frame.locator("canvas").first
    expect(canvas).to_be_visible(timeout=SOON)
    # What lies over the canvas counts steps, and would differ by itself.
    frame.locator("#display").evaluate("display => { display.style.visibility = 'hidden' }")
    first = canvas.screenshot()
    page.wait_for_timeout(1_500)
    assert canvas.screenshot() != first

    # What is shown can be chosen: here the training robots, a moment later the policy again.
    choose(page, "Training")
    expect(frame.locator("#display")).to_contain_text("Training", timeout=SOON)
    page.get_by_role("textbox", name="Robots").fill("3")
    choose(page, "Policy")
    choose(page, "10×")
    expect(frame.locator("#display")).to_contain_text("10× real time", timeout=SOON)

    # A checkpoint can be taken away while the training goes on.
    download_button = page.get_by_test_id("checkpoint").first.get_by_role("link", name=re.compile("Download"))
    with page.expect_download(timeout=SOON) as early:
        download_button.click(timeout=SOON)
    expect(page.get_by_test_id("state").first).to_have_attribute("data-state", "running")
    manifest, _ = read_policy(early.value.path())
    assert manifest.network.name == "resblock"

    # Stopped, the robots go on without the worker, by the best policy; resumed, the training goes on where it was.
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_test_id("state").first).to_have_attribute("data-state", "stopped", timeout=SOON)
    kept = page.get_by_test_id("checkpoint").count()
    expect(frame.locator("#display")).to_contain_text("Best policy", timeout=SOON)
    page.get_by_role("button", name="Resume").click()
    expect(page.get_by_test_id("state").first).to_have_attribute("data-state", "running", timeout=SOON)
    expect(page.get_by_test_id("checkpoint").nth(kept)).to_be_visible(timeout=SOON)
    expect(page.get_by_test_id("events")).to_contain_text(re.compile("resum", re.IGNORECASE))

    page.get_by_role("link", name="Duplicate").click()
    expect(page.get_by_label("Name", exact=True)).to_have_value("Long one (copy)")
    expect(page.get_by_role("textbox", name=re.compile("^Steps"))).to_have_value(re.compile(r"50\D?000\D?000"))

    page.goto("/")
    page.get_by_role("button", name="Actions for Long one").click()
    page.get_by_role("menuitem", name="Delete").click()
    page.get_by_role("dialog").get_by_role("button", name="Delete").click()
    expect(page.get_by_role("link", name="Long one")).to_have_count(0, timeout=SOON)


def test_two_trainings_run_to_their_end_and_are_compared(context: BrowserContext, tmp_path: Path) -> None:
    other = open_form(context, "ResBlock in simple")
    choose(other, "ResBlock")
    set_steps(other, 40_000)
    launch(other)
    page = open_form(context, "MLP in simple")
    choose(page, "MLP")
    launch(page)
    expect(page.get_by_test_id("state").first).to_have_attribute("data-state", "completed", timeout=TRAINED)

    # Every episode behind the figures can be looked at; meanwhile nothing else is drawn.
    expect(page.get_by_test_id("live-frame")).to_be_visible(timeout=SOON)
    page.get_by_role("button", name=re.compile("^Replay episode")).first.click()
    replay = page.frame_locator("[data-testid=replay-frame]")
    seconds = replay.get_by_label("Seconds", exact=True)
    expect(seconds).to_be_visible(timeout=SOON)
    expect(page.get_by_test_id("live-frame")).to_have_count(0)
    started = seconds.input_value()
    expect(seconds).not_to_have_value(started, timeout=SOON)
    page.get_by_role("dialog").locator(".mantine-Modal-close").click()
    expect(page.get_by_role("dialog")).to_have_count(0, timeout=SOON)

    # What is taken away is as good as it was said to be.
    best = page.locator("[data-testid=checkpoint][data-best]").get_by_role("link", name=re.compile("Download"))
    with page.expect_download() as last:
        best.click()
    archive = tmp_path / last.value.suggested_filename
    last.value.save_as(archive)
    assert re.fullmatch(r"mapless-mlp-in-simple-seed\d+-step\d+\.zip", archive.name)
    manifest, policy = read_policy(archive)
    table = run_suite(policy, manifest.training.task, suite_for(manifest.training.task))
    assert len(table.outcomes) >= 200
    assert np.mean(table.outcomes == 1) >= 0.95

    # The two side by side.
    expect(other.get_by_test_id("state").first).to_have_attribute("data-state", "completed", timeout=TRAINED)
    page.goto("/")
    for name in ("ResBlock in simple", "MLP in simple"):
        page.get_by_role("checkbox", name=f"Tick {name}").check()
    page.get_by_role("link", name="Compare 2").click()
    figures = page.get_by_test_id("figures")
    expect(figures.get_by_role("row")).to_have_count(3)
    expect(figures).to_contain_text("1 seed × 200 episodes")
    expect(figures).to_contain_text("simple-200")
    expect(page.get_by_test_id("differences")).to_contain_text("Network")
    expect(page.get_by_test_id("verdicts")).to_contain_text("No verdict below 5 seeds")
    expect(page.get_by_test_id("chart").first).to_be_visible()


def test_wrong_values_are_refused_next_to_their_field(context: BrowserContext) -> None:
    page = open_form(context, "")
    set_steps(page, 3)
    page.get_by_role("button", name="Launch").click()
    expect(page.get_by_test_id("problems")).to_be_visible()
    steps = page.get_by_role("textbox", name=re.compile("^Steps"))
    expect(steps).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_label("Name", exact=True)).to_have_attribute("aria-invalid", "true")


def test_the_paper_preset_fills_the_form(context: BrowserContext) -> None:
    page = open_form(context, "As published")
    choose(page, "Paper settings")
    page.get_by_role("button", name="Advanced").click()
    expect(page.get_by_role("textbox", name=re.compile("^Learning rate"))).to_have_value("0.0003")


def test_a_stranger_is_asked_for_the_token(context: BrowserContext, stack: str) -> None:
    page = context.new_page()
    page.context.clear_cookies()
    page.goto("/")
    expect(page.get_by_label(re.compile("token", re.IGNORECASE))).to_be_visible()
