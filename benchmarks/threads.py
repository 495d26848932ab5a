"""Environment steps per second of one training on one thread and on two, interleaved in one run.

    python -m benchmarks.threads --check

Seconds of the clock, so the machine has to be idle. The results are the same bit for bit
(`tests/workers/test_threads.py`). What two threads can give at most is printed beside: the update is what they share, so
1 / (1 - u / 2) with its share u of the time on one thread.
"""

import statistics
import tempfile
import time
from pathlib import Path

import torch

from benchmarks.report import finish, parser
from benchmarks.training_rates import NEVER, Silent
from workers.config import EvaluationConfig, MlpNetwork, Network, PpoConfig, ResBlockNetwork, TrainingConfig
from workers.live.viewing import Unwatched
from workers.training.threads import ThreadCount
from workers.training.trainer import REPORT_INTERVAL, Training

CASES: dict[str, Network] = {"ppo_mlp_128": MlpNetwork(hidden_sizes=(128, 128)), "ppo_resblock": ResBlockNetwork()}
TARGET = 1.6
_UPDATES = 6


def rate(training: Training) -> tuple[float, float]:
    """Steps per second over some updates, and the update's share of the time."""
    started, first, learning = time.perf_counter(), training.step, 0.0
    for _ in range(_UPDATES):
        training.collect()
        collected = time.perf_counter()
        training.update()
        learning += time.perf_counter() - collected
    seconds = time.perf_counter() - started
    return (training.step - first) / seconds, learning / seconds


def main() -> None:
    """Measure both cases and report."""
    options = parser(__doc__)
    options.add_argument("--segments", type=int, default=8, help="measurements of each; the median counts")
    arguments = options.parse_args()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    figures: dict[str, float] = {}
    for case, network in CASES.items():
        algorithm = PpoConfig(network=network)
        config = TrainingConfig(algorithm=algorithm, steps=NEVER, evaluation=EvaluationConfig(every_steps=NEVER))
        with tempfile.TemporaryDirectory() as directory:
            training = Training(config, 0, Silent(), Path(directory), Unwatched(), REPORT_INTERVAL)
            rates: dict[str, list[tuple[float, float]]] = {"1": [], "2": []}
            for _ in range(arguments.segments + 1):
                for threads, found in rates.items():
                    training.threads = ThreadCount("2" if threads == "2" else "1")
                    found.append(rate(training))
        # The first of each warms caches and allocators up.
        one, two = (statistics.median(each for each, _ in found[1:]) for found in rates.values())
        learning = statistics.median(share for _, share in rates["1"][1:])
        figures[f"{case}_steps_per_second"] = round(one)
        figures[f"{case}_steps_per_second_on_two"] = round(two)
        figures[f"{case}_ratio"] = round(two / one, 2)
        figures[f"{case}_at_most"] = round(1.0 / (1.0 - learning / 2.0), 2)
    finish("threads", figures, at_least={f"{case}_ratio": TARGET for case in CASES}, check=arguments.check)


if __name__ == "__main__":
    main()
