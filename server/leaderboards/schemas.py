"""Leaderboards in JSON."""

from typing import Literal

from pydantic import Field

from server.schemas import Estimate, Schema

EntryKind = Literal["shipped", "training", "evaluation", "baseline", "uploaded"]
"""A policy that ships; a training by its seeds' last checkpoints; checkpoints that were evaluated; what needs no training; a
policy from elsewhere."""

ToldBy = Literal["best", "seeds", "episodes", "nothing"]


class Entry(Schema):
    """Something that was measured on the suite."""

    rank: int = Field(description="By success, from 1; equal rates share one.")
    kind: EntryKind
    id: str = Field(
        description="Name of a shipped policy or a baseline; id of a training; of what was asked for, id of the evaluation."
    )
    title: str
    experiment_id: str | None = Field(None, description="The training that it is of; null for what is none's.")
    evaluations: list[str] = Field([], description="Ids of the evaluations behind it that were asked for, one a seed.")
    success: Estimate
    spl: float | None = Field(description="Success weighted by path length; null where it is not kept.")
    steps: float | None = Field(description="Control steps to the target, over the episodes that arrived.")
    tied: bool = Field(description="Whether it can't be told from the best.")
    told_by: ToldBy = Field(
        description="What that is known by: the difference over seeds where those that have several have five or more; "
        "Fisher's exact test over the episodes where either is one very policy; nothing where either has two to four seeds."
    )
    p: float | None = Field(
        None,
        description="That the two are one, adjusted for all tests here (Holm 1979); tied from 0.05. Null: no test.",
    )


class Leaderboard(Schema):
    """Everything that was measured on a suite, the best first."""

    suite: str
    suite_hash: str = Field(description="Only results of the same hash may be compared.")
    meaning: str | None = Field(description="What the suite asks of a policy; null for one that is drawn for an arena.")
    entries: list[Entry]
    comparisons: int = Field(description="How many entries were tested against the best, which every p is adjusted for.")


class ListedSuite(Schema):
    """A suite on which something was measured."""

    suite: str
    suite_hash: str
    entries: int
    frozen: bool = Field(description="Whether anything can be measured on it by its name.")


class Leaderboards(Schema):
    """Every suite on which something was measured, by name."""

    suites: list[ListedSuite]
