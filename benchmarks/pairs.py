"""Own rates of this checkout against another's, in interleaved pairs: what a change costs, noise and all.

git worktree add ../before a4df879
python -m benchmarks.pairs ../before --check

Each pair is a new process of each checkout. They measure in turns, a slice of half a second to a second each, the order
turned round every time, so that both meet the same state of the machine; the mean of the slices' log ratios is the pair's.
What is measured is each checkout's own code in `benchmarks.sim_throughput`, `training_throughput` and `time_to_success`,
with the defaults: environment steps per CPU-second. The other checkout runs with this one's packages, so pick one whose
requirements they meet. The interval is Student's t over the pairs' log ratios.
"""

import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from benchmarks.report import finish, parser

HERE = Path(__file__).parents[1]
TARGET = 0.95
_SIM_SECONDS = 0.5
_ROBOTS = (256, 4096)
_CASES = ("ppo_mlp_64", "ppo_resblock", "ddpg_mlp_128")
_SUCCESS_STEPS = 60_000
_SLICES = 4
_MEASURE = "measure"

Slice = Callable[[], float]
"""Measures for a while: environment steps per CPU-second."""


def slices(folder: Path) -> dict[str, Slice]:
    """What there is to measure, of the checkout that is first on the path; everything has run once."""
    import torch

    from benchmarks import sim_throughput, time_to_success, training_throughput
    from workers.config import EvaluationConfig, TrainingConfig

    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    # Names that both checkouts have in these modules.
    names = ("Training", "Unwatched", "Silent", "ours", "NEVER", "REPORT_INTERVAL")
    training_of, unwatched, silent, rate, never, interval = (getattr(training_throughput, name) for name in names)
    one_thread: dict[str, Any] = {"threads": "1"} if "threads" in TrainingConfig.model_fields else {}
    found: dict[str, Slice] = {}

    def stepping(robots: int) -> Slice:
        step, _ = sim_throughput.ours(robots)
        for _ in range(20):
            step()
        return lambda: robots * _calls_per_second(step)

    def training(case: str) -> Slice:
        algorithm = training_throughput.CASES[case]
        config = TrainingConfig(
            algorithm=algorithm, steps=never, evaluation=EvaluationConfig(every_steps=never), **one_thread
        )
        trained = training_of(config, 0, silent(), folder / case, unwatched(), interval)
        steps = training_throughput.SEGMENT_STEPS[algorithm.name]
        rate(trained, steps)
        return lambda: float(rate(trained, steps))

    def succeeding() -> Slice:
        config = time_to_success.configuration("ppo").model_copy(update=one_thread)
        trained = training_of(config, 0, silent(), folder / "success", unwatched(), interval)

        def measure() -> float:
            first, started = trained.step, time.process_time()
            while trained.step < first + _SUCCESS_STEPS / _SLICES:
                trained.collect()
                trained.update()
            return float((trained.step - first) / (time.process_time() - started))

        return measure

    for robots in _ROBOTS:
        found[f"sim_throughput, {robots} robots"] = stepping(robots)
    for case in _CASES:
        found[f"training_throughput, {case}"] = training(case)
    return found | {"time_to_success, ppo": succeeding()}


def measure_on_demand() -> None:
    """Answers each name that comes in with its rate, a line each; what there is to measure comes first."""
    with tempfile.TemporaryDirectory() as folder:
        found = slices(Path(folder))
        print(json.dumps(list(found)), flush=True)
        for line in sys.stdin:
            print(json.dumps(found[line.strip()]()), flush=True)


def _calls_per_second(step: Callable[[], None]) -> float:
    calls, started = 0, time.process_time()
    while (spent := time.process_time() - started) < _SIM_SECONDS:
        step()
        calls += 1
    return calls / spent


class Measuring:
    """A process that measures a checkout when it is asked to."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        assert process.stdin is not None
        assert process.stdout is not None
        self._asked, self._told = process.stdin, process.stdout
        self.names: list[str] = self._answer()

    def rate(self, name: str) -> float:
        """Environment steps per CPU-second over a slice."""
        print(name, file=self._asked, flush=True)
        return float(self._answer())

    def _answer(self) -> Any:
        # Whatever else a checkout prints comes before.
        for line in self._told:
            if line.startswith("[") or line[:1].isdigit():
                return json.loads(line)
        raise SystemExit("A checkout's process ended; what it said stands above.")


@contextmanager
def measuring(checkout: Path) -> Iterator[Measuring]:
    """A new process in a checkout."""
    environment = {**os.environ, "PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    # This file, with the other checkout's modules: what it imports at its top both have.
    command = [sys.executable, "-c", f"import runpy; runpy.run_path({__file__!r}, run_name={_MEASURE!r})"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=checkout, env=environment, stdin=pipe, stdout=pipe, text=True) as process:
        yield Measuring(process)
        assert process.stdin is not None
        process.stdin.close()


def pair(before: Path) -> dict[str, float]:
    """The mean log ratio, this checkout's rate to the other's, of everything."""
    with ExitStack() as stack:
        others, ours = (stack.enter_context(measuring(checkout)) for checkout in (before, HERE))
        logarithms: dict[str, list[float]] = {name: [] for name in ours.names}
        for turn in range(_SLICES):
            for name, ratios in logarithms.items():
                order = (others, ours) if turn % 2 else (ours, others)
                rates = {checkout: checkout.rate(name) for checkout in order}
                ratios.append(math.log(rates[ours] / rates[others]))
    return {name: statistics.mean(ratios) for name, ratios in logarithms.items()}


def main() -> None:
    """Measure the pairs and print each ratio with its interval."""
    arguments = parser(__doc__)
    arguments.add_argument("before", type=Path, help="the other checkout")
    arguments.add_argument("--pairs", type=int, default=10)
    options = arguments.parse_args()
    before = options.before.resolve()
    # Compiles what is not compiled yet.
    for checkout in (before, HERE):
        with measuring(checkout):
            pass
    logarithms: dict[str, list[float]] = {}
    for number in range(1, options.pairs + 1):
        for name, ratio in pair(before).items():
            logarithms.setdefault(name, []).append(ratio)
        print(number, {name: round(math.exp(ratios[-1]), 3) for name, ratios in logarithms.items()}, flush=True)
    figures: dict[str, object] = {"pairs": options.pairs}
    from workers.statistics.seeds import mean_interval  # which not every checkout has

    for name, ratios in logarithms.items():
        interval = mean_interval(ratios)
        figures[name] = round(math.exp(statistics.mean(ratios)), 3)
        figures[f"{name}, low"] = round(math.exp(interval.low), 3)
        figures[f"{name}, high"] = round(math.exp(interval.high), 3)
    targets = {f"{name}, low": TARGET for name in logarithms}
    finish("pairs", figures, at_least=targets, check=options.check)


if __name__ == _MEASURE:
    measure_on_demand()
elif __name__ == "__main__":
    main()
