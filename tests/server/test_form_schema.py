"""What the launch form is rendered from, and what the pages' types are generated from."""

from pathlib import Path
from typing import Any

import pytest

from server.experiments.form import form_schema
from server.experiments.schemas import ExperimentCreate
from server.written.openapi import description
from workers import config

OPENAPI = Path(__file__).parents[2] / "web" / "openapi.json"


@pytest.mark.parametrize("algorithm", [config.PpoConfig, config.DdpgConfig, config.Td3Config, config.SacConfig])
def test_every_algorithm_comes_with_all_its_own_defaults(algorithm: Any) -> None:
    properties = form_schema()["$defs"][algorithm.__name__]["properties"]

    assert {name: field["default"] for name, field in properties.items()} == algorithm().model_dump(mode="json")


def test_the_defaults_in_the_schema_are_those_of_the_model() -> None:
    properties = form_schema()["properties"]

    assert {name: field["default"] for name, field in properties.items()} == ExperimentCreate().model_dump(mode="json")


def test_the_description_that_the_pages_types_come_from_is_that_of_the_routes() -> None:
    assert OPENAPI.read_text() == description(), "run `make types`"
