"""Settings that another version stored: the training is shown, says what can't be read of it, and is not trained."""

import pytest
from fastapi.testclient import TestClient

from server.database import tables
from server.experiments.stored import read_training
from server.services import Services
from server.sweeper import Sweeper
from server.workbench.indexing import index_some
from tests.server.harness import WORKER_TOKEN
from workers.config import PpoConfig, TrainingConfig


def test_what_this_version_wrote_it_reads() -> None:
    training = TrainingConfig(algorithm=PpoConfig(gamma=0.95), steps=12_345)
    stored = read_training(training.model_dump(mode="json"))
    assert stored.training == training
    assert stored.unreadable == ()


@pytest.mark.parametrize(
    ("change", "unreadable"),
    [
        ({"steps": -1}, ("steps",)),
        ({"colour": "red"}, ("colour",)),
        ({"algorithm": {"name": "ppo", "gamma": 7, "epochs": 3, "magic": 1}}, ("algorithm.gamma", "algorithm.magic")),
        ({"algorithm": {"name": "alchemy", "gold": 1}}, ("algorithm",)),
        ({"algorithm": {"name": "ppo", "network": {"name": "mlp", "hidden_sizes": [64, "wide"]}}},
         ("algorithm.network.hidden_sizes",)),
        # Neither is wrong by itself: a minibatch larger than a rollout.
        ({"algorithm": {"name": "ppo", "robots": 1, "rollout_steps": 16}}, ("algorithm",)),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_named_and_takes_its_default(change: dict[str, object], unreadable: tuple[str, ...]) -> None:
    stored = read_training(TrainingConfig().model_dump(mode="json") | change)
    assert stored.unreadable == unreadable
    assert stored.training.task == TrainingConfig().task


def test_the_rest_is_kept() -> None:
    document = TrainingConfig(algorithm=PpoConfig(gamma=0.95), steps=12_345).model_dump(mode="json")
    document["algorithm"]["clip_range"] = "wide"
    stored = read_training(document)
    assert stored.unreadable == ("algorithm.clip_range",)
    assert stored.training == TrainingConfig(algorithm=PpoConfig(gamma=0.95), steps=12_345)


def test_such_a_training_is_shown_and_its_runs_fail_with_the_reason(client: TestClient, services: Services) -> None:
    created = client.post("/api/experiments", json={"name": "of tomorrow", "seeds": [1]}).json()
    run_id = created["runs"][0]["id"]
    with services.database.write() as session:
        experiment = session.get_one(tables.Experiment, created["id"])
        experiment.training = {**experiment.training, "teleportation": True}
        experiment.indexed_as = None
    index_some(services)

    listed = client.get("/api/experiments").json()["items"]
    assert [(one["name"], one["unreadable"]) for one in listed] == [("of tomorrow", ["teleportation"])]
    for path in (f"/api/experiments/{created['id']}", f"/api/runs/{run_id}"):
        assert client.get(path).json()["unreadable"] == ["teleportation"]
    assert client.get(f"/api/runs/{run_id}/diagnoses").status_code == 200
    Sweeper(services).sweep()  # rings for it as for any other

    claim = client.post(
        f"/api/worker/runs/{run_id}/claim",
        json={"worker": "w", "published_attempt": 0},
        headers={"Authorization": f"Bearer {WORKER_TOKEN}"},
    )
    assert claim.status_code == 409
    run = client.get(f"/api/runs/{run_id}").json()
    assert (run["state"], run["error"]) == ("failed", "This version can't read teleportation: launch the training anew.")
