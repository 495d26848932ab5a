"""Routes of projects."""

from typing import Annotated

from fastapi import APIRouter, Depends, status

from server.http.paging import WindowDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.projects.schemas import Project, ProjectEdit
from server.projects.service import ProjectService
from server.schemas import Page
from server.security.permissions import ADMINISTRATE, SIGNED_IN, manage
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(prefix="/api/projects", tags=["projects"])


async def _service(services: ServicesDep) -> ProjectService:
    return ProjectService(services)


ProjectServiceDep = Annotated[ProjectService, Depends(_service)]


@router.get("", dependencies=[SIGNED_IN])
def list_projects(service: ProjectServiceDep, principal: PrincipalDep, window: WindowDep) -> Page[Project]:
    """The projects that one may see, by name."""
    return service.page(principal, window)


@router.post("", status_code=status.HTTP_201_CREATED, responses=CONFLICT, dependencies=[ADMINISTRATE])
def create_project(edit: ProjectEdit, service: ProjectServiceDep, principal: PrincipalDep) -> Project:
    """Add an empty project."""
    return service.create(principal, edit)


@router.patch("/{project_id}", responses=NOT_FOUND | CONFLICT, dependencies=[manage("project_id")])
def rename_project(project_id: str, edit: ProjectEdit, service: ProjectServiceDep, principal: PrincipalDep) -> Project:
    """Give it another name."""
    return service.rename(principal, project_id, edit)
