"""A project on its way in, as it arrives: each run with all that hangs on it, or not at all.

A checkpoint's archive goes into the store first, announced as every upload is, so that one of a run that does not come to
its end is swept away; the run's last word (`end`) registers everything in one transaction.
"""

import time
import zlib
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from server.audit.repository import AuditRepository
from server.bags.schemas import MAX_BAG_BYTES
from server.checkpoints.archives import LooseArchives, give_up_archives
from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.errors import ConflictError, CorruptUploadError, InvalidRequestError
from server.events.changes import Change
from server.experiments.repository import ExperimentRepository
from server.files import StoredFile
from server.metrics.buckets import BUCKET_BYTES, MAX_BUCKETS, Buckets
from server.metrics.points import Points
from server.metrics.repository import MetricRepository, PackedSeries
from server.project_archives.others import take_arena, take_evaluation, take_policy, take_recording
from server.project_archives.repository import ProjectArchiveRepository
from server.project_archives.schemas import (
    ArchivedAskedEvaluation,
    ArchivedCheckpoint,
    ArchivedEvaluation,
    ArchivedExperiment,
    ArchivedLog,
    ArchivedPoints,
    ArchivedPolicy,
    ArchivedRecording,
    ArchivedRun,
    ArchivedStudy,
    ArchiveManifest,
    ImportedRun,
    ImportedThing,
    Kind,
    ProjectImport,
)
from server.project_archives.studies import take_study
from server.project_archives.tar import IncomingTar
from server.projects.repository import ProjectRepository
from server.run_log.repository import HEAD_BYTES, TAIL_BYTES, LogRepository
from server.runs import states
from server.runs.repository import RunRepository
from server.services import Services
from server.uploads.schemas import MAX_FILE_BYTES
from sim.config import ArenaFile
from workers.checkpoints import check_archive
from workers.errors import ArchiveError
from workers.wording import counted

MAX_RUNS = 10_000
"""Of one archive."""

MAX_OTHERS = 10_000
"""Of arenas, policies, recordings and evaluations of one archive."""

_OTHERS: dict[str, Kind] = {
    "arenas": "arena",
    "policies": "policy",
    "recordings": "recording",
    "evaluations": "evaluation",
}
# Of those that have a file beside their document: how it ends, and its most bytes.
_FILES: dict[Kind, tuple[str, int]] = {"policy": ("onnx", MAX_FILE_BYTES), "recording": ("bag", MAX_BAG_BYTES)}
_MAX_DOCUMENT = 64 * 2**20
# Of a run, in memory before it is written.
_MAX_POINTS = 10_000_000
_POINT_BYTES = 20
# Of a run's printed lines as they stand in the archive: twice what a server keeps of them.
_MAX_LOG = 2 * (HEAD_BYTES + TAIL_BYTES)

_Document = TypeVar("_Document", bound=BaseModel)


@dataclass
class _Run:
    """What has arrived of a run."""

    archived: ArchivedRun
    files: dict[str, StoredFile] = field(default_factory=dict)
    evaluations: dict[str, ArchivedEvaluation] = field(default_factory=dict)
    series: dict[str, list[Points]] = field(default_factory=dict)
    thinned: dict[str, Buckets] = field(default_factory=dict)
    points: int = 0
    printed: list[ArchivedLog] = field(default_factory=list)
    printed_bytes: int = 0


