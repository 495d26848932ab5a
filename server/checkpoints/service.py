"""What a person may do with checkpoints."""

from collections.abc import Iterator
from dataclasses import dataclass

from server.audit.repository import AuditRepository
from server.checkpoints import views
from server.checkpoints.repository import CheckpointRepository, decode_episodes
from server.checkpoints.schemas import CheckpointPage, CheckpointStep, CheckpointSteps, Episodes
from server.checkpoints.spread import spread
from server.file_names import slug
from server.http.paging import Window
from server.runs.repository import RunRepository
from server.services import Services

MOST_STEPS = 200
"""Checkpoints on the way of a run: as many as one can tell apart by hand."""


@dataclass(frozen=True)
class Described:
    """An archive: under what name to save it, how many bytes it has, and their SHA-256."""

    file_name: str
    size: int
    sha256: str


@dataclass(frozen=True)
class Download:
    """An archive on its way out, from byte `start` on."""

    archive: Described
    start: int
    blocks: Iterator[bytes]


@dataclass(frozen=True)
class Rest:
    """What a client wants that has the first `start` bytes of an archive with the SHA-256 `of`."""

    start: int
    of: str


class CheckpointService:
    """Lists checkpoints, their episodes, and hands out archives."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def of_run(self, run_id: str, window: Window, step: int | None = None) -> CheckpointPage:
        """The run's checkpoints, all or that of one step, the newest first.

        Raises:
            NotFoundError: there is no such run.
        """
        with self._services.database.read() as session:
            RunRepository(session).check(run_id)
            repository = CheckpointRepository(session)
            rows, total = repository.page(run_id, window, step)
            best = repository.best(run_id)
            best_id = best[0].id if best else None
            return CheckpointPage(
                items=[views.checkpoint_view(*row, best=row[0].id == best_id) for row in rows],
                total=total,
                best=views.checkpoint_view(*best, best=True) if best else None,
            )

    def steps(self, run_id: str) -> CheckpointSteps:
        """The way of a run by its checkpoints, `MOST_STEPS` of them at most.

        Raises:
            NotFoundError: there is no such run.
        """
        with self._services.database.read() as session:
            RunRepository(session).check(run_id)
            steps = CheckpointRepository(session).steps(run_id)
        return CheckpointSteps(
            items=[CheckpointStep(id=each.id, step=each.step, success=each.success) for each in spread(steps, MOST_STEPS)],
            total=len(steps),
        )

    def evaluated_at(self, checkpoint_id: str) -> float:
        """When the checkpoint was evaluated, which it is once; in seconds since the epoch.

        Raises:
            NotFoundError: there is no such checkpoint, or it was not evaluated.
        """
        with self._services.database.read() as session:
            repository = CheckpointRepository(session)
            repository.get(checkpoint_id)
            return repository.evaluated_at(checkpoint_id)

    def episodes(self, checkpoint_id: str) -> Episodes:
        """Every episode behind the checkpoint's figures.

        Raises:
            NotFoundError: there is no such checkpoint, or it was not evaluated.
        """
        with self._services.database.read() as session:
            repository = CheckpointRepository(session)
            repository.get(checkpoint_id)
            evaluation = repository.evaluation(checkpoint_id)
            return Episodes(
                checkpoint_id=checkpoint_id,
                suite=evaluation.suite,
                suite_hash=evaluation.suite_hash,
                episodes=decode_episodes(evaluation),
            )

    def described(self, checkpoint_id: str) -> Described:
        """What there is to know of an archive without reading it.

        Raises:
            NotFoundError: there is no such checkpoint, or its file is gone.
        """
        described = self._described(checkpoint_id)
        self._services.files.open(checkpoint_id).close()
        return described

    def _described(self, checkpoint_id: str) -> Described:
        with self._services.database.read() as session:
            checkpoint = CheckpointRepository(session).get(checkpoint_id)
            run = RunRepository(session).get(checkpoint.run_id)
            file_name = f"mapless-{slug(run.experiment.name)}-seed{run.seed}-step{checkpoint.step}.zip"
        return Described(file_name, checkpoint.size, checkpoint.sha256)

    def take_home(self, checkpoint_id: str, rest: Rest | None = None) -> Download:
        """An archive for a person: who took what home is kept.

        Args:
            checkpoint_id: which.
            rest: all that is wanted, if the client has the beginning.

        Raises:
            NotFoundError: there is no such checkpoint, or its file is gone.
        """
        archive = self.taken_home(checkpoint_id)
        start = rest.start if rest is not None and rest.of == archive.sha256 and rest.start < archive.size else 0
        return Download(archive, start, self._services.files.read(checkpoint_id, start))

    def taken_home(self, checkpoint_id: str) -> Described:
        """`described`, for a person who takes what is made of it home.

        Raises:
            NotFoundError: there is no such checkpoint, or its file is gone.
        """
        archive = self.described(checkpoint_id)
        with self._services.database.write() as session:
            checkpoint = CheckpointRepository(session).get(checkpoint_id)
            project_id = RunRepository(session).get(checkpoint.run_id).experiment.project_id
            AuditRepository(session).add(
                "checkpoint.downloaded", target=checkpoint_id, name=archive.file_name, project_id=project_id
            )
        return archive
