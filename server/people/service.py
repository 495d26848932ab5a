"""What administrators may do: people, the members of projects, and workers' tokens."""

import time
from collections.abc import Sequence

from sqlalchemy.orm import Session

from server.audit.repository import AuditRepository
from server.database import tables
from server.database.tables import Role
from server.errors import ConflictError, NotFoundError
from server.http.paging import Window
from server.ids import new_id
from server.people.repository import CredentialRepository, PeopleRepository
from server.people.schemas import (
    Member,
    NewWorkerToken,
    Person,
    PersonPatch,
    PersonRole,
    WorkerToken,
    WorkerTokenCreate,
)
from server.people.secret import WORKER_PREFIX, hash_of, new_secret
from server.projects.repository import ProjectRepository
from server.schemas import Page
from server.services import Services

_MAX_WORKER_TOKENS = 500


class PeopleService:
    """Administers accounts, memberships and workers' tokens."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def page(self, window: Window) -> Page[Person]:
        """People, by name."""
        with self._services.database.read() as session:
            found, total = PeopleRepository(session).page(window)
            return Page(items=_people(session, found), total=total)

    def change(self, user_id: str, patch: PersonPatch) -> Person:
        """Let somebody administrate the installation or not, and close or open their account.

        Raises:
            NotFoundError: there is no such person.
            ConflictError: nobody would be left to administrate.
        """
        with self._services.database.write() as session:
            people, audit = PeopleRepository(session), AuditRepository(session)
            user = people.get(user_id)
            if patch.admin is not None and patch.admin != user.admin:
                user.admin = patch.admin
                audit.add("person.admin" if patch.admin else "person.no_admin", target=user.id, name=user.name)
            if patch.disabled is not None and patch.disabled != (user.disabled_at is not None):
                user.disabled_at = time.time() if patch.disabled else None
                audit.add("person.disabled" if patch.disabled else "person.enabled", target=user.id, name=user.name)
                CredentialRepository(session).end_sessions(user.id)
            session.flush()
            if people.administrators() == 0:
                raise ConflictError("Nobody would be left to administrate: make somebody else an administrator first.")
            view = _people(session, [user])[0]
        self._services.gate.changed()
        return view

    def members(self, project_id: str, window: Window) -> Page[Member]:
        """The people of a project, by name.

        Raises:
            NotFoundError: there is no such project.
        """
        with self._services.database.read() as session:
            ProjectRepository(session).get(project_id)
            found, total = PeopleRepository(session).members(project_id, window)
            return Page(items=[_member(user, role) for user, role in found], total=total)

    def set_role(self, project_id: str, user_id: str, role: Role) -> Member:
        """Let somebody do that much in a project.

        Raises:
            NotFoundError: there is no such project, or person.
        """
        with self._services.database.write() as session:
            project, people = ProjectRepository(session).get(project_id), PeopleRepository(session)
            # Who may manage one project has no list of everybody: people join it by an invitation.
            if people.role(project_id, user_id) is None:
                raise NotFoundError.of("member", user_id)
            user = people.get(user_id)
            people.set_role(project_id, user_id, role)
            AuditRepository(session).add(
                "member.role", target=user_id, name=user.name, project_id=project_id, details=f"{role} in {project.name}"
            )
        self._services.gate.changed()
        return _member(user, role)

    def remove(self, project_id: str, user_id: str) -> None:
        """Take somebody out of a project.

        Raises:
            NotFoundError: they are not in it.
        """
        with self._services.database.write() as session:
            project, people = ProjectRepository(session).get(project_id), PeopleRepository(session)
            if not people.remove(project_id, user_id):
                raise NotFoundError.of("member", user_id)
            AuditRepository(session).add(
                "member.removed",
                target=user_id,
                name=people.get(user_id).name,
                project_id=project_id,
                details=f"from {project.name}",
            )
        self._services.gate.changed()

    def worker_tokens(self) -> list[WorkerToken]:
        """The workers' tokens, by name."""
        with self._services.database.read() as session:
            return [_worker_token(row) for row in CredentialRepository(session).worker_tokens()]

    def make_worker_token(self, request: WorkerTokenCreate) -> NewWorkerToken:
        """A new token for the workers of a machine.

        Raises:
            ConflictError: there is one of that name, or there are too many.
        """
        secret = new_secret(WORKER_PREFIX)
        row = tables.WorkerToken(id=new_id(), name=request.name, hash=hash_of(secret), created_at=time.time())
        with self._services.database.write() as session:
            credentials = CredentialRepository(session)
            others = credentials.worker_tokens()
            if any(other.name.lower() == request.name.lower() for other in others):
                raise ConflictError(f"There is a workers' token {request.name} already: revoke it, or choose another name.")
            if len(others) >= _MAX_WORKER_TOKENS:
                raise ConflictError(f"There are {_MAX_WORKER_TOKENS} workers' tokens already: revoke some.")
            credentials.add(row)
            AuditRepository(session).add("worker_token.made", target=row.id, name=row.name)
        return NewWorkerToken(**_worker_token(row).model_dump(), token=secret)

    def revoke_worker_token(self, token_id: str) -> None:
        """Let a workers' token open nothing any more; links that it opened are cut.

        Raises:
            NotFoundError: there is none.
        """
        with self._services.database.write() as session:
            row = CredentialRepository(session).worker_token(token_id=token_id)
            if row is None:
                raise NotFoundError.of("workers' token", token_id)
            row.revoked_at = time.time()
            AuditRepository(session).add("worker_token.revoked", target=row.id, name=row.name)
        self._services.gate.changed()


def _people(session: Session, users: Sequence[tables.User]) -> list[Person]:
    ids = [user.id for user in users]
    seen = CredentialRepository(session).last_seen(ids)
    roles: dict[str, list[PersonRole]] = {user_id: [] for user_id in ids}
    for user_id, project_id, project, role in PeopleRepository(session).roles(ids):
        roles[user_id].append(PersonRole(project_id=project_id, project=project, role=role))
    return [
        Person(
            id=user.id,
            name=user.name,
            email=user.email,
            admin=user.admin,
            disabled=user.disabled_at is not None,
            created_at=user.created_at,
            seen_at=seen.get(user.id),
            roles=roles[user.id],
        )
        for user in users
    ]


def _member(user: tables.User, role: Role) -> Member:
    return Member(user_id=user.id, name=user.name, role=role, disabled=user.disabled_at is not None)


def _worker_token(row: tables.WorkerToken) -> WorkerToken:
    return WorkerToken(id=row.id, name=row.name, created_at=row.created_at, seen_at=row.seen_at)
