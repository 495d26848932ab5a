"""Success and CPU-seconds of a training for each drive on the simple arena, with the default algorithm.

Each robot trains with PPO's defaults on one thread, a car for more steps than the default, with five seeds. Then the
deterministic policy drives 1,000 episodes that no training sees, once; measuring, and compiling before the first training,
do not count.

    python -m benchmarks.drives [--check] [--drives reverse omnidirectional ackermann] [--seeds 5] [--first-seed 0]

A line of JSON follows each training, so that an interrupted run keeps what it has.
Target: 99 % within 60 CPU-seconds, with each of the seeds.
"""

import json
import tempfile
import time
from pathlib import Path
from typing import Any

import torch

from benchmarks.attempts import first_attempts
from benchmarks.report import finish, parser
from benchmarks.training_rates import NEVER, Silent
from sim.config import (
    AckermannDrive,
    BurgerConfig,
    DifferentialDrive,
    OmnidirectionalDrive,
    RectangularConfig,
    RoundConfig,
    TaskConfig,
)
from workers.config import EvaluationConfig, TrainingConfig
from workers.live.viewing import Unwatched
from workers.policy import torch_policy
from workers.training.trainer import REPORT_INTERVAL, Training

# Bodies and speeds like the default robot's, so that the drive is what differs.
TASKS: dict[str, TaskConfig] = {
    "forward": TaskConfig(),
    "reverse": TaskConfig(robot=BurgerConfig(drive=DifferentialDrive(reverse=0.5))),
    "omnidirectional": TaskConfig(
        robot=RoundConfig(radius=0.105, max_linear_speed=0.25, max_angular_speed=1.0, drive=OmnidirectionalDrive())
    ),
    "ackermann": TaskConfig(
        robot=RectangularConfig(
            length=0.26, width=0.18, max_linear_speed=0.25, max_angular_speed=1.0, drive=AckermannDrive()
        )
    ),
}
# The default; a car needs more, as seeds and episodes showed that are in no row.
STEPS = {"forward": 300_000, "reverse": 300_000, "omnidirectional": 300_000, "ackermann": 1_000_000}
EPISODES_SEED = 5151
TARGET_SUCCESS = 0.99
TARGET_SECONDS = 60.0


def configuration(drive: str) -> TrainingConfig:
    """The training of one of the robots."""
    return TrainingConfig(task=TASKS[drive], steps=STEPS[drive], evaluation=EvaluationConfig(every_steps=NEVER))


def train(config: TrainingConfig, seed: int) -> tuple[float, float]:
    """Success over 1,000 unseen episodes, and CPU-seconds of the training."""
    with tempfile.TemporaryDirectory() as directory:
        training = Training(config, seed, Silent(), Path(directory), Unwatched(), REPORT_INTERVAL)
        started = time.process_time()
        while training.updates < training.total_updates:
            training.collect()
            training.update()
        seconds = time.process_time() - started
        return first_attempts(training.policy(torch_policy), config.task, EPISODES_SEED).success, seconds


def main() -> None:
    """Measure and report."""
    options = parser(__doc__)
    options.add_argument("--drives", nargs="*", default=list(TASKS), choices=list(TASKS))
    options.add_argument("--seeds", type=int, default=5)
    options.add_argument("--first-seed", type=int, default=0)
    arguments = options.parse_args()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    train(configuration("forward").model_copy(update={"steps": 10_000}), 0)  # compiles
    figures: dict[str, Any] = {"seeds": arguments.seeds, **{f"{drive}_steps": STEPS[drive] for drive in arguments.drives}}
    for drive in arguments.drives:
        results = []
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
            success, seconds = train(configuration(drive), seed)
            results.append((success, seconds))
            print(
                json.dumps({"drive": drive, "seed": seed, "success": success, "cpu_seconds": round(seconds, 1)}), flush=True
            )
        figures[f"{drive}_worst_success"] = min(success for success, _ in results)
        figures[f"{drive}_slowest_seconds"] = round(max(seconds for _, seconds in results), 1)
    finish(
        "drives",
        figures,
        at_least={f"{drive}_worst_success": TARGET_SUCCESS for drive in arguments.drives},
        at_most={f"{drive}_slowest_seconds": TARGET_SECONDS for drive in arguments.drives},
        check=arguments.check,
    )


if __name__ == "__main__":
    main()
