"""Launching, listing, stopping, resuming, renaming and deleting experiments."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import select
from sqlalchemy.orm import Session

from server.database import tables
from server.database.engine import Database
from server.database.tables import RunState
from server.events.bus import EventBus
from server.events.changes import Change
from server.experiments.repository import aggregate_state
from server.services import Services
from server.workbench.repository import Wanted, WorkbenchRepository
from tests.server.harness import Reports
from workers.config import TrainingConfig
from workers.protocol import Queue


class RecordingDoorbell:
    """Remembers who was rung."""

    def __init__(self) -> None:
        self.rings: list[tuple[str, int]] = []

    def ring(self, run_id: str, attempt: int, queue: Queue) -> None:
        self.rings.append((run_id, attempt))


class RecordingLinks:
    """Remembers what the workers were told."""

    def __init__(self) -> None:
        self.told: list[tuple[str, str]] = []

    def stop(self, run_id: str) -> None:
        self.told.append(("stop", run_id))

    def cut(self, run_id: str) -> None:
        self.told.append(("cut", run_id))


@pytest.fixture
def doorbell(services: Services) -> RecordingDoorbell:
    services.doorbell = doorbell = RecordingDoorbell()
    return doorbell


@pytest.fixture
def links(services: Services) -> RecordingLinks:
    services.links = links = RecordingLinks()
    return links


def test_launching_queues_one_run_a_seed_and_rings_for_each(
    client: TestClient, doorbell: RecordingDoorbell, reports: Reports
) -> None:
    experiment = reports.experiment("  Corridor ", seeds=(3, 1), steps=5_000)

    assert experiment["name"] == "Corridor"
    assert experiment["state"] == "queued"
    assert experiment["success"] is None
    assert [(run["seed"], run["state"], run["attempt"], run["step"], run["total_steps"]) for run in experiment["runs"]] == [
        (1, "queued", 0, 0, 5_000),
        (3, "queued", 0, 0, 5_000),
    ]
    # What was left out has its default, and is shown.
    assert experiment["training"] == TrainingConfig(steps=5_000).model_dump(mode="json")
    assert client.get(f"/api/experiments/{experiment['id']}").json() == experiment
    assert doorbell.rings == [(run["id"], 0) for run in experiment["runs"]]


@pytest.mark.parametrize(
    ("body", "loc"),
    [
        ({"name": ""}, ["body", "name"]),
        ({"name": "x" * 121}, ["body", "name"]),
        ({"name": "nul \0"}, ["body", "name"]),
        ({"name": "half a \ud800"}, ["body", "name"]),
        ({"seeds": []}, ["body", "seeds"]),
        ({"seeds": [1, 1]}, ["body", "seeds"]),
        ({"seeds": [0, -1]}, ["body", "seeds", 1]),
        ({"training": {"steps": 10}}, ["body", "training", "steps"]),
        ({"training": {"algorithm": {"name": "ppo", "gamma": 1.5}}}, ["body", "training", "algorithm", "ppo", "gamma"]),
        (
            {"training": {"algorithm": {"name": "ppo", "robots": 8}}},
            ["body", "training", "algorithm", "ppo", "minibatch_size"],
        ),
        ({"training": {"task": {"lidar": {"rays": 37}}}}, ["body", "training", "task", "observation"]),
        ({"surprise": 1}, ["body", "surprise"]),
    ],
)
def test_a_wrong_value_is_refused_next_to_its_field(client: TestClient, body: dict[str, Any], loc: list[str]) -> None:
    response = client.post("/api/experiments", content=json.dumps(body), headers={"Content-Type": "application/json"})

    assert response.status_code == 422
    assert [problem["loc"] for problem in response.json()["detail"]] == [loc]
    assert client.get("/api/experiments").json()["total"] == 0


def test_a_part_with_a_wrong_value_is_refused_for_that_alone(client: TestClient) -> None:
    def refused(parts: list[dict[str, Any]]) -> list[tuple[list[Any], str]]:
        answer = client.post("/api/experiments", json={"training": {"task": {"observation": {"parts": parts}}}})
        assert answer.status_code == 422
        return [(each["loc"][-4:], each["msg"]) for each in answer.json()["detail"]]

    # Its wrong part out, the list would be empty: that is nobody's mistake.
    assert refused([{"name": "trail", "sectors": 2}]) == [
        (["parts", 0, "trail", "sectors"], "Input should be greater than or equal to 4")
    ]
    # One that is empty as it was sent is told so.
    assert [place[-1] for place, _ in refused([])] == ["parts"]


def test_a_minibatch_that_does_not_fit_is_answered_with_what_does(client: TestClient) -> None:
    algorithm = {"name": "ppo", "robots": 8, "rollout_steps": 32}
    response = client.post("/api/experiments", json={"training": {"algorithm": algorithm}})
    assert "at most 256 here" in response.json()["detail"][0]["msg"]
    fitting = {"training": {"algorithm": algorithm | {"minibatch_size": 256}}}
    assert client.post("/api/experiments", json=fitting).status_code == 201


def test_infinite_and_missing_numbers_are_refused(client: TestClient) -> None:
    terms = '{"name": "arrival", "weight": Infinity}, {"name": "collision", "weight": NaN}'
    body = f'{{"training": {{"task": {{"reward": {{"terms": [{terms}]}}}}}}}}'
    response = client.post("/api/experiments", content=body, headers={"Content-Type": "application/json"})

    assert response.status_code == 422
    assert [problem["loc"][-2:] for problem in response.json()["detail"][:2]] == [
        ["arrival", "weight"],
        ["collision", "weight"],
    ]


def test_the_form_can_be_sent_as_it_comes(client: TestClient) -> None:
    form = client.get("/api/training/form").json()

    assert form["schema"]["title"] == "ExperimentCreate"
    assert [preset["id"] for preset in form["presets"]] == ["default", "paper", "complex", "new-places"]
    assert form["presets"][0]["training"] == form["defaults"]["training"]
    assert client.post("/api/experiments", json=form["defaults"]).status_code == 201
    paper = form["defaults"] | {"training": form["presets"][1]["training"]}
    assert client.post("/api/experiments", json=paper).json()["training"]["algorithm"]["network"]["name"] == "resblock"


def test_the_list_is_searched_filtered_and_paged(client: TestClient, reports: Reports) -> None:
    names = ["Maze 50%", "maze 500", "Corridor", "Élan"]
    created = {name: reports.experiment(name) for name in names}
    reports.state(created["Corridor"]["runs"][0], "failed")

    def listed(**parameters: Any) -> list[str]:
        page = client.get("/api/experiments", params=parameters).json()
        return [experiment["name"] for experiment in page["items"]]

    assert listed() == names[::-1]
    # Beyond ASCII too.
    assert listed(query="éLAN") == ["Élan"]
    assert listed(query="MAZE") == ["maze 500", "Maze 50%"]
    # A search is for what it says, not a pattern.
    assert listed(query="50%") == ["Maze 50%"]
    assert listed(query="_") == []
    assert listed(state="failed") == ["Corridor"]
    assert listed(state="queued", limit=2, offset=1) == ["maze 500", "Maze 50%"]
    assert client.get("/api/experiments", params={"state": "queued", "limit": 1}).json()["total"] == 3


def test_the_list_says_in_short_what_is_trained_and_how_far_it_is(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("Two", seeds=(0, 1, 2), steps=10_000)
    first, second, _ = experiment["runs"]
    reports.state(first, "completed", step=10_240)
    reports.state(second, "running", step=4_760)
    reports.metrics(second, "time/steps_per_second", {4_760: 524.0})

    (listed,) = client.get("/api/experiments").json()["items"]

    assert (listed["arena"], listed["movers"], listed["robot"]) == ("simple", 0, "burger")
    assert (listed["algorithm"], listed["network"], listed["reward"]) == ("ppo", "mlp", "basic")
    assert (listed["state"], listed["states"], listed["runs"]) == ("running", ["completed", "queued", "running"], 3)
    # 5,240 steps at 524 a second, and then 10,000 of the one that waits.
    assert (listed["progress"], listed["seconds_left"]) == (0.5, pytest.approx(10.0 + 10_000 / 524))
    # A thousand configurations would be megabytes.
    assert len(json.dumps(listed)) < 800


def test_time_left_counts_those_that_wait_as_many_at_a_time_as_run(client: TestClient, reports: Reports) -> None:
    first, second, *_ = reports.experiment("Five", seeds=(0, 1, 2, 3, 4), steps=10_000)["runs"]
    for run, step in ((first, 9_000), (second, 5_000)):
        reports.state(run, "running", step=step)
        reports.metrics(run, "time/steps_per_second", {step: 100.0})

    (listed,) = client.get("/api/experiments").json()["items"]

    # 10 and 50 s are left, 3 x 100 s wait: 360 s of work for two.
    assert listed["seconds_left"] == pytest.approx(180.0)


@pytest.mark.parametrize("parameters", [{"limit": 0}, {"limit": 201}, {"offset": -1}, {"state": "happy"}])
def test_a_page_that_cannot_be_is_refused(client: TestClient, parameters: dict[str, Any]) -> None:
    assert client.get("/api/experiments", params=parameters).status_code == 422


@pytest.mark.parametrize(
    ("states", "together"),
    [
        (["completed", "completed"], "completed"),
        (["completed", "running"], "running"),
        (["stopping", "queued"], "stopping"),
        (["completed", "queued"], "queued"),
        (["completed", "failed"], "mixed"),
        (["stopped"], "stopped"),
    ],
)
def test_the_state_of_runs_together(states: list[RunState], together: str) -> None:
    assert aggregate_state(states) == together


run_states = st.sampled_from(["queued", "running", "stopping", "stopped", "completed", "failed"])


@pytest.fixture(scope="module")
def module_database(tmp_path_factory: pytest.TempPathFactory, new_database: Path) -> Database:
    return Database(f"sqlite:///{shutil.copy(new_database, tmp_path_factory.mktemp('states'))}")


@given(states=st.lists(run_states, min_size=1, max_size=5))
def test_the_filter_in_sql_agrees_with_the_state_that_is_shown(module_database: Database, states: list[RunState]) -> None:
    with Session(module_database.engine) as session:
        runs = [tables.Run(id=str(seed), seed=seed, state=state) for seed, state in enumerate(states)]
        session.add(tables.Experiment(id="e", name="e", training={}, runs=runs))
        session.flush()
        shown = aggregate_state(states)
        for state in ("queued", "running", "stopping", "stopped", "completed", "failed", "mixed"):
            repository = WorkbenchRepository(session)
            assert repository.count(repository.matching(Wanted(f"state = {state}"))) == (state == shown)
        session.rollback()


def test_stopping_ends_what_waits_and_asks_what_runs(client: TestClient, links: RecordingLinks, reports: Reports) -> None:
    experiment = reports.experiment(seeds=(0, 1, 2))
    reports.state(experiment["runs"][1], "running")
    reports.state(experiment["runs"][2], "completed")

    stopped = client.post(f"/api/experiments/{experiment['id']}/stop").json()

    assert [run["state"] for run in stopped["runs"]] == ["stopped", "stopping", "completed"]
    assert stopped["state"] == "stopping"
    assert stopped["runs"][0]["finished_at"] is not None
    assert links.told == [("stop", experiment["runs"][1]["id"])]


def test_resuming_queues_what_was_stopped_or_has_failed(
    client: TestClient, services: Services, doorbell: RecordingDoorbell, reports: Reports
) -> None:
    experiment = reports.experiment(seeds=(0, 1, 2))
    reports.state(experiment["runs"][0], "stopped", attempt=2, finished_at=1.0)
    reports.state(experiment["runs"][1], "failed", attempt=4, error="out of memory", losses=3)
    reports.state(experiment["runs"][2], "completed")
    doorbell.rings.clear()

    resumed = client.post(f"/api/experiments/{experiment['id']}/resume").json()

    assert [run["state"] for run in resumed["runs"]] == ["queued", "queued", "completed"]
    assert resumed["runs"][0]["finished_at"] is None
    assert resumed["runs"][1]["error"] is None
    assert doorbell.rings == [(experiment["runs"][0]["id"], 2), (experiment["runs"][1]["id"], 4)]
    with services.database.read() as session:
        assert session.scalar(select(tables.Run.losses).where(tables.Run.id == experiment["runs"][1]["id"])) == 0


def test_nothing_to_stop_and_nothing_to_resume(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment()
    assert client.post(f"/api/experiments/{experiment['id']}/resume").status_code == 409
    reports.state(experiment["runs"][0], "completed")

    response = client.post(f"/api/experiments/{experiment['id']}/stop")
    assert response.status_code == 409
    assert response.json() == {"detail": "All runs of this experiment have ended already."}


def test_renaming(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment()

    renamed = client.patch(f"/api/experiments/{experiment['id']}", json={"name": "Better name"})
    assert renamed.status_code == 200
    assert renamed.json() == experiment | {"name": "Better name"}
    assert client.patch(f"/api/experiments/{experiment['id']}", json={"name": "   "}).status_code == 422
    assert client.patch(f"/api/experiments/{experiment['id']}", json={"id": "x", "name": "y"}).status_code == 422


def test_deleting_stops_workers_and_removing_cuts_them_off(
    client: TestClient, links: RecordingLinks, reports: Reports
) -> None:
    experiment, other = reports.experiment(), reports.experiment()
    run = experiment["runs"][0]
    reports.state(run, "running")

    response = client.delete(f"/api/experiments/{experiment['id']}")

    assert response.status_code == 204
    assert links.told == [("stop", run["id"])]
    reports.remove(experiment)
    assert links.told == [("stop", run["id"]), ("cut", run["id"])]
    assert client.get(f"/api/experiments/{experiment['id']}").status_code == 404
    assert client.get(f"/api/runs/{run['id']}").status_code == 404
    assert client.get(f"/api/experiments/{other['id']}").status_code == 200


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/api/experiments/nobody"),
        ("PATCH", "/api/experiments/nobody"),
        ("DELETE", "/api/experiments/nobody"),
        ("POST", "/api/experiments/nobody/stop"),
        ("POST", "/api/experiments/nobody/resume"),
    ],
)
def test_an_experiment_that_is_not_there(client: TestClient, method: str, path: str) -> None:
    response = client.request(method, path, json={"name": "x"})

    assert response.status_code == 404
    assert response.json() == {"detail": "There is no experiment nobody; it may have been deleted."}


def test_whoever_looks_on_is_told(client: TestClient, services: Services, reports: Reports) -> None:
    told: list[Change] = []

    class RecordingBus(EventBus):
        def publish(self, change: Change) -> None:
            told.append(change)

    services.bus = RecordingBus()
    experiment = reports.experiment()
    client.post(f"/api/experiments/{experiment['id']}/stop")
    client.delete(f"/api/experiments/{experiment['id']}")

    assert [(change.experiment_id, change.run_id, change.kind) for change in told] == [
        (experiment["id"], None, "experiment"),
        (experiment["id"], experiment["runs"][0]["id"], "run"),
        (experiment["id"], None, "deleted"),
    ]


def test_a_memory_that_makes_checkpoints_larger_than_the_service_takes_is_refused_at_its_field(client: TestClient) -> None:
    algorithm = {"name": "sac", "replay_size": 200_000}
    task = {"lidar": {"rays": 360, "batches": 120}, "frames": 8}
    response = client.post("/api/experiments", json={"name": "wide", "training": {"task": task, "algorithm": algorithm}})
    assert response.status_code == 422
    (problem,) = response.json()["detail"]
    assert problem["loc"] == ["body", "training", "algorithm", "sac", "replay_size"]
    assert "keep at most 104\u202f000 transitions" in problem["msg"]
    assert client.get("/api/experiments").json()["items"] == []


def test_how_quick_a_training_will_be_is_told_from_runs_like_it_that_have_ended(
    client: TestClient, services: Services, reports: Reports
) -> None:
    like = {"algorithm": "ppo", "network": "mlp"}
    assert client.get("/api/training/pace", params=like).json() == {"steps_per_second": None, "runs": 0}

    for seconds, speed in enumerate((1_000.0, 9_000.0, 2_000.0)):
        (run,) = reports.experiment()["runs"]
        reports.metrics(run, "time/steps_per_second", {1_000: speed})
        with services.database.write() as session:
            row = session.get(tables.Run, run["id"])
            assert row is not None
            row.state, row.finished_at = "completed", 1_000.0 + seconds
    (running,) = reports.experiment()["runs"]
    reports.metrics(running, "time/steps_per_second", {1_000: 5.0})

    assert client.get("/api/training/pace", params=like).json() == {"steps_per_second": 2_000.0, "runs": 3}
    other = client.get("/api/training/pace", params={"algorithm": "sac", "network": "mlp"}).json()
    assert other == {"steps_per_second": None, "runs": 0}
