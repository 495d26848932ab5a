"""A person puts a disc into a robot's way, by keyboard alone, and the robot goes round it."""

import re

import pytest
from playwright.sync_api import BrowserContext, Page, expect

pytestmark = pytest.mark.browser

# Milliseconds: two busy cores, and rendering in software.
SOON = 90_000


def take(page: Page, thing: str) -> None:
    """Chooses what is to be put somewhere."""
    things = page.get_by_role("combobox", name="Handles on")
    things.fill(thing)
    things.press("ArrowDown")
    things.press("Enter")
    expect(things).to_have_value(thing)


def type_places(page: Page, **places: float) -> None:
    """Types where the chosen thing is to stand."""
    for label, value in places.items():
        page.get_by_role("textbox", name=re.compile(f"^{label}")).fill(f"{value}")
    page.wait_for_timeout(500)


def open_simple(page: Page) -> None:
    """A playground of a shipped policy in the simple arena, once it drives."""
    page.goto("/policies/complex")
    page.get_by_role("link", name=re.compile("^Play with")).click()
    page.get_by_role("combobox", name="Arena").click()
    page.get_by_role("option", name="Simple").click()
    page.get_by_role("button", name="Let it drive").click()
    expect(page.get_by_test_id("outcome")).to_contain_text("It", timeout=SOON)


def test_the_robot_goes_round_what_is_put_in_its_way(context: BrowserContext) -> None:
    page = context.new_page()
    open_simple(page)
    address = f"/api/playgrounds/{page.url.rsplit('/', 1)[1]}"

    page.get_by_role("button", name="Pause").click()
    take(page, "Robot")
    type_places(page, x=-2, y=0, Heading=0)
    take(page, "Target")
    type_places(page, x=1.5, y=0)
    expect(page.get_by_test_id("outcome")).to_contain_text("It arrives in", timeout=SOON)
    straight = float(re.findall(r"[\d.]+", page.get_by_test_id("outcome").inner_text())[0])

    # Into its way: what it sees coming is a longer way at once, before it has moved.
    page.get_by_role("button", name="Add a disc").press("Enter")
    expect(page.get_by_role("combobox", name="Handles on")).to_have_value("Disc 1")
    type_places(page, x=-0.3, y=0.05, Radius=0.4)
    expect(page.get_by_test_id("outcome")).not_to_contain_text(f" {straight:.1f} s", timeout=SOON)

    # It may have arrived before it was paused. The service is asked, not the page: where that draws slowly, too little would
    # be seen of the way.
    ways, before = [], context.request.get(address).json()
    page.get_by_role("button", name="Go on").click()
    while (now := context.request.get(address).json())["arrivals"] == before["arrivals"]:
        ways.append((now["robot"]["x"], now["robot"]["y"]))
        page.wait_for_timeout(20)
    expect(page.get_by_test_id("tally")).to_contain_text(re.compile(r"[1-9]\d* arrived"), timeout=SOON)
    assert now["collisions"] == before["collisions"]
    # The disc's edge is 0.35 m from the straight line on one side, 0.45 m on the other; the robot is 0.1 m wide.
    assert max(abs(y) for x, y in ways if abs(x + 0.3) < 0.4) > 0.4


def test_a_moment_that_is_kept_is_a_scenario_to_measure_others_on(context: BrowserContext) -> None:
    page = context.new_page()
    open_simple(page)
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Add a disc").press("Enter")
    expect(page.get_by_role("combobox", name="Handles on")).to_have_value("Disc 1")
    type_places(page, x=-0.3, y=0.05, Radius=0.4)

    page.get_by_role("textbox", name="Name").fill("A disc in the way")
    page.get_by_role("combobox", name="Suite of your own").fill("Hard corners")
    page.get_by_role("button", name="Keep", exact=True).click()
    expect(page.get_by_text("Hard corners has 1 scenario now.")).to_be_visible(timeout=SOON)
    page.get_by_role("link", name="Evaluate on the suite").click()
    policies = page.get_by_role("combobox", name="Policies")
    policies.fill("go-to")
    page.get_by_role("option", name="Go-to-goal", exact=True).click()
    policies.press("Escape")
    page.get_by_role("button", name="Evaluate, 1 time").click()
    row = page.get_by_test_id("evaluation").filter(has_text="Hard corners")
    expect(row).to_have_attribute("data-state", "done", timeout=SOON)
    row.get_by_role("link", name="Go-to-goal").click()
    expect(page.get_by_test_id("episode")).to_have_count(1)
    # Other tests count what was measured.
    assert context.request.delete(f"/api/evaluations/{page.url.rsplit('/', 1)[1]}").ok
