"""CPU-seconds of training until a policy reaches 95 % and 99 % on the complex arena, ours and Stable-Baselines3's.

Each algorithm trains with its default configuration, on one thread; Stable-Baselines3 gets the same environment, networks
and hyperparameters. Every so many steps the deterministic policy drives 1,000 episodes that no training sees; that time
does not count. A level is reached at the first look that shows it. The median over the seeds counts, a seed that never
arrives as infinite.

    python -m benchmarks.time_to_success [--check] [--algorithms ppo ddpg td3 sac] [--seeds 5] [--sb3-seeds 3]

A line of JSON follows each training, so that an interrupted run keeps what it has.
Target: PPO to 99 % within 30 CPU-seconds.
"""

import json
import math
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.callbacks import BaseCallback

from benchmarks.attempts import first_attempts
from benchmarks.report import finish, parser
from benchmarks.stable_baselines import build, policy_of
from benchmarks.training_rates import NEVER, Silent
from sim.arrays import PolicyFunction
from sim.config import ArenaConfig, TaskConfig
from workers.config import EvaluationConfig, TrainingConfig
from workers.live.viewing import Unwatched
from workers.policy import torch_policy
from workers.training.trainer import REPORT_INTERVAL, Training

TASK = TaskConfig(arena=ArenaConfig(name="complex"))
STEPS = {"ppo": 1_000_000, "ddpg": 100_000, "td3": 100_000, "sac": 60_000}
# One to three seconds of training each.
EVALUATE_EVERY = {"ppo": 50_000, "ddpg": 10_000, "td3": 10_000, "sac": 10_000}
LEVELS = (0.95, 0.99)
# Other episodes than those that the recipes were chosen on.
EPISODES_SEED = 555
PPO_TARGET_SECONDS = 30.0


def configuration(algorithm: str) -> TrainingConfig:
    """The default of an algorithm on the complex arena."""
    return TrainingConfig.model_validate(
        {
            "task": TASK,
            "algorithm": {"name": algorithm},
            "steps": STEPS[algorithm],
            "evaluation": EvaluationConfig(every_steps=NEVER),
            "threads": "1",
        }
    )


class Clock:
    """CPU-seconds to each level of success, measured between looks only."""

    def __init__(self, every: int) -> None:
        self.reached = dict.fromkeys(LEVELS, math.inf)
        self.looks: list[float] = []
        self._every = self._next = every
        self.spent = 0.0
        self._started = time.process_time()

    def look(self, step: int, policy: Callable[[], PolicyFunction]) -> bool:
        """Looks where it is due; whether every level is reached."""
        if step < self._next:
            return False
        self._next += self._every
        self.spent += time.process_time() - self._started
        success = first_attempts(policy(), TASK, EPISODES_SEED).success
        self.looks.append(success)
        for level, seconds in self.reached.items():
            if success >= level and math.isinf(seconds):
                self.reached[level] = self.spent
        self._started = time.process_time()
        return not any(map(math.isinf, self.reached.values()))


def ours(config: TrainingConfig, seed: int) -> Clock:
    """Our training, by the stages of its own loop."""
    with tempfile.TemporaryDirectory() as directory:
        training = Training(config, seed, Silent(), Path(directory), Unwatched(), REPORT_INTERVAL)
        clock = Clock(EVALUATE_EVERY[config.algorithm.name])
        for _ in _updates(training):
            if clock.look(training.step, lambda: training.policy(torch_policy)):
                break
    return clock


def _updates(training: Training) -> Iterator[None]:
    while training.updates < training.total_updates:
        training.collect()
        training.update()
        yield


class Look(BaseCallback):
    """Hands a model to the clock after each of its steps."""

    def __init__(self, clock: Clock) -> None:
        super().__init__()
        self._clock = clock

    def _on_step(self) -> bool:
        return not self._clock.look(self.num_timesteps, lambda: policy_of(self.model))


def theirs(config: TrainingConfig, seed: int) -> Clock:
    """Stable-Baselines3's training."""
    model = build(config, seed)
    clock = Clock(EVALUATE_EVERY[config.algorithm.name])
    model.learn(config.steps, callback=Look(clock))
    return clock


def race(algorithm: str, who: str, seeds: range) -> dict[str, Any]:
    """Figures of one contender: median and slowest time to each level, and how many seeds never got there."""
    config = configuration(algorithm)
    train = ours if who == "ours" else theirs
    clocks = []
    for seed in seeds:
        clock = train(config, seed)
        clocks.append(clock)
        reached = {f"to_{round(100 * level)}": _finite(seconds) for level, seconds in clock.reached.items()}
        line = {"algorithm": algorithm, "who": who, "seed": seed, "looks": clock.looks, "cpu_seconds": round(clock.spent, 1)}
        print(json.dumps(line | reached), flush=True)
    figures: dict[str, Any] = {f"{algorithm}_{who}_seeds": len(seeds)}
    for level in LEVELS:
        times = [clock.reached[level] for clock in clocks]
        name = f"{algorithm}_{who}_seconds_to_{round(100 * level)}"
        figures[name] = _finite(statistics.median(times))
        figures[f"{name}_slowest"] = _finite(max(times))
        figures[f"{name}_never"] = sum(map(math.isinf, times))
    return figures


def _finite(seconds: float) -> float | None:
    """For JSON, which has no infinity."""
    return round(seconds, 1) if math.isfinite(seconds) else None


def main() -> None:
    """Measure and report."""
    options = parser(__doc__)
    options.add_argument("--algorithms", nargs="*", default=["ppo"], choices=list(STEPS))
    options.add_argument("--seeds", type=int, default=5)
    options.add_argument("--first-seed", type=int, default=0)
    options.add_argument("--sb3-seeds", type=int, help="of Stable-Baselines3, 0 for only ours; as many as ours if left out")
    arguments = options.parse_args()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    sb3_seeds = arguments.seeds if arguments.sb3_seeds is None else arguments.sb3_seeds
    figures: dict[str, Any] = {}
    for algorithm in arguments.algorithms:
        for who, seeds in (("ours", arguments.seeds), ("sb3", sb3_seeds)):
            if seeds:
                figures |= race(algorithm, who, range(arguments.first_seed, arguments.first_seed + seeds))
    targets = {"ppo_ours_seconds_to_99": PPO_TARGET_SECONDS} if "ppo_ours_seeds" in figures else {}
    finish("time_to_success", figures, at_most=targets, check=arguments.check)


if __name__ == "__main__":
    main()