class ProjectArrival:
    """Takes an archive into a project.

    Args:
        services: of the server.
        project_id: where to.
        of_everybodys: whether evaluations of shipped policies and baselines, which everybody sees, are taken too.
    """

    def __init__(self, services: Services, project_id: str, *, of_everybodys: bool) -> None:
        self._services = services
        self._lane = services.lanes.imports
        self._project_id = project_id
        self._of_everybodys = of_everybodys
        self._outcomes: list[ImportedRun] = []
        self._checkpoints = 0
        self._others: list[ImportedThing] = []

    async def take(self, stream: AsyncIterator[bytes]) -> ProjectImport:
        """All runs of an archive as it arrives; those before a fault in it stay.

        Raises:
            InvalidRequestError: it is no project's archive, or ends too early.
        """
        incoming = IncomingTar(stream)
        if await incoming.next() != "manifest.json":
            raise InvalidRequestError("This is no project's archive: it does not begin with its manifest.")
        _read(ArchiveManifest, await incoming.whole(_MAX_DOCUMENT))
        experiment: ArchivedExperiment | None = None
        try:
            while (name := await incoming.next()) is not None:
                parts = name.split("/")
                if len(parts) == 2 and parts[1] == "experiment.json":
                    experiment = _read(ArchivedExperiment, await incoming.whole(_MAX_DOCUMENT))
                elif len(parts) == 2 and parts[0] in _OTHERS:
                    await self._other(parts[0], parts[1], incoming)
                elif len(parts) == 2 and parts[0] == "studies":
                    await self._lane.run(self._study, _read(ArchivedStudy, await incoming.whole(_MAX_DOCUMENT)))
                elif experiment is not None and parts[0] == experiment.id and len(parts) == 3 and parts[2] == "run.json":
                    await self._run(experiment, _read(ArchivedRun, await incoming.whole(_MAX_DOCUMENT)), incoming)
                else:
                    raise InvalidRequestError(f"This is no project's archive: {name} has no place in it.")
        finally:
            if self._outcomes or self._others:
                await self._lane.run(self._note)
        return ProjectImport(
            project_id=self._project_id, runs=self._outcomes, checkpoints=self._checkpoints, others=self._others
        )

    async def _other(self, folder: str, name: str, incoming: IncomingTar) -> None:
        kind = _OTHERS[folder]
        if len(self._others) >= MAX_OTHERS:
            raise InvalidRequestError(
                f"An archive may hold {MAX_OTHERS} things beside its runs: import the rest as another one."
            )
        identifier, _, form = name.partition(".")
        if form != "json":
            raise InvalidRequestError(f"This is no project's archive: {name} has no place in it.")
        content = await incoming.whole(_MAX_DOCUMENT)
        file = b""
        if kind in _FILES:
            ending, most = _FILES[kind]
            if await incoming.next() != f"{folder}/{identifier}.{ending}":
                raise InvalidRequestError(f"This is no project's archive: the file of the {kind} {identifier} is missing.")
            file = await incoming.whole(most)
        try:
            new = await self._lane.run(self._take, kind, identifier, content, file)
            outcome = ImportedThing(kind=kind, id=identifier, outcome="imported" if new else "there", why=None)
        except (ConflictError, CorruptUploadError) as error:
            outcome = ImportedThing(kind=kind, id=identifier, outcome="refused", why=error.message)
        self._others.append(outcome)

    def _take(self, kind: Kind, identifier: str, content: bytes, file: bytes) -> bool:
        """Take something beside the runs; False where it was here.

        Raises:
            InvalidRequestError: it is no such thing.
            ConflictError: it cannot be taken.
            CorruptUploadError: it is damaged.
        """
        if kind == "arena":
            return take_arena(self._services.arenas, identifier, _read(ArenaFile, content))
        with self._services.database.write() as session:
            ProjectRepository(session).get(self._project_id)
            if kind == "policy":
                return take_policy(session, self._project_id, _read(ArchivedPolicy, content), file)
            if kind == "recording":
                return take_recording(session, self._project_id, _read(ArchivedRecording, content), file)
            evaluation = _read(ArchivedAskedEvaluation, content)
            return take_evaluation(session, self._project_id, evaluation, of_everybodys=self._of_everybodys)

    async def _run(self, experiment: ArchivedExperiment, archived: ArchivedRun, incoming: IncomingTar) -> None:
        if len(self._outcomes) >= MAX_RUNS:
            raise InvalidRequestError(f"An archive may hold {MAX_RUNS} runs: import the rest as another one.")
        folder = f"{experiment.id}/{archived.id}/"
        run = _Run(archived)
        problem: str | None = None
        is_there = False
        try:
            try:
                is_there = await self._lane.run(self._look, experiment, archived)
            except ConflictError as error:
                problem = error.message
            while (name := await incoming.next()) != f"{folder}end":
                if name is None or not name.startswith(folder):
                    raise InvalidRequestError(f"This is no project's archive: run {archived.id} has no end.")
                if is_there or problem is not None:
                    # Its bytes pass by.
                    continue
                try:
                    await self._part(run, name.removeprefix(folder), incoming)
                except (CorruptUploadError, ArchiveError) as error:
                    problem = f"{name} is damaged: {error}"
            if not is_there and problem is None:
                try:
                    await self._lane.run(self._register, experiment, run)
                    self._checkpoints += len(run.files)
                    run.files = {}
                except ConflictError as error:
                    problem = error.message
        finally:
            # Of a run that was not registered, or of which nobody knows.
            if run.files:
                await self._lane.run(give_up_archives, self._services, list(run.files))
        outcome = ImportedRun(
            id=archived.id,
            experiment_id=experiment.id,
            outcome="there" if is_there else "imported" if problem is None else "refused",
            why=problem,
        )
        self._outcomes.append(outcome)
        if outcome.outcome == "imported":
            self._services.bus.belongs(experiment.id, self._project_id)
            self._services.bus.publish(Change(experiment_id=experiment.id, run_id=None, kind="experiment"))

    async def _part(self, run: _Run, name: str, incoming: IncomingTar) -> None:
        stem, _, kind = name.partition(".")
        checkpoint = next((each for each in run.archived.checkpoints if each.id == stem), None)
        if kind == "zip" and checkpoint is not None and stem not in run.files:
            await self._archive(run, checkpoint, incoming)
        elif kind == "json" and checkpoint is not None:
            run.evaluations[stem] = _read(ArchivedEvaluation, await incoming.whole(_MAX_DOCUMENT))
        elif kind == "points":
            await self._lane.run(_add_points, run, await incoming.whole(_MAX_DOCUMENT))
        elif kind == "thinned":
            await self._lane.run(_add_thinned, run, await incoming.whole(_MAX_DOCUMENT))
        elif kind == "log":
            _add_log(run, await incoming.whole(_MAX_DOCUMENT))
        else:
            raise InvalidRequestError(f"This is no project's archive: {name} has no place in a run.")

    async def _archive(self, run: _Run, checkpoint: ArchivedCheckpoint, incoming: IncomingTar) -> None:
        await self._lane.run(self._announce, checkpoint.id)
        # From here on it is ours to remove.
        run.files[checkpoint.id] = StoredFile(checkpoint.id, 0, "")
        run.files[checkpoint.id] = await self._services.files.write(checkpoint.id, incoming.blocks(), checkpoint.sha256)
        await self._lane.run(self._check, checkpoint.id)

    def _study(self, archived: ArchivedStudy) -> None:
        with self._services.database.write() as session:
            ProjectRepository(session).get(self._project_id)
            take_study(session, self._project_id, archived)

    def _announce(self, archive_id: str) -> None:
        with self._services.database.write() as session:
            if ProjectArchiveRepository(session).taken([archive_id]):
                raise CorruptUploadError("it stands in the archive twice")
            LooseArchives(session).begin(archive_id)

    def _check(self, archive_id: str) -> None:
        with self._services.files.open(archive_id) as file:
            check_archive(file, f"checkpoint {archive_id}")

    def _look(self, wanted: ArchivedExperiment, archived: ArchivedRun) -> bool:
        """Whether the run has been imported before.

        Raises:
            ConflictError: it cannot be taken.
        """
        with self._services.database.read() as session:
            ProjectRepository(session).get(self._project_id)
            experiment = session.get(tables.Experiment, wanted.id)
            _check_same(experiment, wanted, self._project_id)
            run = session.get(tables.Run, archived.id)
            if run is not None:
                if experiment is None or run.experiment_id != experiment.id or run.created_at != archived.created_at:
                    raise ConflictError("This server has another run of that id.")
                return True
            taken = ProjectArchiveRepository(session).taken([each.id for each in archived.checkpoints])
        if taken:
            raise ConflictError(f"This server has another checkpoint of the id {min(taken)}.")
        return False

    def _register(self, wanted: ArchivedExperiment, arrived: _Run) -> None:
        """All of a run in one transaction.

        Raises:
            ConflictError: it cannot be taken (any more), or something of it is missing.
        """
        archived = arrived.archived
        missing = {each.id for each in archived.checkpoints} - arrived.files.keys()
        if missing:
            raise ConflictError(f"The archive of checkpoint {min(missing)} is missing.")
        # Packed before the database is held: a long run takes seconds of it.
        series = {name: Points.joined(pieces) for name, pieces in arrived.series.items()}
        _check_thinned(arrived.thinned, series)
        packed = PackedSeries.of(archived.id, series, arrived.thinned)
        with self._services.database.write() as session:
            experiment = session.get(tables.Experiment, wanted.id)
            _check_same(experiment, wanted, self._project_id)
            if session.get(tables.Run, archived.id) is not None:
                raise ConflictError("This server has another run of that id.")
            if experiment is None:
                study = session.get(tables.Study, wanted.study_id) if wanted.study_id else None
                experiment = _experiment(wanted, self._project_id, study)
                ExperimentRepository(session).add(experiment)
                session.add_all(tables.ExperimentTag(experiment_id=wanted.id, tag=tag) for tag in dict.fromkeys(wanted.tags))
            session.add(_run(wanted.id, archived, arrived.thinned))
            session.flush()
            session.add_all(
                tables.RunEvent(run_id=archived.id, at=event.at, step=event.step, level=event.level, message=event.message)
                for event in archived.events
            )
            MetricRepository(session).add_packed(archived.id, packed)
            for log in arrived.printed:
                LogRepository(session).add_chunk(archived.id, log.attempt, log.first, log.lines)
            for each in archived.checkpoints:
                if not LooseArchives(session).register(each.id):
                    raise ConflictError("The archive took too long: import it again.")
                evaluation = arrived.evaluations.get(each.id)
                checkpoint = CheckpointRepository(session).add(
                    archived.id, each.step, arrived.files[each.id], evaluation.result if evaluation else None
                )
                checkpoint.created_at = each.created_at
                if evaluation is not None:
                    session.flush()
                    CheckpointRepository(session).evaluation(each.id).created_at = evaluation.created_at
            if archived.state not in states.FINISHED:
                message = f"Imported; it was {archived.state} where it comes from. Resume it to go on."
                RunRepository(session).add_event(archived.id, "info", message, archived.step)

    def _note(self) -> None:
        counts = {kind: sum(each.outcome == kind for each in self._outcomes) for kind in ("imported", "there", "refused")}
        details = "runs: " + ", ".join(f"{number} {kind}" for kind, number in counts.items() if number)
        if self._others:
            details += f"; beside them: {len(self._others)}"
        with self._services.database.write() as session:
            project = ProjectRepository(session).get(self._project_id)
            AuditRepository(session).add(
                "project.imported", target=project.id, name=project.name, project_id=project.id, details=details
            )


