"""Routes of experiments and of the launch form."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, status

from server.experiments.form import form_schema
from server.experiments.schemas import (
    Experiment,
    ExperimentCreate,
    ExperimentPatch,
    ExperimentState,
    ListedExperiment,
    TrainingForm,
)
from server.experiments.service import ExperimentService
from server.paging import WindowDep
from server.problems import CONFLICT, NOT_FOUND
from server.schemas import Page
from server.services import ServicesDep
from workers.presets import PRESETS

router = APIRouter(tags=["experiments"])


def _service(services: ServicesDep) -> ExperimentService:
    return ExperimentService(services)


ExperimentServiceDep = Annotated[ExperimentService, Depends(_service)]


@router.get("/api/training/form")
def get_training_form() -> TrainingForm:
    """What the launch form is made of: schema, defaults and presets."""
    return TrainingForm(schema=form_schema(), defaults=ExperimentCreate(), presets=list(PRESETS))


@router.post("/api/experiments", status_code=status.HTTP_201_CREATED)
def create_experiment(request: ExperimentCreate, service: ExperimentServiceDep) -> Experiment:
    """Launch: one run a seed."""
    return service.create(request)


@router.get("/api/experiments")
def list_experiments(
    service: ExperimentServiceDep,
    window: WindowDep,
    query: Annotated[str, Query(max_length=120, description="Part of the name, in any case.")] = "",
    state: ExperimentState | None = None,
) -> Page[ListedExperiment]:
    """Experiments, the newest first, in short."""
    return service.page(query=query, state=state, window=window)


@router.get("/api/experiments/{experiment_id}", responses=NOT_FOUND)
def get_experiment(experiment_id: str, service: ExperimentServiceDep) -> Experiment:
    """An experiment with its runs."""
    return service.get(experiment_id)


@router.patch("/api/experiments/{experiment_id}", responses=NOT_FOUND)
def rename_experiment(experiment_id: str, patch: ExperimentPatch, service: ExperimentServiceDep) -> Experiment:
    """Give it another name."""
    return service.rename(experiment_id, patch)


@router.delete("/api/experiments/{experiment_id}", status_code=status.HTTP_204_NO_CONTENT, responses=NOT_FOUND)
def delete_experiment(experiment_id: str, service: ExperimentServiceDep) -> None:
    """Remove it with everything that hangs on it; runs that are going on are cut off."""
    service.delete(experiment_id)


@router.post("/api/experiments/{experiment_id}/stop", responses=NOT_FOUND | CONFLICT)
def stop_experiment(experiment_id: str, service: ExperimentServiceDep) -> Experiment:
    """End every run of it that has not ended."""
    return service.stop(experiment_id)


@router.post("/api/experiments/{experiment_id}/resume", responses=NOT_FOUND | CONFLICT)
def resume_experiment(experiment_id: str, service: ExperimentServiceDep) -> Experiment:
    """Go on with every run of it that was stopped or failed."""
    return service.resume(experiment_id)
