"""What each request may do: every route names one of these permissions, and a route without one does not start.

Who sends a request is found out before (`server.security.access`); here is decided what for. What somebody may not even see
is answered as if it were not there.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

from fastapi import Depends, WebSocketException
from fastapi.params import Depends as DependsParam
from starlette.concurrency import run_in_threadpool
from starlette.requests import HTTPConnection

from server.database.tables import Role
from server.errors import ForbiddenError, NotFoundError, ServiceError, UnauthorizedError
from server.live.watched import CHECKPOINT_PREFIX, POLICY_PREFIX
from server.playground.registry import PLAY_PREFIX
from server.projects.repository import ProjectRepository
from server.replays.references import references
from server.security.principal import Principal, principal_of
from server.services import Services, ServicesDep

# RFC 6455: the request violates the server's policy.
_POLICY_VIOLATION = 1008

_LOG_IN = "Log in first: open the URL that the server printed at start, or sign in."


class Permission(ABC):
    """A dependency that lets a request pass or refuses it.

    Args:
        name: of the permission.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    async def __call__(self, connection: HTTPConnection, services: ServicesDep) -> None:
        """Let it pass.

        Raises:
            UnauthorizedError: nobody is signed in.
            NotFoundError: it is about something that may not be seen.
            ForbiddenError: it takes more rights.
            WebSocketException: one of these, for a socket.
        """
        try:
            await self.check(principal_of(connection), connection, services)
        except ServiceError as error:
            if connection.scope["type"] == "websocket":
                raise WebSocketException(_POLICY_VIOLATION, error.message[:120]) from error
            raise

    @abstractmethod
    async def check(self, principal: Principal, connection: HTTPConnection, services: Services) -> None:
        """As `__call__`, for a principal."""


class _Open(Permission):
    async def check(self, principal: Principal, connection: HTTPConnection, services: Services) -> None:
        return


class _SignedIn(Permission):
    """Anybody who has a role, or may get one."""

    async def check(self, principal: Principal, connection: HTTPConnection, services: Services) -> None:
        _somebody(principal)


class _Anywhere(Permission):
    """That role in some project; the endpoint says in which."""

    def __init__(self, name: str, role: Role) -> None:
        super().__init__(name)
        self._role = role

    async def check(self, principal: Principal, connection: HTTPConnection, services: Services) -> None:
        _somebody(principal)
        if not principal.administrates and not principal.has_anywhere(self._role):
            raise ForbiddenError(f"This takes the role {self._role} in some project.")


class _Installation(Permission):
    async def check(self, principal: Principal, connection: HTTPConnection, services: Services) -> None:
        _somebody(principal)
        if not principal.administrates:
            raise ForbiddenError("This takes an administrator of the installation.")


class _OwnAccount(Permission):
    """With a browser: a token makes no tokens, and changes no password."""

    async def check(self, principal: Principal, connection: HTTPConnection, services: Services) -> None:
        _somebody(principal)
        if principal.kind != "person":
            raise ForbiddenError("This takes an account, signed in with a browser.")


class _OwnAlerts(Permission):
    """With a browser, also that of the installation's owner: a token tells nobody anything."""

    async def check(self, principal: Principal, connection: HTTPConnection, services: Services) -> None:
        _somebody(principal)
        if principal.kind not in ("person", "owner"):
            raise ForbiddenError("This takes somebody who is signed in with a browser.")


class _OwnPlayground(Permission):
    """Who opened it: to everybody else it is not there."""

    async def check(self, principal: Principal, connection: HTTPConnection, services: Services) -> None:
        _somebody(principal)
        services.playgrounds.of(connection.path_params["playground_id"], principal)


class _Replayed(Permission):
    """Looking at everything that an address of replays names."""

    async def check(self, principal: Principal, connection: HTTPConnection, services: Services) -> None:
        _somebody(principal)
        named = references(connection.path_params["subjects"])
        for kind in ("checkpoint", "evaluation"):
            identifiers = [each.id for each in named if each.kind == kind]
            if identifiers and principal.everywhere != "admin":
                await run_in_threadpool(_CHECKED[kind].look, principal, identifiers, services)


class _Kind(Permission):
    """A program with a door of its own; `administrates` lets administrators in as well."""

    def __init__(self, name: str, kind: str, *, administrators: bool = False) -> None:
        super().__init__(name)
        self._kind = kind
        self._administrators = administrators

    async def check(self, principal: Principal, connection: HTTPConnection, services: Services) -> None:
        if principal.kind == self._kind or (self._administrators and principal.administrates):
            return
        raise ForbiddenError("This takes another token.")


