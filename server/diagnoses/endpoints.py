"""The route of a run's diagnoses."""

from fastapi import APIRouter

from server.diagnoses.schemas import Diagnoses
from server.diagnoses.service import DiagnosisService
from server.http.problems import NOT_FOUND
from server.security.permissions import view
from server.services import ServicesDep

router = APIRouter(tags=["runs"])


@router.get("/api/runs/{run_id}/diagnoses", responses=NOT_FOUND, dependencies=[view("run_id")])
def get_diagnoses(run_id: str, services: ServicesDep) -> Diagnoses:
    """Whether the run is learning, and if not, the evidence and what to try."""
    return DiagnosisService(services).of_run(run_id)
