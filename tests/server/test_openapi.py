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
        expected = (
            {"401"} | ({"404"} if "{" in name else set()) | ({"409"} if name.endswith(("/stop", "/resume")) else set())
        )
        assert expected <= set(operation["responses"]), name


def test_every_operation_says_that_what_it_needs_may_be_away(document: dict[str, Any]) -> None:
    silent = [name for name, operation in operations(document) if "503" not in operation["responses"]]
    assert silent == []


def test_the_workers_part_is_not_the_pages_business(document: dict[str, Any]) -> None:
    assert [name for name, _ in operations(document) if "/api/worker/" in name] == []


def test_what_is_read_is_complete(document: dict[str, Any]) -> None:
    """A generated type without question marks: the pages need not guess what a missing field means."""
    schemas = document["components"]["schemas"]
    for name in ("Experiment", "Run", "RunDetail", "Checkpoint", "Comparison", "Status", "TrainingConfig-Output"):
        assert set(schemas[name]["required"]) == set(schemas[name]["properties"]), name
