"""Reads a run's curves and hands them to the rules."""

from server.diagnoses.schemas import Diagnoses
from server.experiments.stored import training_of
from server.metrics.buckets import SUMMARY_WIDTH
from server.metrics.lines import cut_lines
from server.metrics.repository import MetricRepository
from server.metrics.service import lines_of_run
from server.runs.repository import PointsState, RunRepository
from server.services import Services
from workers.diagnoses import History, Series, diagnose


class DiagnosisService:
    """Diagnoses runs."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def of_run(self, run_id: str) -> Diagnoses:
        """What the run's curves say now.

        Raises:
            NotFoundError: there is no such run.
        """
        with self._services.database.read() as session:
            run = RunRepository(session).get(run_id)
            training = training_of(run.experiment)
            series = lines_of_run(self._services, MetricRepository(session), PointsState.of(run))
        curves = {name: Series(buckets.steps, buckets.mean) for name, buckets in cut_lines(series, SUMMARY_WIDTH).items()}
        history = History(training, curves)
        return Diagnoses(run_id=run_id, step=history.step, diagnoses=diagnose(history))
