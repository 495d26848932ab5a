"""Alerts in a browser: a rule is made, tried, sees something happen, and is deleted."""

import re

from playwright.sync_api import BrowserContext, expect

SOON = 25_000


def test_a_rule_is_made_and_fires(context: BrowserContext) -> None:
    page = context.new_page()
    page.goto("/")
    page.get_by_role("link", name="Alerts").click()
    expect(page.get_by_text("No rules yet")).to_be_visible()

    # What only the server can reach is refused where it is typed.
    form = page.locator("form")
    form.get_by_role("combobox", name="Tell").click()
    page.get_by_role("option", name="a webhook").click()
    form.get_by_label("URL").fill("http://169.254.169.254/")
    form.get_by_role("button", name="Add").click()
    expect(page.get_by_role("alert")).to_contain_text("private network")

    form.get_by_role("combobox", name="Tell").click()
    page.get_by_role("option", name="this browser").click()
    form.get_by_role("combobox", name="When").click()
    page.get_by_role("option", name="The disk is almost full").click()
    form.get_by_label("GiB left").fill("1000000")
    form.get_by_role("button", name="Add").click()
    rule = page.get_by_test_id("rule")
    expect(rule).to_contain_text("Less than 1000000 GiB are left on the disk")

    rule.get_by_role("button", name="Send a test").click()
    expect(page.get_by_role("alert").filter(has_text="A test of Mapless's alerts")).to_be_visible(timeout=SOON)
    expect(page.get_by_role("alert").filter(has_text="left on the server's disk")).to_be_visible(timeout=SOON)
    told = page.get_by_test_id("alert")
    expect(told.filter(has_text=re.compile(r"GiB are left.*sent"))).to_be_visible(timeout=SOON)

    rule.get_by_role("button", name="Delete").click()
    expect(rule).to_have_count(0)
    expect(told).to_have_count(0)
