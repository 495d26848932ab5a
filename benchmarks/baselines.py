"""The controllers that need no training, on every suite: the rows of docs/suites.md.

python -m benchmarks.baselines --check

Targets: what can be reached without training stays within reach.
"""

from collections.abc import Callable

import numpy as np

from benchmarks.report import finish, parser
from sim.baselines import go_to_goal, random_policy
from sim.config import TaskConfig
from sim.dwa import dynamic_window
from sim.suites import EpisodeTable, Suite, load_suite, run_controller, run_suite, suite_names

TASK = TaskConfig()
BASELINES: dict[str, Callable[[Suite], EpisodeTable]] = {
    "random": lambda suite: run_suite(random_policy(), TASK, suite),
    "go-to-goal": lambda suite: run_suite(go_to_goal(TASK), TASK, suite),
    "dynamic window": lambda suite: run_controller(dynamic_window(TASK), TASK, suite),
}
# Least success in percent.
TARGETS = {
    "simple-200, go-to-goal": 99.0,
    "simple-200, dynamic window": 99.0,
    "complex-200, dynamic window": 99.0,
    "clutter-500, dynamic window": 99.0,
}


def spl(table: EpisodeTable) -> float:
    """Success weighted by path length (Anderson et al. 2018), 0 to 1, for paths up to the target's arrival circle."""
    shortest = np.maximum(table.shortest_paths - TASK.arrival_distance, 0.0)
    return float(np.mean((table.outcomes == 1) * shortest / np.maximum(np.maximum(table.path_lengths, shortest), 1e-9)))


def main() -> None:
    """Run every baseline on every suite and print a table in Markdown."""
    options = parser(__doc__).parse_args()
    figures: dict[str, object] = {}
    print(
        "| suite | baseline | success % | collision % | time-out % | SPL | steps per arrival |\n"
        "|---|---|---|---|---|---|---|"
    )
    for name in suite_names():
        suite = load_suite(name)
        for baseline, run in BASELINES.items():
            table = run(suite)
            success, collision, timeout = (100.0 * float(np.mean(table.outcomes == outcome)) for outcome in (1, 2, 3))
            steps = f"{table.steps[table.outcomes == 1].mean():.0f}" if success else "-"
            print(f"| {name} | {baseline} | {success:.1f} | {collision:.1f} | {timeout:.1f} | {spl(table):.2f} | {steps} |")
            figures[f"{name}, {baseline}"] = round(success, 1)
    finish("baselines", figures, at_least=TARGETS, check=options.check)


if __name__ == "__main__":
    main()