def _check_same(experiment: tables.Experiment | None, wanted: ArchivedExperiment, project_id: str) -> None:
    if experiment is None:
        return
    if experiment.project_id != project_id or experiment.training != wanted.training:
        raise ConflictError(f"This server has another training of the id {wanted.id}.")
    if experiment.deleted_at is not None:
        raise ConflictError(f"The training {wanted.id} lies in the trash: take it back, or remove it.")


def _experiment(wanted: ArchivedExperiment, project_id: str, study: tables.Study | None) -> tables.Experiment:
    return tables.Experiment(
        id=wanted.id,
        project_id=project_id,
        name=wanted.name,
        training=wanted.training,
        created_at=wanted.created_at,
        notes=wanted.notes,
        starred_at=wanted.starred_at,
        archived_at=wanted.archived_at,
        campaign=wanted.campaign,
        campaign_row=wanted.campaign_row,
        study_id=study.id if study is not None and study.project_id == project_id else None,
    )


def _run(experiment_id: str, archived: ArchivedRun, thinned: Mapping[str, Buckets]) -> tables.Run:
    return tables.Run(
        id=archived.id,
        experiment_id=experiment_id,
        seed=archived.seed,
        # No worker of this server has it.
        state=archived.state if archived.state in states.FINISHED else "stopped",
        attempt=archived.attempt,
        step=archived.step,
        last_seq=archived.last_seq,
        error=archived.error,
        created_at=archived.created_at,
        queued_at=archived.created_at,
        started_at=archived.started_at,
        finished_at=archived.finished_at,
        thinned_at=(archived.thinned_at or time.time()) if thinned else None,
        thinned_from=sum(int(each.sizes.sum()) for each in thinned.values()) if thinned else None,
        thinned_to=sum(len(each) for each in thinned.values()) if thinned else None,
    )


