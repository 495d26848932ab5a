"""Two fingers on a phone: they zoom and move charts and the arena that is drawn, and one does what it did."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Page, expect

from tests.browser.hand import Hand, Place
from tests.browser.small_lab import Addresses, small_lab

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory, browser: Browser) -> Iterator[tuple[Addresses, BrowserContext]]:
    """The addresses of a service with one of everything, and a browser that stands still."""
    with small_lab(tmp_path_factory.mktemp("lab"), browser) as (found, context):
        yield found, context


def middle(where: Locator) -> Place:
    box = where.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def scrolled(page: Page) -> tuple[float, float]:
    at = page.evaluate("[scrollY, visualViewport.scale]")
    return at[0], at[1]


def test_two_fingers_zoom_and_move_a_chart_and_one_scrolls_the_page(
    lab: tuple[dict[str, tuple[str, str]], BrowserContext],
) -> None:
    found, context = lab
    page = context.new_page()
    hand = Hand(page)
    page.goto(found["run"][0])
    chart = page.get_by_test_id("chart").first
    chart.scroll_into_view_if_needed()
    over = chart.locator(".u-over")
    expect(over).to_be_visible()
    reset = chart.get_by_role("button", name="Reset zoom")
    expect(reset).to_have_count(0)
    x, y = middle(over)
    before = scrolled(page)

    hand.drag(((x - 20, y), (x - 80, y)), ((x + 20, y), (x + 80, y)))
    expect(reset).to_be_visible()
    assert scrolled(page) == before
    # Every chart beside it shows the same of x.
    others = page.get_by_role("button", name="Reset zoom")
    assert others.count() > 1
    # Back together: all of it is shown again.
    hand.drag(((x - 80, y), (x - 10, y)), ((x + 80, y), (x + 10, y)))
    expect(others).to_have_count(0)
    # Two that come down and go, and move nothing, are no zoom.
    hand.drag(((x - 80, y), (x - 80, y)), ((x + 80, y), (x + 80, y)), steps=0)
    expect(others).to_have_count(0)

    hand.drag(((x, y), (x, y - 150)), steps=12)
    page.wait_for_function("before => scrollY > before", arg=before[0])
    expect(others).to_have_count(0)
    page.close()


def test_two_fingers_zoom_and_move_the_arena_that_is_drawn_and_draw_nothing(
    lab: tuple[dict[str, tuple[str, str]], BrowserContext],
) -> None:
    page = lab[1].new_page()
    hand = Hand(page)
    page.goto("/arenas/draw")
    drawing = page.get_by_test_id("drawing")
    drawing.scroll_into_view_if_needed()
    things = drawing.locator("g[transform] :is(rect, circle, polyline)")
    empty = things.count()
    x, y = middle(drawing)
    before = scrolled(page)

    def shown() -> list[float]:
        return [float(each) for each in (drawing.get_attribute("viewBox") or "").split()]

    def under(at: Place) -> Place:
        found = drawing.evaluate(
            "(svg, [x, y]) => { const m = svg.getScreenCTM().inverse(); return [m.a * x + m.e, m.d * y + m.f] }", list(at)
        )
        return found[0], found[1]

    for tool in ("Select", "Disc", "Wall", "Door", "Person's way"):
        page.get_by_role("button", name=tool, exact=True).click()
        whole, held = shown(), under((x + 30, y))
        hand.drag(((x + 10, y), (x - 20, y + 40)), ((x + 50, y), (x + 80, y + 40)))
        _, _, width, _ = shown()
        assert width == pytest.approx(whole[2] * 40 / 100, rel=0.02), tool
        # What was between the fingers still is.
        assert under((x + 30, y + 40)) == pytest.approx(held, abs=0.05 * width), tool
        hand.drag(((x - 60, y), (x - 5, y)), ((x + 60, y), (x + 5, y)))
        assert shown() == pytest.approx(whole), tool
        assert things.count() == empty, f"{tool} drew something"
    assert scrolled(page) == before

    # One finger draws as before: a disc by a drag, a corner of a way by a tap.
    page.get_by_role("button", name="Disc", exact=True).click()
    hand.drag(((x, y), (x + 40, y)))
    expect(things).not_to_have_count(empty)
    page.get_by_role("button", name="Person's way", exact=True).click()
    for at in (-60, 60):
        hand.drag(((x + at, y - 60), (x + at, y - 60)), steps=0)
    expect(drawing.locator("polyline")).to_have_count(1)
    page.close()
