"""A robot's recording: uploaded, seen from above, held beside a policy, and what is fitted begins a training."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import BrowserContext, expect

from tests.workers.robot_bags import as_mcap, messages, simulated
from tests.workers.test_bags import task

pytestmark = pytest.mark.browser

# Milliseconds: two busy cores.
SOON = 90_000


def test_what_a_robot_recorded_is_seen_and_trained_with(context: BrowserContext, tmp_path: Path) -> None:
    recording = tmp_path / "drive.mcap"
    recording.write_bytes(as_mcap(messages(simulated(seed=3, seconds=40.0, jitter=0.002, speed_noise=0.01, **task()))))
    page = context.new_page()
    page.goto("/evaluations")
    page.get_by_role("main").get_by_role("link", name="From a robot").click()
    expect(page.get_by_role("heading", name="From a robot")).to_be_visible(timeout=SOON)
    page.locator("input[type=file]").set_input_files(recording)

    expect(page.get_by_role("heading", name="drive.mcap", exact=True)).to_be_visible(timeout=SOON)
    expect(page.get_by_role("img", name=re.compile("^The robot's way among"))).to_be_visible(timeout=SOON)
    noise = page.locator("[data-key='lidar.noise']")
    expect(noise).to_contain_text(re.compile(r"0\.0(09|1)\d* m"))
    expect(page.locator("[data-key='command_delay']")).to_contain_text("0.15 s")

    page.get_by_role("combobox", name="Policy").fill("complex")
    page.get_by_role("option", name="Complex arena", exact=True).click()
    partings = page.get_by_role("list", name="Where they part most").get_by_role("button")
    expect(partings.first).to_be_visible(timeout=SOON)
    moment = (partings.first.text_content() or "").partition(" s")[0]
    partings.first.click()
    expect(page.get_by_test_id("time")).to_have_text(f"{moment} s")
    expect(page.get_by_test_id("moment")).to_contain_text(f"At {moment} s the robot did")
    # The choice stands in the address: what one sees can be sent to somebody.
    assert "policy=shipped" in page.url

    page.get_by_role("link", name="Train with these").click()
    page.get_by_role("button", name="Advanced").click()
    expect(page.get_by_role("textbox", name="Linear acceleration")).to_have_value(re.compile(r"^0\.(49|50|51)"))
    expect(page.get_by_role("textbox", name="Rate", exact=True)).to_have_value(re.compile(r"^(9\.9|10)"))


def test_what_is_no_recording_says_so(context: BrowserContext, tmp_path: Path) -> None:
    photo = tmp_path / "photo.mcap"
    photo.write_bytes(b"no recording")
    page = context.new_page()
    page.goto("/recordings")
    page.locator("input[type=file]").set_input_files(photo)
    expect(page.get_by_role("alert")).to_contain_text("choose an .mcap file", timeout=SOON)
    page.get_by_role("link", name="Choose another").click()
    page.get_by_role("button", name="Delete photo.mcap").click()
    page.get_by_role("dialog").get_by_role("button", name="Delete").click()
    expect(page.get_by_text("photo.mcap")).to_have_count(0)
