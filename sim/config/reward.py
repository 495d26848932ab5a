"""What a robot is rewarded for (pydantic only)."""

from typing import Literal

from pydantic import Field

from sim.config.base import ADVANCED, Frozen


class RewardConfig(Frozen):
    """The paper's rewards: on arrival, on collision, and in between progress c_r * (d_before - d_after).

    The advanced ones multiply the progress by 2^(d_before / d_after) and subtract penalty * (1 - hd). The paper leaves hd
    open; here it is the free distance ahead over the LiDAR's range (`clearance`) or 1 - |bearing of the target| / pi
    (`alignment`).
    """

    name: Literal["basic", "clearance", "alignment"] = Field(
        "basic",
        title="Reward",
        description=(
            "Basic: arrival, collision, progress. Clearance and alignment are readings of the advanced reward: "
            "exponential progress, less a penalty for little room ahead or for facing away from the target."
        ),
    )
    arrival: float = Field(120.0, title="Arrival reward", json_schema_extra=ADVANCED)
    collision: float = Field(-100.0, title="Collision reward", json_schema_extra=ADVANCED)
    progress: float = Field(
        500.0, title="Progress coefficient", description="Reward per metre gained.", json_schema_extra=ADVANCED
    )
    penalty: float = Field(
        5.0,
        ge=0.0,
        title="Penalty coefficient",
        description="Largest penalty per step; the basic reward has none.",
        json_schema_extra=ADVANCED,
    )
