"""Tries hyperparameters on one of the built-in arenas: success after each part of a training, seed by seed.

    python -m benchmarks.recipe_search '{"name": "ppo", "gamma": 0.98}' --steps 600000 --seeds 2

With `--target 0.99 --check` it fails where a seed ends below 99 %; without a target there is nothing to miss. A line of JSON
follows each seed, so that an interrupted search keeps what it has. What was tried, and what came of it, is in
docs/recipes.md.
"""

import json
import tempfile
import time
from pathlib import Path
from typing import Any

import torch

from benchmarks.attempts import Attempts, first_attempts
from benchmarks.report import finish, parser
from benchmarks.training_rates import NEVER, Silent
from sim.config import ArenaConfig, ObservationConfig, TaskConfig
from workers.config import TrainingConfig
from workers.live.viewing import Unwatched
from workers.policy import torch_policy
from workers.training.trainer import REPORT_INTERVAL, Training


def learn(config: TrainingConfig, seed: int, parts: int, episodes_seed: int) -> tuple[list[Attempts], float]:
    """How it does after each part of a training, and the CPU-seconds of training alone."""
    looks: list[Attempts] = []
    seconds = 0.0
    with tempfile.TemporaryDirectory() as directory:
        training = Training(config, seed, Silent(), Path(directory), Unwatched(), REPORT_INTERVAL)
        every = config.steps // parts
        while training.updates < training.total_updates:
            started = time.process_time()
            training.collect()
            training.update()
            seconds += time.process_time() - started
            if training.step >= every * (len(looks) + 1) or training.updates == training.total_updates:
                looks.append(first_attempts(training.policy(torch_policy), config.task, episodes_seed))
    return looks, seconds


def main() -> None:
    """Train and tell."""
    options = parser(__doc__)
    options.add_argument("algorithm", type=json.loads, help="an algorithm's configuration, as JSON")
    options.add_argument("--arena", default="complex", choices=("simple", "complex"))
    options.add_argument("--observation", default="improved", choices=("improved", "paper"))
    options.add_argument("--steps", type=int, default=600_000)
    options.add_argument("--parts", type=int, default=6, help="of a training, each with a look at its end")
    options.add_argument("--seeds", type=int, default=2)
    options.add_argument("--first-seed", type=int, default=0)
    options.add_argument("--episodes-seed", type=int, default=123, help="of the starts and targets that measure")
    options.add_argument("--target", type=float, help="success, 0 to 1, that every seed has to end with")
    arguments = options.parse_args()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    config = TrainingConfig.model_validate(
        {
            "task": TaskConfig(
                arena=ArenaConfig.model_validate({"name": arguments.arena}),
                observation=ObservationConfig.preset(arguments.observation),
            ),
            "algorithm": arguments.algorithm,
            "steps": arguments.steps,
            "evaluation": {"every_steps": NEVER},
        }
    )
    figures: dict[str, Any] = {"algorithm": arguments.algorithm, "arena": arguments.arena, "steps": arguments.steps}
    ends = []
    for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
        looks, seconds = learn(config, seed, arguments.parts, arguments.episodes_seed)
        last = looks[-1]
        ends.append(last.success)
        figures[f"seed_{seed}"] = {
            "success": [look.success for look in looks],
            "timeouts": last.timeouts,
            "steps_per_attempt": round(last.steps, 1),
            "mean_actions": last.actions,
            "cpu_seconds": round(seconds, 1),
        }
        print(json.dumps({"seed": seed} | figures[f"seed_{seed}"]), flush=True)
    figures["worst_success"] = min(ends)
    targets = {} if arguments.target is None else {"worst_success": arguments.target}
    finish("recipe_search", figures, at_least=targets, check=arguments.check)


if __name__ == "__main__":
    main()
