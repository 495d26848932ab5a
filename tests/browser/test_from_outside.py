"""Somebody's own algorithm, network, reward, observation and arenas, installed beside a service that never heard of them."""

import json
import re
import subprocess
import sys
import sysconfig
import time
import venv
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.browser.conftest import ROOT, logged_in, running
from workers.statistics.intervals import exact_interval

pytestmark = pytest.mark.browser

SOON, TRAINED = 90_000, 240_000
LAB = "outer_lab"

UNTRAINED = """
import json, sys
import torch
from sim.actions import action_layout
from sim.suites import run_suite, suite_for
from workers.algorithms import build_algorithm
from workers.config import TrainingConfig
from workers.networks.inputs import inputs_of
from workers.policy import Policy, torch_policy

run = json.load(sys.stdin)
training = TrainingConfig.model_validate(run["training"])
inputs, actions = inputs_of(training.task), action_layout(training.task.robot)
fresh = build_algorithm(training.algorithm, inputs, run["seed"], torch.device("cpu"), actions)
untrained = Policy(training.algorithm.network, fresh.policy_weights(), inputs, actions)
suite = suite_for(training.task)
table = run_suite(torch_policy(untrained), training.task, suite)
print(json.dumps([suite.hash, int((table.outcomes == 1).sum())]))
"""
"""What the policy of a run does on its suite before it learns anything: the suite's hash, and arrivals."""


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of a fresh environment in which pip has installed Mapless and a package that was written a moment ago.

    What Mapless depends on is that of this environment: nothing is downloaded.
    """
    folder = tmp_path_factory.mktemp("outside")
    venv.create(folder / "venv", with_pip=False)
    python = folder / "venv" / "bin" / "python"
    site = sysconfig.get_path("purelib", vars={"base": str(folder / "venv"), "platbase": str(folder / "venv")})
    (Path(site) / "beside.pth").write_text(sysconfig.get_path("purelib") + "\n")

    def install(*what: str) -> None:
        options = ["--quiet", "--no-index", "--no-deps", "--no-build-isolation"]
        subprocess.run([python, "-m", "pip", "install", *options, *what], cwd=folder, check=True)

    install("--editable", str(ROOT))
    subprocess.run([python.with_name("mapless"), "extension", "new", LAB], cwd=folder, check=True)
    install(str(folder / LAB))
    return python


@pytest.fixture(scope="module")
def lab(python: Path, browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[BrowserContext]:
    """A browser at the service of that environment."""
    data = tmp_path_factory.mktemp("data")
    with running([str(python.with_name("mapless"))], data, workers=1) as address, logged_in(browser, address) as context:
        yield context


def select(page: Page, label: str, option: str) -> None:
    page.get_by_role("combobox", name=label, exact=True).click()
    page.get_by_role("option", name=option, exact=True).click()


def fill(page: Page, label: str, value: float) -> None:
    page.get_by_role("textbox", name=re.compile(f"^{re.escape(label)}")).fill(str(value))


def test_all_five_are_launched_from_the_form_learn_and_leave_the_house(
    lab: BrowserContext, python: Path, tmp_path: Path
) -> None:
    page = lab.new_page()
    page.goto("/new")
    page.get_by_label("Name", exact=True).fill("From outside")
    fill(page, "Steps", 150_000)
    select(page, "Arena", "Pillars")
    fill(page, "Difficulty", 0)
    select(page, "Algorithm", "REINFORCE")
    select(page, "Network", "Gated")
    page.get_by_role("button", name="Advanced").click()
    fill(page, "Robots", 256)
    fill(page, "Learning rate", 0.01)
    page.get_by_role("checkbox", name="Opening", exact=True).check()
    page.get_by_role("button", name="Add a term").click()
    page.get_by_role("menuitem", name=re.compile("^Gentle turns")).click()
    page.get_by_role("button", name="Launch").click()
    page.wait_for_url("**/runs/*", timeout=SOON)

    # What draws 3D in software would take the time of what learns: until that is done, another page.
    address = page.url
    page.goto("/new")
    run = lab.request.get("/api/runs/" + address.rpartition("/")[2]).text()
    measured = subprocess.run([python, "-c", UNTRAINED], input=run, cwd=tmp_path, check=True, capture_output=True, text=True)
    suite_hash, before = json.loads(measured.stdout.splitlines()[-1])
    wait_for_end(lab, address)
    page.goto(address)
    expect(page.get_by_test_id("state").first).to_have_attribute("data-state", "completed")

    # Its robots drive, by a network that only the package knows, and it can be taken away.
    page.get_by_role("button", name="Watch the best policy").click()
    expect(page.get_by_test_id("live-view")).to_have_attribute("data-receiving", "true", timeout=SOON)
    display = page.frame_locator("[data-testid=live-frame]").locator("#display")
    expect(display).to_contain_text("Best policy", timeout=SOON)
    best = page.locator("[data-testid=checkpoint][data-best]")
    archive, bundle = tmp_path / "policy.zip", tmp_path / "bundle.zip"
    for path, link in ((archive, "Download"), (bundle, "Robot bundle")):
        with page.expect_download(timeout=SOON) as download:
            best.get_by_role("link", name=re.compile(f"^{link}")).click(timeout=SOON)
        download.value.save_as(path)
    shown = best.inner_text()
    page.close()

    # All five stand in what is taken away.
    with zipfile.ZipFile(archive) as opened:
        manifest = json.loads(opened.read("manifest.json"))
    task, algorithm = manifest["training"]["task"], manifest["training"]["algorithm"]
    assert task["arena"]["name"] == f"{LAB}.pillars"
    assert f"{LAB}.opening" in [part["name"] for part in task["observation"]["parts"]]
    assert f"{LAB}.gentle" in [term["name"] for term in task["reward"]["terms"]]
    assert (algorithm["name"], algorithm["network"]["name"]) == (f"{LAB}.reinforce", f"{LAB}.gated")
    assert [one["name"] for one in manifest["training"]["extensions"]] == [LAB]
    numbers = [number["name"] for number in manifest["observation"]["numbers"]]
    assert numbers[-2:] == ["opening bearing", "opening room"]

    # The ONNX graph takes the observation with the part in it.
    with zipfile.ZipFile(bundle) as opened:
        session = onnxruntime.InferenceSession(opened.read("mapless-policy/policy.onnx"))
    action, _ = session.run(["action", "velocity"], {"observation": np.zeros((1, len(numbers)), np.float32)})
    assert action.shape == (1, 2)

    # It is better than it was before it learned anything, in arenas that it never trained in: the intervals are apart.
    evaluation = manifest["evaluation"]
    after, episodes = evaluation["arrivals"], evaluation["episodes"]
    assert f"{100 * after / episodes:.1f}" in shown
    assert suite_hash == evaluation["suite_hash"]
    (_, before_at_most), (after_at_least, _) = exact_interval(before, episodes), exact_interval(after, episodes)
    assert after_at_least > before_at_most, (episodes, before, after)


def wait_for_end(context: BrowserContext, address: str) -> None:
    """Until the run of a page is completed."""
    run = "/api/runs/" + address.rpartition("/")[2]
    deadline = time.monotonic() + TRAINED / 1000
    while (state := context.request.get(run).json()["state"]) != "completed":
        assert state in ("queued", "running"), state
        assert time.monotonic() < deadline, "it takes too long"
        time.sleep(0.5)


def test_the_package_stands_nowhere_in_this_project() -> None:
    listed = subprocess.run(["git", "grep", "-l", LAB], cwd=ROOT, capture_output=True, text=True, check=False)
    assert set(listed.stdout.split()) <= {str(Path(__file__).relative_to(ROOT))}
    assert LAB not in sys.modules
