"""What a person may do with projects."""

from threading import Lock

from server.audit.repository import AuditRepository
from server.database import tables
from server.errors import ConflictError
from server.http.paging import Window
from server.ids import new_id
from server.projects.repository import ProjectRepository
from server.projects.schemas import Project, ProjectEdit
from server.schemas import Page
from server.security.principal import Principal
from server.services import Services

# PostgreSQL would let two through that look for a name at the same moment; one server process serves an installation.
_NAMES = Lock()


class ProjectService:
    """Lists, adds and renames projects."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def page(self, principal: Principal, window: Window) -> Page[Project]:
        """The projects that may be seen, by name."""
        with self._services.database.read() as session:
            found, total = ProjectRepository(session).page(window, principal.visible)
        return Page(items=[_view(project, experiments, principal) for project, experiments in found], total=total)

    def create(self, principal: Principal, edit: ProjectEdit) -> Project:
        """Add an empty project.

        Raises:
            ConflictError: another one has that name.
        """
        project = tables.Project(id=new_id(), name=edit.name)
        with _NAMES, self._services.database.write() as session:
            repository = ProjectRepository(session)
            _check_free(repository, edit.name, project.id)
            repository.add(project)
            AuditRepository(session).add("project.created", target=project.id, name=project.name, project_id=project.id)
        return _view(project, 0, principal)

    def rename(self, principal: Principal, project_id: str, edit: ProjectEdit) -> Project:
        """Give the project another name.

        Raises:
            NotFoundError: there is none.
            ConflictError: another one has that name.
        """
        with _NAMES, self._services.database.write() as session:
            repository = ProjectRepository(session)
            project = repository.get(project_id)
            _check_free(repository, edit.name, project_id)
            details, project.name = f"was {project.name}", edit.name
            AuditRepository(session).add(
                "project.renamed", target=project.id, name=project.name, project_id=project.id, details=details
            )
            experiments = repository.experiments([project_id])
        return _view(project, experiments.get(project_id, 0), principal)


def _check_free(repository: ProjectRepository, name: str, project_id: str) -> None:
    other = repository.named(name)
    if other is not None and other.id != project_id:
        raise ConflictError(f"There is a project {other.name} already: choose another name.")


def _view(project: tables.Project, experiments: int, principal: Principal) -> Project:
    role = principal.role_in(project.id)
    assert role is not None
    return Project(id=project.id, name=project.name, created_at=project.created_at, experiments=experiments, role=role)
