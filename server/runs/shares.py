"""How people share the workers: whose run is next among equal priorities, and which runs wait for a limit.

Next is the run of whoever has the fewest under way, and of these of whoever was given one longest ago; of one person's the
one that has waited longest. Turns are numbered, not timed: a clock that is set changes nobody's place.
"""

import heapq
from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import cast

from sqlalchemy import ColumnElement, Table, and_, bindparam, case, func, select, text, update
from sqlalchemy.orm import Session

from server.database import tables
from server.runs.limits import Limit, Limits
from server.runs.states import ACTIVE

# Of PostgreSQL's locks that programs name: those who give runs away take turns, so that no two see the same slot free.
_LOCK = 0x6D61706C
_SHARES = cast("Table", tables.Share.__table__)
_ACTIVE = (
    select(
        tables.Experiment.id,
        func.coalesce(tables.Experiment.launched_by, ""),
        tables.Experiment.parallel_runs,
        func.count(tables.Run.id),
    )
    .join(tables.Run, tables.Run.experiment_id == tables.Experiment.id)
    .where(tables.Run.state.in_(ACTIVE))
    .group_by(tables.Experiment.id, tables.Experiment.launched_by, tables.Experiment.parallel_runs)
)
_TURNS = select(_SHARES.c.person, _SHARES.c.turn)
_TAKE_TURN = update(_SHARES).where(_SHARES.c.person == bindparam("whose")).values(turn=bindparam("next_turn"))


@dataclass(frozen=True)
class Shares:
    """What people have of the workers at a moment.

    Attributes:
        by_person: runs under way, by who launched them.
        turns: the number of the last turn of each person.
        full: experiments of which as many runs are under way as may be.
        full_people: likewise people.
    """

    by_person: Mapping[str, int]
    turns: Mapping[str, int]
    full: frozenset[str]
    full_people: frozenset[str]

    def waits_for(self, run: tables.Run) -> Limit | None:
        """The limit that keeps a run waiting, if one does."""
        if run.experiment_id in self.full:
            return "experiment limit"
        return "person limit" if person_of(run.experiment) in self.full_people else None

    def allowed(self) -> ColumnElement[bool]:
        """That a run waits for no limit, where its experiment is joined."""
        launched_by = func.coalesce(tables.Experiment.launched_by, "")
        return and_(tables.Experiment.id.not_in(self.full), launched_by.not_in(self.full_people))

    def places(self) -> list[ColumnElement[int]]:
        """Whose turn is before whose, the lowest first, as terms to order by; where the run's experiment is joined."""
        known = sorted({*self.by_person, *self.turns}, key=lambda who: (self.by_person.get(who, 0), self.turns.get(who, 0)))
        if not known:
            return []
        ranks = {person: rank for rank, person in enumerate(known, start=1)}
        return [case(ranks, value=func.coalesce(tables.Experiment.launched_by, ""), else_=0)]

    def in_turn(self, queued: Iterable[tables.Run]) -> list[tables.Run]:
        """All that wait in the order of their turns, as it will be if no run ends meanwhile.

        Args:
            queued: by priority, then by how long they wait, with their experiments.
        """
        waiting: dict[int, dict[str, deque[tables.Run]]] = defaultdict(lambda: defaultdict(deque))
        for run in queued:
            waiting[run.priority][person_of(run.experiment)].append(run)
        active, turns = Counter(self.by_person), dict(self.turns)
        turn = max(turns.values(), default=0)
        order: list[tables.Run] = []
        for priority in sorted(waiting, reverse=True):
            people = waiting[priority]
            heap = [(active[who], turns.get(who, 0), runs[0].queued_at, who) for who, runs in people.items()]
            heapq.heapify(heap)
            while heap:
                *_, who = heapq.heappop(heap)
                order.append(people[who].popleft())
                turn += 1
                active[who], turns[who] = active[who] + 1, turn
                if people[who]:
                    heapq.heappush(heap, (active[who], turn, people[who][0].queued_at, who))
        return order


def person_of(experiment: tables.Experiment) -> str:
    """Who launched it: the id of an account, or nothing for whoever has the installation's token."""
    return experiment.launched_by or ""


class ShareRepository:
    """Reads and writes within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def lock(self) -> None:
        """Wait until nobody else gives a run away, and keep others from it until the transaction ends."""
        if self._session.get_bind().dialect.name == "postgresql":
            self._session.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": _LOCK})

    def read(self, limits: Limits) -> Shares:
        """What people have now."""
        by_person: Counter[str] = Counter()
        full = set()
        for experiment_id, person, own, count in self._session.execute(_ACTIVE):
            by_person[person] += count
            limit = own if own is not None else limits.experiment
            if limit is not None and count >= limit:
                full.add(experiment_id)
        turns = {row.person: row.turn for row in self._session.execute(_TURNS)}
        crowded = {person for person, count in by_person.items() if limits.person is not None and count >= limits.person}
        return Shares(by_person, turns, frozenset(full), frozenset(crowded))

    def took(self, experiment: tables.Experiment, shares: Shares) -> None:
        """Somebody was given a slot: it is everybody else's turn before theirs comes again.

        Args:
            experiment: of the run that was given away.
            shares: as they were read under `lock`.
        """
        turn = max(shares.turns.values(), default=0) + 1
        person = person_of(experiment)
        if person in shares.turns:
            self._session.execute(_TAKE_TURN, {"whose": person, "next_turn": turn})
        else:
            self._session.add(tables.Share(person=person, turn=turn))
