"""Experiments as rows of a list, and in groups."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from sqlalchemy import ColumnElement
from sqlalchemy.orm import Session

from server.arenas.store import ArenaStore
from server.checkpoints.views import success_over_runs
from server.database import tables
from server.database.tables import RunState
from server.estimates import in_short, last_values
from server.experiments.pace import seconds_left
from server.experiments.repository import aggregate_state
from server.http.paging import Window
from server.runs.views import SPEED
from server.schemas import SeedMean
from server.workbench.fields import ALIASES, ATTRIBUTES
from server.workbench.flatten import UNREADABLE, Value, flat_settings, form_of_settings
from server.workbench.keys import KeyRepository
from server.workbench.repository import ListedRun, WorkbenchRepository
from server.workbench.schemas import Group, ListedExperiment

_STEPS = "steps"
_IMPORTED = "task.arena.sha256"
_SHOWN = (*ALIASES.values(), _IMPORTED, _STEPS, UNREADABLE)


@dataclass(frozen=True, slots=True)
class _PacedRun:
    state: RunState
    step: int
    total_steps: int
    steps_per_second: float | None

    @property
    def seconds_left(self) -> float | None:
        speed = self.steps_per_second
        return max(0, self.total_steps - self.step) / speed if speed else None


def listed(
    session: Session,
    arenas: ArenaStore,
    experiments: Sequence[tables.Experiment],
    settings: Collection[str],
    metrics: Sequence[str],
) -> list[ListedExperiment]:
    """These experiments as rows, with the settings and the metrics that are asked for by their whole names."""
    ids = [experiment.id for experiment in experiments]
    repository = WorkbenchRepository(session)
    runs = repository.runs(ids)
    speeds = repository.speeds([run.id for run in chain(*runs.values()) if run.state == "running"], SPEED)
    tags = repository.tags(ids)
    values = _settings(session, experiments, {*_SHOWN, *settings})
    latest = repository.latest([run.id for run in chain(*runs.values())], metrics) if metrics else {}
    figures = figures_of([[run.id for run in runs.get(one, ())] for one in ids], latest, metrics)
    imported = {str(values[one][_IMPORTED]) for one in ids if values[one].get(_IMPORTED)}
    names = {sha256: name for sha256 in imported if (name := arenas.name(sha256))}
    return [
        _row(one, runs.get(one.id, []), speeds, tags.get(one.id, []), values[one.id], names, settings, figures[place])
        for place, one in enumerate(experiments)
    ]


def _settings(
    session: Session, experiments: Sequence[tables.Experiment], keys: Collection[str]
) -> dict[str, dict[str, Value]]:
    written = [experiment.id for experiment in experiments if experiment.indexed_as == form_of_settings()]
    found = KeyRepository(session).of(written, keys)
    for experiment in experiments:
        if experiment.id not in found:
            # Not written down yet: an older version's.
            found[experiment.id] = {key: value for key, value in flat_settings(experiment.training).items() if key in keys}
    return found


def _row(
    experiment: tables.Experiment,
    runs: Sequence[ListedRun],
    speeds: Mapping[str, float],
    tags: list[str],
    values: Mapping[str, Value],
    imported: Mapping[str, str],
    settings: Collection[str],
    metrics: dict[str, SeedMean],
) -> ListedExperiment:
    total = int(values.get(_STEPS, 0))
    paced = [_PacedRun(run.state, run.step, total, speeds.get(run.id)) for run in runs]
    unreadable = values.get(UNREADABLE)
    arena = str(values.get(ALIASES["arena"], ""))
    return ListedExperiment(
        id=experiment.id,
        project_id=experiment.project_id,
        name=experiment.name,
        created_at=experiment.created_at,
        arena=arena,
        arena_title=imported.get(str(values.get(_IMPORTED, "")), arena.replace("_", " ").capitalize()),
        movers=int(values.get(ALIASES["movers"], 0)),
        robot=str(values.get(ALIASES["robot"], "")),
        algorithm=str(values.get(ALIASES["algorithm"], "")),
        network=str(values.get(ALIASES["network"], "")),
        reward=str(values.get(ALIASES["reward"], "")),
        unreadable=str(unreadable).split(", ") if unreadable else [],
        state=aggregate_state([run.state for run in runs]) if runs else "mixed",
        states=sorted({run.state for run in runs}),
        runs=len(runs),
        run_id=runs[0].id if len(runs) == 1 else None,
        progress=min(1.0, sum(run.step for run in runs) / max(1, total * len(runs))),
        seconds_left=seconds_left(paced),
        campaign=experiment.campaign,
        study_id=experiment.study_id,
        success=success_over_runs([run.evaluation for run in runs if run.evaluation]),
        tags=tags,
        starred=experiment.starred_at is not None,
        noted=bool(experiment.notes),
        archived=experiment.archived_at is not None,
        deleted_at=experiment.deleted_at,
        settings={key: values[key] for key in settings if key in values},
        metrics=metrics,
    )


def figures_of(
    sets: Sequence[Sequence[str]], latest: Mapping[str, Mapping[str, float]], names: Sequence[str]
) -> list[dict[str, SeedMean]]:
    """What metrics say over sets of runs, one dictionary a set; what no run of a set has reported is absent."""
    figures: list[dict[str, SeedMean]] = [{} for _ in sets]
    most = max(map(len, sets), default=0)
    for name in names:
        values = np.full((most, len(sets)), np.nan)
        reported = latest.get(name, {})
        for place, run_ids in enumerate(sets):
            for row, run_id in enumerate(run_ids):
                values[row, place] = reported.get(run_id, np.nan)
        for figure, mean in zip(figures, last_values(name, values), strict=True):
            if mean is not None:
                figure[name] = mean
    return figures


def grouped(
    session: Session, wanted: ColumnElement[bool], key: str, metrics: Sequence[str], window: Window
) -> tuple[str, list[Group], int]:
    """The wanted experiments in groups: the key's whole name, the groups of the window, and how many there are.

    Raises:
        QueryError: there is no such key.
    """
    repository = WorkbenchRepository(session)
    whole, found, total = repository.groups(wanted, key, window)
    runs = repository.runs_of(wanted)
    latest = repository.latest_of(wanted, metrics) if metrics else {}
    together = [list(chain.from_iterable(runs.get(one, ()) for one in ids)) for _, ids in found]
    figures = figures_of([[run.id for run in group] for group in together], latest, metrics)
    return (
        whole,
        [
            _group(whole, value, len(ids), group, figure)
            for (value, ids), group, figure in zip(found, together, figures, strict=True)
        ],
        total,
    )


def _group(key: str, value: Any, experiments: int, runs: Sequence[ListedRun], metrics: dict[str, SeedMean]) -> Group:
    states: dict[RunState, int] = {}
    for run in runs:
        states[run.state] = states.get(run.state, 0) + 1
    success = success_over_runs([run.evaluation for run in runs if run.evaluation])
    return Group(
        value=value,
        query=_finds(key, value),
        experiments=experiments,
        runs=len(runs),
        states=states,
        success=in_short(success) if success else None,
        metrics=metrics,
    )


def _finds(key: str, value: Any) -> str:
    if key == "starred":
        return f"starred = {'no' if value is None else 'yes'}"
    if value is None:
        return f"{key} != *"
    return f"{key} = {value!r}" if isinstance(value, float | int) else f'{key} = "{value}"'


def is_setting(key: str) -> bool:
    """Whether a whole key names a setting rather than a property or a metric."""
    return key not in ATTRIBUTES and "/" not in key
