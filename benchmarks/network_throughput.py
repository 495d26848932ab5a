"""Environment steps per CPU-second of PPO's training loop by network, on one thread, interleaved.

    python -m benchmarks.network_throughput [--check]

Target: 20,000 a second for the networks that go by autograd. CPU-seconds rather than seconds, so that other work on the
machine does not count; what it takes of the caches does.
"""

import statistics
import tempfile
from pathlib import Path

import torch

from benchmarks.report import finish, parser
from benchmarks.training_rates import NEVER, Silent, ours
from workers.config import ConvNetwork, EvaluationConfig, GruNetwork, MlpNetwork, NetworkConfig, PpoConfig, TrainingConfig
from workers.live.viewing import Unwatched
from workers.training.trainer import REPORT_INTERVAL, Training

CASES: dict[str, NetworkConfig] = {"mlp": MlpNetwork(), "conv": ConvNetwork(), "gru": GruNetwork()}
TARGETS = {"conv_steps_per_second": 20_000.0, "gru_steps_per_second": 20_000.0}
SEGMENT_STEPS = 24_576


def main() -> None:
    """Measure every network and report."""
    options = parser(__doc__)
    options.add_argument("--segments", type=int, default=3, help="measurements of each; the median counts")
    arguments = options.parse_args()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    with tempfile.TemporaryDirectory() as directory:
        trainings = {}
        for name, network in CASES.items():
            algorithm = PpoConfig(network=network)
            config = TrainingConfig(
                algorithm=algorithm, steps=NEVER, evaluation=EvaluationConfig(every_steps=NEVER), threads="1"
            )
            trainings[name] = Training(config, 0, Silent(), Path(directory), Unwatched(), REPORT_INTERVAL)
        # The first segment warms caches, allocators and optimisers up.
        segments = [
            {name: ours(training, SEGMENT_STEPS) for name, training in trainings.items()}
            for _ in range(arguments.segments + 1)
        ][1:]
    print(segments)
    figures = {f"{name}_steps_per_second": round(statistics.median(each[name] for each in segments)) for name in CASES}
    finish("network_throughput", figures, at_least=TARGETS, check=arguments.check)


if __name__ == "__main__":
    main()
