"""Answers that need not be sent again: a tag that changes with what they say, and is known without making them."""

from typing import Any

import pytest
from fastapi.testclient import TestClient

from tests.server.harness import Reports


@pytest.fixture
def run(reports: Reports) -> dict[str, Any]:
    """A run with a curve, and a checkpoint that was evaluated."""
    run: dict[str, Any] = reports.experiment()["runs"][0]
    reports.metrics(run, "train/return", {100: 1.0, 200: 2.0})
    run["checkpoint"] = reports.checkpoint(run, 200, reports.evaluation(7))
    reports.state(run, "completed", step=200, last_seq=2)
    return run


def again(client: TestClient, path: str, tag: str) -> Any:
    return client.get(path, headers={"If-None-Match": tag})


TAGGED = (
    "/api/runs/{run}/metrics",
    "/api/runs/{run}/metrics?points=2&names=train/return",
    "/api/runs/{run}/export?format=csv",
    "/api/runs/{run}/export?format=tensorboard",
    "/api/experiments/{experiment}/export?format=csv",
    "/api/checkpoints/{checkpoint}/episodes",
    "/api/checkpoints/{checkpoint}/download",
    "/api/policies",
    "/api/policies/{policy}",
    "/api/policies/{policy}/suites/{suite}/episodes",
    "/api/policies/{policy}/download",
    "/api/reproduction",
    "/api/training/form",
    "/api/arenas/fixed?name=complex",
    "/api/arenas/generated?name=maze&seed=3",
)


@pytest.mark.parametrize("path", TAGGED)
def test_what_one_has_is_not_sent_again(client: TestClient, run: dict[str, Any], path: str) -> None:
    policy = client.get("/api/policies").json()[0]
    address = path.format(
        run=run["id"],
        experiment=run["experiment_id"],
        checkpoint=run["checkpoint"],
        policy=policy["name"],
        suite=policy["results"][0]["suite"],
    )
    first = client.get(address)
    assert first.status_code == 200, first.text
    tag = first.headers["etag"]
    # A browser asks each time: whoever is signed out is told so.
    assert first.headers["cache-control"] == "private, no-cache"

    for asked in (tag, f'"another", {tag}', tag.removeprefix("W/")):
        kept = again(client, address, asked)
        assert (kept.status_code, kept.content, kept.headers["etag"]) == (304, b"", tag)
    other = again(client, address, '"another"')
    assert (other.status_code, other.content) == (200, first.content)


def test_a_curve_that_has_grown_is_sent(client: TestClient, reports: Reports, run: dict[str, Any]) -> None:
    address = f"/api/runs/{run['id']}/metrics"
    tag = client.get(address).headers["etag"]

    reports.metrics(run, "train/return", {300: 3.0})
    reports.state(run, "completed", step=300, last_seq=3)

    assert again(client, address, tag).status_code == 200


def test_another_part_of_a_curve_has_another_tag(client: TestClient, run: dict[str, Any]) -> None:
    asked = ("", "?points=2", "?names=train/return", "?since=100&attempt=0")
    tags = {client.get(f"/api/runs/{run['id']}/metrics{query}").headers["etag"] for query in asked}
    assert len(tags) == len(asked)


MADE_BY = {
    "/api/runs/{run}/metrics": "server.metrics.service.MetricService.of_run",
    "/api/checkpoints/{checkpoint}/episodes": "server.checkpoints.service.decode_episodes",
    "/api/policies/{policy}/suites/{suite}/episodes": "server.policies.service.episodes",
}


@pytest.mark.parametrize("path", MADE_BY)
def test_nothing_is_computed_for_who_has_it(
    client: TestClient, run: dict[str, Any], monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    policy = client.get("/api/policies").json()[0]
    suite = policy["results"][0]["suite"]
    address = path.format(run=run["id"], checkpoint=run["checkpoint"], policy=policy["name"], suite=suite)
    tag = client.get(address).headers["etag"]
    monkeypatch.setattr(MADE_BY[path], _refuse)

    assert again(client, address, tag).status_code == 304
    with pytest.raises(AssertionError):
        client.get(address)


def _refuse(*_: object, **__: object) -> None:
    raise AssertionError("made, though the client has it")


def test_a_download_that_is_not_sent_is_not_noted(client: TestClient, run: dict[str, Any]) -> None:
    address = f"/api/checkpoints/{run['checkpoint']}/download"
    tag = client.get(address).headers["etag"]

    again(client, address, tag)

    assert client.get("/api/audit", params={"action": "checkpoint.downloaded"}).json()["total"] == 1


def test_who_may_not_see_it_learns_no_tag(client: TestClient, app: Any, run: dict[str, Any]) -> None:
    address = f"/api/runs/{run['id']}/metrics"
    tag = client.get(address).headers["etag"]
    stranger = TestClient(app, base_url="http://127.0.0.1")

    assert stranger.get(address, headers={"If-None-Match": tag}).status_code == 401
