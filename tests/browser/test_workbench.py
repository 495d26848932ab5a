"""The table of trainings with a thousand of them: found, ordered, grouped, acted upon, by mouse and by keyboard."""

import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from subprocess import PIPE, STDOUT, Popen

import pytest
from playwright.sync_api import Browser, Page, expect

from server.database import tables
from server.database.engine import Database
from server.database.migrate import upgrade
from server.ids import new_id
from server.workbench.keys import KeyRepository
from tests.browser.conftest import ROOT, read_url
from workers.config import TrainingConfig

COUNT = 1_000
# Milliseconds: two busy cores.
SOON = 60_000


def make(data: Path) -> None:
    """A thousand trainings of two runs, by SQL: PPO at three gammas, every tenth failed."""
    settings = [
        TrainingConfig.model_validate({"algorithm": {"name": "ppo", "gamma": gamma}}).model_dump(mode="json")
        for gamma in (0.9, 0.99, 0.995)
    ]
    database = Database(f"sqlite:///{data / 'mapless.db'}")
    upgrade(database)
    now = time.time()
    with database.write() as session:
        experiments = [
            tables.Experiment(
                id=new_id(), name=f"Training {index}", training=settings[index % 3], created_at=now - 60 * index
            )
            for index in range(COUNT)
        ]
        for index, experiment in enumerate(experiments):
            experiment.runs = [
                tables.Run(
                    id=new_id(),
                    seed=seed,
                    state="failed" if index % 10 == 0 else "completed",
                    final_step=1,
                    final_suite="suite",
                    final_arrivals=index * 100 // COUNT,
                    final_episodes=100,
                )
                for seed in (0, 1)
            ]
        session.add_all(experiments)
        session.flush()
        KeyRepository(session).write_down(experiments)
    database.dispose()


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    data = tmp_path_factory.mktemp("thousand")
    make(data)
    command = [sys.executable, "-m", "server", "serve", "--port", "0", "--data-dir", str(data)]
    with Popen(command, cwd=ROOT, stdout=PIPE, stderr=STDOUT, text=True) as process:
        try:
            yield read_url(process, 60.0)
        finally:
            process.terminate()


@pytest.fixture
def page(browser: Browser, address: str) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    page.goto(address)
    yield page
    context.close()


def test_a_training_among_a_thousand_is_found_and_opened_by_keyboard(page: Page) -> None:
    grid = page.get_by_role("grid", name="Trainings")
    expect(page.get_by_text(re.compile("^1.000 trainings$"))).to_be_visible(timeout=SOON)
    # Of a thousand those in sight are drawn.
    assert grid.get_by_test_id("experiment").count() < 60

    search = page.get_by_role("textbox", name="Search and filter")
    search.press_sequentially("algorithm.gam")
    page.get_by_role("option", name="algorithm.gamma").wait_for()
    search.press("ArrowDown")
    search.press("Enter")
    search.press_sequentially("= 0.995 state = failed")
    expect(page.get_by_text("33 trainings")).to_be_visible(timeout=SOON)
    search.fill("state = happy")
    expect(page.get_by_role("alert")).to_contain_text("A state is one of queued")
    search.fill('"Training 500"')
    expect(page.get_by_text("1 training", exact=True)).to_be_visible(timeout=SOON)
    search.press("Escape")
    grid.get_by_test_id("experiment").first.focus()
    page.keyboard.press(" ")
    expect(page.get_by_role("region", name="Ticked trainings")).to_contain_text("1 training")
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("/experiments/"))
    page.go_back()
    # The view lives in the address.
    expect(search).to_have_value('"Training 500"')


def test_sorted_grouped_and_scrolled_to_the_end(page: Page) -> None:
    rows = page.get_by_test_id("experiment")
    page.get_by_role("columnheader", name="Success, 95 % interval").get_by_role("button").click()
    expect(rows.first).to_contain_text("99.0", timeout=SOON)
    rows.first.focus()
    page.keyboard.press("End")
    # The end of all thousand, which come a hundred at a time, below the row of headings.
    expect(page.locator(f'[aria-rowindex="{COUNT + 1}"]')).to_be_focused(timeout=SOON)
    expect(rows.last).to_contain_text("0 %")

    page.get_by_role("combobox", name="Group by").fill("gamma")
    page.get_by_role("option", name="algorithm.gamma").click()
    groups = page.get_by_test_id("group")
    expect(groups).to_have_count(3, timeout=SOON)
    expect(groups.first).to_contain_text("334 trainings")
    groups.first.focus()
    page.keyboard.press("Enter")
    expect(rows.first).to_be_visible(timeout=SOON)


def test_tagged_archived_deleted_and_taken_back(page: Page) -> None:
    page.goto(page.url.split("?")[0] + "?q=name+%3D+%22Training+77%22")
    bar = page.get_by_role("region", name="Ticked trainings")
    page.get_by_role("checkbox", name="Tick Training 77", exact=True).check(timeout=SOON)
    bar.get_by_role("button", name="Tag").click()
    page.get_by_label("Tags").last.press_sequentially("baseline")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Put on").click()
    expect(page.get_by_test_id("experiment")).to_contain_text("baseline", timeout=SOON)

    bar.get_by_role("button", name="Delete").click()
    expect(page.get_by_text("No training matches")).to_be_visible(timeout=SOON)
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_role("link", name="Training 77", exact=True)).to_be_visible(timeout=SOON)
