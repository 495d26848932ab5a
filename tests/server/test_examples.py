"""Examples in the API's description: one for every body, all of them true, and what they launch is launched."""

import base64
import json
from typing import Any

import pytest
from fastapi.routing import APIRoute
from fastapi.testclient import TestClient
from pydantic import TypeAdapter

from server.app import ROUTERS
from server.examples import ANSWERS, BODIES
from server.written.openapi import description
from tests.workers.test_onnx_policy import graph

ROUTES = {
    f"{method} {route.path}": route
    for router in ROUTERS
    for route in router.routes
    if isinstance(route, APIRoute) and route.include_in_schema
    for method in route.methods or ()
}
# That need nothing to be there before.
DONE_AT_ONCE = (
    "POST /api/projects",
    "POST /api/experiments",
    "POST /api/studies",
    "POST /api/evaluations",
    "POST /api/arenas/imported",
    "POST /api/arenas/reviews",
    "POST /api/playgrounds",
    "POST /api/suites",
    "POST /api/uploads/shapes",
    "POST /api/reproduction",
    "POST /api/worker-tokens",
    "POST /api/alerts/rules",
    "PUT /api/workbench/views",
)


def test_every_body_has_one_in_the_description() -> None:
    bodies = {
        f"{method.upper()} {path}": content["application/json"]
        for path, methods in json.loads(description())["paths"].items()
        for method, operation in methods.items()
        if "application/json" in (content := operation.get("requestBody", {}).get("content", {}))
    }
    assert {name: content.get("example") for name, content in bodies.items()} == BODIES


@pytest.mark.parametrize("name", BODIES)
def test_a_body_is_one_that_is_taken(name: str) -> None:
    field = ROUTES[name].body_field
    assert field is not None
    _, problems = field.validate(BODIES[name], {}, loc=("body",))
    assert not problems


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_is_one_that_is_given(name: str) -> None:
    answer: TypeAdapter[Any] = TypeAdapter(ROUTES[name].response_model)
    given = answer.validate_json(json.dumps(ANSWERS[name]))
    # Nothing is left out of it.
    assert json.loads(answer.dump_json(given)) == json.loads(json.dumps(ANSWERS[name]))


@pytest.mark.parametrize("name", DONE_AT_ONCE)
def test_what_an_example_asks_for_is_done(client: TestClient, name: str) -> None:
    method, path = name.split(" ")
    response = client.request(method, path, json=BODIES[name])
    assert response.is_success, response.text


def test_a_policy_is_uploaded_as_the_example_says_once_its_file_is_whole(client: TestClient) -> None:
    """A file takes more than an example's line: the one there is how it begins."""
    whole = BODIES["POST /api/uploads"] | {"content": base64.b64encode(graph()).decode()}
    assert client.post("/api/uploads", json=whole).status_code == 201
    assert client.post("/api/uploads", json=BODIES["POST /api/uploads"]).status_code == 422


def test_a_training_is_launched_as_the_example_says(client: TestClient) -> None:
    wanted = BODIES["POST /api/experiments"]
    made = client.post("/api/experiments", json=wanted).json()
    assert [run["seed"] for run in made["runs"]] == wanted["seeds"]
    assert (made["name"], made["parallel_runs"]) == (wanted["name"], wanted["parallel_runs"])
    assert made["training"]["algorithm"]["gamma"] == wanted["training"]["algorithm"]["gamma"]
