"""A project on its way out: run by run, each read when its turn comes."""

from collections.abc import Iterator, Sequence

from pydantic import BaseModel

from server.audit.repository import AuditRepository
from server.checkpoints.repository import CheckpointRepository, evaluation_result
from server.data_export.files import OutgoingFile
from server.data_export.series import read_run
from server.database import tables
from server.errors import NotFoundError
from server.file_names import slug
from server.project_archives import tar
from server.project_archives.others import archived_evaluation, archived_policy, archived_recording, arenas_of
from server.project_archives.repository import ProjectArchiveRepository
from server.project_archives.schemas import (
    ArchivedCheckpoint,
    ArchivedEvaluation,
    ArchivedEvent,
    ArchivedExperiment,
    ArchivedLog,
    ArchivedPoints,
    ArchivedRun,
    ArchiveManifest,
)
from server.project_archives.studies import archived_study
from server.projects.repository import ProjectRepository
from server.run_log.repository import LogRepository
from server.runs.repository import RunRepository
from server.services import Services
from server.version import version
from server.workbench.marks import MarkRepository


def leaving(services: Services, project_id: str) -> OutgoingFile:
    """The project as one file: studies, experiments with tags and notes, runs with all that hangs on them.

    That is events, printed lines, points, checkpoints and their evaluations. Beside them uploaded policies, robots'
    recordings, evaluations that were asked for of any of these, of shipped policies and of baselines, and the imported
    arenas that any of these use.

    What lies in the trash stays, and so do a damaged checkpoint and one whose archive is gone. A run that goes on leaves
    as it is when its turn comes. Only one run's documents are held at a time.

    Raises:
        NotFoundError: there is no such project.
    """
    with services.database.write() as session:
        project = ProjectRepository(session).get(project_id)
        AuditRepository(session).add("project.exported", target=project.id, name=project.name, project_id=project.id)
        experiment_ids = ProjectArchiveRepository(session).experiments(project_id)
        study_ids = ProjectArchiveRepository(session).studies(project_id)
    manifest = ArchiveManifest(version=version(), project=project.name)
    blocks = _whole(services, project_id, manifest, study_ids, experiment_ids)
    return OutgoingFile(f"mapless-{slug(project.name)}.tar", "application/x-tar", blocks)


def _whole(
    services: Services, project_id: str, manifest: ArchiveManifest, study_ids: Sequence[str], experiment_ids: Sequence[str]
) -> Iterator[bytes]:
    yield from _document("manifest.json", manifest)
    with services.database.read() as session:
        # One after another: a thousand of them, each of some kilobytes.
        arenas = list(arenas_of(session, services.arenas, project_id))
        policy_ids = ProjectArchiveRepository(session).policies(project_id)
        recording_ids = ProjectArchiveRepository(session).recordings(project_id)
    for arena in arenas:
        yield from _document(f"arenas/{arena.sha256}.json", arena)
    for policy_id in policy_ids:
        yield from _policy(services, policy_id)
    for recording_id in recording_ids:
        yield from _recording(services, recording_id)
    for study_id in study_ids:
        with services.database.read() as session:
            study = archived_study(session, study_id)
        if study is not None:
            yield from _document(f"studies/{study_id}.json", study)
    for experiment_id in experiment_ids:
        with services.database.read() as session:
            experiment = session.get(tables.Experiment, experiment_id)
            if experiment is None or experiment.deleted_at is not None:
                continue
            archived = _experiment(experiment, MarkRepository(session).tags(experiment_id))
            run_ids = ProjectArchiveRepository(session).runs(experiment_id)
        yield from _document(f"{experiment_id}/experiment.json", archived)
        for run_id in run_ids:
            yield from _run(services, f"{experiment_id}/{run_id}", run_id)
    with services.database.read() as session:
        evaluation_ids = ProjectArchiveRepository(session).evaluations(project_id)
    for evaluation_id in evaluation_ids:
        with services.database.read() as session:
            evaluation = archived_evaluation(session, evaluation_id)
        if evaluation is not None:
            yield from _document(f"evaluations/{evaluation_id}.json", evaluation)
    yield tar.end()


