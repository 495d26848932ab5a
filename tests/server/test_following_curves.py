"""A comparison's curves while runs report: what comes after an answer, put behind it, is what the next whole answer says."""

from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.comparison.following import Followed
from tests.server.harness import Reports

NAME = "train/return"


def curves(client: TestClient, experiment: dict[str, Any], since: str | None = None, **query: Any) -> dict[str, Any]:
    params: dict[str, Any] = {"experiment": experiment["id"], "name": NAME} | query
    response = client.get("/api/compare/curves", params=params if since is None else params | {"since": since})
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    return answer


def behind(known: dict[str, Any], news: dict[str, Any]) -> dict[str, Any]:
    """As the pages put it together."""
    if news["since"] is None:
        return news
    kept = sum(step <= news["since"] for step in known["steps"])
    joined = news | {"since": None, "steps": known["steps"][:kept] + news["steps"], "experiments": []}
    for old, new in zip(known["experiments"], news["experiments"], strict=True):
        seeds = [
            one | {"values": one["values"][:kept] + other["values"]}
            for one, other in zip(old["seeds"], new["seeds"], strict=True)
        ]
        lists = {key: old[key][:kept] + new[key] for key in ("mean", "low", "high", "count")}
        joined["experiments"].append(new | lists | {"seeds": seeds})
    return joined


@pytest.fixture
def experiment(reports: Reports) -> dict[str, Any]:
    """Two seeds that go on, one of which is ahead."""
    experiment = reports.experiment("Corridor", seeds=(0, 1))
    ahead, slow = experiment["runs"]
    for run in (ahead, slow):
        reports.state(run, "running", attempt=1)
    reports.metrics(ahead, NAME, {100: 1.0, 200: 2.0, 300: 3.0, 400: 4.0})
    reports.metrics(slow, NAME, {100: 2.0, 250: 5.0})
    return experiment


def test_what_is_new_comes_alone_and_makes_the_same(
    client: TestClient, reports: Reports, experiment: dict[str, Any]
) -> None:
    known = curves(client, experiment)
    assert known["since"] is None

    ahead, slow = experiment["runs"]
    reports.metrics(ahead, NAME, {500: 7.0})
    reports.metrics(slow, NAME, {350: 1.0})
    news = curves(client, experiment, known["follow"])

    # The slow seed had got to 250: what is beyond may have changed.
    assert (news["since"], news["steps"]) == (250, [300, 350, 400, 500])
    assert [seed["values"] for seed in news["experiments"][0]["seeds"]] == [[3.0, 3.5, 4.0, 7.0], [3.0, 1.0, None, None]]
    assert behind(known, news) == curves(client, experiment)

    reports.metrics(slow, NAME, {450: 2.0})
    more = curves(client, experiment, news["follow"])
    assert more["since"] == 350
    assert behind(behind(known, news), more) == curves(client, experiment)


def test_without_anything_new_there_is_nothing_more(
    client: TestClient, experiment: dict[str, Any], reports: Reports
) -> None:
    for run in experiment["runs"]:
        reports.state(run, "completed")
    known = curves(client, experiment)

    news = curves(client, experiment, known["follow"])

    assert (news["since"], news["steps"], news["experiments"][0]["mean"]) == (400, [], [])
    assert behind(known, news) == curves(client, experiment)


def test_points_that_were_compacted_are_gone_on_from(
    client: TestClient, reports: Reports, experiment: dict[str, Any], services: Any
) -> None:
    from server.metrics.repository import MetricRepository

    known = curves(client, experiment)
    with services.database.write() as session:
        for run in experiment["runs"]:
            MetricRepository(session).compact(run["id"])
    ahead, slow = experiment["runs"]
    reports.metrics(ahead, NAME, {500: 7.0})
    reports.metrics(slow, NAME, {350: 1.0})

    news = curves(client, experiment, known["follow"])

    assert news["since"] == 250
    assert behind(known, news) == curves(client, experiment)


def test_long_curves_go_on_as_evenly_as_they_were(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("Long")
    (run,) = experiment["runs"]
    reports.state(run, "running", attempt=1)
    reports.metrics(run, NAME, {step: float(step) for step in range(10, 1_010, 10)})
    known = curves(client, experiment, points=10)
    assert (known["spacing"], known["steps"][-2:]) == ("even", [890, 1_000])

    reports.metrics(run, NAME, {step: float(step) for step in range(1_010, 1_300, 10)})
    news = curves(client, experiment, known["follow"], points=10)
    assert (news["since"], news["steps"]) == (1_000, [1_110, 1_220, 1_290])
    assert news["experiments"][0]["mean"] == pytest.approx(news["steps"])

    # The newest point stood beside the grid: its place is left again.
    reports.metrics(run, NAME, {1_300: 1_300.0, 1_340: 1_340.0})
    more = curves(client, experiment, news["follow"], points=10)
    assert (more["since"], more["steps"]) == (1_220, [1_330, 1_340])


@pytest.mark.parametrize("what", ["begun", "cut back", "another seed", "another question", "too much", "evaluated"])
def test_where_what_is_known_is_no_longer_true_the_answer_is_whole(client: TestClient, reports: Reports, what: str) -> None:
    experiment = reports.experiment("Corridor", seeds=(0, 1))
    first, second = experiment["runs"]
    reports.state(first, "running", attempt=1)
    reports.metrics(first, NAME, {100: 1.0, 200: 2.0})
    known = curves(client, experiment)
    query: dict[str, Any] = {}
    match what:
        case "begun":
            reports.metrics(second, NAME, {100: 3.0})
        case "cut back":
            reports.state(first, "running", attempt=2)
        case "another seed":
            assert client.post(f"/api/experiments/{experiment['id']}/seeds", json={"seeds": [7]}).status_code == 204
        case "another question":
            query = {"lines": 1}
        case "too much":
            query = {"points": 20}
            known = curves(client, experiment, **query)
            reports.metrics(first, NAME, dict.fromkeys(range(210, 900, 10), 1.0))
        case "evaluated":
            reports.checkpoint(first, 200, reports.evaluation(8))

    assert curves(client, experiment, known["follow"], **query)["since"] is None


def test_what_nobody_was_told_is_answered_whole(client: TestClient, experiment: dict[str, Any]) -> None:
    assert curves(client, experiment, "what?")["since"] is None
    assert curves(client, experiment, f"{'0' * 16}.200.0")["since"] is None
    over_time = curves(client, experiment, curves(client, experiment)["follow"], x="wall")
    assert (over_time["since"], over_time["follow"]) == (None, None)


def test_a_token_says_what_it_says() -> None:
    followed = Followed("0123456789abcdef", 512, 16)
    assert Followed.of(followed.token) == followed
    assert Followed.of(followed.token + "0" * 30) is None
