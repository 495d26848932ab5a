"""Environment steps per CPU-second of training, ours and Stable-Baselines3's, interleaved in one run.

Both train on the same environment with the same networks, batch sizes, number of gradient steps and one thread:

    python -m pip install stable-baselines3
    python -m benchmarks.training_throughput [--check] [--ppo '{"robots": 128, "minibatch_size": 512}']

Targets: PPO at least 2 times Stable-Baselines3, DDPG at least 1.5 times. CPU-seconds rather than seconds, so that other
work on the machine does not count.
"""

import json
import statistics
import tempfile
import time
from pathlib import Path

import torch
from stable_baselines3.common.base_class import BaseAlgorithm

from benchmarks.report import finish, parser
from benchmarks.stable_baselines import build
from benchmarks.training_rates import NEVER, Silent, ours
from workers.config import DdpgConfig, EvaluationConfig, MlpNetwork, PpoConfig, ResBlockNetwork, TrainingConfig
from workers.live.viewing import Unwatched
from workers.training.trainer import REPORT_INTERVAL, Training

CASES: dict[str, PpoConfig | DdpgConfig] = {
    "ppo_mlp_64": PpoConfig(network=MlpNetwork(hidden_sizes=(64, 64))),
    "ppo_mlp_128": PpoConfig(network=MlpNetwork(hidden_sizes=(128, 128))),
    "ppo_resblock": PpoConfig(network=ResBlockNetwork()),
    "ddpg_mlp_128": DdpgConfig(warmup_steps=0),
}
TARGETS = {
    "ppo_mlp_64_ratio": 2.0,
    "ppo_mlp_128_ratio": 2.0,
    "ppo_resblock_ratio": 2.0,
    "ddpg_mlp_128_ratio": 1.5,
}

# Enough updates for a steady figure, few enough that both meet the same state of the machine.
SEGMENT_STEPS = {"ppo": 40_960, "ddpg": 6_400}


def theirs(model: BaseAlgorithm, steps: int) -> float:
    """The same for Stable-Baselines3."""
    started, first = time.process_time(), model.num_timesteps
    model.learn(steps, reset_num_timesteps=False)
    return (model.num_timesteps - first) / (time.process_time() - started)


def main() -> None:
    """Measure every case and report."""
    options = parser(__doc__)
    options.add_argument("--segments", type=int, default=4, help="measurements of each; the median counts")
    options.add_argument("--cases", nargs="*", default=list(CASES), choices=list(CASES))
    options.add_argument("--ppo", type=json.loads, default={}, help="what PPO's cases shall differ in, as JSON")
    arguments = options.parse_args()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    figures: dict[str, float] = {}
    for case in arguments.cases:
        algorithm = CASES[case]
        if isinstance(algorithm, PpoConfig):
            algorithm = PpoConfig.model_validate(algorithm.model_dump() | arguments.ppo)
        config = TrainingConfig(
            algorithm=algorithm, steps=NEVER, evaluation=EvaluationConfig(every_steps=NEVER), threads="1"
        )
        steps = SEGMENT_STEPS[algorithm.name]
        with tempfile.TemporaryDirectory() as directory:
            training = Training(config, 0, Silent(), Path(directory), Unwatched(), REPORT_INTERVAL)
            model = build(config, 0)
            # The first segment warms caches, allocators and optimisers up.
            rates = [(ours(training, steps), theirs(model, steps)) for _ in range(arguments.segments + 1)][1:]
        figures[f"{case}_steps_per_second"] = round(statistics.median(mine for mine, _ in rates))
        figures[f"{case}_sb3_steps_per_second"] = round(statistics.median(other for _, other in rates))
        figures[f"{case}_ratio"] = round(statistics.median(mine / other for mine, other in rates), 2)
        print(case, rates)
    targets = {name: value for name, value in TARGETS.items() if name in figures}
    finish("training_throughput", figures, at_least=targets, check=arguments.check)


if __name__ == "__main__":
    main()