def _policy(services: Services, policy_id: str) -> Iterator[bytes]:
    with services.database.read() as session:
        row = session.get(tables.UploadedPolicy, policy_id)
        if row is None:
            return
        archived, graph = archived_policy(row), row.graph
    yield from _document(f"policies/{policy_id}.json", archived)
    yield from tar.member(f"policies/{policy_id}.onnx", len(graph), [graph])


def _recording(services: Services, recording_id: str) -> Iterator[bytes]:
    with services.database.read() as session:
        row = session.get(tables.Bag, recording_id)
        if row is None:
            return
        archived, content = archived_recording(row), row.content
    yield from _document(f"recordings/{recording_id}.json", archived)
    yield from tar.member(f"recordings/{recording_id}.bag", len(content), [content])


def _run(services: Services, folder: str, run_id: str) -> Iterator[bytes]:
    with services.database.read() as session:
        run = session.get(tables.Run, run_id)
        if run is None:
            return
        events = RunRepository(session).events(run_id)
        checkpoints = ProjectArchiveRepository(session).checkpoints(run_id)
        evaluated = ProjectArchiveRepository(session).evaluated(run_id)
    kept = [checkpoint for checkpoint in checkpoints if _is_there(services, checkpoint)]
    yield from _document(f"{folder}/run.json", _archived(run, events, kept))
    for checkpoint in kept:
        blocks = services.files.read(checkpoint.id)
        yield from tar.member(f"{folder}/{checkpoint.id}.zip", checkpoint.size, blocks)
        if checkpoint.id in evaluated:
            with services.database.read() as session:
                evaluation = CheckpointRepository(session).evaluation(checkpoint.id)
            yield from _document(
                f"{folder}/{checkpoint.id}.json",
                ArchivedEvaluation(created_at=evaluation.created_at, result=evaluation_result(evaluation)),
            )
    with services.database.read() as session:
        # Two megabytes at most.
        printed = list(LogRepository(session).chunks(run_id))
    for number, (attempt, first, lines) in enumerate(printed):
        yield from _document(f"{folder}/{number}.log", ArchivedLog(attempt=attempt, first=first, lines=lines))
    series = read_run(services.database, run_id)
    for number, (name, buckets) in enumerate(series.thinned.items()):
        head = ArchivedPoints(name=name, count=len(buckets)).model_dump_json().encode() + b"\n"
        content = head + buckets.encode()
        yield from tar.member(f"{folder}/{number}.thinned", len(content), [content])
    for number, (name, points) in enumerate(series.pieces):
        head = ArchivedPoints(name=name, count=len(points)).model_dump_json().encode() + b"\n"
        content = head + points.encode()
        yield from tar.member(f"{folder}/{number}.points", len(content), [content])
    yield from tar.member(f"{folder}/end", 0, [])


def _document(name: str, document: BaseModel) -> Iterator[bytes]:
    content = document.model_dump_json().encode()
    return tar.member(name, len(content), [content])


def _is_there(services: Services, checkpoint: tables.Checkpoint) -> bool:
    try:
        services.files.open(checkpoint.id).close()
    except NotFoundError:
        return False
    return True


def _experiment(experiment: tables.Experiment, tags: list[str]) -> ArchivedExperiment:
    return ArchivedExperiment(
        id=experiment.id,
        name=experiment.name,
        training=experiment.training,
        created_at=experiment.created_at,
        notes=experiment.notes,
        starred_at=experiment.starred_at,
        archived_at=experiment.archived_at,
        tags=tags,
        campaign=experiment.campaign,
        campaign_row=experiment.campaign_row,
        study_id=experiment.study_id,
    )


def _archived(run: tables.Run, events: Sequence[tables.RunEvent], checkpoints: Sequence[tables.Checkpoint]) -> ArchivedRun:
    return ArchivedRun(
        id=run.id,
        seed=run.seed,
        state=run.state,
        attempt=run.attempt,
        step=run.step,
        last_seq=run.last_seq,
        error=run.error,
        created_at=run.created_at,
        started_at=run.started_at,
        finished_at=run.finished_at,
        thinned_at=run.thinned_at,
        events=[ArchivedEvent(at=event.at, step=event.step, level=event.level, message=event.message) for event in events],
        checkpoints=[
            ArchivedCheckpoint(id=each.id, step=each.step, created_at=each.created_at, size=each.size, sha256=each.sha256)
            for each in checkpoints
        ],
    )
