"""The data of runs, experiments and comparisons as files."""

from collections.abc import Iterator, Sequence
from typing import Literal

from sqlalchemy.orm import Session

from server.audit.repository import AuditRepository
from server.comparison.service import ComparisonService
from server.data_export.comparison import tables_of
from server.data_export.document import document, exported
from server.data_export.event_file import event_file
from server.data_export.files import OutgoingFile
from server.data_export.parquet import MEDIA_TYPE, about, parquet, point_blocks, point_columns, require_parquet
from server.data_export.schemas import ExportedComparison, ExportedExperiment
from server.data_export.series import read_run, said_of, with_edges
from server.data_export.table import HEADING, WIDE_HEADING, point_rows
from server.data_export.zips import zipped
from server.database import tables
from server.experiments.repository import ExperimentRepository
from server.experiments.told import state_of_runs
from server.file_names import slug
from server.runs.repository import PointsState, RunRepository
from server.services import Services

TableFormat = Literal["csv", "parquet", "json"]
DataFormat = Literal["csv", "parquet", "json", "tensorboard"]


class DataExportService:
    """Makes files, block by block: what they need of memory does not grow with what they hold."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._database = services.database

    def points_of_run(self, run_id: str) -> tuple[object, ...]:
        """What a run's file of points depends on, its name too.

        Raises:
            NotFoundError: there is no such run.
        """
        with self._database.read() as session:
            run = RunRepository(session).get(run_id)
            return (run.experiment.name, *PointsState.of(run))

    def points_of_experiment(self, experiment_id: str) -> tuple[object, ...]:
        """What an experiment's file of points depends on, its name too.

        Raises:
            NotFoundError: there is no such experiment.
        """
        with self._database.read() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            return (experiment.name, *(PointsState.of(run) for run in experiment.runs))

    def state_of_run(self, run_id: str) -> tuple[object, ...]:
        """What a run's document depends on.

        Raises:
            NotFoundError: there is no such run.
        """
        with self._database.read() as session:
            run = RunRepository(session).get(run_id)
            return state_of_runs(session, [run.experiment], [run])

    def state_of_experiment(self, experiment_id: str) -> str:
        """What an experiment's document depends on.

        Raises:
            NotFoundError: there is no such experiment.
        """
        return self.state_of_comparison([experiment_id])

    def state_of_comparison(self, experiment_ids: Sequence[str]) -> str:
        """What a comparison depends on, beside what is asked of it.

        Raises:
            NotFoundError: one of the experiments is missing.
        """
        return ComparisonService(self._services).state(experiment_ids)

    def run(self, run_id: str, data_format: DataFormat) -> OutgoingFile:
        """The data of one run.

        Raises:
            NotFoundError: there is no such run.
            MissingExtraError: what writes the format is not installed.
        """
        _require(data_format)
        with self._database.write() as session:
            run = RunRepository(session).get(run_id)
            _note(session, run.experiment, data_format, target=run.id)
            experiment, runs = exported(run.experiment), _seeds([run])
            stem = f"mapless-{slug(experiment.name)}-seed{run.seed}-{run_id}"
            began = run.created_at
        if data_format == "tensorboard":
            return OutgoingFile(_event_file_name(stem, began), "application/octet-stream", self._events(run_id, began))
        return self._file(stem, experiment, runs, data_format)

    def experiment(self, experiment_id: str, data_format: DataFormat) -> OutgoingFile:
        """The data of all runs of an experiment.

        Raises:
            NotFoundError: there is no such experiment.
            MissingExtraError: what writes the format is not installed.
        """
        _require(data_format)
        with self._database.write() as session:
            found = ExperimentRepository(session).get(experiment_id)
            _note(session, found, data_format)
            experiment, runs = exported(found), _seeds(found.runs)
            began = {run.id: run.created_at for run in found.runs}
        stem = f"mapless-{slug(experiment.name)}-{experiment_id}"
        if data_format == "tensorboard":
            files = (
                (f"{stem}/seed{seed}/{_event_file_name(run_id, began[run_id])}", self._events(run_id, began[run_id]))
                for run_id, seed in runs.items()
            )
            return OutgoingFile(f"{stem}-tensorboard.zip", "application/zip", zipped(files))
        return self._file(stem, experiment, runs, data_format)

    def comparison(
        self, experiment_ids: Sequence[str], margin: float, name: str, points: int, data_format: TableFormat
    ) -> OutgoingFile:
        """Figures and one metric's curves, as `ComparisonService` has them; as CSV or Parquet, three tables in a zip.

        Raises:
            NotFoundError: one of the experiments is missing.
            MissingExtraError: what writes the format is not installed.
        """
        _require(data_format)
        service = ComparisonService(self._services)
        compared, curves = service.compare(experiment_ids, margin), service.curves(experiment_ids, name, points)
        with self._database.write() as session:
            for experiment in ExperimentRepository(session).get_many(experiment_ids):
                _note(session, experiment, f"compared, {data_format}")
        if data_format == "json":
            whole = ExportedComparison(comparison=compared, curves=curves).model_dump_json().encode()
            return OutgoingFile("mapless-comparison.json", "application/json", iter([whole]))
        tables_there = tables_of(compared, curves)
        files = ((f"{one.name}.{data_format}", one.csv() if data_format == "csv" else one.parquet()) for one in tables_there)
        return OutgoingFile("mapless-comparison.zip", "application/zip", zipped(files))

    def _file(
        self, stem: str, experiment: ExportedExperiment, runs: dict[str, int], data_format: TableFormat
    ) -> OutgoingFile:
        if data_format == "json":
            return OutgoingFile(f"{stem}.json", "application/json", document(self._database, experiment, list(runs)))
        if data_format == "parquet":
            return OutgoingFile(f"{stem}.parquet", MEDIA_TYPE, self._parquet(experiment, runs))
        return OutgoingFile(f"{stem}.csv", "text/csv; charset=utf-8", self._table(runs))

    def _events(self, run_id: str, began: float) -> Iterator[bytes]:
        series = read_run(self._database, run_id)
        return event_file(began, with_edges(series), said_of(series))

    def _parquet(self, experiment: ExportedExperiment, runs: dict[str, int]) -> Iterator[bytes]:
        wide = self._any_thinned(runs)
        blocks = (
            block
            for run_id, seed in runs.items()
            for block in point_blocks(run_id, seed, read_run(self._database, run_id), wide=wide)
        )
        told = about("points", experiment=experiment.id, name=experiment.name, project=experiment.project_id)
        return parquet(point_columns(wide=wide), blocks, told)

    def _any_thinned(self, runs: dict[str, int]) -> bool:
        with self._database.read() as session:
            return RunRepository(session).any_thinned(list(runs))

    def _table(self, runs: dict[str, int]) -> Iterator[bytes]:
        wide = self._any_thinned(runs)
        yield WIDE_HEADING if wide else HEADING
        for run_id, seed in runs.items():
            yield from point_rows(run_id, seed, read_run(self._database, run_id), wide=wide)


def _require(data_format: DataFormat) -> None:
    if data_format == "parquet":
        require_parquet()


def _note(session: Session, experiment: tables.Experiment, details: str, target: str | None = None) -> None:
    """What has left, in the audit log of its project."""
    AuditRepository(session).add(
        "data.exported",
        target=target or experiment.id,
        name=experiment.name,
        project_id=experiment.project_id,
        details=details,
    )


def _seeds(runs: Sequence[tables.Run]) -> dict[str, int]:
    """The seed of each run, by id and in their order."""
    return {run.id: run.seed for run in runs}


def _event_file_name(stem: str, began: float) -> str:
    """TensorBoard looks for names that begin so, and reads several files of a folder in the order of their names."""
    return f"events.out.tfevents.{int(began)}.{stem}"
