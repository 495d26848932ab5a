"""Checkpoints and their evaluations in SQL."""

import zlib
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import TypeAdapter
from sqlalchemy import Float, Select, cast, func, select
from sqlalchemy.orm import Session, defer

from server.checkpoints.sums import add_to_sums
from server.database import tables
from server.errors import NotFoundError
from server.files import StoredFile
from server.http.paging import Window
from server.ids import new_id
from workers.reporting import EpisodeResult, EvaluationResult

_EPISODES = TypeAdapter(tuple[EpisodeResult, ...])


@dataclass(frozen=True)
class Step:
    """A checkpoint in a line: its id and step, the hash of the suite that it was measured on, and the share that arrived."""

    id: str
    step: int
    suite_hash: str | None
    success: float | None


class CheckpointRepository:
    """Reads and writes checkpoints within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, run_id: str, step: int, file: StoredFile, evaluation: EvaluationResult | None) -> tables.Checkpoint:
        """Register an archive that lies in the file store, under the store's id, with what its weights achieved."""
        checkpoint = tables.Checkpoint(id=file.id, run_id=run_id, step=step, size=file.size, sha256=file.sha256)
        self._session.add(checkpoint)
        self._session.flush()
        experiment_id = self._session.get_one(tables.Run, run_id).experiment_id
        add_to_sums(self._session, experiment_id, checkpoint_count=1, checkpoint_bytes=file.size)
        if evaluation is not None:
            arrived = [episode.steps for episode in evaluation.episodes if episode.outcome == "arrival"]
            self._session.add(
                tables.Evaluation(
                    id=new_id(),
                    checkpoint_id=file.id,
                    suite=evaluation.suite,
                    suite_hash=evaluation.suite_hash,
                    episode_count=len(evaluation.episodes),
                    arrivals=len(arrived),
                    steps_mean=float(np.mean(arrived)) if arrived else None,
                    reward_mean=float(np.mean([episode.reward for episode in evaluation.episodes])),
                    episodes=zlib.compress(_EPISODES.dump_json(evaluation.episodes)),
                )
            )
            self._keep_last(run_id, step, evaluation, len(arrived))
        return checkpoint

    def _keep_last(self, run_id: str, step: int, evaluation: EvaluationResult, arrivals: int) -> None:
        """Beside the run, unless a later step has been evaluated."""
        run = self._session.get_one(tables.Run, run_id)
        if run.final_step is None or run.final_step <= step:
            run.final_step, run.final_suite = step, evaluation.suite_hash
            run.final_arrivals, run.final_episodes = arrivals, len(evaluation.episodes)

    def get(self, checkpoint_id: str) -> tables.Checkpoint:
        """The checkpoint.

        Raises:
            NotFoundError: there is none.
        """
        checkpoint = self._session.get(tables.Checkpoint, checkpoint_id)
        if checkpoint is None:
            raise NotFoundError.of("checkpoint", checkpoint_id)
        return checkpoint

    def at_step(self, run_id: str, step: int) -> tables.Checkpoint | None:
        """The run's whole checkpoint of exactly this step, if there is one."""
        query = _whole(run_id).where(tables.Checkpoint.step == step)
        return self._session.scalars(query.order_by(tables.Checkpoint.created_at.desc()).limit(1)).first()

    def last(self, run_id: str) -> tables.Checkpoint | None:
        """The run's whole checkpoint of the highest step, from which it is resumed."""
        query = _whole(run_id).order_by(tables.Checkpoint.step.desc(), tables.Checkpoint.created_at.desc())
        return self._session.scalars(query.limit(1)).first()

    def page(
        self, run_id: str, window: Window, step: int | None = None
    ) -> tuple[Sequence[tuple[tables.Checkpoint, tables.Evaluation | None]], int]:
        """The run's checkpoints, all or that of one step, the newest first, each with its evaluation; how many in all.

        The episodes of the evaluations are left in the database.
        """
        wanted = [tables.Checkpoint.run_id == run_id]
        if step is not None:
            wanted.append(tables.Checkpoint.step == step)
        total = self._session.scalar(select(func.count()).select_from(tables.Checkpoint).where(*wanted)) or 0
        query = (
            select(tables.Checkpoint, tables.Evaluation)
            .outerjoin(tables.Evaluation, tables.Evaluation.checkpoint_id == tables.Checkpoint.id)
            .where(*wanted)
            .options(defer(tables.Evaluation.episodes))
            .order_by(tables.Checkpoint.step.desc(), tables.Checkpoint.created_at.desc())
            .limit(window.limit)
            .offset(window.offset)
        )
        return [(checkpoint, evaluation) for checkpoint, evaluation in self._session.execute(query)], total

    def steps(self, run_id: str) -> list[Step]:
        """The run's whole checkpoints in the order of their steps, without what is heavy."""
        checkpoint, evaluation = tables.Checkpoint, tables.Evaluation
        query = (
            select(checkpoint.id, checkpoint.step, evaluation.suite_hash, evaluation.arrivals, evaluation.episode_count)
            .outerjoin(evaluation, evaluation.checkpoint_id == checkpoint.id)
            .where(checkpoint.run_id == run_id, checkpoint.damaged_at.is_(None))
            .order_by(checkpoint.step, checkpoint.created_at)
        )
        return [
            Step(row[0], row[1], row[2], None if row[4] is None else row[3] / row[4]) for row in self._session.execute(query)
        ]

    def best(self, run_id: str) -> tuple[tables.Checkpoint, tables.Evaluation] | None:
        """The run's whole checkpoint with the highest success rate; of equal ones the quickest, then the newest."""
        rate = cast(tables.Evaluation.arrivals, Float) / tables.Evaluation.episode_count
        query = (
            select(tables.Checkpoint, tables.Evaluation)
            .join(tables.Evaluation, tables.Evaluation.checkpoint_id == tables.Checkpoint.id)
            .where(tables.Checkpoint.run_id == run_id, tables.Checkpoint.damaged_at.is_(None))
            .options(defer(tables.Evaluation.episodes))
            # Where nobody arrived there are no steps to the target: behind all others.
            .order_by(
                rate.desc(),
                tables.Evaluation.steps_mean.is_(None),
                tables.Evaluation.steps_mean,
                tables.Checkpoint.step.desc(),
            )
            .limit(1)
        )
        row = self._session.execute(query).first()
        return (row[0], row[1]) if row else None

    def evaluation(self, checkpoint_id: str) -> tables.Evaluation:
        """The checkpoint's evaluation.

        Raises:
            NotFoundError: it has none.
        """
        query = select(tables.Evaluation).where(tables.Evaluation.checkpoint_id == checkpoint_id)
        evaluation = self._session.scalars(query).first()
        if evaluation is None:
            raise NotFoundError(f"Checkpoint {checkpoint_id} has not been evaluated.")
        return evaluation

    def evaluated_at(self, checkpoint_id: str) -> float:
        """When the checkpoint was evaluated, in seconds since the epoch.

        Raises:
            NotFoundError: it was not.
        """
        evaluated_at = self._session.scalars(
            select(tables.Evaluation.created_at).where(tables.Evaluation.checkpoint_id == checkpoint_id)
        ).first()
        if evaluated_at is None:
            raise NotFoundError(f"Checkpoint {checkpoint_id} has not been evaluated.")
        return evaluated_at

    def evaluated(self, run_ids: Collection[str]) -> list[tuple[str, int, float]]:
        """How many evaluated checkpoints each of these runs has, and when the last was evaluated, by run."""
        checkpoint, evaluation = tables.Checkpoint, tables.Evaluation
        query = (
            select(checkpoint.run_id, func.count(), func.max(evaluation.created_at))
            .join(evaluation, evaluation.checkpoint_id == checkpoint.id)
            .where(checkpoint.run_id.in_(run_ids))
            .group_by(checkpoint.run_id)
            .order_by(checkpoint.run_id)
        )
        return [(row[0], row[1], row[2]) for row in self._session.execute(query)]

    def final_evaluations(self, run_ids: Collection[str], *, with_episodes: bool = False) -> dict[str, tables.Evaluation]:
        """The evaluation of each run's last evaluated checkpoint, by run.

        Args:
            run_ids: of the runs.
            with_episodes: whether to read their episodes at once; else they are left in the database.
        """
        last = (
            select(tables.Checkpoint.run_id, func.max(tables.Checkpoint.step).label("step"))
            .join(tables.Evaluation, tables.Evaluation.checkpoint_id == tables.Checkpoint.id)
            .where(tables.Checkpoint.run_id.in_(run_ids))
            .group_by(tables.Checkpoint.run_id)
            .subquery()
        )
        query = (
            select(tables.Checkpoint.run_id, tables.Evaluation)
            .join(tables.Evaluation, tables.Evaluation.checkpoint_id == tables.Checkpoint.id)
            .join(last, (last.c.run_id == tables.Checkpoint.run_id) & (last.c.step == tables.Checkpoint.step))
            .options(*(() if with_episodes else (defer(tables.Evaluation.episodes),)))
            .order_by(tables.Evaluation.created_at)
        )
        return {row[0]: row[1] for row in self._session.execute(query)}

    def archives(self, run_ids: Collection[str]) -> dict[str, str]:
        """The SHA-256 of the archive of each checkpoint of these runs, by its id."""
        query = select(tables.Checkpoint.id, tables.Checkpoint.sha256).where(tables.Checkpoint.run_id.in_(run_ids))
        return {row[0]: row[1] for row in self._session.execute(query)}


def _whole(run_id: str) -> Select[tables.Checkpoint]:
    return select(tables.Checkpoint).where(tables.Checkpoint.run_id == run_id, tables.Checkpoint.damaged_at.is_(None))


def decode_episodes(evaluation: tables.Evaluation) -> tuple[EpisodeResult, ...]:
    """The evaluation's episodes, in the suite's order."""
    return _EPISODES.validate_json(zlib.decompress(evaluation.episodes))


def evaluation_result(evaluation: tables.Evaluation) -> EvaluationResult:
    """The evaluation as it was reported."""
    return EvaluationResult(suite=evaluation.suite, suite_hash=evaluation.suite_hash, episodes=decode_episodes(evaluation))
