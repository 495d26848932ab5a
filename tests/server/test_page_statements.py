"""What the pages ask takes as few statements for many trainings as for a few: none is asked for one by one."""

from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.metrics.cache import AnswerCache
from server.metrics.kept import KeptSeries
from server.recent import Recent
from server.services import Services
from tests.server.harness import Reports
from tests.server.statements import statements

FEW, MANY = 2, 9
SEEDS = range(3)
# Statements of an answer that nobody has asked for before, by its address.
MOST = {
    "/api/account": 1,
    "/api/status": 3,
    "/api/alerts/news": 1,
    "/api/projects?limit=200": 3,
    "/api/workbench/keys": 2,
    "/api/experiments?place=live&sort=-created&limit=100": 6,
    "/api/training/form": 0,
    "/api/experiments/{one}": 4,
    "/api/experiments/{one}/lineage": 3,
    "/api/experiments/{one}/marks": 3,
    "/api/runs/{run}": 2,
    "/api/runs/{run}/checkpoints/steps": 2,
    "/api/runs/{run}/checkpoints?limit=25": 4,
    "/api/runs/{run}/lineage": 2,
    "/api/runs/{run}/diagnoses": 6,
    "/api/runs/{run}/metrics?points=600": 9,
    "/api/compare/metrics?{all}": 5,
    "/api/compare?{all}": 5,
    "/api/compare/profiles?{all}": 5,
    "/api/compare/curves?{all}&name=train%2Freturn&points=400&lines=100": 10,
}


@pytest.fixture
def trained(reports: Reports) -> list[dict[str, Any]]:
    """Trainings whose runs have reported, and have checkpoints that were measured."""
    experiments = [reports.experiment(f"Training {number}", SEEDS) for number in range(MANY)]
    for run in (run for experiment in experiments for run in experiment["runs"]):
        reports.rows(run, {step: {"train/return": float(step), "train/success_rate": 0.5} for step in range(1, 20)})
        for step in (5, 10):
            reports.checkpoint(run, step, reports.evaluation(7))
        reports.state(run, "completed", step=20)
    return experiments


def count(client: TestClient, services: Services, address: str) -> int:
    """Statements of an answer of which nothing is remembered."""
    services.compared, services.series, services.curves = Recent(1), KeptSeries(), AnswerCache()
    with statements(services.database, of_requests=True) as asked:
        response = client.get(address)
    assert response.status_code == 200, response.text
    return len(asked)


def addresses(experiments: list[dict[str, Any]]) -> dict[str, str]:
    chosen = "&".join(f"experiment={experiment['id']}" for experiment in experiments)
    words = {"one": experiments[0]["id"], "run": experiments[0]["runs"][0]["id"], "all": chosen}
    return {address: address.format(**words) for address in MOST}


def test_a_page_asks_as_little_of_the_database_as_it_may(
    client: TestClient, services: Services, trained: list[dict[str, Any]]
) -> None:
    asked = {name: count(client, services, address) for name, address in addresses(trained).items()}

    assert {name: number for name, number in asked.items() if number > MOST[name]} == {}


@pytest.mark.parametrize("name", [name for name in MOST if "{all}" in name])
def test_many_that_are_compared_take_no_more_than_a_few(
    client: TestClient, services: Services, trained: list[dict[str, Any]], name: str
) -> None:
    few, many = (count(client, services, addresses(some)[name]) for some in (trained[:FEW], trained))

    assert many == few


def test_what_a_page_compares_is_read_once_until_something_is_reported(
    client: TestClient, services: Services, reports: Reports, trained: list[dict[str, Any]]
) -> None:
    together = addresses(trained)
    asked = together["/api/compare?{all}"]
    before = client.get(asked).json()
    with statements(services.database, of_requests=True) as again:
        profiles = client.get(together["/api/compare/profiles?{all}"])
    assert profiles.status_code == 200
    assert not [statement for statement in again if "evaluations" in statement]

    run = trained[0]["runs"][0]
    reports.checkpoint(run, 15, reports.evaluation(10))
    after = client.get(asked).json()
    success = [answer["experiments"][0]["success"]["value"] for answer in (before, after)]
    assert success == pytest.approx([0.7, 0.8])
