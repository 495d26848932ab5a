"""The controllers that need no training, on every suite: the rows of docs/suites.md.

python -m benchmarks.baselines --check
python -m benchmarks.baselines crowd-200

Targets: what can be reached without training stays within reach.
"""

from benchmarks.report import finish, parser
from sim.config import TaskConfig
from sim.suites import load_suite, suite_names
from sim.suites.scores import barn_score
from workers.shipped.build import CONTROLLERS
from workers.shipped.figures import figures as figures_of
from workers.training.evaluation import to_result

# Least success in percent.
TARGETS = {
    "simple-200, go-to-goal": 99.0,
    "simple-200, dynamic window": 99.0,
    "complex-200, dynamic window": 99.0,
    "clutter-500, dynamic window": 99.0,
}


def main() -> None:
    """Run every baseline on the suites and print a table in Markdown."""
    arguments = parser(__doc__)
    arguments.add_argument("suites", nargs="*", default=suite_names(), help="all of them if none is named")
    options = arguments.parse_args()
    figures: dict[str, object] = {}
    print(
        "| suite | baseline | success % | collision % | time-out % | SPL | steps per arrival |\n"
        "|---|---|---|---|---|---|---|"
    )
    for name in options.suites:
        suite = load_suite(name)
        for baseline, drive in CONTROLLERS.items():
            table = drive(suite)
            found = figures_of(to_result(table, suite).episodes, TaskConfig().arrival_distance)
            success, collision, timeout = (100.0 * rate for rate in (found.success, found.collision, found.timeout))
            steps = "-" if found.steps is None else f"{found.steps:.0f}"
            print(f"| {name} | {baseline} | {success:.1f} | {collision:.1f} | {timeout:.1f} | {found.spl:.2f} | {steps} |")
            figures[f"{name}, {baseline}"] = round(success, 1)
            if name.startswith("barn-"):
                figures[f"{name}, {baseline}, BARN score"] = round(float(barn_score(table, TaskConfig()).mean()), 3)
    targets = {name: target for name, target in TARGETS.items() if name in figures}
    finish("baselines", figures, at_least=targets, check=options.check)


if __name__ == "__main__":
    main()
