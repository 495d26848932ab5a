"""Own rates of this checkout against another's, in interleaved pairs: what a change costs, noise and all.

git worktree add ../before a4df879
python -m benchmarks.pairs ../before --check

Each pair measures both, one after the other, the order turned round every time, each in a process of its own. What is
measured is each checkout's own code in `benchmarks.sim_throughput`, `training_throughput` and `time_to_success`, with the
defaults: environment steps per CPU-second. The other checkout runs with this one's packages, so pick one whose
requirements they meet. The interval is Student's t over the logarithms of the pairs' ratios.
"""

import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.report import finish, parser

HERE = Path(__file__).parents[1]
TARGET = 0.95
_SIM_SECONDS = 1.5
_ROBOTS = (256, 4096)
_CASES = ("ppo_mlp_64", "ppo_resblock", "ddpg_mlp_128")
_SUCCESS_STEPS = 60_000
_MEASURE = "measure"


def measure() -> dict[str, float]:
    """Rates of the checkout that is first on the path, environment steps per CPU-second."""
    import torch

    from benchmarks import sim_throughput, time_to_success, training_throughput
    from workers.config import EvaluationConfig, TrainingConfig

    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    one_thread: dict[str, Any] = {"threads": "1"} if "threads" in TrainingConfig.model_fields else {}
    rates: dict[str, float] = {}
    for robots in _ROBOTS:
        step, _ = sim_throughput.ours(robots)
        rates[f"sim_throughput, {robots} robots"] = robots * _calls_per_second(step)
    # Names that both checkouts have in these modules.
    names = ("Training", "Unwatched", "Silent", "ours", "NEVER", "REPORT_INTERVAL")
    training_of, unwatched, silent, rate, never, interval = (getattr(training_throughput, name) for name in names)
    with tempfile.TemporaryDirectory() as folder:
        for case in _CASES:
            algorithm = training_throughput.CASES[case]
            evaluation = EvaluationConfig(every_steps=never)
            config = TrainingConfig(algorithm=algorithm, steps=never, evaluation=evaluation, **one_thread)
            training = training_of(config, 0, silent(), Path(folder) / case, unwatched(), interval)
            steps = training_throughput.SEGMENT_STEPS[algorithm.name]
            rate(training, steps)
            rates[f"training_throughput, {case}"] = rate(training, steps)
        config = time_to_success.configuration("ppo").model_copy(update=one_thread)
        training = training_of(config, 0, silent(), Path(folder) / "success", unwatched(), interval)
        started = time.process_time()
        while training.step < _SUCCESS_STEPS:
            training.collect()
            training.update()
        rates["time_to_success, ppo"] = training.step / (time.process_time() - started)
    return rates


def _calls_per_second(step: Callable[[], None]) -> float:
    for _ in range(20):
        step()
    calls, started = 0, time.process_time()
    while (spent := time.process_time() - started) < _SIM_SECONDS:
        step()
        calls += 1
    return calls / spent


def rates_of(checkout: Path) -> dict[str, float]:
    """What `measure` finds in a process of its own, in a checkout."""
    environment = {**os.environ, "PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    # This file, with the other checkout's modules: what it imports at its top both have.
    command = [sys.executable, "-c", f"import runpy; runpy.run_path({__file__!r}, run_name={_MEASURE!r})"]
    done = subprocess.run(command, cwd=checkout, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    rates: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return rates


def main() -> None:
    """Measure the pairs and print each ratio with its interval."""
    arguments = parser(__doc__)
    arguments.add_argument("before", type=Path, help="the other checkout")
    arguments.add_argument("--pairs", type=int, default=10)
    options = arguments.parse_args()
    before = options.before.resolve()
    # Compiles what is not compiled yet.
    for checkout in (before, HERE):
        rates_of(checkout)
    logarithms: dict[str, list[float]] = {}
    for pair in range(options.pairs):
        order = (before, HERE) if pair % 2 else (HERE, before)
        found = {checkout: rates_of(checkout) for checkout in order}
        for name, rate in found[HERE].items():
            logarithms.setdefault(name, []).append(math.log(rate / found[before][name]))
        print(pair + 1, {name: round(math.exp(ratios[-1]), 3) for name, ratios in logarithms.items()}, flush=True)
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
    print(json.dumps(measure()))
elif __name__ == "__main__":
    main()
