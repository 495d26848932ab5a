"""The paper's reproduction in a real browser against the real stack: one button, and everything that comes of it."""

import re

import pytest
from playwright.sync_api import BrowserContext, expect

from workers.reproduction.claims import CLAIMS
from workers.reproduction.rows import OTHER_WAY, ROWS, TABLES

pytestmark = pytest.mark.browser

# Milliseconds: eight short trainings on the two cores that everything here shares.
SOON, TRAINED = 90_000, 280_000


def test_a_trial_from_the_button_to_the_tables_and_a_cancelled_campaign(context: BrowserContext) -> None:
    page = context.new_page()
    page.goto("/")
    page.get_by_role("link", name="Paper", exact=True).click()
    expect(page.get_by_test_id("invitation")).to_contain_text(f"{5 * len(ROWS)} trainings")
    page.get_by_role("button", name="Try it out first").click()
    campaign = page.get_by_test_id("campaign")
    expect(campaign.get_by_test_id("state")).to_have_attribute("data-state", "running", timeout=SOON)
    expect(campaign).to_contain_text("left")

    expect(campaign.get_by_test_id("state")).to_have_attribute("data-state", "completed", timeout=TRAINED)
    expect(campaign).to_contain_text(f"{len(ROWS)} of {len(ROWS)} trainings done")
    expect(page.get_by_test_id("trial")).to_be_visible()
    # What is there is there after a reload as well.
    page.reload()
    lines = page.get_by_test_id("our-row")
    expect(lines).to_have_count(sum(len(table.rows) for table in TABLES))
    for line in lines.all():
        expect(line).to_contain_text("ours, 1 seed")
    expect(page.get_by_test_id("other-way-row")).to_have_count(
        sum(row in OTHER_WAY for table in TABLES for row in table.rows)
    )
    claims = page.get_by_test_id("claim")
    expect(claims).to_have_count(len(CLAIMS))
    expect(claims.first).to_contain_text("No verdict below 5 seeds: 1 of 5 done.")
    expect(page.get_by_test_id("chart").first).to_be_visible(timeout=SOON)

    # Each seed leads to its run, with checkpoints and 3D view; the experiment leads back.
    seeds = page.get_by_test_id("seeds").first
    seeds.get_by_text("1 seed").click()
    seeds.get_by_role("link", name=re.compile("^Seed 0: ")).click()
    expect(page.get_by_test_id("checkpoint").first).to_be_visible(timeout=SOON)
    page.go_back()
    page.get_by_role("link", name="Vanilla PPO").click()
    page.get_by_role("link", name="a row of the paper's tables").click()

    # The whole of it, cancelled; both campaigns can be looked at.
    page.get_by_role("button", name="Reproduce the paper").click()
    expect(campaign).to_contain_text(f"of {5 * len(ROWS)} trainings done", timeout=SOON)
    page.get_by_role("button", name="Cancel all").click()
    expect(campaign.get_by_test_id("state")).to_have_attribute("data-state", "stopped", timeout=SOON)
    expect(page.get_by_role("button", name="Go on")).to_be_visible()
    page.get_by_role("combobox", name="Campaign").click()
    page.get_by_role("option", name=re.compile("Earlier")).click()
    expect(page.get_by_test_id("trial")).to_be_visible()
