"""Environment steps per second of one training on a CPU and on a CUDA device, by turns in one run.

    python -m benchmarks.devices [--cases ppo_mlp_64 rooms ...] [--segments 3]

On a CPU once on one thread and once on two. Seconds of the clock, so the machine has to be idle. Beside each rate stands the
share of the time that is spent in updates: what is left are simulation, observation and the policy's actions, of which only
the last go to the device. Cases with many robots are those of the same name: a device pays where one call does more.
"""

import json
import statistics
import tempfile
import time
from pathlib import Path

import torch

from benchmarks.report import finish, parser
from benchmarks.training_rates import NEVER, Silent
from workers.config import (
    Algorithm,
    ConvNetwork,
    DdpgConfig,
    EvaluationConfig,
    GruNetwork,
    MlpNetwork,
    PpoConfig,
    ResBlockNetwork,
    SacConfig,
    Threads,
    TrainingConfig,
)
from workers.live.viewing import Unwatched
from workers.shipped.recipes import recipe
from workers.training.threads import ThreadCount
from workers.training.trainer import REPORT_INTERVAL, Training

_MANY = {"robots": 512, "rollout_steps": 64, "minibatch_size": 4096}


def _case(algorithm: Algorithm) -> TrainingConfig:
    return TrainingConfig(algorithm=algorithm)


CASES: dict[str, TrainingConfig] = {
    "ppo_mlp_64": _case(PpoConfig()),
    "ppo_mlp_128": _case(PpoConfig(network=MlpNetwork(hidden_sizes=(128, 128)))),
    "ppo_resblock": _case(PpoConfig(network=ResBlockNetwork())),
    "ppo_conv": _case(PpoConfig(network=ConvNetwork())),
    "ppo_gru": _case(PpoConfig(network=GruNetwork())),
    "ddpg_mlp_128": _case(DdpgConfig(network=MlpNetwork(hidden_sizes=(128, 128)), warmup_steps=0)),
    "sac_mlp_128": _case(SacConfig(network=MlpNetwork(hidden_sizes=(128, 128)), warmup_steps=0)),
    "ppo_mlp_128_many": _case(PpoConfig(network=MlpNetwork(hidden_sizes=(128, 128)), **_MANY)),
    "ppo_mlp_1024_many": _case(PpoConfig(network=MlpNetwork(hidden_sizes=(1024, 1024)), **_MANY)),
    "ppo_resblock_many": _case(PpoConfig(network=ResBlockNetwork(), **_MANY)),
    "ppo_conv_many": _case(PpoConfig(network=ConvNetwork(channels=(32, 64)), **_MANY)),
    "ppo_gru_many": _case(PpoConfig(network=GruNetwork(units=128), **_MANY)),
    "rooms": recipe("rooms").training,
}
"""The form's defaults, then with 512 robots, and what *Through rooms and mazes* is trained from."""


def rate(training: Training, seconds: float) -> tuple[float, float]:
    """Steps per second over whole updates until so many seconds are over, and the updates' share of the time."""
    started, first, learning = time.perf_counter(), training.step, 0.0
    while time.perf_counter() - started < seconds:
        training.collect()
        collected = time.perf_counter()
        training.update()
        learning += time.perf_counter() - collected
    spent = time.perf_counter() - started
    return (training.step - first) / spent, learning / spent


def training_on(device: str, case: str, directory: Path) -> Training:
    """A new training of a case that never ends."""
    changed = {"device": device, "threads": "1", "steps": NEVER, "evaluation": EvaluationConfig(every_steps=NEVER)}
    return Training(CASES[case].model_copy(update=changed), 0, Silent(), directory, Unwatched(), REPORT_INTERVAL)


def measure(case: str, segments: int, seconds: float) -> dict[str, float]:
    """The medians of a case's rates, by device, and the update's shares."""
    ways: dict[str, tuple[str, Threads]] = {"cpu": ("cpu", "1"), "cpu_two_threads": ("cpu", "2")}
    if torch.cuda.is_available():
        ways["cuda"] = ("cuda", "1")
    with tempfile.TemporaryDirectory() as directory:
        trainings = {
            device: training_on(device, case, Path(directory)) for device in {device for device, _ in ways.values()}
        }
        found: dict[str, list[tuple[float, float]]] = {way: [] for way in ways}
        # The first of each warms caches and allocators up, and compiles.
        for _ in range(segments + 1):
            for way, (device, threads) in ways.items():
                trainings[device].threads = ThreadCount(threads, cores=2)
                found[way].append(rate(trainings[device], seconds))
    figures: dict[str, float] = {}
    for way, rates in found.items():
        figures[f"{case}_{way}"] = round(statistics.median(each for each, _ in rates[1:]))
        figures[f"{case}_{way}_update_share"] = round(statistics.median(share for _, share in rates[1:]), 2)
    return figures


def main() -> None:
    """Measure the cases and report."""
    options = parser(__doc__)
    options.add_argument("--segments", type=int, default=3, help="measurements of each; the median counts")
    options.add_argument("--seconds", type=float, default=1.0, help="of a measurement, at least")
    options.add_argument("--cases", nargs="*", default=list(CASES), choices=list(CASES))
    arguments = options.parse_args()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    figures: dict[str, float] = {}
    for case in arguments.cases:
        found = measure(case, arguments.segments, arguments.seconds)
        print(json.dumps(found), flush=True)
        figures |= found
    device = torch.cuda.get_device_name() if torch.cuda.is_available() else "none"
    finish("devices", {"device": device, **figures}, check=arguments.check)


if __name__ == "__main__":
    main()
