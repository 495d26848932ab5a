"""Lists: one pair of parameters, a bound on every answer, and how many there are beyond it."""

import json
from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.http.paging import MAX_PAGE, MAX_PART, TOTAL_HEADER
from server.written.openapi import description
from tests.server.harness import Reports

# What is read whole, or from a moment on, with a bound of its own.
OTHERWISE = {
    "/api/alerts/news": "what came after the last one that a browser has shown",
    "/api/checkpoints/{checkpoint_id}/episodes": "all episodes of one suite, a table's columns of one row",
    "/api/evaluations/{evaluation_id}/episodes": "all episodes of one suite",
    "/api/evaluations/{evaluation_id}/ways": "all ways through one arena of the suite",
    "/api/policies/{name}/suites/{suite}/episodes": "all episodes of one suite",
    "/api/runs/{run_id}/checkpoints/steps": "a slider's stops, spread over the run where there are too many",
    "/api/workbench/ids": "as many as one action may be about",
    "/api/workbench/keys": "what completes a query",
    "/api/workbench/values": "what completes a query",
}


@pytest.fixture(scope="module")
def lists() -> dict[str, dict[str, Any]]:
    """Every route that lists something, with its parameters by name."""
    document = json.loads(description())
    gets = {path: methods["get"] for path, methods in document["paths"].items() if "get" in methods}
    return {
        path: {one["name"]: one["schema"] for one in operation.get("parameters", ())}
        for path, operation in gets.items()
        if operation["operationId"].startswith("list_") or "limit" in str(operation.get("parameters", ""))
        if not path.endswith("/log")
    }


def test_every_list_takes_the_same_parameters(lists: dict[str, dict[str, Any]]) -> None:
    without = {path for path, parameters in lists.items() if not {"limit", "offset"} <= parameters.keys()}
    assert without == OTHERWISE.keys()


def test_what_answers_with_a_list_is_called_one(lists: dict[str, dict[str, Any]]) -> None:
    """So that none is left out above for its name."""
    document = json.loads(description())

    def whole(schema: dict[str, Any]) -> dict[str, Any]:
        while "$ref" in schema:
            schema = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
        return schema

    answered = {
        path: whole(content["schema"])
        for path, methods in document["paths"].items()
        if (content := methods.get("get", {}).get("responses", {}).get("200", {}).get("content", {}).get("application/json"))
    }
    listing = {
        path for path, schema in answered.items() if schema.get("type") == "array" or "items" in schema.get("properties", {})
    }
    assert listing <= lists.keys()


def test_every_list_has_a_bound(lists: dict[str, dict[str, Any]]) -> None:
    paged = [(path, parameters) for path, parameters in lists.items() if path not in OTHERWISE]
    assert len(paged) > 20
    for path, parameters in paged:
        limit, offset = parameters["limit"], parameters["offset"]
        assert (limit["minimum"], offset["minimum"], offset["default"]) == (1, 0, 0), path
        assert (limit["default"], limit["maximum"]) in {(50, MAX_PAGE), (MAX_PAGE, MAX_PAGE), (MAX_PART, MAX_PART)}, path


def test_a_short_list_comes_whole_and_in_parts(client: TestClient) -> None:
    whole = client.get("/api/arenas")
    total = len(whole.json())
    assert total > 3
    assert whole.headers[TOTAL_HEADER] == str(total)

    parts = [client.get("/api/arenas", params={"limit": 3, "offset": offset}) for offset in range(0, total, 3)]

    assert [arena for part in parts for arena in part.json()] == whole.json()
    assert {part.headers[TOTAL_HEADER] for part in parts} == {str(total)}
    assert client.get("/api/arenas", params={"limit": MAX_PART + 1}).status_code == 422


def test_a_runs_events_come_in_parts(client: TestClient, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]
    for action in ("stop", "resume", "stop"):
        assert client.post(f"/api/runs/{run['id']}/{action}").status_code == 200
    whole = client.get(f"/api/runs/{run['id']}/events")
    assert len(whole.json()) >= 2

    part = client.get(f"/api/runs/{run['id']}/events", params={"limit": 1, "offset": 1})

    assert part.json() == whole.json()[1:2]
    assert part.headers[TOTAL_HEADER] == str(len(whole.json())) == whole.headers[TOTAL_HEADER]


def test_groups_beyond_the_first_can_be_read(client: TestClient, reports: Reports) -> None:
    for number in range(3):
        reports.experiment(f"Number {number}", algorithm={"name": "ppo", "gamma": 0.9 + number / 100})
    whole = client.get("/api/workbench/groups", params={"by": "gamma"}).json()

    part = client.get("/api/workbench/groups", params={"by": "gamma", "limit": 2, "offset": 2}).json()

    assert (part["total"], part["items"]) == (3, whole["items"][2:])
