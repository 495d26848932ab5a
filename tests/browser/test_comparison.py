"""A verdict and what leaves of it, in a real browser: trainings of five seeds, measured before the service starts."""

import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from playwright.sync_api import Browser, BrowserContext, expect

from server.app import create_app
from server.settings import Settings
from tests.browser.conftest import logged_in, running
from tests.server.harness import BASE_URL, TOKEN, Reports
from tests.server.test_comparison import measured

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def compared(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[BrowserContext, str]]:
    """A profile that is logged in to a service with two trainings, and the address of their comparison."""
    directory = tmp_path_factory.mktemp("compared")
    # Playwright's event loop runs on this thread.
    with ThreadPoolExecutor(1) as thread:
        address = thread.submit(fill, directory).result()
    with running([sys.executable, "-m", "server"], directory, workers=1) as service, logged_in(browser, service) as context:
        yield context, address


def fill(directory: Path) -> str:
    """Two trainings with curves and verdicts; the address of their comparison."""
    app = create_app(Settings(data_dir=directory, token=TOKEN))
    with TestClient(app, base_url=BASE_URL, headers={"Authorization": f"Bearer {TOKEN}", "Origin": BASE_URL}) as client:
        reports = Reports(client, app.state.services)
        base = measured(reports, "Short sight", (800, 820, 790, 850, 810), steps=100)
        other = measured(reports, "Long_sight & 99%", (990, 980, 970, 990, 980), steps=80)
        for experiment in (base, other):
            for run in experiment["runs"]:
                reports.rows(
                    run,
                    {
                        step: {"eval/success_rate": success, "loss/value": loss, "time/wall_seconds": 3.6 * step}
                        for step, success, loss in ((1_000, 0.5, 10.0), (2_000, 0.75, 1.0), (3_000, 0.9, 0.1))
                    },
                )
                reports.state(run, "completed")
    return f"/compare?experiment={base['id']}&experiment={other['id']}"


def test_a_verdict_and_its_latex_by_keyboard(compared: tuple[BrowserContext, str], tmp_path: Path) -> None:
    context, address = compared
    page = context.new_page()
    page.goto(address)
    verdicts = page.get_by_role("table", name="Verdicts")
    success = verdicts.get_by_role("row").nth(1)
    expect(success).to_contain_text("16.8 points more, 95 % interval [+")
    expect(success.get_by_text("better", exact=True)).to_be_visible()

    page.get_by_role("button", name="Export the table Verdicts").focus()
    page.keyboard.press("Enter")
    latex = page.get_by_role("menuitem", name="LaTeX (booktabs)")
    expect(latex).to_be_visible()
    # The menu takes the focus when its opening has ended: an arrow before and one after go to different items.
    with page.expect_download() as download:
        latex.press("Enter")
    assert download.value.suggested_filename == "mapless-verdicts.tex"
    text = download.value.path().read_text()
    assert r"Long\_sight \& 99\% & Short sight & Success & 5, 5 & +16.8 [+" in text

    # The base that is chosen is the one that is printed.
    page.get_by_role("combobox", name="Held against").select_option("Long_sight & 99%")
    expect(success.get_by_text("worse", exact=True)).to_be_visible()
    with page.expect_download() as download:
        page.get_by_role("link", name="Report (HTML)").click()
    report = tmp_path / "report.html"
    download.value.save_as(report)
    offline = context.new_page()
    offline.goto(report.as_uri())
    expect(offline.get_by_role("cell", name="worse").first).to_be_visible()
    expect(offline.get_by_role("img", name="eval/success_rate")).to_be_visible()


def test_charts_zoom_together_and_their_lines_are_hidden_by_name(compared: tuple[BrowserContext, str]) -> None:
    context, address = compared
    page = context.new_page()
    page.goto(address)
    chart = page.get_by_role("figure", name="Success rate").first
    expect(chart).to_be_visible()
    area = chart.locator(".u-over")
    area.scroll_into_view_if_needed()
    box = area.bounding_box()
    assert box is not None
    reset = page.get_by_role("button", name="Reset zoom")
    expect(reset).to_have_count(0)
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 50)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 52, steps=4)
    page.mouse.up()
    expect(chart.get_by_role("button", name="Reset zoom")).to_be_visible()
    reset.first.click()
    expect(reset).to_have_count(0)

    name = chart.get_by_role("button", name="Short sight, 5 seeds")
    name.focus()
    page.keyboard.press("Space")
    expect(name).to_have_attribute("aria-pressed", "false")


def test_a_chart_leaves_as_numbers_and_as_pictures(compared: tuple[BrowserContext, str]) -> None:
    context, address = compared
    page = context.new_page()
    page.goto(address)
    found = {}
    for kind in ("Numbers (CSV)", "Picture (SVG)", "Picture (PNG)"):
        button, item = (
            page.get_by_role("button", name="Export the chart Success rate, evaluation"),
            page.get_by_role("menuitem"),
        )
        button.click()
        try:
            expect(item.first).to_be_visible(timeout=10_000)
        except AssertionError:
            # What came in meanwhile has drawn the chart anew, without its menu.
            button.click()
        with page.expect_download() as download:
            item.filter(has_text=kind).click()
        found[Path(download.value.suggested_filename).suffix] = download.value.path().read_bytes()
    assert found[".csv"].decode().splitlines()[-1].startswith("3000,0.9")
    assert found[".svg"].startswith(b"<svg ")
    assert found[".png"].startswith(b"\x89PNG")
    assert len(found[".png"]) > 5_000


def test_charts_over_time_under_way_are_in_the_address(compared: tuple[BrowserContext, str]) -> None:
    context, address = compared
    page = context.new_page()
    page.goto(address)
    axis = page.get_by_role("combobox", name="Horizontal axis")
    axis.select_option("Wall time")
    chart = page.get_by_role("figure", name="Success rate").first
    # Three thousand steps of 3.6 s.
    expect(chart).to_have_attribute("data-step", "10800")
    expect(page.get_by_text("Means at the 3 times of all points, until the first seed is through").first).to_be_visible()
    expect(axis.get_by_role("option", name="CPU time, not counted")).to_be_disabled()
    page.reload()
    expect(axis).to_have_value("wall")
    expect(chart).to_have_attribute("data-step", "10800")
