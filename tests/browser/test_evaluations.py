"""Does this policy work in my arena? Asked from the gallery, measured by a worker, looked at, replayed."""

import base64
import re
from pathlib import Path

import pytest
from playwright.sync_api import BrowserContext, expect

from sim.config import ArenaFile
from workers.export.bundle import export_checkpoint
from workers.shipped.library import shipped_policy

pytestmark = pytest.mark.browser
MEASURED = 120_000


def wall_file(name: str, length: float) -> dict[str, str]:
    """An arena of 6 x 6 m with a wall in its middle, as an upload has it; one of the same walls is kept once."""
    wall = ArenaFile.model_validate(
        {"name": name, "width": 6.0, "height": 6.0, "boxes": [{"x": 0.0, "y": 0.0, "length": length, "width": 0.2}]}
    )
    return {"name": "wall.json", "content": base64.b64encode(wall.model_dump_json().encode()).decode()}


def test_a_policy_and_a_baseline_are_measured_in_an_imported_arena(context: BrowserContext) -> None:
    imported = context.request.post("/api/arenas/imported", data={"files": [wall_file("A wall", 3.0)], "keep": True})
    assert imported.ok, imported.text()

    page = context.new_page()
    page.goto("/arenas")
    page.get_by_role("link", name="Evaluate on A wall").click()
    policies = page.get_by_role("combobox", name="Policies")
    for typed, name in (("go-to", "Go-to-goal"), ("complex", "Complex arena")):
        policies.fill(typed)
        page.get_by_role("option", name=name, exact=True).click()
    policies.press("Escape")
    page.get_by_role("button", name="Evaluate, 2 times").click()

    rows = page.get_by_test_id("evaluation")
    expect(rows).to_have_count(2)
    for row in rows.all():
        expect(row).to_have_attribute("data-state", "done", timeout=MEASURED)
        expect(row).to_contain_text("A wall-200")
    page.get_by_role("link", name="Go-to-goal").click()
    expect(page.get_by_role("heading", name="Go-to-goal")).to_be_visible()

    # Blind as it is, it ends at the wall; each way is on the map, and a click replays it.
    expect(page.get_by_role("img", name="200 ways in A wall, from above")).to_be_visible()
    page.get_by_text(re.compile("^Collisions")).first.click()
    expect(page.get_by_role("img", name=re.compile(r"^\d{1,2} ways in A wall, from above"))).to_be_visible()
    page.get_by_role("button", name=re.compile("^Replay episode")).first.click()
    replay = page.frame_locator("[data-testid=replay-frame]")
    expect(replay.locator("#display")).to_contain_text("Collided", timeout=MEASURED)
    page.get_by_role("dialog").locator(".mantine-Modal-close").click()

    # Both stand on the board of this suite, the one that sees before the one that does not.
    page.get_by_role("link", name="Leaderboard").click()
    entries = page.get_by_test_id("entry")
    expect(entries).to_have_count(2)
    expect(entries.nth(0)).to_contain_text("Complex arena")
    expect(entries.nth(1)).to_contain_text("Below")


def test_an_uploaded_onnx_policy_is_measured_in_an_imported_arena(context: BrowserContext, tmp_path: Path) -> None:
    policy = shipped_policy("complex")
    mine = tmp_path / "elsewhere.onnx"
    mine.write_bytes(export_checkpoint(policy.archive).by_observation)
    arena = context.request.post("/api/arenas/imported", data={"files": [wall_file("Another wall", 2.5)], "keep": True})
    assert arena.ok, arena.text()

    page = context.new_page()
    page.goto("/evaluations")
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Upload a policy").click()
    chooser.value.set_files(mine)
    dialog = page.get_by_role("dialog")
    # Filled in by hand for another LiDAR it is refused in words; filled in as of the policy it is taken.
    dialog.get_by_role("textbox", name="Rays", exact=True).fill("60")
    dialog.get_by_role("button", name="Change: settings of Ranges").click()
    dialog.get_by_role("textbox", name="Batches").fill("60")
    expect(dialog.get_by_test_id("shapes")).to_contain_text("ranges 60")
    dialog.get_by_role("button", name="Upload").click()
    expect(dialog.get_by_role("alert")).to_contain_text("and this robot, LiDAR and observation make it (n, ")
    dialog.get_by_role("combobox", name="As of").fill("complex")
    page.get_by_role("option", name=policy.card.title, exact=True).click()
    expect(dialog.get_by_role("textbox", name="Rays", exact=True)).to_have_value("30")
    dialog.get_by_role("button", name="Upload").click()
    expect(dialog).to_have_count(0)

    # It is chosen already.
    expect(page.get_by_role("button", name="Evaluate, 1 time")).to_be_enabled()
    suites = page.get_by_role("combobox", name="On", exact=True)
    suites.fill("another")
    page.get_by_role("option", name="Another wall", exact=True).click()
    suites.press("Escape")
    page.get_by_role("button", name="Evaluate, 1 time").click()
    row = page.get_by_test_id("evaluation").filter(has_text="elsewhere")
    expect(row).to_have_attribute("data-state", "done", timeout=MEASURED)
    expect(row).to_contain_text("Another wall-200")
    # It learned to go round walls: onnxruntime drives as well as torch did.
    page.get_by_role("link", name="elsewhere", exact=True).click()
    expect(page.get_by_text(re.compile("^Arrivals (1[5-9]|20)[0-9]"))).not_to_have_count(0)
