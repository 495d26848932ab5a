"""The manifest of a checkpoint archive: all that a stranger needs to run the policy (pydantic only)."""

from typing import Literal

from pydantic import Field

from sim.config import Frozen
from workers.config import TrainingConfig

MANIFEST = "manifest.json"
POLICY = "policy.safetensors"
STATE_ARRAYS = "state.safetensors"
STATE_COUNTERS = "state.json"
USUAL_GAMMA = 0.99
"""Discount of a step, of policies that do not say theirs."""


class Number(Frozen):
    """One number of an observation or an action.

    Attributes:
        index: its place in the vector.
        name: short and unique in the vector.
        meaning: how it is computed from lengths in metres and angles in radians, or what it commands.
        low, high: its range.
    """

    index: int
    name: str
    meaning: str
    low: float
    high: float


class Observation(Frozen):
    """What the policy is given: `numbers` in order; the same name and version always mean the same numbers."""

    name: str
    version: int
    numbers: tuple[Number, ...]


class NetworkLayout(Frozen):
    """How the policy's arrays make actions.

    Attributes:
        name: of the network.
        layers: prefixes of the arrays 'prefix.weight' (outputs, inputs) and 'prefix.bias' (outputs,), in order.
        activation: applied to hidden layers; empty, as `layers` is, where only an ONNX graph says what is computed.
        formula: the whole computation, with x the observation, 'layer(x)' = weight @ x + bias.
    """

    name: str
    layers: tuple[str, ...]
    activation: Literal["relu", "tanh", "leaky_relu", ""]
    formula: tuple[str, ...]


class FileEntry(Frozen):
    """A file of the archive."""

    sha256: str = Field(pattern="^[0-9a-f]{64}$")
    size: int = Field(ge=0)


class EvaluationSummary(Frozen):
    """How this policy did on its suite."""

    suite: str
    suite_hash: str
    episodes: int
    arrivals: int


class Manifest(Frozen):
    """`manifest.json`."""

    format: Literal["mapless-policy"] = "mapless-policy"
    version: Literal[1] = 1
    training: TrainingConfig
    seed: int
    step: int = Field(ge=0)
    observation: Observation
    action: tuple[Number, ...]
    network: NetworkLayout
    evaluation: EvaluationSummary | None
    versions: dict[str, str]
    files: dict[str, FileEntry]

    @property
    def gamma(self) -> float:
        """Discount of a step in its training; a usual one of an algorithm that has none."""
        return float(getattr(self.training.algorithm, "gamma", USUAL_GAMMA))


class Effort(Frozen):
    """What led to a step of a training, over all of its attempts.

    Time under way alone counts: a training that waits, is stopped or is lost, or whose machine sleeps, takes none meanwhile;
    and what an attempt did beyond the checkpoint from which the next one resumed did not lead here.
    """

    wall_seconds: float = Field(0.0, ge=0.0, description="While a trainer was at it, from its start on.")
    cpu_seconds: float = Field(
        0.0, ge=0.0, description="Of the trainer's process, all threads together; work of a graphics card is not in it."
    )
    episodes: int = Field(0, ge=0, description="Attempts at a target that have ended.")


class TrainingCounters(Frozen):
    """`state.json`: where a training stands, beside its arrays."""

    step: int = Field(ge=0)
    updates: int = Field(ge=0)
    evaluations: int = Field(ge=0)
    effort: Effort | None = Field(None, description="Null in archives from before it was counted.")
