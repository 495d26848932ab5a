"""Leaderboards in JSON."""

from typing import Literal

from pydantic import Field

from server.schemas import Estimate, Schema

EntryKind = Literal["shipped", "training", "evaluation", "baseline"]
"""A policy that ships; a training by its seeds' last checkpoints; an evaluation; what needs no training."""


class Entry(Schema):
    """Something that was measured on the suite."""

    rank: int = Field(description="By success, from 1; equal rates share one.")
    kind: EntryKind
    id: str = Field(description="Name of a shipped policy or a baseline; id of a training or an evaluation.")
    title: str
    success: Estimate
    spl: float | None = Field(description="Success weighted by path length; null where it is not kept.")
    steps: float | None = Field(description="Control steps to the target, over the episodes that arrived.")
    tied: bool = Field(description="Whether it can't be told from the best.")
    told_by: Literal["best", "seeds", "episodes"] = Field(
        description="What that is known by: the difference over seeds where both have five or more (95 % interval), else "
        "Fisher's exact test over the episodes of these very policies (p below 0.05)."
    )


class Leaderboard(Schema):
    """Everything that was measured on a suite, the best first."""

    suite: str
    suite_hash: str = Field(description="Only results of the same hash may be compared.")
    meaning: str | None = Field(description="What the suite asks of a policy; null for one that is drawn for an arena.")
    entries: list[Entry]
    comparisons: int = Field(description="How many entries were compared with the best: of so many, some differ by chance.")


class ListedSuite(Schema):
    """A suite on which something was measured."""

    suite: str
    suite_hash: str
    entries: int
    frozen: bool = Field(description="Whether anything can be measured on it by its name.")


class Leaderboards(Schema):
    """Every suite on which something was measured, by name."""

    suites: list[ListedSuite]
