"""No program breaks by an update without a new version: the API's description is held against the one that was kept."""

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from server.version import version
from server.written.api_changes import breaking, stripped
from server.written.openapi import description

KEPT = Path(__file__).with_name("api_kept.json")


@pytest.fixture
def now() -> dict[str, Any]:
    return stripped(json.loads(description()))


def test_nothing_breaks_without_a_new_version(now: dict[str, Any]) -> None:
    kept = json.loads(KEPT.read_text("utf-8"))
    again = f"python -m server.written.api_changes {KEPT.relative_to(Path(__file__).parents[2])}"

    assert kept["version"] == version(), f"a new version: keep what it promises ({again})"
    assert breaking(kept, now) == [], f"raise the version in pyproject.toml, say so in CHANGELOG.md, then {again}"


def test_what_is_added_breaks_nothing(now: dict[str, Any]) -> None:
    more = copy.deepcopy(now)
    more["paths"]["/api/new"] = {"get": {"parameters": {}, "body": {}, "answers": {}}}
    more["paths"]["/api/queue"]["get"]["parameters"]["query new"] = {"required": False}
    more["schemas"]["WaitingRun"]["properties"]["new"] = {"type": "string"}
    more["schemas"]["WaitingRun"]["required"].append("new")
    more["schemas"]["WaitingRun"]["properties"]["waits_for"]["enum"].append("luck")

    assert breaking(now, more) == []


def test_every_kind_of_break_is_named(now: dict[str, Any]) -> None:
    less = copy.deepcopy(now)
    paths, schemas = less["paths"], less["schemas"]
    del paths["/api/workers"]
    del paths["/api/queue"]["get"]["parameters"]["query limit"]
    paths["/api/queue"]["get"]["parameters"]["query offset"]["required"] = True
    paths["/api/runs/{run_id}/log"]["get"]["parameters"]["query new"] = {"required": True}
    paths["/api/runs/{run_id}/priority"]["put"]["body"] = {}
    paths["/api/version"]["get"]["answers"]["200"] = {}
    del schemas["WaitingRun"]["properties"]["seed"]
    schemas["WaitingRun"]["properties"]["total_steps"]["type"] = "string"
    schemas["WaitingRun"]["properties"]["waits_for"]["enum"].remove("gpu")
    schemas["WaitingRun"]["properties"]["starts_in"]["anyOf"] = [{"type": "number"}]
    schemas["Notes"]["properties"]["author"] = {"type": "string"}
    schemas["Notes"]["required"].append("author")
    del schemas["RunEvent"]

    assert set(breaking(now, less)) == {
        "GET /api/workers is gone",
        "GET /api/queue: the parameter query limit is gone",
        "GET /api/queue: the parameter query offset has become required",
        "GET /api/runs/{run_id}/log: the new parameter query new is required",
        "PUT /api/runs/{run_id}/priority: takes another body",
        "GET /api/version: answers 200 with something else",
        "WaitingRun.seed is gone",
        "WaitingRun.total_steps was integer, and is string",
        "WaitingRun.waits_for has lost 'gpu'",
        "WaitingRun.starts_in may no longer be null",
        "Notes.author has become required",
        "the schema RunEvent is gone",
    }
