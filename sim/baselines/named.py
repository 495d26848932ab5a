"""Baselines by their configurations: those that are built in, and those that extensions have added."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, TypeAdapter

from sim.actions import action_layout
from sim.arrays import Floats
from sim.baselines.dwa import CLEARANCE, HEADING, PROGRESS, SPEED, dynamic_window
from sim.baselines.memory import mapping_planner
from sim.baselines.mppi import path_integral
from sim.baselines.orca import reciprocal_avoidance
from sim.baselines.simple import go_to_goal, random_policy
from sim.baselines.vfh import vector_field_histogram
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


class HistogramBaseline(Frozen):
    """The Vector Field Histogram, VFH+ (Ulrich and Borenstein 1998)."""

    name: Literal["vfh"] = Field("vfh", title="VFH+")


class PathIntegralBaseline(Frozen):
    """Model Predictive Path Integral control (Williams et al. 2017)."""

    name: Literal["mppi"] = Field("mppi", title="MPPI")


class MappingBaseline(Frozen):
    """Maps what it sees as it drives, plans in that by A*, and follows by the Dynamic Window Approach."""

    name: Literal["mapping"] = Field("mapping", title="Mapping planner")


class ReciprocalBaseline(Frozen):
    """Optimal Reciprocal Collision Avoidance (van den Berg et al. 2011), told where people are and how they move."""

    name: Literal["orca"] = Field("orca", title="ORCA")


BuiltInBaseline = (
    RandomBaseline
    | GoToGoalBaseline
    | DynamicWindowBaseline
    | HistogramBaseline
    | PathIntegralBaseline
    | MappingBaseline
    | ReciprocalBaseline
)
if TYPE_CHECKING:
    AnyBaseline = BuiltInBaseline | AddedBaseline
else:
    AnyBaseline = Annotated[with_added(BuiltInBaseline, added(AddedBaseline)), Field(discriminator="name")]

BASELINES: TypeAdapter[AnyBaseline] = TypeAdapter(AnyBaseline)
"""Reads the configuration of any of them; those that are named only take their defaults."""

TABLED: Mapping[str, BuiltInBaseline] = MappingProxyType(
    {
        "random": RandomBaseline(),
        "go-to-goal": GoToGoalBaseline(),
        "dynamic window": DynamicWindowBaseline(),
        "VFH+": HistogramBaseline(),
        "MPPI": PathIntegralBaseline(),
        "mapping, A* and dynamic window": MappingBaseline(),
        "ORCA, told where people are": ReciprocalBaseline(),
    }
)
"""What policies are compared with, by the names that stand in tables."""


def controller_of(baseline: AnyBaseline, task: TaskConfig) -> Callable[[Situation], Floats]:
    """A baseline as a controller for `sim.suites.run_controller`."""
    match baseline:
        case RandomBaseline():
            random = random_policy(baseline.seed, actions=action_layout(task.robot))
            return lambda situation: random(situation.observations)
        case GoToGoalBaseline():
            towards = go_to_goal(task)
            return lambda situation: towards(situation.observations)
        case DynamicWindowBaseline():
            return dynamic_window(task, (baseline.heading, baseline.clearance, baseline.speed, baseline.progress))
        case HistogramBaseline():
            return vector_field_histogram(task)
        case PathIntegralBaseline():
            return path_integral(task)
        case MappingBaseline():
            return mapping_planner(task)
        case ReciprocalBaseline():
            return reciprocal_avoidance(task)
        case _:
            controller: Callable[[Situation], Floats] = implementation(baseline)(baseline, task)
            return controller
