"""Studies: asked for in the background, scored, stopped early, stopped and resumed, and judged on seeds of their own."""

import time
from collections.abc import Callable
from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.app import create_services
from server.database import tables
from server.services import Services
from server.settings import Settings
from server.studies.advance import advance, fresh_seeds
from server.studies.repository import StudyRepository
from server.studies.schemas import JUDGES
from tests.server.harness import Reports

LEARNING_RATE = {"kind": "range", "path": "algorithm.learning_rate", "low": 1e-4, "high": 1e-2, "log": True}
EPOCHS = {"kind": "list", "path": "algorithm.epochs", "values": [2, 4, 8]}
LAYERS = {"kind": "list", "path": "algorithm.network.hidden_sizes", "values": [[64, 64], [128, 128], [256, 256]]}
HIDDEN = ["algorithm", "network", "hidden_sizes"]
TERMS = ["task", "reward", "terms"]
TRAINING = {"steps": 100_000, "evaluation": {"every_steps": 10_000}}


@pytest.fixture
def settings(settings: Settings, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Settings:
    """On both kinds of database for tests that ask for their address; for those that move studies, nothing else does."""
    if "move" in request.fixturenames:
        monkeypatch.setattr("server.studies.advance._PAUSE_SECONDS", 3_600.0)
    if "database_url" not in request.fixturenames:
        return settings
    return settings.model_copy(update={"database_url": request.getfixturevalue("database_url")})


@pytest.fixture
def move(services: Services, client: TestClient) -> Callable[[], int]:
    return lambda: advance(services)


def launch(client: TestClient, **fields: Any) -> dict[str, Any]:
    request = {"name": "Search", "training": TRAINING, "settings": [LEARNING_RATE, EPOCHS], "trials": 3} | fields
    response = client.post("/api/studies", json=request)
    assert response.status_code == 201, response.text
    study: dict[str, Any] = response.json()
    return study


def look(client: TestClient, study: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = client.get(f"/api/studies/{study['id']}").json()
    return found


def states(study: dict[str, Any]) -> list[str]:
    return [trial["state"] for trial in study["results"]]


def runs(client: TestClient, experiment_id: str | None) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = client.get(f"/api/experiments/{experiment_id}").json()["runs"]
    return found


def trained(client: TestClient, reports: Reports, experiment_id: str | None, arrivals: list[int], **evaluation: Any) -> None:
    """As if workers had trained every run of an experiment for a minute."""
    for run, arrived in zip(runs(client, experiment_id), arrivals, strict=True):
        reports.checkpoint(run, 100_000, Reports.evaluation(arrived, **evaluation))
        reports.state(run, "completed", step=100_000, started_at=1_000.0, finished_at=1_060.0)


def test_a_study_asks_for_as_many_trials_as_may_go_on_at_once(client: TestClient, move: Callable[[], int]) -> None:
    study = launch(client)
    assert (study["state"], study["results"], study["asked"]) == ("running", [], 0)

    move()
    move()
    now = look(client, study)
    assert states(now) == ["running", "running"]
    first = client.get(f"/api/experiments/{now['results'][0]['experiment_id']}").json()
    assert first["name"] == "Search, trial 1"
    assert [run["seed"] for run in first["runs"]] == [0, 1, 2]
    assert {run["state"] for run in first["runs"]} == {"queued"}
    values = now["results"][0]["values"]
    algorithm = first["training"]["algorithm"]
    assert (algorithm["learning_rate"], algorithm["epochs"]) == (
        values["algorithm.learning_rate"],
        values["algorithm.epochs"],
    )
    assert 1e-4 <= algorithm["learning_rate"] <= 1e-2
    assert algorithm["epochs"] in (2, 4, 8)


def test_a_study_from_its_first_trial_to_the_judgement(
    client: TestClient, reports: Reports, database_url: str, move: Callable[[], int]
) -> None:
    study = launch(client)
    move()
    first, second = look(client, study)["results"]
    # 7, 8 and 9 of ten with three seeds: 0.8. After 80 steps of 0.2 s those that arrived were there: 16 s.
    trained(client, reports, first["experiment_id"], [7, 8, 9])
    trained(client, reports, second["experiment_id"], [8, 8, 8], steps=40)
    move()
    now = look(client, study)
    assert states(now) == ["complete", "complete", "running"]
    assert now["results"][0]["success"] == pytest.approx(0.8)
    assert now["results"][0]["seconds_to_target"] == pytest.approx(16.0)
    assert now["results"][0]["cost"] == pytest.approx(180.0)
    # As successful and quicker is better.
    assert now["best"] == 2
    assert now["best_success"] == pytest.approx(0.8)
    assert now["seconds_left"] is not None

    (third,) = (trial for trial in now["results"] if trial["state"] == "running")
    trained(client, reports, third["experiment_id"], [1, 2, 3])
    move()
    now = look(client, study)
    assert (now["state"], now["best"], now["complete"]) == ("judging", 2, 3)
    judgement = now["judgement"]
    assert (judgement["trial"], judgement["seeds"]) == (2, [3, 4, 5, 6, 7])
    judged = client.get(f"/api/experiments/{judgement['experiment_id']}").json()
    assert judged["study_id"] is None
    assert judged["training"]["algorithm"]["learning_rate"] == second["values"]["algorithm.learning_rate"]

    trained(client, reports, judgement["experiment_id"], [6, 6, 6, 6, 6])
    move()
    now = look(client, study)
    assert (now["state"], now["progress"]) == ("done", 1.0)
    assert now["judgement"]["success"]["value"] == pytest.approx(0.6)
    assert now["judgement"]["success"]["seeds"] == JUDGES


def test_a_failed_trial_is_told_as_failed(client: TestClient, reports: Reports, move: Callable[[], int]) -> None:
    study = launch(client, trials=2)
    move()
    first, second = look(client, study)["results"]
    one, *others = runs(client, first["experiment_id"])
    reports.state(one, "failed", error="out of memory")
    trained(client, reports, second["experiment_id"], [5, 5, 5])
    move()

    now = look(client, study)
    assert states(now) == ["failed", "complete"]
    assert now["results"][0]["reason"] == "Seed 0 failed: out of memory"
    assert now["results"][0]["success"] is None
    # Nothing is spent any more on what can't be scored.
    assert [run["state"] for run in runs(client, first["experiment_id"])[1:]] == ["stopped"] * len(others)


def test_settings_that_make_no_training_are_a_failed_trial_that_costs_nothing(
    client: TestClient, move: Callable[[], int]
) -> None:
    """A rollout of few robots is smaller than the minibatch of this training."""
    robots = {"kind": "list", "path": "algorithm.robots", "values": [2, 3]}
    study = launch(client, settings=[robots], trials=2)
    move()

    now = look(client, study)
    assert (states(now), now["state"]) == (["failed", "failed"], "done")
    assert "These settings make no training: at most" in now["results"][0]["reason"]
    assert now["results"][0]["experiment_id"] is None
    assert now["judgement"] is None


def test_a_trial_that_does_worse_than_the_median_is_stopped(
    client: TestClient, reports: Reports, move: Callable[[], int]
) -> None:
    study = launch(client, trials=5, at_once=5)
    move()
    *good, bad = look(client, study)["results"]
    for trial in good:
        for run in runs(client, trial["experiment_id"]):
            reports.checkpoint(run, 30_000, Reports.evaluation(6))
        trained(client, reports, trial["experiment_id"], [9, 9, 9])
    slow = runs(client, bad["experiment_id"])
    reports.checkpoint(slow[0], 30_000, Reports.evaluation(2))
    move()
    # One seed alone may have had bad luck.
    assert states(look(client, study))[-1] == "running"

    reports.checkpoint(slow[1], 30_000, Reports.evaluation(4))
    reports.state(slow[0], "running", attempt=1)
    move()
    now = look(client, study)
    assert states(now)[-1] == "pruned"
    assert "at best 30.0\u202f%" in now["results"][-1]["reason"]
    assert "60.0\u202f% with the same ones" in now["results"][-1]["reason"]
    assert [run["state"] for run in runs(client, bad["experiment_id"])] == ["stopping", "stopped", "stopped"]
    assert now["rule"].startswith("A trial is stopped early once two or more of its seeds")


def test_stopped_resumed_and_extended(client: TestClient, database_url: str, move: Callable[[], int]) -> None:
    study = launch(client, trials=1)
    move()
    assert client.post(f"/api/studies/{study['id']}/stop").json()["state"] == "stopped"
    move()
    now = look(client, study)
    assert (states(now), now["asked"]) == (["stopped"], 1)
    (trial,) = now["results"]
    assert {run["state"] for run in runs(client, trial["experiment_id"])} == {"stopped"}
    assert client.post(f"/api/studies/{study['id']}/stop").status_code == 409

    assert client.post(f"/api/studies/{study['id']}/resume").json()["state"] == "running"
    move()
    assert states(look(client, study)) == ["running"]
    assert {run["state"] for run in runs(client, trial["experiment_id"])} == {"queued"}
    assert client.post(f"/api/studies/{study['id']}/resume").status_code == 409

    assert client.post(f"/api/studies/{study['id']}/extend", json={"trials": 2}).json()["trials"] == 3
    move()
    assert states(look(client, study)) == ["running", "running"]


def test_a_run_that_is_still_stopping_is_waited_for(client: TestClient, reports: Reports, move: Callable[[], int]) -> None:
    study = launch(client, trials=1)
    move()
    (trial,) = look(client, study)["results"]
    reports.state(runs(client, trial["experiment_id"])[0], "running", attempt=1)
    client.post(f"/api/studies/{study['id']}/stop")
    refused = client.post(f"/api/studies/{study['id']}/resume")
    assert refused.status_code == 409
    assert "try again in a moment" in refused.json()["detail"]


def test_an_extended_study_judges_again_only_a_better_one(
    client: TestClient, reports: Reports, move: Callable[[], int]
) -> None:
    study = launch(client, trials=1)
    move()
    trained(client, reports, look(client, study)["results"][0]["experiment_id"], [8, 8, 8])
    move()
    judgement = look(client, study)["judgement"]["experiment_id"]
    assert client.post(f"/api/studies/{study['id']}/extend", json={"trials": 1}).status_code == 409
    trained(client, reports, judgement, [7, 7, 7, 7, 7])
    move()

    client.post(f"/api/studies/{study['id']}/extend", json={"trials": 1})
    move()
    trained(client, reports, look(client, study)["results"][1]["experiment_id"], [5, 5, 5])
    move()
    move()
    now = look(client, study)
    assert (now["state"], now["judgement"]["experiment_id"]) == ("done", judgement)


def test_a_server_that_starts_goes_on_where_the_last_one_was(
    client: TestClient, services: Services, settings: Settings, reports: Reports, database_url: str, move: Callable[[], int]
) -> None:
    """And two of them never ask for the same trial."""
    study = launch(client, trials=4)
    move()
    other = create_services(settings)
    try:
        for trial in look(client, study)["results"]:
            trained(client, reports, trial["experiment_id"], [8, 8, 8])
        advance(other)
        advance(services)
        now = look(client, study)
        assert states(now) == ["complete", "complete", "running", "running"]
        assert [trial["number"] for trial in now["results"]] == [1, 2, 3, 4]
        listed = client.get("/api/experiments", params={"query": f"study = {study['id']}"}).json()
        assert listed["total"] == 4
    finally:
        other.database.dispose()


def test_a_trial_whose_training_was_deleted_or_measured_elsewhere_has_failed(
    client: TestClient, reports: Reports, move: Callable[[], int]
) -> None:
    study = launch(client, trials=3, at_once=3)
    move()
    first, second, third = look(client, study)["results"]
    client.delete(f"/api/experiments/{first['experiment_id']}")
    trained(client, reports, second["experiment_id"], [8, 8, 8])
    trained(client, reports, third["experiment_id"], [9, 9, 9], suite_hash="hash-b")
    move()
    now = look(client, study)
    assert states(now) == ["failed", "complete", "failed"]
    assert now["results"][0]["reason"] == "Its training was deleted."
    assert "other scenarios" in now["results"][2]["reason"]


def test_trials_stay_out_of_the_table_of_trainings_and_of_leaderboards(
    client: TestClient, reports: Reports, move: Callable[[], int]
) -> None:
    study = launch(client, trials=1)
    reports.experiment("Ordinary")
    move()
    trained(client, reports, look(client, study)["results"][0]["experiment_id"], [8, 8, 8])
    names = [row["name"] for row in client.get("/api/experiments").json()["items"]]
    assert names == ["Ordinary"]
    asked = client.get("/api/experiments", params={"query": f"study = {study['id']}"}).json()["items"]
    assert [(row["name"], row["study_id"]) for row in asked] == [("Search, trial 1", study["id"])]
    assert client.get("/api/leaderboards/hash-a").status_code == 404


def weighed(services: Services, study_id: str, trials: int) -> None:
    """As if so many trials were complete, of which those with a small step size did well."""
    with services.database.write() as session:
        for number in range(trials):
            values = {LEARNING_RATE["path"]: 10 ** (-4 + 2 * number / trials), EPOCHS["path"]: (2, 4, 8)[number % 3]}
            row = tables.StudyTrial(study_id=study_id, number=number, values=values, rungs={}, state="complete")
            row.success = row.score = 1.0 - number / trials
            session.add(row)
        StudyRepository(session).note(study_id, asked=trials, budget=trials, state="done", importances={"a": 1.0})


@pytest.mark.parametrize(
    ("trials", "told"), [(40, "of the 40 complete ones"), (12, "can't be told from 12 complete trials")]
)
def test_importances_that_another_version_left_get_their_intervals_once(
    client: TestClient, services: Services, database_url: str, move: Callable[[], int], trials: int, told: str
) -> None:
    study = launch(client, trials=1)
    weighed(services, study["id"], trials)
    assert look(client, study)["importance_intervals"] is None
    assert move() == 1
    now = look(client, study)
    sure = now["importance_intervals"]
    assert (sure["unit"], sure["trials"]) == ("trials", trials)
    assert told in sure["told"]
    share = now["importances"][LEARNING_RATE["path"]]
    assert share > 0.8
    if trials == 40:
        span = sure["spans"][LEARNING_RATE["path"]]
        assert 0.0 < span["low"] < share <= span["high"] <= 1.0
    else:
        assert sure["spans"] == {}
    # Nothing has changed since: nothing is computed again.
    assert move() == 0


def test_a_study_that_this_version_can_not_read_is_weighed_no_more_than_once(
    client: TestClient, services: Services, move: Callable[[], int]
) -> None:
    study = launch(client, trials=1)
    weighed(services, study["id"], 40)
    with services.database.write() as session:
        row = StudyRepository(session).get(study["id"])
        row.spec = row.spec | {"settings": [{**LEARNING_RATE, "path": "algorithm.of_another_version"}]}
    assert (move(), move()) == (1, 0)
    assert look(client, study)["importance_intervals"]["spans"] == {}


def test_a_deleted_study_leaves_its_trials_in_the_trash(client: TestClient, move: Callable[[], int]) -> None:
    study = launch(client, trials=1)
    move()
    assert client.delete(f"/api/studies/{study['id']}").status_code == 204
    assert client.get(f"/api/studies/{study['id']}").status_code == 404
    trash = client.get("/api/experiments", params={"place": "trash"}).json()["items"]
    assert [(row["name"], row["study_id"], row["state"]) for row in trash] == [("Search, trial 1", None, "stopped")]


@pytest.mark.parametrize(
    ("fields", "where", "why"),
    [
        ({"settings": [{**LEARNING_RATE, "path": "algorithm.speed"}]}, ["algorithm", "speed"], "no such setting"),
        ({"settings": [{**LEARNING_RATE, "high": 2.0}]}, ["algorithm", "learning_rate"], "2.0 is refused"),
        ({"settings": [{**EPOCHS, "values": [2, "many"]}]}, ["algorithm", "epochs"], "'many' is refused"),
        ({"settings": [{**LEARNING_RATE, "path": "task.arena.seed"}]}, ["task", "arena", "seed"], "measured by"),
        ({"settings": [{**LEARNING_RATE, "path": "task.step_limit"}]}, ["task", "step_limit"], "measured by"),
        ({"settings": [{**LEARNING_RATE, "path": "algorithm.network"}]}, ["algorithm", "network"], "only numbers"),
        ({"settings": [LEARNING_RATE, LEARNING_RATE]}, ["algorithm", "learning_rate"], "only once"),
        ({"settings": [{**LEARNING_RATE, "path": "algorithm.epochs"}]}, ["algorithm", "epochs"], "whole numbers"),
        ({"settings": [{**LEARNING_RATE, "path": "algorithm.scale_returns"}]}, ["algorithm", "scale_returns"], "list its"),
        ({"settings": [{**LEARNING_RATE, "path": "algorithm.final_std"}]}, ["algorithm", "final_std"], "is refused"),
        ({"settings": [{**LAYERS, "values": [[64, 64], 128]}]}, HIDDEN, "it is a list of numbers, as 64, 64 is: 128 does"),
        ({"settings": [{**LAYERS, "values": [[64], [64, 2]]}]}, HIDDEN, "64, 2 is refused: every hidden layer needs"),
        ({"settings": [{**LAYERS, "values": [[64], []]}]}, HIDDEN, "none is refused"),
        ({"settings": [{**LAYERS, "values": [[64], [64.5]]}]}, HIDDEN, "64.5 is refused"),
        ({"settings": [{**LEARNING_RATE, "path": LAYERS["path"], "low": 8, "high": 64}]}, HIDDEN, "list its values"),
        ({"settings": [{**EPOCHS, "values": [2, [4]]}]}, ["algorithm", "epochs"], "takes single values, no lists of them"),
        ({"settings": [{**LAYERS, "path": "task.reward.terms"}]}, ["task", "reward", "terms"], "only numbers"),
        ({"settings": [{**LEARNING_RATE, "path": "task.reward.terms.7.weight"}]}, [*TERMS, "7", "weight"], "no such"),
        ({"settings": [{**LEARNING_RATE, "path": "start_from"}]}, ["start_from"], "is refused"),
    ],
)
def test_what_can_not_be_searched_is_refused_at_its_field(
    client: TestClient, fields: dict[str, Any], where: list[str], why: str
) -> None:
    training = TRAINING | {"algorithm": {"name": "ppo", "network": {"name": "mlp"}}}
    request = {"name": "Search", "training": training} | fields
    response = client.post("/api/studies", json=request)
    assert response.status_code == 422, response.text
    (problem,) = response.json()["detail"]
    assert problem["loc"] == ["body", "training", *where]
    assert why in problem["msg"]


def test_a_range_across_zero_has_no_logarithmic_scale(client: TestClient) -> None:
    weight = {"kind": "range", "path": "task.reward.terms.1.weight", "low": -100.0, "high": 10.0, "log": True}
    refused = client.post("/api/studies", json={"name": "Search", "training": {}, "settings": [weight]})
    assert refused.status_code == 422
    assert "has to keep to one side of 0" in refused.json()["detail"][0]["msg"]


def test_weights_and_layers_from_the_launch_to_the_trials(client: TestClient, move: Callable[[], int]) -> None:
    weight = {"kind": "range", "path": "task.reward.terms.1.weight", "low": -400.0, "high": -25.0, "log": True}
    training = TRAINING | {"algorithm": {"name": "ppo", "network": {"name": "mlp"}}}
    study = launch(client, training=training, settings=[weight, LAYERS], sampler="grid", at_once=15)
    assert study["spec"]["settings"][1]["values"] == LAYERS["values"]
    move()
    for trial in look(client, study)["results"]:
        trained = client.get(f"/api/experiments/{trial['experiment_id']}").json()["training"]
        collision = trained["task"]["reward"]["terms"][1]
        assert (collision["name"], collision["weight"]) == ("collision", trial["values"][weight["path"]])
        assert trained["algorithm"]["network"]["hidden_sizes"] == trial["values"][LAYERS["path"]]


def test_a_grid_has_no_more_trials_than_points(client: TestClient) -> None:
    study = launch(client, sampler="grid", settings=[EPOCHS, {**LEARNING_RATE, "points": 3}], trials=100)
    assert study["trials"] == 9
    assert client.post(f"/api/studies/{study['id']}/extend", json={"trials": 1}).status_code == 409
    paths = ("gamma", "gae_lambda", "clip_range", "entropy_coefficient", "max_grad_norm", "learning_rate")
    many = [{"kind": "range", "path": f"algorithm.{one}", "low": 1e-3, "high": 0.01, "points": 5} for one in paths]
    refused = client.post("/api/studies", json={"name": "Grid", "training": {}, "settings": many, "sampler": "grid"})
    assert refused.status_code == 422
    assert "15\u202f625 points" in refused.json()["detail"][0]["msg"]


def test_the_list_of_studies(client: TestClient, reports: Reports, move: Callable[[], int]) -> None:
    first = launch(client, trials=2)
    move()
    one, _ = look(client, first)["results"]
    trained(client, reports, one["experiment_id"], [8, 8, 8])
    move()
    launch(client, name="Later", sampler="random")
    page = client.get("/api/studies", params={"limit": 1, "offset": 1}).json()
    assert page["total"] == 2
    (listed,) = page["items"]
    assert (listed["name"], listed["complete"], listed["asked"], listed["best_success"]) == (
        "Search",
        1,
        2,
        pytest.approx(0.8),
    )


def test_studies_move_on_by_themselves(client: TestClient) -> None:
    study = launch(client)
    deadline = time.monotonic() + 30.0
    while look(client, study)["asked"] < 2 and time.monotonic() < deadline:
        time.sleep(0.1)
    assert states(look(client, study)) == ["running", "running"]


def test_judges_are_never_among_the_seeds_that_were_tuned_on() -> None:
    assert fresh_seeds([0, 1, 2]) == [3, 4, 5, 6, 7]
    assert fresh_seeds([7, 0, 3]) == [8, 9, 10, 11, 12]
    assert fresh_seeds([0, 2, 2**31 - 1]) == [1, 3, 4, 5, 6]
