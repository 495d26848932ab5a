"""axe finds nothing: every page with data on it, light and dark, on a phone and on a desk, dialogs and menus open.

And no page has to be scrolled sideways in a window of 320 pixels (WCAG 2.2, 1.4.10).
"""

import base64
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import APIRequestContext, Browser, BrowserContext, Page, expect

from benchmarks.dashboard.data import Lab, Sizes, make
from sim.config import ArenaFile
from tests.browser.conftest import ROOT, logged_in, running

pytestmark = pytest.mark.browser

AXE = ROOT / "web/node_modules/axe-core/axe.min.js"
DESK, PHONE, NARROW = (1280, 900), (390, 844), (320, 844)
SMALL = Sizes(experiments=9, points=60, long_experiments=1, long_points=400, checkpoints=12, live=0)
# All rules once on a desk and once on a phone, in one scheme each; in the other scheme the colours of all that a desk shows.
LOOKS = ((DESK, "light", None), (DESK, "dark", "color-contrast"), (PHONE, "dark", None))
PAINTED = "new Promise((painted) => requestAnimationFrame(() => requestAnimationFrame(painted)))"
TOO_WIDE = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
CHECK = """
async (rule) => {
  const found = await axe.run(document, {
    resultTypes: ['violations'],
    iframes: false,
    // WCAG 2.2, 2.5.8: axe asks for the size of what is pressed where it is told to.
    ...(rule ? { runOnly: { type: 'rule', values: [rule] } } : { rules: { 'target-size': { enabled: true } } }),
  })
  return found.violations.flatMap(({ id, nodes }) =>
    nodes.map(({ target, failureSummary }) => `${id}: ${target} ${failureSummary}`))
}
"""


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory, browser: Browser) -> Iterator[tuple[Lab, BrowserContext]]:
    """A service with trainings, an imported arena, and an evaluation on it; and a browser that stands still."""
    directory = tmp_path_factory.mktemp("lab")
    made = make(directory, SMALL)
    with (
        running([sys.executable, "-m", "server"], directory, workers=1) as address,
        logged_in(browser, address) as context,
    ):
        # The robots in 3D are a page of their own, and slow to draw without a graphics card.
        context.route("**/live/**", lambda route: route.abort())
        ask(context.request)
        yield made, context


def ask(api: APIRequestContext) -> None:
    """Import an arena and have a baseline measured in it."""
    wall = ArenaFile.model_validate(
        {"name": "A wall", "width": 6.0, "height": 6.0, "boxes": [{"x": 0.0, "y": 0.0, "length": 3.0, "width": 0.2}]}
    )
    file = {"name": "wall.json", "content": base64.b64encode(wall.model_dump_json().encode()).decode()}
    arena = api.post("/api/arenas/imported", data={"files": [file], "keep": True}).json()["config"]
    question = {"policies": [{"source": "baseline", "name": "go-to-goal"}], "suites": [{"by": "arena", "arena": arena}]}
    created(api, "/api/evaluations", question)
    created(api, "/api/alerts/rules", {"event": "ended", "channel": "browser"})


def search(api: APIRequestContext) -> str:
    """The id of a study; the server asks for its trial within seconds, while the other pages are looked at."""
    sizes = {"kind": "range", "path": "algorithm.learning_rate", "low": 1e-4, "high": 1e-2, "log": True}
    training = {"steps": 2_000, "evaluation": {"every_steps": 2_000}}
    body = {"name": "Step sizes", "training": training, "settings": [sizes], "trials": 1}
    return str(created(api, "/api/studies", body)["id"])


def created(api: APIRequestContext, path: str, body: dict[str, Any]) -> Any:
    """What has come of a request."""
    answer = api.post(path, data=body)
    assert answer.ok, answer.text()
    return answer.json()


def measured(api: APIRequestContext) -> str:
    """The id of the evaluation, once it is done."""
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline:
        (evaluation,) = api.get("/api/evaluations").json()["items"]
        if evaluation["state"] == "done":
            return str(evaluation["id"])
        time.sleep(0.2)
    raise AssertionError("the evaluation did not end")


