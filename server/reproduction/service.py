"""Launches, reads, stops, resumes and deletes campaigns."""

import time
from collections.abc import Callable, Collection, Sequence
from threading import Lock

from sqlalchemy.orm import Session

from server.audit.actor import current_actor
from server.audit.repository import AuditRepository
from server.database import tables
from server.errors import ConflictError
from server.events.changes import Change
from server.experiments.repository import UNFINISHED, ExperimentRepository
from server.experiments.service import ExperimentService
from server.ids import new_id
from server.metrics.points import Points
from server.metrics.repository import MetricRepository
from server.projects.repository import ProjectRepository
from server.reproduction.schemas import CampaignCreate, CampaignSummary, Reproduction
from server.reproduction.views import campaign_view, reproduction_view
from server.runs import states
from server.runs.repository import PointsState, RunRepository
from server.runs.service import RunService, resume_run, stop_run
from server.runs.states import Occasion
from server.runs.views import EVAL_SUCCESS
from server.services import Services
from server.system.service import workers_lately
from workers.protocol import queues_of
from workers.reproduction.rows import ROWS, Row, scaled, title
from workers.training.table import METRICS

# PostgreSQL would let two launches through that look at the same moment; one server process serves an installation.
_LAUNCH = Lock()


class ReproductionService:
    """What a person may do with the paper's reproduction."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._runs = RunService(services)

    def state(self, campaign_id: str | None = None, visible: Collection[str] | None = None) -> tuple[object, ...]:
        """What the answer of `get` depends on; where runs are on their way, the time too, to the second.

        Raises:
            NotFoundError: there is no such campaign.
        """
        with self._services.database.read() as session:
            repository = ExperimentRepository(session)
            campaigns = repository.campaigns(visible)
            chosen = campaign_id or (campaigns[0][0] if campaigns else None)
            runs = repository.campaign_runs(chosen) if chosen is not None else []
            active = any(run.state in UNFINISHED for run in runs)
            states = [(*PointsState.of(run), run.state, run.error, run.started_at, run.finished_at) for run in runs]
            return (chosen, campaigns, len(workers_lately(session)), states, int(time.time()) if active else None)

    def get(self, campaign_id: str | None = None, visible: Collection[str] | None = None) -> Reproduction:
        """A campaign beside the paper, the newest if none is named; the paper alone before the first.

        Only campaigns in `visible` projects are known, where they are given.

        Raises:
            NotFoundError: there is no such campaign.
        """
        with self._services.database.read() as session:
            repository = ExperimentRepository(session)
            campaigns = [CampaignSummary(id=each, created_at=at) for each, at in repository.campaigns(visible)]
            workers = len(workers_lately(session))
            chosen = campaign_id or (campaigns[0].id if campaigns else None)
            if chosen is None:
                return reproduction_view((), {}, {}, None, campaigns, workers)
            experiments = repository.campaign(chosen)
            done = [run.id for experiment in experiments for run in experiment.runs if run.state == "completed"]
            return reproduction_view(
                experiments,
                RunRepository(session).latest_metrics(done, METRICS),
                _evaluations(session, done),
                campaign_view(chosen, experiments, workers, time.time()),
                campaigns,
                workers,
            )

    def launch(self, request: CampaignCreate, project_id: str) -> Reproduction:
        """Queue every row with every seed in a project, and wake workers for them.

        Raises:
            NotFoundError: there is no such project.
            ConflictError: a campaign is not finished yet.
        """
        campaign = new_id()
        experiments = [_experiment(row, campaign, request, project_id) for row in ROWS]
        with _LAUNCH, self._services.database.write() as session:
            ProjectRepository(session).get(project_id)
            repository = ExperimentRepository(session)
            if repository.unfinished_campaign() is not None:
                raise ConflictError("A campaign is not finished yet: wait for it, or cancel it first.")
            for experiment in experiments:
                repository.add(experiment)
            AuditRepository(session).add(
                "campaign.launched", target=campaign, project_id=project_id, details=f"{request.seeds} seeds of each row"
            )
        # Seed by seed: the first intervals can be looked at early.
        queues = [queues_of(row.training) for row in ROWS]
        for runs in zip(*(experiment.runs for experiment in experiments), strict=True):
            for run, its in zip(runs, queues, strict=True):
                for queue in its:
                    self._services.doorbell.ring(run.id, run.attempt, queue)
        for experiment in experiments:
            self._services.bus.publish(Change(experiment_id=experiment.id, run_id=None, kind="experiment"))
        return self.get(campaign)

    def stop(self, campaign_id: str) -> Reproduction:
        """End every run that has not ended.

        Raises:
            NotFoundError: there is no such campaign.
            ConflictError: all of its runs have ended.
        """
        for run in self._move(campaign_id, "stop", stop_run, "All runs of this campaign have ended already."):
            self._runs.announce_stopped(run)
        return self.get(campaign_id)

    def resume(self, campaign_id: str) -> Reproduction:
        """Queue every run that was stopped or failed.

        Raises:
            NotFoundError: there is no such campaign.
            ConflictError: none of its runs was stopped or has failed.
        """
        refusal = "No run of this campaign was stopped or has failed, so there is nothing to go on with."
        for run in self._move(campaign_id, "resume", resume_run, refusal):
            self._runs.announce_queued(run)
        return self.get(campaign_id)

    def add_seeds(self, campaign_id: str) -> Reproduction:
        """Queue five more runs of every row whose intervals are wider than their margins.

        Raises:
            NotFoundError: there is no such campaign.
            ConflictError: no row wants more, or it can't be told yet.
        """
        wanted = self.get(campaign_id).wanted
        if not wanted:
            raise ConflictError(
                "No row of this campaign wants more seeds: its runs are not all done, it is a trial, its intervals are as "
                "narrow as their margins, or its rows have forty."
            )
        with self._services.database.write() as session:
            added = []
            for experiment in ExperimentRepository(session).campaign(campaign_id):
                there = {run.seed for run in experiment.runs}
                runs = [
                    tables.Run(id=new_id(), seed=seed)
                    for seed in range(wanted.get(experiment.campaign_row or "", 0))
                    if seed not in there
                ]
                experiment.runs.extend(runs)
                added += runs
            added.sort(key=lambda run: run.seed)
            if added:
                project = added[0].experiment.project_id
                details = f"{len(added)} more runs"
                AuditRepository(session).add("campaign.seeds_added", target=campaign_id, project_id=project, details=details)
        for run in added:
            self._runs.announce_queued(run)
        return self.get(campaign_id)

    def delete(self, campaign_id: str) -> None:
        """Remove a campaign with everything that it has trained. Workers that still train for it are cut off.

        Raises:
            NotFoundError: there is no such campaign.
        """
        ExperimentService(self._services).delete_campaign(campaign_id)

    def _move(
        self, campaign_id: str, occasion: Occasion, move: Callable[[Session, tables.Run], None], refusal: str
    ) -> Sequence[tables.Run]:
        """The runs that were moved, by seed and then by row."""
        with self._services.database.write() as session:
            repository = ExperimentRepository(session)
            runs = [
                run
                for experiment in repository.campaign(campaign_id)
                for run in repository.lock_runs(experiment.id)
                if states.allows(run.state, occasion)
            ]
            if not runs:
                raise ConflictError(refusal)
            runs.sort(key=lambda run: run.seed)
            for run in runs:
                move(session, run)
            action = "campaign.stopped" if occasion == "stop" else "campaign.resumed"
            AuditRepository(session).add(action, target=campaign_id, project_id=runs[0].experiment.project_id)
        return runs


def _experiment(row: Row, campaign: str, request: CampaignCreate, project_id: str) -> tables.Experiment:
    return tables.Experiment(
        id=new_id(),
        project_id=project_id,
        name=f"Paper: {title(row)}",
        training=scaled(row.training, request.effort).model_dump(mode="json"),
        launched_by=current_actor().principal.user_id,
        campaign=campaign,
        campaign_row=row.id,
        runs=[tables.Run(id=new_id(), seed=seed) for seed in range(request.seeds)],
    )


def _evaluations(session: Session, run_ids: Sequence[str]) -> dict[str, Points]:
    read = MetricRepository(session).read_many(run_ids, [EVAL_SUCCESS])
    return {run_id: series.get(EVAL_SUCCESS, Points.joined([])) for run_id, series in read.items()}
