"""An evaluation as files: its episodes as CSV and JSON, its figures as a table that one prints."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from server.database import tables
from server.errors import NotFoundError
from server.estimates import mean_estimate, success_estimate
from server.evaluations.figures import merits
from server.evaluations.repository import episodes_of
from server.evaluations.schemas import EvaluationFigures, ExportedEpisode, ExportedEvaluation
from server.evaluations.ways import unpacked
from server.file_names import slug
from server.printing.tables import PrintedTable, number, percentage
from server.printing.text import latex, markdown
from server.printing.values import NOTHING
from server.spreadsheets import csv_rows
from sim.config import TaskConfig
from workers.reporting import Outcome

ExportFormat = Literal["csv", "json", "latex", "markdown"]

MEDIA: dict[ExportFormat, str] = {
    "csv": "text/csv",
    "json": "application/json",
    "latex": "application/x-tex",
    "markdown": "text/markdown",
}
_SUFFIXES: dict[ExportFormat, str] = {"csv": "csv", "json": "json", "latex": "tex", "markdown": "md"}
_UNITS = {"seconds": "s", "path_length": "m", "shortest_path": "m", "clearance": "m", "jerk": "m/s3"}


@dataclass(frozen=True)
class EvaluationFile:
    """What somebody takes away of an evaluation."""

    name: str
    content: bytes


def exported(evaluation: tables.PolicyEvaluation, wanted: ExportFormat) -> EvaluationFile:
    """One of an evaluation's files.

    Args:
        evaluation: the whole of it.
        wanted: csv: an episode in a row. json: the same with figures. latex, markdown: the figures with N and intervals.

    Raises:
        NotFoundError: it is not measured.
    """
    writers: dict[ExportFormat, Callable[[ExportedEvaluation], bytes]] = {
        "csv": _csv,
        "json": lambda whole: whole.model_dump_json(indent=1).encode(),
        "latex": lambda whole: latex(_printed(whole)).encode(),
        "markdown": lambda whole: markdown(_printed(whole)).encode(),
    }
    whole = _whole(evaluation)
    return EvaluationFile(f"mapless-{slug(f'{whole.title} on {whole.suite}')}.{_SUFFIXES[wanted]}", writers[wanted](whole))


def _whole(evaluation: tables.PolicyEvaluation) -> ExportedEvaluation:
    if evaluation.suite is None or evaluation.suite_hash is None or evaluation.task is None:
        raise NotFoundError("This evaluation is not measured yet: it has no episodes.")
    task, episodes = TaskConfig.model_validate(evaluation.task), episodes_of(evaluation)
    kept = unpacked(evaluation.ways) if evaluation.ways else None
    return ExportedEvaluation(
        id=evaluation.id,
        title=evaluation.title,
        suite=evaluation.suite,
        suite_hash=evaluation.suite_hash,
        figures=EvaluationFigures.model_validate(evaluation.figures),
        episodes=[
            ExportedEpisode(
                scenario=index + 1,
                map=kept.arenas[kept.arena_indices[index]].name if kept else None,
                outcome=episode.outcome,
                steps=episode.steps,
                seconds=round(episode.steps * task.control_period, 6),
                path_length=episode.path_length,
                shortest_path=episode.shortest_path,
                spl=merit,
                clearance=episode.min_clearance,
                jerk=kept.jerks[index] if kept and kept.jerks else None,
                reward=episode.reward,
                terms=dict(zip(kept.terms, kept.returns[index], strict=True)) if kept and kept.returns else None,
            )
            for index, (episode, merit) in enumerate(zip(episodes, merits(episodes, task), strict=True))
        ],
    )


def _csv(whole: ExportedEvaluation) -> bytes:
    """A row an episode; each of the reward's terms has a column where they are known."""
    columns = [name for name in ExportedEpisode.model_fields if name != "terms"]
    terms = list(whole.episodes[0].terms or {})
    heading = [f"{name} ({_UNITS[name]})" if name in _UNITS else name for name in columns]
    rows = [
        [*(getattr(episode, name) for name in columns), *((episode.terms or {})[name] for name in terms)]
        for episode in whole.episodes
    ]
    return csv_rows([[*heading, *(f"reward/{name}" for name in terms)], *rows])


def _printed(whole: ExportedEvaluation) -> PrintedTable:
    episodes = whole.episodes
    arrived = [episode for episode in episodes if episode.outcome == "arrival"]
    ended = [episode.outcome for episode in episodes]
    all_of = f"{len(episodes)}"

    def share(name: str, outcome: Outcome) -> tuple[str, ...]:
        return name, percentage(success_estimate([ended.count(outcome)], [len(ended)], trained=False)), all_of

    def mean(
        name: str, some: Sequence[ExportedEpisode], of: Callable[[ExportedEpisode], float], digits: int
    ) -> tuple[str, ...]:
        return name, number(mean_estimate([np.array([of(each) for each in some])]), digits), f"{len(some)}"

    rows = [
        share("Success (%)", "arrival"),
        share("Collision (%)", "collision"),
        share("Time-out (%)", "timeout"),
        mean("SPL", episodes, lambda each: each.spl, 3),
        ("SPL of the worst tenth", f"{whole.figures.worst_tenth_spl:.3f}", all_of),
        mean("Steps to target", arrived, lambda each: each.steps, 1),
        mean("Time to target (s)", arrived, lambda each: each.seconds, 2),
        mean("Path (m)", arrived, lambda each: each.path_length, 2),
        mean("Clearance (m)", episodes, lambda each: each.clearance, 3),
        ("Jerk (m/s³)", f"{whole.figures.jerk:.3f}", all_of)
        if episodes[0].jerk is None
        else mean("Jerk (m/s³)", episodes, lambda each: each.jerk or 0.0, 3),
        mean("Return", episodes, lambda each: each.reward, 1),
        *(
            mean(f"Return by {name}", episodes, lambda each, name=name: (each.terms or {})[name], 1)  # type: ignore[misc]
            for name in episodes[0].terms or {}
        ),
    ]
    return PrintedTable(
        name="evaluation",
        title=f"{whole.title} on {whole.suite}",
        caption=f"Suite {whole.suite} ({whole.suite_hash[:8]}). 95 % intervals over the episodes of this one policy (exact "
        "of shares, Student's t of means); another seed of it is not in them. Steps, time and path are of arrivals.",
        heading=("Figure", "Value", "N (episodes)"),
        rows=[tuple(cell or NOTHING for cell in row) for row in rows],
    )
