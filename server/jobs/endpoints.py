"""Routes of jobs: the queue, one of them, and taking one back."""

from fastapi import APIRouter

from server.database import tables
from server.http.paging import WindowDep
from server.http.problems import NOT_FOUND
from server.jobs.schemas import Job, JobPage
from server.jobs.service import JobService
from server.jobs.views import job_view
from server.security.permissions import ADMINISTRATE
from server.services import Services, ServicesDep

router = APIRouter(prefix="/api/jobs", tags=["jobs"])


@router.get("", dependencies=[ADMINISTRATE])
def list_jobs(window: WindowDep, services: ServicesDep) -> JobPage:
    """Some of the jobs: those under way, those that wait in the order of their turn, then what has ended."""
    return JobService(services).page(window)


@router.get("/{job_id}", responses=NOT_FOUND, dependencies=[ADMINISTRATE])
def get_job(job_id: str, services: ServicesDep) -> Job:
    """One of them, with its progress and the time that is left."""
    return _view(services, JobService(services).find(job_id))


@router.post("/{job_id}/cancel", responses=NOT_FOUND, dependencies=[ADMINISTRATE])
def cancel_job(job_id: str, services: ServicesDep) -> Job:
    """Take a job back; one that has ended stays as it is."""
    return _view(services, JobService(services).cancel(job_id))


def _view(services: Services, job: tables.Job) -> Job:
    return job_view(job, services.board, JobService(services).lacking(job))