def pages(lab: Lab) -> list[tuple[str, str, str]]:
    """Every page: its address, what is on it once it is whole, and what is pressed for something over it ("" for nothing).

    Buttons and tabs by their names; one after the other where they are parted by " > ".
    """
    compared = f"/compare?experiment={lab.experiments[0]}&experiment={lab.long_experiments[0]}"
    return [
        ("/", "[data-testid=experiment]", "Actions for Long 0"),
        ("/", "[data-testid=experiment]", "Views"),
        ("/new", "[data-testid=launch-summary]", "Advanced"),
        (f"/experiments/{lab.long_experiments[0]}", "[data-testid=chart] canvas", "Seeds"),
        (f"/runs/{lab.many}", "[data-testid=checkpoint]", ""),
        (compared, "[data-testid=figures]", ""),
        (compared, "[data-testid=chart] canvas", "Panels"),
        ("/compare", "[data-testid=experiment]", ""),
        ("/policies", "[data-testid=policy]", ""),
        ("/policies/complex", "[data-testid=episode]", "Download Complex arena"),
        ("/arenas", "text=A wall", "Delete A wall"),
        ("/arenas/draw", "text=All is well", "Start from…"),
        ("/alerts", "[data-testid=rule]", ""),
        ("/studies", "h1", ""),
        ("/recordings", "h1", ""),
        ("/queue", "[data-testid=job]", ""),
        ("/evaluations", "[data-testid=evaluation]", ""),
        ("/leaderboards", "[data-testid=entry]", ""),
        ("/reproduction", "[data-testid=claim]", ""),
        ("/storage", "[data-testid=stored]", "Clean up Long 0"),
        ("/storage", "[data-testid=stored]", "Clean up Long 0 > Curves"),
        ("/account", "h1", ""),
        ("/projects", "h1", ""),
        ("/projects/default", "h1", ""),
        ("/people", "h1", ""),
        ("/audit", "table", ""),
        ("/join", "h1", ""),
        ("/nowhere", "h1", ""),
        ("/runs/nothing", "h2", ""),
    ]


def faults(page: Page) -> Iterator[str]:
    """What axe finds in every look of a page, and by how much it is too wide for a narrow window."""
    page.evaluate(f"{AXE.read_text()};0")
    for (width, height), scheme, rule in LOOKS:
        page.set_viewport_size({"width": width, "height": height})
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")  # type: ignore[arg-type]
        expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", scheme)
        page.evaluate(PAINTED)
        yield from (f"{page.url} {width} {scheme}: {each}" for each in page.evaluate(CHECK, rule))
    page.set_viewport_size({"width": NARROW[0], "height": NARROW[1]})
    page.evaluate(PAINTED)
    if (by := page.evaluate(TOO_WIDE)) > 0:
        yield f"{page.url}: {by} pixels too wide for {NARROW[0]}"


@pytest.mark.timeout(900)  # two dozen pages, three times each, once a service has started
def test_axe_finds_nothing_on_any_page(lab: tuple[Lab, BrowserContext]) -> None:
    made, context = lab
    evaluation = measured(context.request)
    page = context.new_page()
    page.emulate_media(reduced_motion="reduce")
    found: list[str] = []
    study = search(context.request)
    ground = created(context.request, "/api/playgrounds", {"policy": {"source": "shipped", "name": "simple"}})
    later = [
        (f"/evaluations/{evaluation}", "[data-testid=episode]", ""),
        (f"/playground/{ground['id']}", "[data-testid=tally]", ""),
        ("/playground", "text=Let it drive", ""),
        (f"/studies/{study}", "[data-testid=trial]", ""),
        ("/policies/complex?suite=complex-200&replay=8", "[role=dialog] [data-testid=chart] canvas", ""),
    ]
    for path, whole, opens in [*pages(made), *later]:
        page.set_viewport_size({"width": DESK[0], "height": DESK[1]})
        page.goto(path)
        expect(page.locator(whole).first).to_be_visible()
        for name in filter(None, opens.split(" > ")):
            page.get_by_role("button", name=name).or_(page.get_by_role("tab", name=name)).first.click()
        found += faults(page)
    page.close()
    assert not found, "\n".join(found)


def test_axe_finds_nothing_where_one_logs_in(lab: tuple[Lab, BrowserContext], browser: Browser) -> None:
    _, known = lab
    page = known.new_page()
    page.goto("/")
    origin = page.url
    page.close()
    stranger = browser.new_context(base_url=origin)
    page = stranger.new_page()
    page.goto("/")
    expect(page.get_by_role("heading", level=1, name="Log in")).to_be_visible()
    found = list(faults(page))
    stranger.close()
    assert not found, "\n".join(found)


def test_the_menu_of_a_policy_gives_the_focus_back(lab: tuple[Lab, BrowserContext]) -> None:
    _, context = lab
    page = context.new_page()
    page.goto("/policies/complex")
    button = page.get_by_role("button", name="Download Complex arena")
    for opens in ("Enter", "Space"):
        button.focus()
        page.keyboard.press(opens)
        expect(page.get_by_role("menuitem").first).to_be_focused()
        page.keyboard.press("Escape")
        expect(page.get_by_role("menuitem")).to_have_count(0)
        expect(button).to_be_focused()
    button.click()
    with page.expect_download():
        page.get_by_role("menuitem", name="Checkpoint").click()
    expect(button).to_be_focused()
    page.close()


@pytest.mark.timeout(300)
def test_axe_finds_nothing_in_an_alert_that_comes_over_a_page(lab: tuple[Lab, BrowserContext]) -> None:
    _, context = lab
    page = context.new_page()
    page.goto("/alerts")
    expect(page.get_by_test_id("rule").first).to_be_visible()
    training = {"steps": 2_000, "evaluation": {"every_steps": 2_000}}
    created(context.request, "/api/experiments", {"name": "Soon over", "training": training, "seeds": [0]})
    expect(page.get_by_role("alert").first).to_be_visible(timeout=120_000)
    found = list(faults(page))
    page.close()
    assert not found, "\n".join(found)
