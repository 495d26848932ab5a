"""The matrices of docs/generalisation.md: baselines and shipped policies in families at difficulty 1, BARN, among people.

python -m benchmarks.field --check
python -m benchmarks.field --size 100 --only families --families maze rooms
python -m benchmarks.field --only people --baselines "dynamic window" MPPI

Every success stands with the exact 95 % interval over scenarios; a policy that ships is one training seed, so its interval
says nothing of other seeds. Each scenario of a family has a map of its own, of seeds that no training, no suite and no
choice of a recipe has met. Attempts there last 500 steps or four times as long as the shortest path takes at top speed,
whichever is more; those of the challenge 100 s, those among people 60 s.
"""

import dataclasses
import time
from collections.abc import Callable, Sequence
from typing import get_args

import numpy as np

from benchmarks.report import finish, parser
from sim.arrays import Floats
from sim.baselines.memory import mapping_planner
from sim.config import FamilyName, LidarConfig, ObservationConfig, TaskConfig
from sim.errors import SuiteError
from sim.suites import EpisodeTable, Situation, Suite, SuiteRules, load_suite, run_controller, suite_in, suite_places
from sim.suites.people import run_among_people
from sim.suites.scores import barn_score
from workers.checkpoints import read_policy
from workers.policy import torch_policy
from workers.shipped.build import CONTROLLERS, controller
from workers.shipped.library import ShippedPolicy, shipped_policies
from workers.statistics.seeds import success_rate

FAMILIES: tuple[FamilyName, ...] = tuple(name for name in get_args(FamilyName) if name != "mixed")
PEOPLE = ("people-500", "heedless-500")
BARN = "barn-jackal-120"
PARTS = ("families", "barn", "people")
FIRST_MAP = 100_000
"""First of the suites' maps that are drawn here."""

ROUND = TaskConfig(
    lidar=LidarConfig(rays=60, field_of_view=360.0), observation=ObservationConfig.preset("improved", batches=30)
)
"""What baselines are and see in families: the default robot, all round with 60 rays."""

# Successes in percent that any run must reach: what was measured, less what a small run may be off.
TARGETS = {
    "clutter, dynamic window": 85.0,
    "clutter, mapping, A* and dynamic window": 85.0,
    "maze, mapping, A* and dynamic window": 50.0,
}

Driver = tuple[str, TaskConfig | None, Callable[[TaskConfig], Callable[[Situation], Floats]]]
"""A name, the task that goes with it (None: what the suite's rules ask for), and the controller for a task."""


def family(name: FamilyName, size: int) -> Suite:
    """Scenarios of a family at difficulty 1, each in a map of its own."""
    places = suite_places(name, 1.0, size, first=FIRST_MAP)
    return suite_in(f"field-{name}-{size}", places, size, SuiteRules(patience=4.0))


def part_of(suite: Suite, size: int) -> Suite:
    """So many of a suite's scenarios, spread over all of it."""
    which = np.unique(np.linspace(0, len(suite) - 1, min(size, len(suite))).astype(int))
    names = ("arena_indices", "starts", "targets", "shortest_paths")
    return dataclasses.replace(suite, **{name: getattr(suite, name)[which] for name in names})


def shipped(policy: ShippedPolicy) -> Driver:
    """A shipped policy with its own task."""
    _, read = read_policy(policy.archive)
    act = torch_policy(read)
    return f"*{policy.card.title}*", policy.card.training.task, lambda _: lambda situation: act(situation.observations)


def baseline(name: str, task: TaskConfig | None) -> Driver:
    """A baseline."""
    return name, task, lambda own: controller(name, own)


def rate(successes: int, count: int) -> str:
    """Percent with the exact 95 % interval."""
    interval = success_rate([successes], [count])
    return f"{100 * successes / count:.1f} [{100 * interval.low:.1f}, {100 * interval.high:.1f}]"


def families(names: Sequence[FamilyName], drivers: Sequence[Driver], size: int, figures: dict[str, object]) -> None:
    """Success of every driver in every family, worst family first."""
    rows: list[tuple[float, str]] = []
    for name in names:
        suite, cells = family(name, size), []
        for title, task, make in drivers:
            own = task or ROUND
            arrived = int((run_controller(make(own), own, suite).outcomes == 1).sum())
            figures[f"{name}, {title}"] = round(100.0 * arrived / size, 1)
            cells.append(rate(arrived, size))
        rows.append((sum(float(cell.split()[0]) for cell in cells), f"| {name} | " + " | ".join(cells) + " |"))
    print(f"\nSuccess, %, of {size} scenarios of difficulty 1\n")
    print("| family | " + " | ".join(title for title, *_ in drivers) + " |\n|---" + "|---" * len(drivers) + "|")
    print("\n".join(row for _, row in sorted(rows)), flush=True)


