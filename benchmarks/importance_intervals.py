"""How often the intervals of a study's importances hold what twenty thousand trials say.

python -m benchmarks.importance_intervals
"""

import argparse
import time

import numpy as np

from server.studies.importance_intervals import intervals, shares
from server.studies.space import ListedSetting, RangedSetting, Space, Values
from workers.config import TrainingConfig

_RATE = RangedSetting(kind="range", path="algorithm.learning_rate", low=1e-4, high=1e-2, log=True)
_DISCOUNT = RangedSetting(kind="range", path="algorithm.gamma", low=0.9, high=0.999)
_SCHEDULE = ListedSetting(kind="list", path="algorithm.learning_rate_schedule", values=["linear", "constant"])
_TRUTH = 20_000
_NOISE = 0.02


def drawn(chance: np.random.Generator, trials: int) -> tuple[list[Values], list[float]]:
    """Random trials and their success: the step size matters most, then the discount, the schedule next to nothing."""
    values: list[Values] = []
    scores: list[float] = []
    for _ in range(trials):
        power, discount, linear = chance.uniform(-4.0, -2.0), chance.uniform(0.9, 0.999), chance.random() < 0.5
        values.append(
            {
                _RATE.path: float(10**power),
                _DISCOUNT.path: float(discount),
                _SCHEDULE.path: "linear" if linear else "constant",
            }
        )
        merit = 3.0 - 3.0 * (power + 3.0) ** 2 - 900.0 * (discount - 0.97) ** 2 - 0.2 * linear
        scores.append(float(1.0 / (1.0 + np.exp(-merit)) + chance.normal(0.0, _NOISE)))
    return values, scores


def main() -> None:
    """Prints a line for each number of trials."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, nargs="+", default=[20, 30, 60, 100, 300])
    parser.add_argument("--repetitions", type=int, default=100)
    wanted = parser.parse_args()
    space = Space(TrainingConfig().model_dump(mode="json"), (_RATE, _DISCOUNT, _SCHEDULE))
    chance = np.random.default_rng(0)
    truth = shares(space, *drawn(chance, _TRUTH))
    print({path: round(share, 3) for path, share in truth.items()})
    for trials in wanted.trials:
        began = time.perf_counter()
        found = [intervals(space, *drawn(chance, trials)) for _ in range(wanted.repetitions)]
        seconds = (time.perf_counter() - began) / wanted.repetitions
        for path, share in truth.items():
            held = sum(one[path][0] <= share <= one[path][1] for one in found) / len(found)
            width = sum(one[path][1] - one[path][0] for one in found) / len(found)
            print(f"{trials} trials, {path}: held {held:.0%}, {100 * width:.0f} points wide, {seconds:.2f} s")


if __name__ == "__main__":
    main()
