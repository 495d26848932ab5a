"""An experiment's runs as JSON: configuration, seeds, final evaluations and their episodes."""

from collections.abc import Iterator, Sequence

from sqlalchemy.orm import Session

from server.checkpoints.repository import CheckpointRepository, decode_episodes
from server.data_export.schemas import ExportedEvaluation, ExportedExperiment, ExportedRun
from server.database import tables
from server.database.engine import Database
from server.metrics.views import thinned_view
from server.runs.repository import RunRepository


def exported(experiment: tables.Experiment) -> ExportedExperiment:
    """The experiment without its runs."""
    return ExportedExperiment(
        id=experiment.id,
        name=experiment.name,
        project_id=experiment.project_id,
        created_at=experiment.created_at,
        notes=experiment.notes,
        training=experiment.training,
        runs=[],
    )


def document(database: Database, experiment: ExportedExperiment, run_ids: Sequence[str]) -> Iterator[bytes]:
    """`ExportedExperiment` as JSON, a run at a time: each is a transaction of its own.

    Raises:
        NotFoundError: a run was removed meanwhile.
    """
    yield experiment.model_dump_json().encode().removesuffix(b"]}")
    for index, run_id in enumerate(run_ids):
        with database.read() as session:
            run = _run(session, run_id)
        yield (b"," if index else b"") + run.model_dump_json().encode()
    yield b"]}"


def _run(session: Session, run_id: str) -> ExportedRun:
    run = RunRepository(session).get(run_id)
    checkpoints = CheckpointRepository(session)
    evaluation = checkpoints.final_evaluations([run_id]).get(run_id)
    return ExportedRun(
        id=run.id,
        seed=run.seed,
        state=run.state,
        attempt=run.attempt,
        step=run.step,
        worker=run.worker,
        error=run.error,
        created_at=run.created_at,
        started_at=run.started_at,
        finished_at=run.finished_at,
        thinned=thinned_view(run),
        final_evaluation=None
        if evaluation is None
        else ExportedEvaluation(
            checkpoint=evaluation.checkpoint_id,
            step=checkpoints.get(evaluation.checkpoint_id).step,
            suite=evaluation.suite,
            suite_hash=evaluation.suite_hash,
            episodes=list(decode_episodes(evaluation)),
        ),
    )
