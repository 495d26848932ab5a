"""Tries hyperparameters on the complex arena: success after each sixth of a training, seed by seed.

    python -m benchmarks.recipe_search '{"name": "ppo", "gamma": 0.98}' --steps 600000 --seeds 2

With `--target 0.99 --check` it fails where a seed ends below 99 %; without a target there is nothing to miss.
What was tried, and what came of it, is in docs/recipes.md.
"""

import json
import tempfile
import time
from pathlib import Path
from typing import Any

import torch

from benchmarks.report import finish, parser
from benchmarks.time_to_success import TASK, success_rate
from benchmarks.training_throughput import NEVER, Silent
from workers.config import TrainingConfig
from workers.live.viewing import Unwatched
from workers.policy import torch_policy
from workers.trainer import REPORT_INTERVAL, Training

EVALUATIONS = 6


def learn(config: TrainingConfig, seed: int) -> tuple[list[float], float]:
    """Success after each part of a training, and the CPU-seconds of training alone."""
    successes: list[float] = []
    seconds = 0.0
    with tempfile.TemporaryDirectory() as directory:
        training = Training(config, seed, Silent(), Path(directory), Unwatched(), REPORT_INTERVAL)
        every = config.steps // EVALUATIONS
        while training.updates < training.total_updates:
            started = time.process_time()
            training.collect()
            training.update()
            seconds += time.process_time() - started
            if training.step >= every * (len(successes) + 1) or training.updates == training.total_updates:
                successes.append(success_rate(training.policy(torch_policy)))
    return successes, seconds


def main() -> None:
    """Train and tell."""
    options = parser(__doc__)
    options.add_argument("algorithm", type=json.loads, help="an algorithm's configuration, as JSON")
    options.add_argument("--steps", type=int, default=600_000)
    options.add_argument("--seeds", type=int, default=2)
    options.add_argument("--target", type=float, help="success, 0 to 1, that every seed has to end with")
    arguments = options.parse_args()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    config = TrainingConfig.model_validate(
        {
            "task": TASK,
            "algorithm": arguments.algorithm,
            "steps": arguments.steps,
            "evaluation": {"every_steps": NEVER},
        }
    )
    figures: dict[str, Any] = {"algorithm": arguments.algorithm, "steps": arguments.steps}
    ends = []
    for seed in range(arguments.seeds):
        successes, seconds = learn(config, seed)
        ends.append(successes[-1])
        figures[f"seed_{seed}"] = {"success": successes, "cpu_seconds": round(seconds, 1)}
    figures["worst_success"] = min(ends)
    targets = {} if arguments.target is None else {"worst_success": arguments.target}
    finish("recipe_search", figures, at_least=targets, check=arguments.check)


if __name__ == "__main__":
    main()