_Find = Callable[[ProjectRepository, Sequence[str]], dict[str, set[str]]]
# How what a route is about leads to projects, by the name of the path's or the query's parameter.
_OF: dict[str, tuple[str, _Find]] = {
    "project_id": ("project", ProjectRepository.of_projects),
    "experiment_id": ("experiment", ProjectRepository.of_experiments),
    "experiment": ("experiment", ProjectRepository.of_experiments),
    "run_id": ("run", ProjectRepository.of_runs),
    "checkpoint_id": ("checkpoint", ProjectRepository.of_checkpoints),
    "campaign_id": ("campaign", ProjectRepository.of_campaigns),
    "campaign": ("campaign", ProjectRepository.of_campaigns),
    "upload_id": ("uploaded policy", ProjectRepository.of_uploads),
    "recording_id": ("recording", ProjectRepository.of_bags),
    "evaluation_id": ("evaluation", ProjectRepository.of_evaluations),
    "study_id": ("study", ProjectRepository.of_studies),
}


class InProject(Permission):
    """That role in the project of what the route is about.

    Args:
        name: of the permission.
        role: that it takes.
        parameter: of the path or the query, which says what it is about.
    """

    def __init__(self, name: str, role: Role, parameter: str) -> None:
        super().__init__(name)
        self._role = role
        self._parameter = parameter
        self._kind, self._find = _OF[parameter]

    async def check(self, principal: Principal, connection: HTTPConnection, services: Services) -> None:
        """As `Permission.check`."""
        _somebody(principal)
        given = connection.path_params.get(self._parameter)
        if given is not None and given.startswith(PLAY_PREFIX):
            services.playgrounds.of(given, principal)
            return
        if given is not None and given.startswith(CHECKPOINT_PREFIX):
            if principal.everywhere != "admin":
                one = [given.removeprefix(CHECKPOINT_PREFIX)]
                await run_in_threadpool(_CHECKED["checkpoint"].look, principal, one, services)
            return
        # Nothing to look up for who may do everything, which is everybody on a laptop.
        if principal.everywhere == "admin":
            return
        identifiers = [given] if given is not None else connection.query_params.getlist(self._parameter)
        identifiers = [each for each in dict.fromkeys(identifiers) if not each.startswith(POLICY_PREFIX)][:200]
        if identifiers:
            await run_in_threadpool(self.look, principal, identifiers, services)

    def look(self, principal: Principal, identifiers: list[str], services: Services) -> None:
        """Whether somebody may do that with these; raises as `Permission.__call__`."""
        with services.database.read() as session:
            found = self._find(ProjectRepository(session), identifiers)
        for identifier in identifiers:
            projects = found.get(identifier)
            if projects is None or any(principal.role_in(project) is None for project in projects):
                raise NotFoundError.of(self._kind, identifier)
            if not projects and not principal.has_anywhere(self._role):
                raise ForbiddenError(f"This takes the role {self._role} in some project.")
            for project in projects:
                principal.require(self._role, project)


_CHECKED = {
    "checkpoint": InProject("view checkpoint_id", "viewer", "checkpoint_id"),
    "evaluation": InProject("view evaluation_id", "viewer", "evaluation_id"),
}


def _somebody(principal: Principal) -> None:
    if principal.kind == "anonymous":
        raise UnauthorizedError(_LOG_IN)
    if principal.kind in ("worker", "scraper"):
        raise ForbiddenError("This token opens nothing here.")


def permission_of(dependencies: Sequence[DependsParam]) -> Permission | None:
    """The permission among a route's dependencies."""
    found = [each.dependency for each in dependencies if isinstance(each.dependency, Permission)]
    return found[0] if len(found) == 1 else None


def _dependency(permission: Permission) -> Any:
    return Depends(permission)


OPEN = _dependency(_Open("open"))
SIGNED_IN = _dependency(_SignedIn("signed in"))
LAUNCH = _dependency(_Anywhere("launch", "editor"))
INVITE = _dependency(_Anywhere("invite", "admin"))
ADMINISTRATE = _dependency(_Installation("administrate"))
OWN_PLAYGROUND = _dependency(_OwnPlayground("own playground"))
OWN_ACCOUNT = _dependency(_OwnAccount("own account"))
OWN_ALERTS = _dependency(_OwnAlerts("own alerts"))
VIEW_REPLAYED = _dependency(_Replayed("view"))
WORK = _dependency(_Kind("work", "worker"))
SCRAPE = _dependency(_Kind("scrape", "scraper", administrators=True))


def view(parameter: str) -> Any:
    """Looking at something of a project."""
    return _dependency(InProject(f"view {parameter}", "viewer", parameter))


def edit(parameter: str) -> Any:
    """Changing something of a project."""
    return _dependency(InProject(f"edit {parameter}", "editor", parameter))


def manage(parameter: str) -> Any:
    """Administrating a project."""
    return _dependency(InProject(f"manage {parameter}", "admin", parameter))
