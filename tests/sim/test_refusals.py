"""What configurations are refused for is told in words that say what to do."""

from typing import Any

import pytest
from pydantic import ValidationError

from sim.config import TaskConfig
from sim.config.refusals import to_tell


def told(document: dict[str, Any]) -> dict[str, str]:
    with pytest.raises(ValidationError) as refused:
        TaskConfig.model_validate(document)
    return {".".join(map(str, problem["loc"])): problem["msg"] for problem in to_tell(refused.value.errors())}


def test_what_is_of_several_kinds_has_to_say_which() -> None:
    assert told({"arena": {"difficulty": 0.5}}) == {"arena": "'name' is missing, which says of which kind it is"}


def test_a_kind_that_there_is_not_is_told_beside_those_that_there_are() -> None:
    (message,) = told({"robot": {"name": "hovercraft"}}).values()
    assert message.startswith("'name' is 'hovercraft', and has to be one of '")


def test_a_list_is_not_told_to_be_empty_for_its_wrong_items() -> None:
    assert list(told({"observation": {"parts": [{"name": "ranges", "batches": -1}]}})) == [
        "observation.parts.0.ranges.batches"
    ]
    assert list(told({"observation": {"parts": []}})) == ["observation.parts"]
