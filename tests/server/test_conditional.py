"""Answers that need not be sent again: a tag that changes with what they say, and is known without making them."""

import re
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import event

from server.audit.repository import AuditRepository
from server.checkpoints.endpoints import LISTED_FROM as CHECKPOINTS
from server.database import tables
from server.leaderboards.endpoints import MADE_OF as LEADERBOARDS
from server.services import Services
from server.workbench.service import MADE_OF as WORKBENCH
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
    "/api/experiments",
    "/api/experiments?query=arena%20%3D%20simple&column=gamma&column=train/return&sort=gamma",
    "/api/workbench/groups?by=algorithm&column=train/return",
    "/api/workbench/keys",
    "/api/runs/{run}/checkpoints",
    "/api/runs/{run}/checkpoints/steps",
    "/api/runs/{run}/export?format=json",
    "/api/experiments/{experiment}/export?format=json",
    "/api/compare?experiment={experiment}",
    "/api/compare/profiles?experiment={experiment}",
    "/api/compare/metrics?experiment={experiment}",
    "/api/compare/curves?experiment={experiment}",
    "/api/compare/export?experiment={experiment}&format=json",
    "/api/leaderboards",
    "/api/leaderboards/{suite_hash}",
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
        suite_hash=policy["results"][0]["suite_hash"],
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


# By route: the tables whose writes its tag counts.
COUNTED = {
    "/api/experiments?column=gamma&column=train/return": WORKBENCH,
    "/api/workbench/groups?by=algorithm&column=train/return": WORKBENCH,
    "/api/workbench/keys": WORKBENCH,
    "/api/runs/{run}/checkpoints": (*CHECKPOINTS, "runs"),
    "/api/runs/{run}/checkpoints/steps": (*CHECKPOINTS, "runs"),
    "/api/leaderboards": (*LEADERBOARDS, "runs"),
    "/api/leaderboards/{suite_hash}": (*LEADERBOARDS, "runs"),
}


@pytest.mark.parametrize("path", COUNTED)
def test_no_answer_is_made_of_what_its_tag_does_not_count(
    client: TestClient, services: Services, run: dict[str, Any], path: str
) -> None:
    suite_hash = client.get("/api/policies").json()[0]["results"][0]["suite_hash"]
    read: set[str] = set()

    @event.listens_for(services.database.engine, "before_cursor_execute")
    def _note(_connection: Any, _cursor: Any, statement: str, *_: Any) -> None:
        # What goes on in the background reads much; what asks who is there is looked at before the tag.
        if any(Path(frame.filename).name == "endpoints.py" for frame in traceback.extract_stack()):
            read.update(re.findall(r"(?:FROM|JOIN) (\w+)", statement))

    assert client.get(path.format(run=run["id"], suite_hash=suite_hash)).status_code == 200

    assert read
    assert read & tables.Base.metadata.tables.keys() <= {*COUNTED[path]}


def test_a_list_is_sent_again_once_anything_in_it_has_changed(
    client: TestClient, reports: Reports, run: dict[str, Any]
) -> None:
    experiment = f"/api/experiments/{run['experiment_id']}"
    changes: dict[str, Callable[[], object]] = {
        "another name": lambda: client.patch(experiment, json={"name": "Another"}),
        "a tag": lambda: client.post(
            "/api/workbench/actions", json={"action": "tag", "experiments": [run["experiment_id"]], "tag": "good"}
        ),
        "a report": lambda: reports.metrics(run, "train/return", {300: 3.0}),
        "a launch": lambda: reports.experiment(),
        "a deletion": lambda: client.delete(experiment),
    }
    for what, change in changes.items():
        tag = client.get("/api/experiments").headers["etag"]
        assert again(client, "/api/experiments", tag).status_code == 304
        change()
        assert again(client, "/api/experiments", tag).status_code == 200, what


def test_what_concerns_others_leaves_a_list_as_it_is(
    client: TestClient, services: Services, reports: Reports, run: dict[str, Any]
) -> None:
    other = reports.experiment()["runs"][0]
    paths = [f"/api/runs/{run['id']}/checkpoints", f"/api/compare/curves?experiment={run['experiment_id']}"]
    tags = [client.get(path).headers["etag"] for path in paths]

    reports.metrics(other, "train/return", {100: 1.0})
    with services.database.write() as session:
        AuditRepository(session).add("run.stopped", target=other["id"])

    assert [again(client, path, tag).status_code for path, tag in zip(paths, tags, strict=True)] == [304, 304]


def test_a_comparison_is_sent_again_once_one_of_its_runs_has_reported(
    client: TestClient, reports: Reports, run: dict[str, Any]
) -> None:
    paths = [f"/api/compare{part}?experiment={run['experiment_id']}" for part in ("", "/curves", "/metrics", "/profiles")]
    tags = [client.get(path).headers["etag"] for path in paths]

    reports.checkpoint(run, 300, reports.evaluation(8))

    assert {again(client, path, tag).status_code for path, tag in zip(paths, tags, strict=True)} == {200}


MADE_BY = {
    "/api/experiments": "server.workbench.service.listed",
    "/api/workbench/groups?by=algorithm": "server.workbench.service.grouped",
    "/api/runs/{run}/checkpoints": "server.checkpoints.repository.CheckpointRepository.page",
    "/api/runs/{run}/checkpoints/steps": "server.checkpoints.repository.CheckpointRepository.steps",
    "/api/runs/{run}/export?format=json": "server.data_export.service.document",
    "/api/compare?experiment={experiment}": "server.comparison.service.verdicts",
    "/api/compare/curves?experiment={experiment}": "server.metrics.cache.AnswerCache.get",
    "/api/compare/export?experiment={experiment}": "server.comparison.service.common_grid",
    "/api/leaderboards": "server.leaderboards.service.boards",
    "/api/leaderboards/{suite_hash}": "server.leaderboards.service.ranked",
    "/api/reproduction": "server.reproduction.service.reproduction_view",
    "/api/runs/{run}/metrics": "server.metrics.service.MetricService.of_run",
    "/api/checkpoints/{checkpoint}/episodes": "server.checkpoints.service.decode_episodes",
    "/api/policies/{policy}/suites/{suite}/episodes": "server.policies.service.episodes",
}


@pytest.mark.parametrize("path", MADE_BY)
def test_nothing_is_computed_for_who_has_it(
    client: TestClient, run: dict[str, Any], monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    policy = client.get("/api/policies").json()[0]
    result = policy["results"][0]
    address = path.format(
        run=run["id"],
        experiment=run["experiment_id"],
        checkpoint=run["checkpoint"],
        policy=policy["name"],
        suite=result["suite"],
        suite_hash=result["suite_hash"],
    )
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
