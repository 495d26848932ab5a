"""The API's description: the source of the pages' types, so it is complete, and the same for the same routes."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from server.written.openapi import description

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads(description())
    return loaded


def operations(document: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    return [
        (f"{method.upper()} {path}", operation)
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
    ]


def test_every_run_writes_the_same(tmp_path: Path) -> None:
    file = tmp_path / "openapi.json"
    subprocess.run([sys.executable, "-m", "server.written.openapi", str(file)], cwd=ROOT, check=True)

    assert file.read_text() == description()


def test_every_operation_has_a_sentence_and_a_name_of_its_own(document: dict[str, Any]) -> None:
    found = operations(document)
    assert len({operation["operationId"] for _, operation in found}) == len(found)
    assert [name for name, operation in found if not operation.get("description")] == []


def test_every_operation_says_how_it_may_be_refused(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        # What comes before every route refuses what can't be read, who is not let in, guesses, and what can't be done now.
        expected = {"400", "401", "403", "429", "503"}
        expected |= {"404"} if "{" in name else set()
        expected |= {"409"} if name.endswith(("/stop", "/resume")) else set()
        expected |= (
            {"408", "413", "422"} if "application/json" in operation.get("requestBody", {}).get("content", {}) else set()
        )
        assert expected <= set(operation["responses"]), name


def test_what_many_refuse_with_is_written_once(document: dict[str, Any]) -> None:
    written = document["components"]["responses"]
    named = [
        answer["$ref"].removeprefix("#/components/responses/")
        for _, operation in operations(document)
        for status, answer in operation["responses"].items()
        if status[0] in "45" and status != "501"
    ]
    assert set(named) == set(written)
    for name in ("NotNow", "TooManyAttempts"):
        assert written[name]["headers"]["Retry-After"]["required"]


def test_the_workers_part_is_not_the_pages_business(document: dict[str, Any]) -> None:
    assert [name for name, _ in operations(document) if "/api/worker/" in name] == []


def test_what_is_read_is_complete(document: dict[str, Any]) -> None:
    """A generated type without question marks: the pages need not guess what a missing field means."""
    schemas = document["components"]["schemas"]
    for name in ("Experiment", "Run", "RunDetail", "Checkpoint", "Comparison", "Status", "TrainingConfig-Output"):
        assert set(schemas[name]["required"]) == set(schemas[name]["properties"]), name
