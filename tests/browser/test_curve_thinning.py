"""Curves are thinned in a browser: a rule is given, what it would do is read, it is done, and the run's page says so."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, expect

from benchmarks.dashboard.data import Lab, Sizes, make
from tests.browser.conftest import logged_in, running
from tests.browser.test_accessibility import AXE, CHECK

pytestmark = pytest.mark.browser

# The twelve rows of the paper come first, and then one more with five runs; none is long.
SMALL = Sizes(experiments=1, points=60, long_experiments=1, long_points=5_000, checkpoints=3, live=0)


@pytest.fixture
def lab(tmp_path: Path, browser: Browser) -> Iterator[tuple[Lab, BrowserContext]]:
    made = make(tmp_path, SMALL)
    with running([sys.executable, "-m", "server"], tmp_path, workers=1) as address, logged_in(browser, address) as context:
        context.route("**/live/**", lambda route: route.abort())
        yield made, context


def test_curves_become_fewer_points_and_say_so(lab: tuple[Lab, BrowserContext]) -> None:
    made, context = lab
    page = context.new_page()
    page.goto("/storage")
    page.get_by_role("button", name="Clean up Long 0").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_role("tab", name="Curves").click()
    expect(dialog.get_by_text("Every point stays.")).to_be_visible()
    dialog.get_by_text("Long ago, fewer").click()
    dialog.get_by_label("Points of a metric").fill("500")
    dialog.get_by_label("Days after a run's end").fill("0")
    # 23 series of 5,000 points in each of five runs.
    expect(dialog.get_by_test_id("preview")).to_contain_text(
        re.compile(r"575\D000 points of 5 runs become 57\D500, which frees about")
    )
    page.evaluate(f"{AXE.read_text()};0")
    assert page.evaluate(CHECK, None) == []
    dialog.get_by_role("button", name="Apply").click()
    row = page.get_by_test_id("stored").filter(has_text="Long 0")
    expect(row).to_contain_text("Curves: 500 points a metric 0 days after a run's end")
    before = row.get_by_role("cell").nth(3).inner_text()

    row.get_by_role("button", name="Clean up Long 0").click()
    dialog.get_by_role("tab", name="Curves").click()
    expect(dialog.get_by_text("By the rule that holds now 5 runs will be thinned")).to_be_visible()
    page.goto(f"/runs/{made.many}")
    expect(page.get_by_test_id("thinned")).to_contain_text("A rule thins these curves on")
    # Whoever looks on sees it come.
    elsewhere = context.new_page()
    elsewhere.goto("/storage")
    elsewhere.get_by_role("button", name="Clean up Long 0").click()
    elsewhere.get_by_role("tab", name="Curves").click()
    elsewhere.get_by_role("button", name="Thin 5 runs now").click()
    expect(page.get_by_test_id("thinned")).to_contain_text(
        re.compile(r"Curves were thinned on .*: of 115\D000 points 11\D[3-5]\d\d means of neighbours are left")
    )
    curves = page.get_by_test_id("main-curves")
    expect(curves.locator("canvas, svg").first).to_be_visible()
    elsewhere.reload()
    expect(elsewhere.get_by_test_id("stored").filter(has_text="Long 0").get_by_role("cell").nth(3)).not_to_have_text(before)
