"""Baselines by their configurations: those that are built in, and those that extensions have added."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, TypeAdapter

from sim.arrays import Floats
from sim.baselines.dwa import CLEARANCE, HEADING, PROGRESS, SPEED, dynamic_window
from sim.baselines.simple import go_to_goal, random_policy
from sim.config import Frozen, TaskConfig
from sim.extending.discovery import added, implementation, with_added
from sim.extending.parts import Baseline as AddedBaseline
from sim.suites import Situation


class RandomBaseline(Frozen):
    """Actions drawn uniformly."""

    name: Literal["random"] = Field("random", title="Random")
    seed: int = Field(0, ge=0, title="Seed")


class GoToGoalBaseline(Frozen):
    """Turns towards the target and drives, blind to obstacles."""

    name: Literal["go-to-goal"] = Field("go-to-goal", title="Go to goal")


class DynamicWindowBaseline(Frozen):
    """The Dynamic Window Approach (Fox, Burgard and Thrun 1997)."""

    name: Literal["dynamic-window"] = Field("dynamic-window", title="Dynamic window")
    heading: float = Field(HEADING, ge=0.0, title="Weight of the heading")
    clearance: float = Field(CLEARANCE, ge=0.0, title="Weight of the clearance")
    speed: float = Field(SPEED, ge=0.0, title="Weight of the speed")
    progress: float = Field(PROGRESS, ge=0.0, title="Weight of the progress")


BuiltInBaseline = RandomBaseline | GoToGoalBaseline | DynamicWindowBaseline
if TYPE_CHECKING:
    AnyBaseline = BuiltInBaseline | AddedBaseline
else:
    AnyBaseline = Annotated[with_added(BuiltInBaseline, added(AddedBaseline)), Field(discriminator="name")]

BASELINES: TypeAdapter[AnyBaseline] = TypeAdapter(AnyBaseline)
"""Reads the configuration of any of them; those that are named only take their defaults."""


def controller_of(baseline: AnyBaseline, task: TaskConfig) -> Callable[[Situation], Floats]:
    """A baseline as a controller for `sim.suites.run_controller`."""
    match baseline:
        case RandomBaseline():
            random = random_policy(baseline.seed)
            return lambda situation: random(situation.observations)
        case GoToGoalBaseline():
            towards = go_to_goal(task)
            return lambda situation: towards(situation.observations)
        case DynamicWindowBaseline():
            return dynamic_window(task, (baseline.heading, baseline.clearance, baseline.speed, baseline.progress))
        case _:
            controller: Callable[[Situation], Floats] = implementation(baseline)(baseline, task)
            return controller
