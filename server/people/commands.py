"""What whoever runs the server may do with people, at its machine, without a login."""

from dataclasses import dataclass

from server.audit.repository import AuditRepository
from server.database import tables
from server.database.engine import Database
from server.database.migrate import upgrade
from server.database.tables import Role
from server.errors import ConflictError, NotFoundError
from server.http.paging import MAX_PAGE, Window
from server.ids import new_id
from server.people.invitations import add_invitation, add_reset
from server.people.passwords import hash_password
from server.people.repository import PeopleRepository
from server.people.schemas import InvitationCreate
from server.projects.repository import ProjectRepository
from server.settings import Settings

_BY = "owner"


@dataclass(frozen=True)
class PeopleCommands:
    """Adds people to the database of the settings; a server that runs knows them at once.

    Args:
        settings: whose database it is.
    """

    settings: Settings

    def create_admin(self, name: str, password: str) -> None:
        """Somebody who administrates the installation.

        Raises:
            ConflictError: the name is taken.
            ServiceError: the database can't be used.
        """
        user = tables.User(id=new_id(), name=name, password_hash=hash_password(password), admin=True)
        database = self._database()
        with database.write() as session:
            people = PeopleRepository(session)
            if people.named(name) is not None:
                raise ConflictError(f"There is somebody called {name} already.")
            people.add(user)
            AuditRepository(session).add("person.created", target=user.id, name=name, details="administrator")
        database.dispose()

    def invite(self, project: str | None, role: Role, days: int, *, admin: bool) -> str:
        """A link by which somebody joins, once.

        Raises:
            NotFoundError: there is no project of that name.
            ServiceError: the database can't be used.
        """
        database = self._database()
        with database.write() as session:
            found = ProjectRepository(session).named(project) if project is not None else None
            if project is not None and found is None:
                raise NotFoundError(f"There is no project called {project}.")
            request = InvitationCreate(project_id=found.id if found else None, role=role, admin=admin, days=days)
            path = add_invitation(session, _BY, request).path
        database.dispose()
        return self.settings.resolved_public_url + path

    def password_link(self, name: str) -> str:
        """A link by which somebody sets a new password.

        Raises:
            NotFoundError: there is nobody of that name.
            ServiceError: the database can't be used.
        """
        database = self._database()
        with database.write() as session:
            user = PeopleRepository(session).named(name)
            if user is None:
                raise NotFoundError(f"There is nobody called {name}.")
            path = add_reset(session, _BY, user).path
        database.dispose()
        return self.settings.resolved_public_url + path

    def lines(self) -> list[str]:
        """Everybody with an account, a line each."""
        database = self._database()
        with database.read() as session:
            people = PeopleRepository(session)
            users, total = people.page(Window(MAX_PAGE, 0))
            roles: dict[str, list[str]] = {}
            for user_id, _, project, role in people.roles([user.id for user in users]):
                roles.setdefault(user_id, []).append(f"{role} in {project}")
        database.dispose()
        lines = [
            ", ".join(
                [
                    user.name,
                    *(["closed"] if user.disabled_at is not None else []),
                    *(["administrator"] if user.admin else []),
                    *roles.get(user.id, []),
                ]
            )
            for user in users
        ]
        return lines if total <= MAX_PAGE else [*lines, f"... {total - MAX_PAGE} more"]

    def _database(self) -> Database:
        database = Database(self.settings.resolved_database_url)
        upgrade(database)
        return database
