"""Routes of experiments and of the launch form."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, Response, status

from server.experiments.form import training_form
from server.experiments.schemas import (
    Experiment,
    ExperimentLaunch,
    ExperimentPatch,
    TrainingForm,
    TrainingPace,
)
from server.experiments.service import ExperimentService
from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.security.permissions import LAUNCH, SIGNED_IN, edit, view
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(tags=["experiments"])


async def _service(services: ServicesDep) -> ExperimentService:
    return ExperimentService(services)


ExperimentServiceDep = Annotated[ExperimentService, Depends(_service)]


@router.get("/api/training/form", response_model=TrainingForm, responses=NOT_MODIFIED, dependencies=[SIGNED_IN])
def get_training_form(kept: KeptDep) -> Response:
    """What the launch form is made of: schema, defaults and presets."""
    headers = kept.unless()
    return Response(training_form(), media_type="application/json", headers=headers)


@router.get("/api/training/pace", dependencies=[SIGNED_IN])
def get_training_pace(
    algorithm: Annotated[str, Query(max_length=64)],
    network: Annotated[str, Query(max_length=64)],
    service: ExperimentServiceDep,
) -> TrainingPace:
    """How quick runs of an algorithm with a network were here, to tell how long another will take."""
    return service.pace(algorithm, network)


@router.post("/api/experiments", status_code=status.HTTP_201_CREATED, responses=NOT_FOUND, dependencies=[LAUNCH])
def create_experiment(request: ExperimentLaunch, service: ExperimentServiceDep, principal: PrincipalDep) -> Experiment:
    """Launch into a project: one run a seed."""
    principal.require("editor", request.project_id)
    return service.create(request, principal)


@router.get("/api/experiments/{experiment_id}", responses=NOT_FOUND, dependencies=[view("experiment_id")])
def get_experiment(experiment_id: str, service: ExperimentServiceDep) -> Experiment:
    """An experiment with its runs."""
    return service.get(experiment_id)


@router.patch("/api/experiments/{experiment_id}", responses=NOT_FOUND, dependencies=[edit("experiment_id")])
def change_experiment(
    experiment_id: str, patch: ExperimentPatch, service: ExperimentServiceDep, principal: PrincipalDep
) -> Experiment:
    """Give it another name, or move it to another project."""
    if patch.project_id is not None:
        principal.require("editor", patch.project_id)
    return service.change(experiment_id, patch)


@router.delete(
    "/api/experiments/{experiment_id}",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=NOT_FOUND,
    dependencies=[edit("experiment_id")],
)
def delete_experiment(experiment_id: str, service: ExperimentServiceDep) -> None:
    """Put it into the trash, where it lies for a week and can be taken out again; its runs are stopped."""
    service.delete(experiment_id)


@router.post("/api/experiments/{experiment_id}/stop", responses=NOT_FOUND | CONFLICT, dependencies=[edit("experiment_id")])
def stop_experiment(experiment_id: str, service: ExperimentServiceDep) -> Experiment:
    """End every run of it that has not ended."""
    return service.stop(experiment_id)


@router.post("/api/experiments/{experiment_id}/resume", responses=NOT_FOUND | CONFLICT, dependencies=[edit("experiment_id")])
def resume_experiment(experiment_id: str, service: ExperimentServiceDep) -> Experiment:
    """Go on with every run of it that was stopped or failed."""
    return service.resume(experiment_id)
