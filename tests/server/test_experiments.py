"""Launching, listing, stopping, resuming, renaming and deleting experiments."""

from fastapi.testclient import TestClient


def test_launching_queues_one_run_a_seed(client: TestClient) -> None:
    response = client.post("/api/experiments", json={"name": "Corridor", "seeds": [3, 1], "training": {"steps": 5_000}})

    assert response.status_code == 201
    experiment = response.json()
    assert experiment["name"] == "Corridor"
    assert experiment["state"] == "queued"
    assert experiment["success"] is None
    assert [(run["seed"], run["state"], run["total_steps"]) for run in experiment["runs"]] == [
        (1, "queued", 5_000),
        (3, "queued", 5_000),
    ]
    assert experiment["training"]["task"]["arena"] == {"name": "simple"}
    assert client.get(f"/api/experiments/{experiment['id']}").json() == experiment
