"""Which checkpoints of a run stay. Its own imports are light: the settings have a rule."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from pydantic import BaseModel, ConfigDict, Field, model_validator


class KeepRule(BaseModel):
    """What stays of each run; that is all, where `last` is null."""

    model_config = ConfigDict(frozen=True, extra="forbid", json_schema_serialization_defaults_required=True)

    last: int | None = Field(None, ge=1, le=10_000, description="So many newest ones; null for all, and then nothing goes.")
    every: int | None = Field(None, ge=1, le=10_000, description="Each so many-th by step as well, from the first one on.")
    best: bool = Field(True, description="The best one as well, where runs are evaluated.")

    @model_validator(mode="after")
    def _all_is_all(self) -> Self:
        if self.last is None and self.every is not None:
            raise ValueError("where all checkpoints stay, every n-th is no rule: give `last`, or leave `every` out")
        return self


KEEP_ALL = KeepRule()


@dataclass(frozen=True)
class Stored:
    """A checkpoint of a run.

    Attributes:
        id: of it.
        whole: its archive is as it was stored.
        best: the best of its run.
    """

    id: str
    whole: bool
    best: bool


def staying(rule: KeepRule, checkpoints: Sequence[Stored]) -> set[str]:
    """The ids of those that stay of a run's checkpoints, given by step; of damaged ones none does."""
    if rule.last is None:
        return {checkpoint.id for checkpoint in checkpoints}
    whole = [checkpoint for checkpoint in checkpoints if checkpoint.whole]
    stay = {checkpoint.id for checkpoint in whole[-rule.last :]}
    if rule.every is not None:
        stay |= {checkpoint.id for checkpoint in whole[:: rule.every]}
    if rule.best:
        stay |= {checkpoint.id for checkpoint in whole if checkpoint.best}
    return stay
