"""CPU-seconds of training until a policy reaches 95 % and 99 % on the complex arena, ours and Stable-Baselines3's.

Each algorithm trains with its default configuration, on one thread; Stable-Baselines3 gets the same environment, networks
and hyperparameters. After every 50,000 steps the deterministic policy drives 1,000 episodes that no training sees; that
time does not count. The median over the seeds counts, a seed that never arrives as infinite.

    python -m benchmarks.time_to_success [--check] [--algorithms ppo ddpg td3 sac] [--seeds 5]

Target: PPO to 99 % within 30 CPU-seconds.
"""

import math
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback

from benchmarks.report import finish, parser
from benchmarks.stable_baselines import build, policy_of
from benchmarks.training_throughput import NEVER, Silent
from sim.config import ArenaConfig, TaskConfig
from sim.vector_env import NavigationVectorEnv
from workers.config import EvaluationConfig, TrainingConfig
from workers.live.viewing import PolicyFunction, Unwatched
from workers.policy import torch_policy
from workers.trainer import REPORT_INTERVAL, Training

TASK = TaskConfig(arena=ArenaConfig(name="complex"))
STEPS = {"ppo": 1_000_000, "ddpg": 300_000, "td3": 300_000, "sac": 200_000}
LEVELS = (0.95, 0.99)
EVALUATE_EVERY = 50_000
EPISODES = 1_000
EVALUATION_SEED = 123
PPO_TARGET_SECONDS = 30.0


def success_rate(policy: PolicyFunction) -> float:
    """Arrivals among the first attempts of 1,000 robots."""
    env = NavigationVectorEnv(TASK, EPISODES, seed=EVALUATION_SEED, copy=False)
    observations, _ = env.reset(seed=EVALUATION_SEED)
    outcomes = np.zeros(EPISODES, np.uint8)
    while not outcomes.all():
        observations, *_ = env.step(policy(observations))
        outcomes = np.where(outcomes, outcomes, env.outcomes)
    return float((outcomes == 1).mean())


def configuration(algorithm: str) -> TrainingConfig:
    """The default of an algorithm on the complex arena."""
    return TrainingConfig.model_validate(
        {
            "task": TASK,
            "algorithm": {"name": algorithm},
            "steps": STEPS[algorithm],
            "evaluation": EvaluationConfig(every_steps=NEVER),
        }
    )


class Clock:
    """CPU-seconds to each level of success, measured between evaluations only."""

    def __init__(self) -> None:
        self.reached = dict.fromkeys(LEVELS, math.inf)
        self._spent = 0.0
        self._started = time.process_time()
        self._next = EVALUATE_EVERY

    def look(self, step: int, policy: Callable[[], PolicyFunction]) -> bool:
        """Evaluates where it is due; whether every level is reached."""
        if step < self._next:
            return False
        self._next += EVALUATE_EVERY
        self._spent += time.process_time() - self._started
        success = success_rate(policy())
        for level, seconds in self.reached.items():
            if success >= level and math.isinf(seconds):
                self.reached[level] = self._spent
        self._started = time.process_time()
        return not any(map(math.isinf, self.reached.values()))


def ours(config: TrainingConfig, seed: int) -> dict[float, float]:
    """Our training, by the stages of its own loop."""
    with tempfile.TemporaryDirectory() as directory:
        training = Training(config, seed, Silent(), Path(directory), Unwatched(), REPORT_INTERVAL)
        clock = Clock()
        for _ in _updates(training):
            if clock.look(training.step, lambda: training.policy(torch_policy)):
                break
    return clock.reached


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


def theirs(config: TrainingConfig, seed: int) -> dict[float, float]:
    """Stable-Baselines3's training."""
    model = build(config, seed)
    clock = Clock()
    model.learn(config.steps, callback=Look(clock))
    return clock.reached


def main() -> None:
    """Measure and report."""
    options = parser(__doc__)
    options.add_argument("--algorithms", nargs="*", default=["ppo"], choices=list(STEPS))
    options.add_argument("--seeds", type=int, default=5)
    options.add_argument("--without-sb3", action="store_true", help="only ours")
    arguments = options.parse_args()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    figures: dict[str, Any] = {"seeds": arguments.seeds}
    for algorithm in arguments.algorithms:
        config = configuration(algorithm)
        for who, run in (("ours", ours), ("sb3", theirs)):
            if who == "sb3" and arguments.without_sb3:
                continue
            runs = [run(config, seed) for seed in range(arguments.seeds)]
            for level in LEVELS:
                median = statistics.median(reached[level] for reached in runs)
                name = f"{algorithm}_{who}_seconds_to_{round(100 * level)}"
                figures[name] = round(median, 1) if math.isfinite(median) else None
            print(algorithm, who, runs)
    targets = {"ppo_ours_seconds_to_99": PPO_TARGET_SECONDS} if "ppo" in arguments.algorithms else {}
    finish("time_to_success", figures, at_most=targets, check=arguments.check)


if __name__ == "__main__":
    main()
