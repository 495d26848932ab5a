"""What a diagnosis says (pydantic only)."""

from collections.abc import Callable
from typing import Literal

from pydantic import Field

from sim.config import Frozen
from workers.diagnoses.history import History

DiagnosisId = Literal[
    "not_finite",
    "constant_observations",
    "kl_exploded",
    "value_diverges",
    "entropy_collapsed",
    "actions_saturate",
    "spins",
    "reward_hacked",
    "success_stuck",
]


class Evidence(Frozen):
    """A number that a diagnosis rests on."""

    metric: str = Field(description="Name of the curve.")
    value: float | None = Field(description="The curve's recent median, or its peak; null where it is not a number.")
    expected: str = Field(description="What a healthy run has.")


class Diagnosis(Frozen):
    """Something that is wrong with a run."""

    id: DiagnosisId
    severity: Literal["warning", "error"] = Field(description="An error never mends itself.")
    title: str
    explanation: str
    evidence: tuple[Evidence, ...]
    advice: tuple[str, ...] = Field(description="What to try, the most promising first.")
    step: int = Field(description="Environment step of the newest number behind it.")


Rule = Callable[[History], Diagnosis | None]
"""Looks for one thing; None where it is not there, or where the curves are too short to tell."""
