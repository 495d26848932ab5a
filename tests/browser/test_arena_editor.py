"""An arena is drawn with the mouse, kept, and trained on: by a person, in a real browser, against the real stack."""

import re

import pytest
from playwright.sync_api import BrowserContext, Locator, Page, expect

pytestmark = pytest.mark.browser

# Milliseconds: trainings run on the same two cores as everything else here.
SOON, TRAINED = 90_000, 240_000

Place = tuple[float, float]


def tool(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def drag(page: Page, drawing: Locator, *places: Place) -> None:
    """The mouse goes down at the first place of the arena, metres, over the others, and up at the last."""
    a, d, e, f = drawing.evaluate("svg => { const m = svg.getScreenCTM(); return [m.a, m.d, m.e, m.f] }")
    points = [(e + a * x, f - d * y) for x, y in places]
    page.mouse.move(*points[0])
    page.mouse.down()
    for point in points[1:]:
        page.mouse.move(*point, steps=5)
    page.mouse.up()


def test_an_arena_is_drawn_with_the_mouse_kept_and_trained_on(context: BrowserContext) -> None:
    page = context.new_page()
    page.goto("/arenas")
    page.get_by_role("link", name="Draw an arena").click()
    drawing = page.get_by_test_id("drawing")
    for name, metres in (("Width, m", "8"), ("Height, m", "6")):
        page.get_by_role("textbox", name=name).fill(metres)
    page.get_by_role("textbox", name="Name").fill("Drawn by hand")

    # Two rooms without a door between them: the server says so, and where.
    tool(page, "Wall")
    drag(page, drawing, (0, -3), (0, 3))
    tool(page, "Start")
    drag(page, drawing, (-3, 0), (-2, 0))
    tool(page, "Target")
    drag(page, drawing, (3, 0))
    review = page.get_by_test_id("review")
    expect(review).to_contain_text("are closed off", timeout=SOON)
    expect(review).to_contain_text("There is no way from the start to the target")

    tool(page, "Door")
    drag(page, drawing, (0, 1.5))
    expect(review).to_contain_text("All is well", timeout=SOON)

    # A pillar that stands in the door is dragged out of the way; its edge is pulled; the last pull is taken back.
    tool(page, "Disc")
    drag(page, drawing, (0, 1.5), (0, 2))
    expect(review).to_contain_text("are closed off", timeout=SOON)
    tool(page, "Select")
    drag(page, drawing, (0, 1.5), (-1, 0), (-2, -2))
    drag(page, drawing, (-1.5, -2), (-1, -2))
    page.keyboard.press("Control+z")
    tool(page, "Person's way")
    for corner in ((1, -2), (3, -2), (3, -2)):
        drag(page, drawing, corner)
    expect(review).to_contain_text("All is well", timeout=SOON)

    # It is there after a reload.
    page.reload()
    page.get_by_role("button", name="Train on it").click()
    page.wait_for_url("**/new?arena=*", timeout=SOON)
    page.get_by_label("Name", exact=True).fill("In what I drew")
    page.get_by_role("textbox", name=re.compile("^Steps")).fill("8192")
    page.get_by_role("button", name="Launch").click()
    page.wait_for_url("**/runs/*", timeout=SOON)
    expect(page.get_by_test_id("state").first).to_have_text("Completed", timeout=TRAINED)

    (arena,) = (one for one in context.request.get("/api/arenas").json() if one["title"] == "Drawn by hand")
    assert arena["config"]["sha256"] == arena["key"]
    geometry = context.request.get(f"/api/arenas/imported/{arena['key']}").json()["geometry"]
    assert (geometry["width"], geometry["height"]) == (8.0, 6.0)
    assert geometry["circles"] == [{"x": -2.0, "y": -2.0, "radius": 0.5}]
    assert sorted((box["y"], box["length"]) for box in geometry["boxes"]) == [(-1.025, 4.05), (2.525, 1.05)]
    (mover,) = geometry["movers"]
    assert (mover["kind"], mover["waypoints"]) == ("pedestrian", [{"x": 1.0, "y": -2.0}, {"x": 3.0, "y": -2.0}])
    run = context.request.get(f"/api/runs/{page.url.rsplit('/', 1)[1].split('?')[0]}").json()
    experiment = context.request.get(f"/api/experiments/{run['experiment_id']}").json()
    assert experiment["training"]["task"]["arena"]["sha256"] == arena["key"]

    # And joins a suite of one's own, from the gallery.
    page.goto("/arenas")
    page.get_by_role("button", name="Add Drawn by hand to a suite").click()
    page.get_by_role("combobox", name="Suite of your own").fill("What I drew")
    page.get_by_role("button", name="Add", exact=True).click()
    expect(page.get_by_role("status").filter(has_text="What I drew has 1 scenario now.")).to_be_visible(timeout=SOON)
    (suite,) = (one for one in context.request.get("/api/suites").json() if one["name"] == "What I drew")
    assert [scenario["sha256"] for scenario in suite["scenarios"]] == [arena["key"]]
