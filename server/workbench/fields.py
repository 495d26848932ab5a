"""What a key of the query language stands for in SQL: a condition, or a value to sort and group by."""

import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

from sqlalchemy import ColumnElement, Float, Select, SQLColumnExpression, and_, cast, func, not_, or_, select, true
from sqlalchemy.orm import InstrumentedAttribute, Session

from server.database import tables
from server.experiments.repository import aggregate_state_sql
from server.workbench.flatten import OBSERVATION, REWARD
from server.workbench.keys import KeyRepository
from server.workbench.language import All, AnyOf, Comparison, Node, Not, Operator, QueryError, Text, Word

Kind = Literal["text", "number", "time", "yes"]

ALIASES: Mapping[str, str] = {
    "arena": "task.arena.name",
    "movers": "task.arena.movers.count",
    "robot": "task.robot.name",
    "observation": OBSERVATION,
    "algorithm": "algorithm.name",
    "network": "algorithm.network.name",
    "reward": REWARD,
}
"""Short names of settings that everybody asks for."""

STATES = ("queued", "running", "stopping", "stopped", "completed", "failed", "mixed")
_YES, _NO = frozenset({"yes", "true", "1"}), frozenset({"no", "false", "0"})
_AGO = re.compile(r"-?(\d{1,6}(?:\.\d+)?)([hdwmy])")
_SECONDS = {"h": 3_600.0, "d": 86_400.0, "w": 604_800.0, "m": 2_629_800.0, "y": 31_557_600.0}

_Experiment = tables.Experiment


@dataclass(frozen=True, slots=True)
class Attribute:
    """Something that an experiment has beside its settings and metrics.

    Attributes:
        kind: of its values.
        meaning: for people.
        values: that it may have, where they are few.
    """

    kind: Kind
    meaning: str
    values: tuple[str, ...] = ()


ATTRIBUTES: Mapping[str, Attribute] = {
    "name": Attribute("text", "Its name"),
    "id": Attribute("text", "Its id"),
    "state": Attribute("text", "Of its runs together", STATES),
    "tag": Attribute("text", "A tag that it has"),
    "project": Attribute("text", "The project that it belongs to"),
    "notes": Attribute("text", "What its notes say"),
    "starred": Attribute("yes", "Whether it has a star", ("yes", "no")),
    "created": Attribute("time", "When it was launched"),
    "seeds": Attribute("number", "How many runs it has"),
    "success": Attribute("number", "Mean success rate of its runs' last evaluations, 0 to 1"),
    "worker": Attribute("text", "A worker that trains it now"),
    "campaign": Attribute("text", "Of the paper's reproduction"),
    "study": Attribute("text", "The study that it is a trial of; a query lists trials only if it asks for this"),
}


def is_series(key: str) -> bool:
    """Whether a key names a metric: all of their names have a slash."""
    return "/" in key


def resolve(session: Session, key: Text) -> str:
    """The whole name of what a key stands for.

    Raises:
        QueryError: nothing has that name, or several things do.
    """
    if key.text in ATTRIBUTES or is_series(key.text):
        return key.text
    if key.text in ALIASES:
        return ALIASES[key.text]
    match KeyRepository(session).matching(key.text):
        case [found]:
            return found
        case [one, other]:
            raise QueryError(f"{key.text} may be {one} or {other}: write more of it.", key.position)
        case _:
            raise QueryError(f"No training has a setting, a metric or a property {key.text}.", key.position)


def condition(session: Session, node: Node) -> ColumnElement[bool]:
    """The experiments for which a query holds.

    Raises:
        QueryError: a key or a value in it makes no sense.
    """
    match node:
        case Word(text):
            return func.lower(_Experiment.name).contains(text.text.lower(), autoescape=True)
        case Not(part):
            return not_(condition(session, part))
        case All(parts):
            return and_(true(), *(condition(session, part) for part in parts))
        case AnyOf(parts):
            return or_(*(condition(session, part) for part in parts))
        case Comparison():
            return _comparison(session, node)


def asks_for(node: Node, key: str) -> bool:
    """Whether a query compares a key with anything."""
    match node:
        case Word():
            return False
        case Not(part):
            return asks_for(part, key)
        case All(parts) | AnyOf(parts):
            return any(asks_for(part, key) for part in parts)
        case Comparison(compared):
            return compared.text == key


