"""What my_lab adds to Mapless. The server reads this file too: it imports `sim.extending` and `workers.extending` only."""

from typing import Literal

from sim.extending import ArenaFamily, Baseline, Extension, Field, ObservationNumber, ObservationPart, RewardTerm
from workers.extending import Algorithm, Network


class GentleTerm(RewardTerm):
    """Turning faster than need be: radians per second beyond a limit."""

    name: Literal["my_lab.gentle"] = Field("my_lab.gentle", title="Gentle turns")
    weight: float = Field(-1.0, title="Weight", description="Reward per rad/s beyond the limit, in every step.")
    limit: float = Field(0.5, ge=0.0, le=10.0, title="Limit", description="Turning rate that costs nothing, rad/s.")

    formula = "max(0, abs(turning_rate) - limit)"


class OpeningPart(ObservationPart):
    """Where there is most room, and how much."""

    name: Literal["my_lab.opening"] = Field("my_lab.opening", title="Opening")
    rays: int = Field(3, ge=1, le=30, title="Rays", description="Neighbours that have to be free together.")

    implementation = "my_lab.sight:opening"

    def numbers(self):
        """What the policy sees, in order."""
        return (
            ObservationNumber("opening bearing", "of the freest rays / pi, left positive", -1.0, 1.0, "pi rad"),
            ObservationNumber("opening room", "their shortest / the LiDAR's range", 0.0, 1.0, "the LiDAR's range"),
        )


class PillarsFamily(ArenaFamily):
    """Round pillars that stand about."""

    name: Literal["my_lab.pillars"] = Field("my_lab.pillars", title="Pillars")
    radius: float = Field(0.2, ge=0.1, le=0.5, title="Radius", description="Of a pillar, metres.")

    implementation = "my_lab.arenas:pillars"


class TimidBaseline(Baseline):
    """Turns towards the target and drives, slower the nearer anything is."""

    name: Literal["my_lab.timid"] = Field("my_lab.timid", title="Timid")
    caution: float = Field(0.5, gt=0.0, le=5.0, title="Caution", description="Room that full speed needs, metres.")

    implementation = "my_lab.control:timid"


class GatedNetwork(Network):
    """One hidden layer, and a gate that says how much of each of its units counts."""

    name: Literal["my_lab.gated"] = Field("my_lab.gated", title="Gated")
    units: int = Field(64, ge=4, le=1024, title="Units", description="Of the hidden layer.")

    implementation = "my_lab.networks:gated"


class ReinforceConfig(Algorithm):
    """REINFORCE with a baseline (Williams 1992; Sutton and Barto 2018, section 13.4)."""

    name: Literal["my_lab.reinforce"] = Field("my_lab.reinforce", title="REINFORCE")
    rollout_steps: int = Field(16, ge=2, le=1024, title="Rollout", description="Steps of each robot between two updates.")
    learning_rate: float = Field(3e-3, gt=0.0, le=0.1, title="Learning rate")
    gamma: float = Field(0.98, gt=0.0, lt=1.0, title="Discount (gamma)")
    initial_std: float = Field(0.4, gt=0.0, le=2.0, title="Initial std", description="Exploration, in halves of the range.")

    implementation = "my_lab.learning:Reinforce"


extension = Extension(
    name="my_lab",
    version="0.1.0",
    api=1,
    parts=(GentleTerm, OpeningPart, PillarsFamily, TimidBaseline, GatedNetwork, ReinforceConfig),
    source="pip install my_lab==0.1.0",
)