def barn(drivers: Sequence[Driver], size: int, figures: dict[str, object]) -> None:
    """The challenge, with what a planner that knows the map makes of it first."""
    suite = part_of(load_suite(BARN), size)
    known = [suite.arenas[index] for index in suite.arena_indices]
    told: Driver = ("knows the map: A* and dynamic window", None, lambda task: mapping_planner(task, known))
    print(f"\n{BARN}, {len(suite)} worlds\n")
    print("| driver | score, of 0.5 | success, % | collisions, % | time, s |\n|---|---|---|---|---|")
    for title, task, make in (told, *drivers):
        own = task or suite.rules.task()
        try:
            table = run_controller(make(own), own, suite)
        except SuiteError:
            continue  # a policy of another robot
        score = float(barn_score(table, own).mean())
        figures[f"{BARN}, {title}"] = round(score, 4)
        taken = _mean(own.control_period * table.steps[table.outcomes == 1])
        hit = 100.0 * (table.outcomes == 2).mean()
        print(f"| {title} | {score:.3f} | {_success(table)} | {hit:.1f} | {taken} |", flush=True)


def people(drivers: Sequence[Driver], size: int, figures: dict[str, object]) -> None:
    """Among people who see, and among those who do not."""
    for name in PEOPLE:
        suite = part_of(load_suite(name), size)
        print(f"\n{name}, {len(suite)} scenarios\n")
        print("| driver | success, % | collisions, % | the robot's, % | time, s | intrusion, s | delay, s | detour, % |")
        print("|---|---|---|---|---|---|---|---|")
        for title, task, make in drivers:
            own = task or suite.rules.task()
            try:
                found = run_among_people(make(own), own, suite)
            except SuiteError:
                continue
            table = found.episodes
            figures[f"{name}, {title}"] = round(100.0 * float((table.outcomes == 1).mean()), 1)
            hit, own_fault = 100.0 * (table.outcomes == 2).mean(), 100.0 * found.at_fault.mean()
            taken = _mean(own.control_period * table.steps[table.outcomes == 1])
            print(
                f"| {title} | {_success(table)} | {hit:.1f} | {own_fault:.1f} | {taken} | {found.intrusion.mean():.2f} | "
                f"{found.delay.mean():.1f} | {100 * found.detour.mean():+.1f} |",
                flush=True,
            )


def _success(table: EpisodeTable) -> str:
    return rate(int((table.outcomes == 1).sum()), len(table.outcomes))


def _mean(values: Floats) -> str:
    return f"{values.mean():.1f}" if len(values) else "-"


def main() -> None:
    """Print the matrices in Markdown."""
    arguments = parser(__doc__)
    arguments.add_argument("--size", type=int, default=1000, help="scenarios of each family and suite, at most")
    arguments.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    arguments.add_argument("--families", nargs="+", choices=FAMILIES, default=FAMILIES)
    arguments.add_argument("--baselines", nargs="*", choices=tuple(CONTROLLERS), default=tuple(CONTROLLERS))
    arguments.add_argument("--policies", nargs="*", default=[each.card.name for each in shipped_policies()], metavar="NAME")
    options = arguments.parse_args()
    begun = time.time()
    policies = [shipped(each) for each in shipped_policies() if each.card.name in options.policies]
    figures: dict[str, object] = {"size": options.size}
    drivers = [*(baseline(name, None) for name in options.baselines), *policies]
    if "families" in options.only:
        families(options.families, [driver for driver in drivers if not driver[0].startswith("ORCA")], options.size, figures)
    if "barn" in options.only:
        barn([driver for driver in drivers if not driver[0].startswith("ORCA")], options.size, figures)
    if "people" in options.only:
        people(drivers, options.size, figures)
    figures["seconds"] = round(time.time() - begun)
    targets = {name: target for name, target in TARGETS.items() if name in figures}
    finish("field", figures, at_least=targets, check=options.check)


if __name__ == "__main__":
    main()
