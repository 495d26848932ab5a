"""Which runs' curves are thinned, and what that comes to, in SQL."""

from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from sqlalchemy import Float, Integer, case, cast, func, or_, select, update
from sqlalchemy.orm import Session
from sqlalchemy.sql.elements import ColumnElement

from server.curve_thinning.rule import CURVES_STAY, CurveRule
from server.database import tables
from server.metrics.thinning import ThinningRepository
from server.runs import states

DAY = 86_400.0
_RUNS_AT_ONCE = 1_000

STARRED = "it is starred"
SEARCHED = "a study that goes on measures by it"
IN_TRASH = "it lies in the trash, and goes as a whole"


@dataclass(frozen=True)
class Longest:
    """The series of a run that a rule would thin.

    Attributes:
        points: of each, by name.
        size: bytes of what they take, and nothing else needs.
    """

    points: dict[str, int]
    size: int


def rule_of(experiment: tables.Experiment, default: CurveRule | None) -> CurveRule:
    """The rule that an experiment goes by."""
    if experiment.curve_rule is None:
        return default or CURVES_STAY
    return CurveRule.model_validate(experiment.curve_rule)


class CurveThinningRepository:
    """Reads and writes within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def spared(self, experiment: tables.Experiment) -> str | None:
        """Why no run of an experiment is thinned; None where a rule may."""
        if experiment.deleted_at is not None:
            return IN_TRASH
        if experiment.starred_at is not None:
            return STARRED
        trial = tables.StudyTrial
        searched = select(trial.number).where(trial.experiment_id == experiment.id, trial.state == "running").limit(1)
        return SEARCHED if self._session.scalar(searched) is not None else None

    def unlooked(self, default: CurveRule | None, now: float, limit: int) -> Sequence[str]:
        """Some runs that a rule holds for and that nobody has looked at by it, those that ended first first."""
        run, experiment, trial = tables.Run, tables.Experiment, tables.StudyTrial
        points, days = _rules(default)
        searched = select(trial.experiment_id).where(trial.state == "running", trial.experiment_id.is_not(None))
        query = (
            select(run.id)
            .join(experiment, experiment.id == run.experiment_id)
            .where(
                run.state.in_(states.FINISHED),
                run.finished_at <= now - days * DAY,
                run.thins_at.is_(None),
                points.is_not(None),
                or_(run.thin_enough.is_(None), run.thin_enough > points),
                experiment.deleted_at.is_(None),
                experiment.starred_at.is_(None),
                experiment.id.not_in(searched),
            )
            .order_by(run.finished_at, run.id)
        )
        return self._session.scalars(query.limit(limit)).all()

    def due(self, now: float) -> str | None:
        """A run that was to be thinned by now, the one that has been due for longest."""
        run = tables.Run
        return self._session.scalar(select(run.id).where(run.thins_at <= now).order_by(run.thins_at, run.id).limit(1))

    def without_rule(self, default: CurveRule | None) -> Sequence[str]:
        """Marked runs that no rule holds for any more."""
        run, experiment = tables.Run, tables.Experiment
        points, _ = _rules(default)
        stays = or_(points.is_(None), experiment.starred_at.is_not(None), experiment.deleted_at.is_not(None))
        query = select(run.id).join(experiment, experiment.id == run.experiment_id).where(run.thins_at.is_not(None), stays)
        return self._session.scalars(query.limit(_RUNS_AT_ONCE)).all()

    def spare(self, run_ids: Collection[str]) -> None:
        """Take their mark from runs."""
        self._session.execute(update(tables.Run).where(tables.Run.id.in_(run_ids)).values(thins_at=None))

    def begin_anew(self, experiment_id: str) -> None:
        """Nobody has looked at an experiment's runs yet, and none is thinned."""
        run = tables.Run
        marked = or_(run.thins_at.is_not(None), run.thin_enough.is_not(None))
        query = update(run).where(run.experiment_id == experiment_id, marked)
        self._session.execute(query.values(thins_at=None, thin_enough=None))

    def hasten(self, experiment_id: str, moment: float) -> int:
        """Let what is thinned of an experiment be thinned at `moment`; how many runs that are."""
        run = tables.Run
        marked = update(run).where(run.experiment_id == experiment_id, run.thins_at > moment)
        return self._session.execute(marked.values(thins_at=moment)).rowcount  # type: ignore[attr-defined,no-any-return]

    def longest(self, run_ids: Collection[str], limit: int) -> dict[str, Longest]:
        """By run the series that have more points than `limit`; runs that have none are left out."""
        counted = ThinningRepository(self._session).longer_than(run_ids, limit)
        points: dict[str, dict[str, int]] = defaultdict(dict)
        for (run_id, name), count in counted.items():
            points[run_id][name] = count
        sizes = self._sizes(points)
        return {run_id: Longest(of_run, sizes[run_id]) for run_id, of_run in points.items()}

    def _sizes(self, series: dict[str, dict[str, int]]) -> dict[str, int]:
        """Bytes of these series by run: their chunks, their summaries, and the axes on which nothing else lies."""
        sizes = dict.fromkeys(series, 0)
        chunk, axis, summary = tables.MetricChunk, tables.MetricAxis, tables.MetricSummary
        kept: set[tuple[str, str]] = set()
        chunks = select(chunk.run_id, chunk.name, chunk.axis, func.length(chunk.points)).where(chunk.run_id.in_(series))
        for run_id, name, lies_on, size in self._session.execute(chunks):
            if name in series[run_id]:
                sizes[run_id] += int(size)
            elif lies_on is not None:
                kept.add((run_id, lies_on))
        axes = select(axis.run_id, axis.id, func.length(axis.data)).where(axis.run_id.in_(series))
        for run_id, axis_id, size in self._session.execute(axes):
            sizes[run_id] += int(size) if (run_id, axis_id) not in kept else 0
        summaries = select(summary.run_id, summary.name, func.length(summary.data)).where(summary.run_id.in_(series))
        for run_id, name, size in self._session.execute(summaries):
            sizes[run_id] += int(size) if name in series[run_id] else 0
        return sizes


def _rules(default: CurveRule | None) -> tuple[ColumnElement[int | None], ColumnElement[float]]:
    """Points and days of the rule that an experiment goes by."""
    rule, usual = tables.Experiment.curve_rule, default or CURVES_STAY
    own = rule.is_not(None)
    return (
        case((own, rule["points"].as_integer()), else_=cast(usual.points, Integer)),
        case((own, rule["after_days"].as_float()), else_=cast(usual.after_days, Float)),
    )
