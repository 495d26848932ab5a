"""The benchmark of other people's tools: it runs with what is installed, and says what is not."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path


def test_stable_baselines_is_told_nothing_but_the_id_and_counts_to_the_end() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.standard_tools", "--steps", "2100"],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[2],
        timeout=200,
    )
    figures = json.loads(done.stdout.splitlines()[-1])
    assert figures["stable_baselines3_evaluations"] >= 3  # PPO ends with a whole rollout of 2,048
    assert 0.0 <= figures["stable_baselines3_success"] <= 1.0
    assert figures["stable_baselines3_episodes"] >= 20  # of at most 100 steps
    assert figures["cleanrl"] == "no script given"
    for name in ("skrl", "sbx"):
        if importlib.util.find_spec(name) is None:
            assert figures[name] == "not installed"
        else:
            assert f"{name}_success" in figures
