"""Shipped policies against the dynamic window approach, scenario by scenario: the figures of docs/generalisation.md.

python -m benchmarks.generalisation
python -m benchmarks.generalisation --also seeds/1/thickets seeds/2/thickets

Every policy meets the same scenarios as the planner, which sees 360 degrees with 60 rays or, as the default task does, 180
degrees with 30. So the two are compared by the scenarios in which only one of them arrives: the exact McNemar test, and
Wald's 95 % interval of the difference in success. `crowd-200` is too small for what policies differ by among pedestrians:
`crowd-4000` holds scenarios of the same kind, each in a map of its own with pedestrians of its own, none of them in a
suite or a training.
"""

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.report import finish, parser
from sim.baselines.dwa import dynamic_window
from sim.config import GeneratedArenaConfig, LidarConfig, MoversConfig, ObservationConfig, TaskConfig
from sim.suites import Suite, load_suite, run_controller, run_suite, suite_for, suite_in, suite_places
from workers.checkpoints import read_policy
from workers.policy import torch_policy
from workers.shipped.library import FOLDER, ShippedPolicy

SUITES = ("clutter-500", "barn-20", "crowd-200")
THICKETS = TaskConfig(arena=GeneratedArenaConfig(name="thicket", difficulty=0.9, seed=0))
CROWD, FIRST_CROWD_MAP = 4000, 20_000  # scenarios, one a map; the first of these maps among those kept for suites
POLICIES = ("clutter", "thickets", "crowd")
PLANNERS = {
    "180 degrees": TaskConfig(),
    "360 degrees": TaskConfig(
        lidar=LidarConfig(rays=60, field_of_view=360.0), observation=ObservationConfig.preset("improved", batches=30)
    ),
}


def mcnemar(only_one: int, only_other: int) -> float:
    """Two-sided exact p: how likely a split at least as uneven would be if both were as good."""
    count, fewer = only_one + only_other, min(only_one, only_other)
    return min(1.0, sum(math.comb(count, k) for k in range(fewer + 1)) / 2.0 ** (count - 1))


def difference(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> str:
    """How much more often one succeeds than the other, in points, with its interval and p."""
    wins, losses, n = int((one & ~other).sum()), int((~one & other).sum()), len(one)
    mean = (wins - losses) / n
    reach = 1.96 * math.sqrt(wins + losses - (wins - losses) ** 2 / n) / n
    interval = f"{100 * mean:+.1f} [{100 * (mean - reach):+.1f}, {100 * (mean + reach):+.1f}]"
    return f"{interval}, {wins} : {losses}, p = {mcnemar(wins, losses):.2g}"


def large_crowd() -> Suite:
    """Scenarios as in `crowd-200`, twenty times as many, each in another map."""
    movers = MoversConfig(count=4, kind="pedestrian", speed=1.0)
    return suite_in(f"crowd-{CROWD}", suite_places("clutter", 0.3, CROWD, movers, first=FIRST_CROWD_MAP), CROWD)


def arrivals(policy: ShippedPolicy, suite: Suite) -> NDArray[np.bool_]:
    """Whether a policy arrived in each scenario: as recorded where it was measured on the suite, else driven now."""
    if suite.name in (result.suite for result in policy.card.results):
        return np.array([episode.outcome == "arrival" for episode in policy.evaluation(suite.name).episodes])
    _, numpy_policy = read_policy(policy.archive)
    table = run_suite(torch_policy(numpy_policy), policy.card.training.task, suite)
    return np.asarray(table.outcomes == 1)


def main() -> None:
    """Print a table in Markdown for each suite."""
    arguments = parser(__doc__)
    arguments.add_argument("--also", nargs="*", type=Path, default=[], help="folders of more policies")
    options = arguments.parse_args()
    policies = [(name, ShippedPolicy(FOLDER / name)) for name in POLICIES]
    policies += [
        (f"{path.name}, seed {policy.card.seed}", policy) for path in options.also for policy in [ShippedPolicy(path)]
    ]
    figures: dict[str, object] = {}
    for suite in (*map(load_suite, SUITES), suite_for(THICKETS), large_crowd()):
        name = suite.name
        planned = {view: run_controller(dynamic_window(task), task, suite).outcomes == 1 for view, task in PLANNERS.items()}
        solved = np.any(list(planned.values()), axis=0)
        heads = "".join(f" against it with {view} |" for view in PLANNERS)
        print(
            f"\n{name}: "
            + ", ".join(f"dynamic window, {view}, {100 * found.mean():.1f} %" for view, found in planned.items())
        )
        print(f"\n| policy | success % |{heads}\n|---|---|---|---|")
        for title, policy in policies:
            arrived = arrivals(policy, suite)
            solved |= arrived
            cells = "".join(f" {difference(arrived, found)} |" for found in planned.values())
            print(f"| {title} | {100 * arrived.mean():.1f} |{cells}", flush=True)
            figures[f"{name}, {title}"] = round(100.0 * float(arrived.mean()), 1)
        print(f"\n{int((~solved).sum())} of {len(solved)} are solved by nobody here.")
        figures[f"{name}, solved by nobody"] = int((~solved).sum())
    targets = {"clutter-500, clutter": 97.0, "clutter-500, thickets": 97.0}
    finish("generalisation", figures, at_least=targets, check=options.check)


if __name__ == "__main__":
    main()
