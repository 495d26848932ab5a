"""Who drives: shipped policies, baselines that see as much as they do, and a planner that knows the map."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from sim.arrays import Floats
from sim.baselines.memory import mapping_planner
from sim.baselines.named import TABLED, controller_of
from sim.config import LidarConfig, TaskConfig
from sim.drivers import Driver
from sim.suites import Situation, Suite, SuiteRules
from workers.checkpoints import read_policy
from workers.policy import torch_policy
from workers.shipped.field import Part
from workers.shipped.library import ARCHIVE, ShippedPolicy, shipped_policies

Controller = Callable[[Situation], Floats]

KNOWS_THE_MAP = "knows the map: A* and dynamic window"
TOLD_PEOPLE = "ORCA, told where people are"

DEAR = ("MPPI", "mapping, A* and dynamic window")
"""Baselines that take many times as long as the others: in families they drive with the middle one of the sights only."""

SIGHTS = (LidarConfig(), LidarConfig(rays=60, field_of_view=360.0), LidarConfig(rays=120, field_of_view=360.0))
"""What shipped policies see in families, and so the baselines beside them; the first is the default."""


@dataclass(frozen=True)
class Candidate:
    """A policy or a baseline with what it sees.

    Attributes:
        name: a baseline's, or a policy's title.
        policy: of which shipped policy; None for a baseline.
        seed: of its training; None for a baseline.
        task_under: its task under a suite's rules.
        controller: makes one that drives a suite with a task.
    """

    name: str
    policy: str | None
    seed: int | None
    task_under: Callable[[SuiteRules], TaskConfig]
    controller: Callable[[TaskConfig, Suite], Controller]


def baselines(names: Sequence[str], part: Part) -> list[Candidate]:
    """Baselines by name: in families with every sight, else with what the suite's rules ask for."""
    drivers = []
    for name in names:
        if name == TOLD_PEOPLE and part != "people":
            continue
        if part != "families":
            drivers.append(_baseline(name, SuiteRules.task))
            continue
        sights = SIGHTS[1:2] if name in DEAR else SIGHTS
        drivers += [_baseline(name, partial(_whatever_the_rules, TaskConfig(lidar=sight))) for sight in sights]
    return drivers


def knows_the_map() -> Candidate:
    """A* on the whole map with room for the body, followed by the dynamic window: what is there to be reached."""

    def make(task: TaskConfig, suite: Suite) -> Controller:
        return mapping_planner(task, [suite.arenas[index] for index in suite.arena_indices])

    return Candidate(KNOWS_THE_MAP, None, None, SuiteRules.task, make)


def policies(names: Sequence[str], seeds: Path | None) -> list[Candidate]:
    """Shipped policies by name, and the same of other training seeds.

    Args:
        names: of the policies.
        seeds: a folder that holds SEED/NAME/policy.zip, as `python -m workers.shipped.build NAME --seed SEED --folder
            seeds/SEED` writes it; None where there are no others.
    """
    drivers = []
    for each in shipped_policies():
        if each.card.name not in names:
            continue
        drivers.append(_policy(each, each.archive, each.card.seed))
        others = sorted(seeds.glob(f"*/{each.card.name}/{ARCHIVE}")) if seeds else []
        drivers += [_policy(each, archive, int(archive.parent.parent.name)) for archive in others]
    return drivers


def of_the_default_robot(drivers: Sequence[Candidate]) -> list[Candidate]:
    """Those that drive it: in families, which ask for no robot, they alone stand beside one another on equal terms."""
    return [each for each in drivers if each.task_under(SuiteRules()).robot == TaskConfig().robot]


def _baseline(name: str, task_under: Callable[[SuiteRules], TaskConfig]) -> Candidate:
    return Candidate(name, None, None, task_under, lambda task, _: controller_of(TABLED[name], task))


def _whatever_the_rules(task: TaskConfig, _: SuiteRules) -> TaskConfig:
    return task


def _policy(shipped: ShippedPolicy, archive: Path, seed: int) -> Candidate:
    def make(_: TaskConfig, suite: Suite) -> Controller:
        driver = Driver(torch_policy(read_policy(archive)[1]), len(suite))
        return lambda situation: driver(situation.observations, situation.robots)

    return Candidate(shipped.card.title, shipped.card.name, seed, lambda _: shipped.card.training.task, make)