def _comparison(session: Session, node: Comparison) -> ColumnElement[bool]:
    key = resolve(session, node.key)
    if node.operator == "!=":
        # What there is not is unequal to everything.
        return not_(_comparison(session, Comparison(node.key, "=", node.values)))
    one = _condition_of(key)
    return or_(*(one(node.operator, value) for value in node.values))


def _condition_of(key: str) -> Callable[[Operator, Text], ColumnElement[bool]]:
    if is_series(key):
        return lambda operator, value: _Experiment.id.in_(_having(mean_of_series(key), operator, value))
    if key not in ATTRIBUTES:
        return lambda operator, value: _setting(key, operator, value)
    special = {
        "state": _state,
        "tag": _tag,
        "project": _project,
        "starred": _starred,
        "created": _created,
        "worker": _worker,
        "seeds": lambda operator, value: _Experiment.id.in_(_having(_SEEDS, operator, value)),
        "success": lambda operator, value: _Experiment.id.in_(_having(_SUCCESS, operator, value)),
    }
    columns = {
        "name": _Experiment.name,
        "id": _Experiment.id,
        "notes": _Experiment.notes,
        "campaign": _Experiment.campaign,
        "study": _Experiment.study_id,
    }
    if key in columns:
        return lambda operator, value: _text(columns[key], operator, value)
    return special[key]


def _is_any(value: Text) -> bool:
    return value.text == "*" and not value.quoted


def _text(column: InstrumentedAttribute[Any], operator: Operator, value: Text) -> ColumnElement[bool]:
    if operator == "=" and _is_any(value):
        return and_(column.is_not(None), column != "")
    if operator == "=":
        return and_(column.is_not(None), func.lower(column) == value.text.lower())
    if operator == "~":
        return and_(column.is_not(None), func.lower(column).contains(value.text.lower(), autoescape=True))
    raise QueryError(f"This is text: {operator} compares numbers. Use = or ~ (contains).", value.position)


def _number(value: Text) -> float:
    number = _number_or_none(value)
    if number is None:
        raise QueryError(f"{value.text} is no number.", value.position)
    return number


def _number_or_none(value: Text) -> float | None:
    text = value.text
    try:
        number = float(text[:-1]) / 100 if text.endswith("%") else float(text)
    except ValueError:
        return None
    return number if abs(number) < 1e300 else None


def _compare(column: SQLColumnExpression[Any], operator: Operator, number: float) -> ColumnElement[bool]:
    match operator:
        case "<":
            return column < number
        case "<=":
            return column <= number
        case ">":
            return column > number
        case ">=":
            return column >= number
        case _:
            return column == number


def _setting(key: str, operator: Operator, value: Text) -> ColumnElement[bool]:
    table = tables.ExperimentKey
    if operator == "=" and _is_any(value):
        fits: ColumnElement[bool] = true()
    elif operator in ("=", "~"):
        text = func.lower(table.text)
        number = _number_or_none(value)
        fits = text == value.text.lower() if operator == "=" else text.contains(value.text.lower(), autoescape=True)
        if number is not None and operator == "=":
            fits = or_(fits, table.number == number)
    else:
        fits = _compare(table.number, operator, _number(value))
    return _Experiment.id.in_(select(table.experiment_id).where(table.key == key, fits))


def _having(values: Select[str, Any], operator: Operator, value: Text) -> Select[str]:
    """The experiments whose value, the second column of `values`, compares so."""
    found = values.subquery()
    if operator == "=" and _is_any(value):
        return select(found.c[0]).where(found.c[1].is_not(None))
    if operator == "~":
        raise QueryError("This is a number: ~ searches in text.", value.position)
    return select(found.c[0]).where(_compare(found.c[1], operator, _number(value)))


def mean_of_series(name: str) -> Select[str, Any]:
    """Of each experiment the mean over its runs of a metric's newest value."""
    return (
        select(tables.Run.experiment_id, func.avg(tables.LatestMetric.value))
        .join(tables.LatestMetric, tables.LatestMetric.run_id == tables.Run.id)
        .where(tables.LatestMetric.name == name)
        .group_by(tables.Run.experiment_id)
    )