def _unpacked(run: _Run, content: bytes, size: int) -> tuple[ArchivedPoints, bytes]:
    """What stands before points or buckets, and these as they are packed, of `size` bytes each: no more than it promises."""
    line, _, data = content.partition(b"\n")
    head = _read(ArchivedPoints, line)
    run.points += head.count
    if run.points > _MAX_POINTS:
        raise CorruptUploadError(f"a run may have {counted(_MAX_POINTS)} points")
    reader = zlib.decompressobj()
    try:
        if len(reader.decompress(data, size * head.count + 1)) != size * head.count or not reader.eof:
            raise CorruptUploadError(f"it does not hold {head.count} points")
    except zlib.error as error:
        raise CorruptUploadError(str(error)) from error
    return head, data


def _add_points(run: _Run, content: bytes) -> None:
    head, data = _unpacked(run, content, _POINT_BYTES)
    points = Points.decode(data, head.count)
    if int(points.steps.min()) < 0 or not bool((abs(points.times) <= 1e11).all()):
        raise CorruptUploadError("steps or times are no such")
    run.series.setdefault(head.name, []).append(
        Points.of(points.steps.tolist(), points.times.tolist(), points.values.tolist())
    )


def _add_thinned(run: _Run, content: bytes) -> None:
    head, data = _unpacked(run, content, BUCKET_BYTES)
    buckets = Buckets.decode(data, head.count)
    empty = buckets.finite == 0
    with np.errstate(invalid="ignore"):
        ordered = (buckets.low <= buckets.mean) & (buckets.mean <= buckets.high)
    sound = (
        head.count <= MAX_BUCKETS
        and head.name not in run.thinned
        and buckets.steps[0] >= 0
        and (np.diff(buckets.steps) > 0).all()
        and (buckets.sizes >= 1).all()
        and ((buckets.finite >= 0) & (buckets.finite <= buckets.sizes)).all()
        and np.where(empty, np.isnan(buckets.low) & np.isnan(buckets.mean) & np.isnan(buckets.high), ordered).all()
    )
    if not sound:
        raise CorruptUploadError("it holds no buckets of a thinned series")
    run.thinned[head.name] = buckets


def _check_thinned(thinned: Mapping[str, Buckets], series: Mapping[str, Points]) -> None:
    """Whether there is a mean to each bucket.

    Raises:
        ConflictError: there is not.
    """
    for name, buckets in thinned.items():
        if name not in series or not np.isin(buckets.steps, series[name].steps).all():
            raise ConflictError(f"Points of {name}, which was thinned, are missing.")


def _add_log(run: _Run, content: bytes) -> None:
    run.printed_bytes += len(content)
    if run.printed_bytes > _MAX_LOG:
        raise CorruptUploadError(f"a run may have {_MAX_LOG // 2**20} MiB of printed lines")
    run.printed.append(_read(ArchivedLog, content))


def _read(model: type[_Document], content: bytes) -> _Document:
    try:
        return model.model_validate_json(content)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise InvalidRequestError(
            f"This archive is not one that this version reads: {place or model.__name__}: {first['msg']}."
        ) from error
