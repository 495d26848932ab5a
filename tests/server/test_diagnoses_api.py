"""A run's diagnoses over the API."""

import math

import pytest
from fastapi.testclient import TestClient

from server.metrics.repository import MetricRepository, ReportedRow
from server.services import Services


@pytest.fixture
def run_id(client: TestClient) -> str:
    created = client.post("/api/experiments", json={"name": "Corridor", "seeds": [0], "training": {"steps": 10_000}})
    identifier: str = created.json()["runs"][0]["id"]
    return identifier


def report(services: Services, run_id: str, **curves: list[float]) -> None:
    """Reports curves, a point every 100 steps; '__' stands for '/'."""
    length = len(next(iter(curves.values())))
    rows = [
        ReportedRow(i + 1, 100 * (i + 1), 1.0, {name.replace("__", "/"): values[i] for name, values in curves.items()})
        for i in range(length)
    ]
    with services.database.write() as session:
        MetricRepository(session).append({run_id: rows})


def test_a_run_that_has_not_begun_has_none(client: TestClient, run_id: str) -> None:
    assert client.get(f"/api/runs/{run_id}/diagnoses").json() == {"run_id": run_id, "step": 0, "diagnoses": []}


def test_a_sick_run_is_explained(client: TestClient, services: Services, run_id: str) -> None:
    report(services, run_id, policy__kl=[0.3] * 40, train__success_rate=[0.0] * 40)

    answer = client.get(f"/api/runs/{run_id}/diagnoses").json()

    assert answer["step"] == 4_000
    kl, stuck = answer["diagnoses"]
    assert (kl["id"], kl["severity"], kl["title"]) == ("kl_exploded", "error", "KL divergence exploded")
    assert kl["evidence"][0] == {"metric": "policy/kl", "value": pytest.approx(0.3), "expected": "below 0.05"}
    assert "Lower the learning rate (now 0.001)" in kl["advice"][0]
    assert stuck["id"] == "success_stuck"


def test_numbers_that_are_none_are_told_as_null(client: TestClient, services: Services, run_id: str) -> None:
    report(services, run_id, loss__value=[0.1] * 9 + [math.nan])

    (diagnosis,) = client.get(f"/api/runs/{run_id}/diagnoses").json()["diagnoses"]

    assert diagnosis["id"] == "not_finite"
    assert diagnosis["evidence"] == [{"metric": "loss/value", "value": None, "expected": "a finite number"}]


def test_an_unknown_run_has_no_diagnoses(client: TestClient) -> None:
    assert client.get("/api/runs/0123456789abcdef/diagnoses").status_code == 404
