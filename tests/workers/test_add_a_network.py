"""What docs/extending/add-a-network.md says works as written, from one file."""

import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tests.workers.test_trainer import Recorder
from workers.checkpoints import read_policy
from workers.config import EvaluationConfig, TrainingConfig
from workers.networks.registry import forget_network
from workers.training.trainer import train

PAGE = Path(__file__).parents[2] / "docs" / "extending" / "add-a-network.md"


def test_the_lines_of_the_page_train(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("one_file")
    # pydantic looks the annotations up where the class says that it was written.
    monkeypatch.setitem(sys.modules, "one_file", module)
    names: dict[str, Any] = vars(module)
    for lines in re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL):
        exec(lines, names)
    training: TrainingConfig = names["training"]
    try:
        recorder = Recorder()
        short = training.model_copy(update={"steps": 10_000, "evaluation": EvaluationConfig(every_steps=10_000)})
        assert train(short, 0, recorder, tmp_path) == "completed"
        manifest, policy = read_policy(recorder.checkpoints[-1][1])
        assert manifest.network.name == "gated"
        assert set(policy.weights) == {"hidden.weight", "hidden.bias", "head.weight", "head.bias"}
    finally:
        forget_network(names["GatedNetwork"])