_SUCCESS: Select[str, Any] = (
    select(tables.Run.experiment_id, func.avg(cast(tables.Run.final_arrivals, Float) / tables.Run.final_episodes))
    .where(tables.Run.final_episodes > 0)
    .group_by(tables.Run.experiment_id)
)
_SEEDS: Select[str, Any] = select(tables.Run.experiment_id, func.count()).group_by(tables.Run.experiment_id)
_STATES: Select[str, Any] = select(tables.Run.experiment_id, aggregate_state_sql()).group_by(tables.Run.experiment_id)


def _state(operator: Operator, value: Text) -> ColumnElement[bool]:
    if operator != "=" or value.text.lower() not in STATES:
        raise QueryError(f"A state is one of {', '.join(STATES)}.", value.position)
    return in_state(value.text.lower())


def in_state(state: str) -> ColumnElement[bool]:
    """The experiments that are in a state, or mixed."""
    found = _STATES.subquery()
    return _Experiment.id.in_(select(found.c[0]).where(found.c[1] == state))


def _tag(operator: Operator, value: Text) -> ColumnElement[bool]:
    table = tables.ExperimentTag
    return _Experiment.id.in_(select(table.experiment_id).where(_text(table.tag, operator, value)))


def _project(operator: Operator, value: Text) -> ColumnElement[bool]:
    return _Experiment.project_id.in_(select(tables.Project.id).where(_text(tables.Project.name, operator, value)))


def _worker(operator: Operator, value: Text) -> ColumnElement[bool]:
    return _Experiment.id.in_(select(tables.Run.experiment_id).where(_text(tables.Run.worker, operator, value)))


def _starred(operator: Operator, value: Text) -> ColumnElement[bool]:
    text = value.text.lower()
    if operator != "=" or text not in _YES | _NO:
        raise QueryError("It is starred = yes, or starred = no.", value.position)
    return _Experiment.starred_at.is_not(None) if text in _YES else _Experiment.starred_at.is_(None)


def _created(operator: Operator, value: Text) -> ColumnElement[bool]:
    """A day is all of it: created = 2026-11-20 is any time of that day, created > 2026-11-20 the days after it."""
    if operator == "~":
        raise QueryError("This is a time: compare it with =, < or >.", value.position)
    if ago := _AGO.fullmatch(value.text):
        if operator == "=":
            raise QueryError(f"Say created > {value.text} for less than that ago.", value.position)
        return _compare(_Experiment.created_at, operator, time.time() - float(ago[1]) * _SECONDS[ago[2]])
    try:
        begin = datetime.fromisoformat(value.text)
    except ValueError:
        raise QueryError("A time is a day, 2026-11-20, or how long ago: 7d, 12h, 2w.", value.position) from None
    begin = begin if begin.tzinfo else begin.replace(tzinfo=UTC)
    start = begin.timestamp()
    end = start + (86_400.0 if len(value.text) <= len("2026-11-20") else 60.0)
    column = _Experiment.created_at
    match operator:
        case "<":
            return column < start
        case "<=":
            return column < end
        case ">":
            return column >= end
        case ">=":
            return column >= start
        case _:
            return and_(column >= start, column < end)


def values_of(session: Session, key: str) -> Select[str, Any]:
    """Of each experiment that has one its value under a whole key, as the second column, to sort and group by."""
    if is_series(key):
        return mean_of_series(key)
    if key not in ATTRIBUTES:
        table = tables.ExperimentKey
        value: SQLColumnExpression[Any] = table.number if KeyRepository(session).is_number(key) else func.lower(table.text)
        return select(table.experiment_id, value).where(table.key == key)
    columns: dict[str, SQLColumnExpression[Any]] = {
        "name": func.lower(_Experiment.name),
        "id": _Experiment.id,
        "notes": _Experiment.notes,
        "created": _Experiment.created_at,
        "campaign": _Experiment.campaign,
        "study": _Experiment.study_id,
        "starred": _Experiment.starred_at,
    }
    if key in columns:
        return select(_Experiment.id, columns[key])
    if key == "project":
        return select(_Experiment.id, tables.Project.name).join(tables.Project, tables.Project.id == _Experiment.project_id)
    if key == "tag":
        return select(tables.ExperimentTag.experiment_id, func.min(tables.ExperimentTag.tag)).group_by(
            tables.ExperimentTag.experiment_id
        )
    if key == "worker":
        return select(tables.Run.experiment_id, func.max(tables.Run.worker)).group_by(tables.Run.experiment_id)
    return {"success": _SUCCESS, "seeds": _SEEDS, "state": _STATES}[key]
