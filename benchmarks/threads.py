"""Environment steps per second of one training on one thread and on two, interleaved in one run.

    python -m benchmarks.threads --check

Seconds of the clock, so the machine has to be idle. The results are the same bit for bit
(`tests/workers/test_threads.py`). Beside it stand two bounds. Where the update is all that is shared, two threads can give
1 / (1 - u / 2) at most, with its share u of the time on one thread; *Through rooms and mazes*, whose robots see what takes
long, shares them, too. And what the machine's two cores give at all: twice the rate on one thread while another process
trains the same on the other core, over the rate alone.
"""

import multiprocessing
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.synchronize import Event
from pathlib import Path

import torch

from benchmarks.report import finish, parser
from benchmarks.training_rates import NEVER, Silent
from workers.config import EvaluationConfig, MlpNetwork, PpoConfig, ResBlockNetwork, TrainingConfig
from workers.live.viewing import Unwatched
from workers.shipped.recipes import recipe
from workers.training.threads import ThreadCount
from workers.training.trainer import REPORT_INTERVAL, Training

CASES = {
    "ppo_mlp_128": TrainingConfig(algorithm=PpoConfig(network=MlpNetwork(hidden_sizes=(128, 128)))),
    "ppo_resblock": TrainingConfig(algorithm=PpoConfig(network=ResBlockNetwork())),
    "through_rooms_and_mazes": recipe("rooms").training,
}
TARGETS = {"ppo_mlp_128": 1.6, "ppo_resblock": 1.6}
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


def training_of(case: str, directory: Path) -> Training:
    """A new training of a case that never ends."""
    endless = {"steps": NEVER, "evaluation": EvaluationConfig(every_steps=NEVER), "threads": "1"}
    config = CASES[case].model_copy(update=endless)
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    return Training(config, 0, Silent(), directory, Unwatched(), REPORT_INTERVAL)


def train_while(case: str, wanted: Event, running: Event) -> None:
    """What the other process does: trains whenever it is `wanted`, and says when it does."""
    with tempfile.TemporaryDirectory() as directory:
        training = training_of(case, Path(directory))
        while wanted.wait():
            training.collect()
            training.update()
            running.set()


@contextmanager
def neighbour(case: str) -> Iterator[tuple[Event, Event]]:
    """Another process that trains the same when it is asked to."""
    context = multiprocessing.get_context("spawn")
    wanted, running = context.Event(), context.Event()
    process = context.Process(target=train_while, args=(case, wanted, running), daemon=True)
    process.start()
    try:
        yield wanted, running
    finally:
        process.kill()
        process.join()


def main() -> None:
    """Measure all cases and report."""
    options = parser(__doc__)
    options.add_argument("--segments", type=int, default=8, help="measurements of each; the median counts")
    arguments = options.parse_args()
    figures: dict[str, float] = {}
    for case in CASES:
        with tempfile.TemporaryDirectory() as directory, neighbour(case) as (wanted, running):
            training = training_of(case, Path(directory))
            rates: dict[str, list[tuple[float, float]]] = {"one": [], "two": [], "beside another": []}
            for _ in range(arguments.segments + 1):
                for how, found in rates.items():
                    training.threads = ThreadCount("2" if how == "two" else "1")
                    training.env.threads = training.threads.now()
                    if how == "beside another":
                        running.clear()
                        wanted.set()
                        running.wait()
                    found.append(rate(training))
                    wanted.clear()
                # It ends the update that it is in.
                time.sleep(0.5)
        # The first of each warms caches and allocators up.
        one, two, beside = (statistics.median(each for each, _ in found[1:]) for found in rates.values())
        learning = statistics.median(share for _, share in rates["one"][1:])
        figures[f"{case}_steps_per_second"] = round(one)
        figures[f"{case}_steps_per_second_on_two"] = round(two)
        figures[f"{case}_ratio"] = round(two / one, 2)
        if case in TARGETS:
            figures[f"{case}_at_most"] = round(1.0 / (1.0 - learning / 2.0), 2)
        figures[f"{case}_two_trainings"] = round(2.0 * beside / one, 2)
    finish("threads", figures, at_least={f"{case}_ratio": target for case, target in TARGETS.items()}, check=arguments.check)


if __name__ == "__main__":
    main()
