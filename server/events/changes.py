"""What is told of a change, and how much of it a page hears that shows some things and not others."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

from pydantic import Field

from server.schemas import Schema

ChangeKind = Literal["experiment", "run", "metrics", "checkpoint", "deleted"]


class Change(Schema):
    """Something is not as it was; the REST API says how it is now."""

    experiment_id: str | None = Field(description="Null for one that the page does not show.")
    run_id: str | None = Field(description="Null where all of an experiment is meant.")
    kind: ChangeKind


_ELSEWHERE = {kind: Change(experiment_id=None, run_id=None, kind=kind) for kind in get_args(ChangeKind)}


@dataclass(frozen=True)
class Shown:
    """What a page shows.

    Attributes:
        experiments: by id.
        runs: by id.
        reports: whether it matters that any other run has reported metrics, as in a list.
    """

    experiments: frozenset[str]
    runs: frozenset[str]
    reports: bool

    def of(self, changes: Iterable[Change]) -> list[Change]:
        """The changes of what it shows as they are; of everything else, once, which kinds there were."""
        told: dict[Change, None] = {}
        for change in changes:
            # What concerns a whole experiment is rare, and concerns its runs, whose experiment the page need not know.
            if change.experiment_id in self.experiments or change.run_id is None or change.run_id in self.runs:
                told[change] = None
            elif change.kind != "metrics" or self.reports:
                told[_ELSEWHERE[change.kind]] = None
        return list(told)
