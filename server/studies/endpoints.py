"""Routes of studies."""

from typing import Annotated

from fastapi import APIRouter, Depends, status

from server.http.paging import WindowDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.security.permissions import LAUNCH, SIGNED_IN, edit, view
from server.security.principal import PrincipalDep
from server.services import ServicesDep
from server.studies.schemas import Study, StudyExtension, StudyLaunch, StudyPage
from server.studies.service import StudyService

router = APIRouter(prefix="/api/studies", tags=["studies"])


async def _service(services: ServicesDep) -> StudyService:
    return StudyService(services)


StudyServiceDep = Annotated[StudyService, Depends(_service)]


@router.post("", status_code=status.HTTP_201_CREATED, responses=NOT_FOUND, dependencies=[LAUNCH])
def launch_study(request: StudyLaunch, service: StudyServiceDep, principal: PrincipalDep) -> Study:
    """Search settings of a training, in a project."""
    principal.require("editor", request.project_id)
    return service.launch(request, principal)


@router.get("", dependencies=[SIGNED_IN])
def list_studies(window: WindowDep, service: StudyServiceDep, principal: PrincipalDep) -> StudyPage:
    """Some of the studies, the newest first."""
    return service.page(window, principal)


@router.get("/{study_id}", responses=NOT_FOUND, dependencies=[view("study_id")])
def get_study(study_id: str, service: StudyServiceDep) -> Study:
    """A study with its trials."""
    return service.get(study_id)


@router.post("/{study_id}/stop", responses=NOT_FOUND | CONFLICT, dependencies=[edit("study_id")])
def stop_study(study_id: str, service: StudyServiceDep) -> Study:
    """Ask for no more trials, and stop those that go on."""
    return service.stop(study_id)


@router.post("/{study_id}/resume", responses=NOT_FOUND | CONFLICT, dependencies=[edit("study_id")])
def resume_study(study_id: str, service: StudyServiceDep) -> Study:
    """Go on with a study that was stopped, and with its trials where they were."""
    return service.resume(study_id)


@router.post("/{study_id}/extend", responses=NOT_FOUND | CONFLICT, dependencies=[edit("study_id")])
def extend_study(study_id: str, extension: StudyExtension, service: StudyServiceDep) -> Study:
    """Give a study more trials; one that was done goes on."""
    return service.extend(study_id, extension.trials)


@router.delete("/{study_id}", status_code=status.HTTP_204_NO_CONTENT, responses=NOT_FOUND, dependencies=[edit("study_id")])
def delete_study(study_id: str, service: StudyServiceDep) -> None:
    """Forget a study; its trials go into the trash, the training that judged the best stays."""
    service.delete(study_id)
