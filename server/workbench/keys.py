"""The settings of experiments, written down key by key."""

from collections.abc import Collection, Sequence

from sqlalchemy import ColumnElement, delete, func, insert, select, true
from sqlalchemy.orm import InstrumentedAttribute, Session

from server.database import tables
from server.workbench.flatten import Value, flat_settings, form_of_settings

_VALUES = 20
# Series are alike in all runs of an algorithm: those of the newest runs name them all.
_RUNS_LOOKED_AT = 200


class KeyRepository:
    """Reads and writes settings and their names within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def write_down(self, experiments: Collection[tables.Experiment]) -> None:
        """Replace what is written down of these experiments' settings."""
        table = tables.ExperimentKey
        self._session.execute(delete(table).where(table.experiment_id.in_([one.id for one in experiments])))
        rows = []
        for experiment in experiments:
            for key, value in flat_settings(experiment.training).items():
                text = value if isinstance(value, str) else None
                rows.append(
                    {"experiment_id": experiment.id, "key": key, "number": None if text is not None else value, "text": text}
                )
            experiment.indexed_as = form_of_settings()
        if rows:
            self._session.flush()
            self._session.execute(insert(table), rows)

    def due(self, limit: int) -> Sequence[tables.Experiment]:
        """Experiments whose settings were written down by another version, or never, the newest first."""
        query = (
            select(tables.Experiment)
            .where(tables.Experiment.indexed_as.is_distinct_from(form_of_settings()))
            .order_by(tables.Experiment.created_at.desc())
            .limit(limit)
        )
        return self._session.scalars(query).all()

    def settings(self, visible: Collection[str] | None = None) -> list[tuple[str, bool]]:
        """Every key with whether its values are numbers, by key."""
        table = tables.ExperimentKey
        query = select(table.key, func.count(table.number)).where(_seen(table.experiment_id, visible))
        query = query.group_by(table.key).order_by(table.key)
        return [(key, numbers > 0) for key, numbers in self._session.execute(query)]

    def series(self, visible: Collection[str] | None = None) -> list[str]:
        """The names of metrics that the newest runs have reported."""
        newest = (
            select(tables.Run.id)
            .where(_seen(tables.Run.experiment_id, visible))
            .order_by(tables.Run.created_at.desc())
            .limit(_RUNS_LOOKED_AT)
        )
        query = select(tables.LatestMetric.name).where(tables.LatestMetric.run_id.in_(newest)).distinct()
        return sorted(self._session.scalars(query))

    def values(self, key: str, part: str, visible: Collection[str] | None = None) -> list[str]:
        """Values of a key that contain `part` in any case, the most frequent first, numbers as they are typed."""
        table = tables.ExperimentKey
        query = (
            select(table.number, table.text)
            .where(table.key == key, _seen(table.experiment_id, visible))
            .group_by(table.number, table.text)
            .order_by(func.count().desc(), table.text, table.number)
        )
        if part:
            query = query.where(func.lower(table.text).contains(part.lower(), autoescape=True) | table.text.is_(None))
        shown = [text or "" if number is None else f"{number:g}" for number, text in self._session.execute(query)]
        return [value for value in shown if part.lower() in value.lower()][:_VALUES]

    def tags(self, part: str, visible: Collection[str] | None = None) -> list[str]:
        """Tags in use that contain `part` in any case, the most frequent first."""
        table = tables.ExperimentTag
        query = (
            select(table.tag)
            .where(_seen(table.experiment_id, visible))
            .group_by(table.tag)
            .order_by(func.count().desc(), table.tag)
            .limit(_VALUES)
        )
        if part:
            query = query.where(func.lower(table.tag).contains(part.lower(), autoescape=True))
        return list(self._session.scalars(query))

    def matching(self, ending: str) -> list[str]:
        """The keys that are `ending`, or else that end with it after a dot: two at most."""
        key = tables.ExperimentKey.key
        if self._session.scalar(select(key).where(key == ending).limit(1)) is not None:
            return [ending]
        query = select(key).where(key.endswith(f".{ending}", autoescape=True)).distinct().order_by(key).limit(2)
        return list(self._session.scalars(query))

    def is_number(self, key: str) -> bool:
        """Whether a key has a number anywhere: then it is sorted by numbers."""
        table = tables.ExperimentKey
        return (
            self._session.scalar(select(table.key).where(table.key == key, table.number.is_not(None)).limit(1)) is not None
        )

    def of(self, experiment_ids: Collection[str], keys: Collection[str]) -> dict[str, dict[str, Value]]:
        """What these experiments have under these keys, by experiment and key; what there is not is absent."""
        table = tables.ExperimentKey
        found: dict[str, dict[str, Value]] = {experiment_id: {} for experiment_id in experiment_ids}
        query = select(table.experiment_id, table.key, table.number, table.text).where(
            table.experiment_id.in_(experiment_ids), table.key.in_(keys)
        )
        for experiment_id, key, number, text in self._session.execute(query):
            value = text if number is None else number
            if value is not None:
                found[experiment_id][key] = value
        return found


def _seen(experiment_id: InstrumentedAttribute[str], visible: Collection[str] | None) -> ColumnElement[bool]:
    """Whether an experiment is of one of these projects; of any where they are None."""
    if visible is None:
        return true()
    return experiment_id.in_(select(tables.Experiment.id).where(tables.Experiment.project_id.in_(visible)))
