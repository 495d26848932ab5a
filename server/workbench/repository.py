"""The list of experiments in SQL: filtered, sorted, in parts, in groups."""

import base64
import json
from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, Select, and_, func, or_, select
from sqlalchemy.orm import Session, defer

from server.database import tables
from server.database.tables import RunState
from server.errors import InvalidRequestError
from server.experiments.schemas import ExperimentState
from server.http.paging import Window
from server.workbench.fields import asks_for, condition, in_state, resolve, values_of
from server.workbench.language import Text, parse
from server.workbench.schemas import Place

_Experiment = tables.Experiment


class LastEvaluation(NamedTuple):
    """Of a run's last evaluated checkpoint."""

    suite_hash: str
    arrivals: int
    episode_count: int


class ListedRun(NamedTuple):
    """A run as a list needs it; `evaluation` is None before the first."""

    id: str
    experiment_id: str
    state: RunState
    step: int
    evaluation: LastEvaluation | None


@dataclass(frozen=True, slots=True)
class Sorting:
    """By the values of a key; experiments that have none come last either way, equal ones by their id."""

    key: str
    descending: bool

    @classmethod
    def of(cls, text: str) -> "Sorting":
        """As it stands in an address: "-created" is the newest first."""
        return cls(text.removeprefix("-"), text.startswith("-"))


@dataclass(frozen=True, slots=True)
class Wanted:
    """Which experiments a list is about.

    Attributes:
        query: in the little language.
        place: where they are.
        state: that they are in; None for any.
        project_id: that they belong to; None for any.
        visible: the projects that may be seen; None for all.
    """

    query: str = ""
    place: Place = "live"
    state: ExperimentState | None = None
    project_id: str | None = None
    visible: Collection[str] | None = None


