"""A verdict and what leaves of it, in a real browser: trainings of five seeds, measured before the service starts."""

import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import pytest
from fastapi.testclient import TestClient
from playwright.sync_api import Browser, BrowserContext, expect

from server.app import create_app
from server.printing.palette import LIGHT, color_of, looks_of
from server.settings import Settings
from tests.browser.conftest import logged_in, running
from tests.server.harness import BASE_URL, TOKEN, Reports
from tests.server.test_comparison import measured

pytestmark = pytest.mark.browser

# Lighthouse calls a page's cumulative layout shift good below it.
GOOD_SHIFT = 0.1
SHIFTS = """
window.__shift = 0
new PerformanceObserver((list) => {
  for (const each of list.getEntries()) if (!each.hadRecentInput) window.__shift += each.value
}).observe({ type: 'layout-shift', buffered: true })
"""


@pytest.fixture(scope="module")
def compared(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[BrowserContext, str]]:
    """A profile that is logged in to a service with two trainings, and the address of their comparison."""
    directory = tmp_path_factory.mktemp("compared")
    # Playwright's event loop runs on this thread.
    with ThreadPoolExecutor(1) as thread:
        address = thread.submit(fill, directory).result()
    with running([sys.executable, "-m", "server"], directory, workers=1) as service, logged_in(browser, service) as context:
        yield context, address


@pytest.fixture(autouse=True)
def closed(compared: tuple[BrowserContext, str]) -> Iterator[None]:
    """Every page is closed behind its test: six that listen for changes are as many connections as a browser opens."""
    yield
    for page in compared[0].pages:
        page.close()


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
    assert b'rotate(-90)" text-anchor="middle" fill="#3d464d">Share of episodes</text>' in found[".svg"]
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


def test_panels_are_chosen_by_keyboard_kept_in_the_address_and_drawn_when_one_comes_near(
    compared: tuple[BrowserContext, str],
) -> None:
    context, address = compared
    page = context.new_page()
    page.goto(address)
    button, chosen = page.get_by_role("button", name="Panels"), page.get_by_role("list", name="Panels")
    expect(page.get_by_role("figure", name="Success rate").first).to_be_visible()
    button.focus()
    page.keyboard.press("Enter")
    expect(chosen.get_by_role("listitem")).to_have_count(4)
    page.get_by_role("combobox", name="Add a panel").fill("loss")
    page.get_by_role("option", name="Value loss").click()
    expect(chosen.get_by_role("listitem")).to_have_count(5)
    page.keyboard.press("Escape")
    expect(chosen).to_have_count(0)
    expect(button).to_be_focused()
    page.wait_for_url("**panel=loss%2Fvalue")

    # The fifth waits below: idle time does not draw it.
    page.reload()
    fifth = page.get_by_role("heading", name="Value loss")
    expect(page.get_by_role("heading", name="Steps to the target")).to_be_attached()
    page.wait_for_timeout(3_000)
    expect(fifth).to_have_count(0)
    page.get_by_role("heading", name="What differs in their settings").scroll_into_view_if_needed()
    expect(fifth).to_be_visible()


def test_controls_answer_before_the_charts_are_drawn(compared: tuple[BrowserContext, str]) -> None:
    context, address = compared
    page = context.new_page()
    page.goto(address)
    expect(page.get_by_role("figure", name="Success rate").first).to_be_visible()
    log = page.get_by_role("checkbox", name="Log horizontal axis")
    # In the very task of the click; and what is chosen a moment later loses nothing of it.
    checked = log.evaluate("async (box) => { box.click(); await null; return box.checked }")
    page.get_by_role("checkbox", name="Log axis of Success rate, evaluation").click()
    assert checked
    page.wait_for_url("**xlog=1&ylog=eval%2Fsuccess_rate")
    expect(log).to_be_checked()


def test_an_experiment_has_one_colour_everywhere(compared: tuple[BrowserContext, str]) -> None:
    context, address = compared
    page = context.new_page()
    page.goto(address)
    ids = parse_qs(urlsplit(address).query)["experiment"]
    looks = looks_of(ids)
    swatches = page.get_by_test_id("figures").locator("svg[data-color]")
    expect(swatches).to_have_count(2)
    assert [each.get_attribute("data-color") for each in swatches.all()] == [str(color_of(each)) for each in ids]
    legend = page.get_by_role("figure", name="Success rate").first.locator("svg[data-color]")
    expect(legend).to_have_count(2)
    assert [each.get_attribute("data-color") for each in legend.all()] == [str(color_of(each)) for each in ids]
    page.get_by_role("button", name="Export the chart Performance profile").click()
    with page.expect_download() as download:
        page.get_by_role("menuitem", name="Picture (SVG)").click()
    picture = download.value.path().read_text()
    assert all(f'stroke="{LIGHT[look.color]}" stroke-width="2"{look.dashes(2)}' in picture for look in looks.values())
    page.goto("/")
    for name, each in zip(("Short sight", "Long_sight & 99%"), ids, strict=True):
        row = page.get_by_role("row").filter(has_text=name)
        expect(row.locator("svg[data-color]")).to_have_attribute("data-color", str(color_of(each)))


@pytest.mark.parametrize("size", [(412, 823), (1280, 900), (1920, 1080)])
def test_a_comparison_comes_where_it_stays(compared: tuple[BrowserContext, str], size: tuple[int, int]) -> None:
    context, address = compared
    page = context.new_page()
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.add_init_script(SHIFTS)
    page.goto(address)
    expect(page.get_by_test_id("verdicts")).to_be_visible()
    expect(page.get_by_role("figure", name="Performance profile")).to_be_attached()
    page.wait_for_timeout(1_500)
    assert page.evaluate("window.__shift") < GOOD_SHIFT
