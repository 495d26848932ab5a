"""Whatever the API is asked, and in whatever order: no 500, and no answer that its description does not know.

Schemathesis makes the requests from the description: such as it allows, such as it does not, and chains of them in which
what one answered is what the next one asks for. On both databases, three seeds each.
"""

import json
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import pytest
import requests
import schemathesis
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis.stateful import run_state_machine_as_test
from schemathesis import Case, GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.core.failures import FailureGroup
from schemathesis.core.result import Ok
from schemathesis.schemas import BaseSchema
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from server.openapi import description
from tests.server.test_serving import serving

CHECKS: list[Any] = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_schema_conformance,
    response_headers_conformance,
]
# A stream that goes on until somebody leaves has tests of its own.
ENDLESS = {"/api/events"}
SEEDS = (1, 2, 3)
EXAMPLES = 3
CHAINS, STEPS = 5, 6


@pytest.fixture
def session() -> Iterator[requests.Session]:
    with requests.Session() as session:
        yield session


@pytest.fixture
def schema(tmp_path: Path, database_url: str, session: requests.Session) -> Iterator[BaseSchema]:
    """The description of a service that runs, and a browser that is logged in to it."""
    with serving(tmp_path / "data", MAPLESS_DATABASE_URL=database_url) as (_, url):
        base, _, token = url.partition("/?token=")
        session.headers["Authorization"] = f"Bearer {token}"
        document = json.loads(description())
        document["paths"] = {path: item for path, item in document["paths"].items() if path not in ENDLESS}
        schema = schemathesis.openapi.from_dict(document)
        schema.config.update(base_url=base)
        yield schema


def bounded(examples: int) -> settings:
    return settings(
        max_examples=examples,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
        stateful_step_count=STEPS,
    )


def test_every_operation_answers_as_its_description_says(schema: BaseSchema, session: requests.Session) -> None:
    wrong: dict[str, str] = {}
    asked = 0
    for result in schema.get_all_operations():
        assert isinstance(result, Ok), result
        operation = result.ok()
        # Any text will do for what stands in a path alone: nothing that it is asked is against its description.
        modes = list(GenerationMode) if operation.query or operation.body else [GenerationMode.POSITIVE]
        for mode, number in product(modes, SEEDS):

            @seed(number)
            @bounded(EXAMPLES)
            @given(case=operation.as_strategy(generation_mode=mode))
            def ask(case: Case[Any]) -> None:
                nonlocal asked
                asked += 1
                try:
                    case.call_and_validate(session=session, checks=CHECKS, timeout=60)
                except FailureGroup as failures:
                    wrong.setdefault(case.operation.label, str(failures))

            ask()
    assert wrong == {}
    assert asked > 100 * len(SEEDS)


def test_what_one_answers_the_next_is_asked_for(schema: BaseSchema, session: requests.Session) -> None:
    found: set[str] = set()

    class Chain(schema.as_state_machine()):  # type: ignore[misc]
        def get_call_kwargs(self, case: Case[Any]) -> dict[str, Any]:
            return {"session": session, "timeout": 60}

        def validate_response(self, response: Any, case: Case[Any], *_arguments: Any, **_options: Any) -> None:
            case.validate_response(response, checks=CHECKS)
            if response.status_code < 300 and case.path_parameters:
                found.add(case.operation.label)

    for number in SEEDS:
        seed(number)(Chain)
        run_state_machine_as_test(Chain, settings=bounded(CHAINS))
    # What was launched is what was asked for, stopped, renamed.
    assert len(found) >= 3, found