class WorkbenchRepository:
    """Reads lists within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def matching(self, wanted: Wanted) -> ColumnElement[bool]:
        """The experiments that are wanted.

        Raises:
            QueryError: the query makes no sense.
        """
        query = parse(wanted.query)
        parts = [_in_place(wanted.place), condition(self._session, query)]
        if wanted.place == "live" and not asks_for(query, "study"):
            # A study has hundreds of trials, and a page of its own.
            parts.append(_Experiment.study_id.is_(None))
        if wanted.state is not None:
            parts.append(in_state(wanted.state))
        if wanted.project_id is not None:
            parts.append(_Experiment.project_id == wanted.project_id)
        if wanted.visible is not None:
            parts.append(_Experiment.project_id.in_(wanted.visible))
        return and_(*parts)

    def count(self, wanted: ColumnElement[bool]) -> int:
        """How many there are."""
        return self._session.scalar(select(func.count()).select_from(_Experiment).where(wanted)) or 0

    def page(
        self, wanted: ColumnElement[bool], sorting: Sorting, limit: int, offset: int, after: str | None
    ) -> tuple[Sequence[tables.Experiment], str | None]:
        """Some of the wanted experiments, without their settings, and where those after them begin.

        Raises:
            QueryError: there is no such key to sort by.
            InvalidRequestError: `after` is no end of a part of this list.
        """
        query, value = self._sorted(wanted, sorting)
        if after is not None:
            query = query.where(_beyond(value, sorting.descending, after))
        order = value.desc() if sorting.descending else value
        rows = self._session.execute(
            query.order_by(value.is_(None), order, _Experiment.id).limit(limit + 1).offset(offset)
        ).all()
        shown = rows[:limit]
        following = _end_of(shown[-1][1], shown[-1][0].id) if len(rows) > limit else None
        return [experiment for experiment, _ in shown], following

    def ids(self, wanted: ColumnElement[bool], limit: int) -> list[str]:
        """The ids of the newest of the wanted experiments."""
        query = select(_Experiment.id).where(wanted).order_by(_Experiment.created_at.desc(), _Experiment.id).limit(limit)
        return list(self._session.scalars(query))

    def runs(self, experiment_ids: Collection[str]) -> dict[str, list[ListedRun]]:
        """The runs of these experiments, by experiment and seed."""
        return self._runs(tables.Run.experiment_id.in_(experiment_ids))

    def speeds(self, run_ids: Collection[str], name: str) -> dict[str, float]:
        """The newest value of a metric by run; a run without one is absent."""
        return self.latest(run_ids, [name]).get(name, {})

    def latest(self, run_ids: Collection[str], names: Collection[str]) -> dict[str, dict[str, float]]:
        """The newest values of metrics, by name and run."""
        table = tables.LatestMetric
        found: dict[str, dict[str, float]] = defaultdict(dict)
        query = select(table.run_id, table.name, table.value).where(table.run_id.in_(run_ids), table.name.in_(names))
        for run_id, name, value in self._session.execute(query):
            found[name][run_id] = value
        return found

    def tags(self, experiment_ids: Collection[str]) -> dict[str, list[str]]:
        """The tags of these experiments, in alphabetical order; one without any is absent."""
        table = tables.ExperimentTag
        found: dict[str, list[str]] = defaultdict(list)
        query = select(table.experiment_id, table.tag).where(table.experiment_id.in_(experiment_ids)).order_by(table.tag)
        for experiment_id, tag in self._session.execute(query):
            found[experiment_id].append(tag)
        return found

    def groups(self, wanted: ColumnElement[bool], key: str, window: Window) -> tuple[str, list[tuple[Any, list[str]]], int]:
        """The wanted experiments by what they have under a key, the largest groups first.

        Returns:
            The key's whole name, those groups of the window as (value, ids), and how many there are.

        Raises:
            QueryError: there is no such key.
        """
        whole = resolve(self._session, Text(key, 0))
        values = values_of(self._session, whole).subquery()
        query = select(_Experiment.id, values.c[1]).outerjoin(values, values.c[0] == _Experiment.id).where(wanted)
        found: dict[Any, list[str]] = defaultdict(list)
        for experiment_id, value in self._session.execute(query):
            found[value].append(experiment_id)
        ordered = sorted(found.items(), key=lambda group: (-len(group[1]), group[0] is None, group[0]))
        return whole, ordered[window.offset : window.offset + window.limit], len(ordered)

    def runs_of(self, wanted: ColumnElement[bool]) -> dict[str, list[ListedRun]]:
        """The runs of all wanted experiments, by experiment and seed."""
        return self._runs(tables.Run.experiment_id.in_(select(_Experiment.id).where(wanted)))

    def latest_of(self, wanted: ColumnElement[bool], names: Collection[str]) -> dict[str, dict[str, float]]:
        """The newest values of metrics of all runs of the wanted experiments, by name and run."""
        table = tables.LatestMetric
        found: dict[str, dict[str, float]] = defaultdict(dict)
        query = (
            select(table.run_id, table.name, table.value)
            .join(tables.Run, tables.Run.id == table.run_id)
            .where(tables.Run.experiment_id.in_(select(_Experiment.id).where(wanted)), table.name.in_(names))
        )
        for run_id, name, value in self._session.execute(query):
            found[name][run_id] = value
        return found

    def _sorted(
        self, wanted: ColumnElement[bool], sorting: Sorting
    ) -> tuple[Select[tables.Experiment, Any], ColumnElement[Any]]:
        values = values_of(self._session, resolve(self._session, Text(sorting.key, 0))).subquery()
        value = values.c[1]
        query = (
            select(_Experiment, value)
            .outerjoin(values, values.c[0] == _Experiment.id)
            .where(wanted)
            .options(defer(_Experiment.training))
        )
        return query, value

    def _runs(self, wanted: ColumnElement[bool]) -> dict[str, list[ListedRun]]:
        run = tables.Run
        query = (
            select(
                run.id,
                run.experiment_id,
                run.state,
                run.step,
                run.final_suite,
                run.final_arrivals,
                run.final_episodes,
            )
            .where(wanted)
            .order_by(run.seed)
        )
        found: dict[str, list[ListedRun]] = defaultdict(list)
        for run_id, experiment_id, state, step, suite, arrivals, episodes in self._session.execute(query):
            evaluation = LastEvaluation(suite, arrivals, episodes) if suite and arrivals is not None and episodes else None
            found[experiment_id].append(ListedRun(run_id, experiment_id, state, step, evaluation))
        return found


def _in_place(place: Place) -> ColumnElement[bool]:
    match place:
        case "trash":
            return _Experiment.deleted_at.is_not(None)
        case "archived":
            return and_(_Experiment.deleted_at.is_(None), _Experiment.archived_at.is_not(None))
        case "live":
            return and_(_Experiment.deleted_at.is_(None), _Experiment.archived_at.is_(None))


def _beyond(value: ColumnElement[Any], descending: bool, after: str) -> ColumnElement[bool]:
    """What follows an end in the order of `page`."""
    last, last_id = _read_end(after)
    if last is None:
        return and_(value.is_(None), _Experiment.id > last_id)
    further = value < last if descending else value > last
    return or_(further, and_(value == last, _Experiment.id > last_id), value.is_(None))


def _end_of(value: object, experiment_id: str) -> str:
    return base64.urlsafe_b64encode(json.dumps([value, experiment_id]).encode()).decode()


def _read_end(after: str) -> tuple[float | str | None, str]:
    try:
        value, experiment_id = json.loads(base64.urlsafe_b64decode(after))
    except ValueError:
        value, experiment_id = None, None
    if not isinstance(experiment_id, str) or not isinstance(value, float | int | str | None):
        raise InvalidRequestError("This is not where a part of the list ends: begin at its start.")
    return value, experiment_id
