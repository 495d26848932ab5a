"""People of a lab, made at once: accounts with roles, their browsers and tokens."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fastapi.testclient import TestClient

from server.database import tables
from server.database.tables import Role, TokenScope
from server.ids import new_id
from server.people.accounts import AccountService
from server.people.repository import PeopleRepository
from server.people.schemas import ApiTokenCreate, WorkerTokenCreate
from server.people.service import PeopleService
from server.people.sign_in import open_session
from server.projects.repository import ProjectRepository
from server.security.principal import Principal
from server.services import Services


@dataclass(frozen=True)
class Lab:
    """Adds projects, people and what they sign in with to a service, past the pages."""

    services: Services

    def project(self, name: str) -> str:
        """A project; its id."""
        row = tables.Project(id=new_id(), name=name)
        with self.services.database.write() as session:
            ProjectRepository(session).add(row)
        return row.id

    def person(
        self,
        name: str,
        roles: Mapping[str, Role] | None = None,
        *,
        admin: bool = False,
        password_hash: str | None = None,
    ) -> str:
        """An account with a role in each of the projects, by id; its id."""
        row = tables.User(id=new_id(), name=name, admin=admin, password_hash=password_hash)
        with self.services.database.write() as session:
            people = PeopleRepository(session)
            people.add(row)
            for project_id, role in (roles or {}).items():
                people.set_role(project_id, row.id, role)
        return row.id

    def browser(self, user_id: str) -> dict[str, str]:
        """Headers of a browser in which somebody is signed in."""
        with self.services.database.write() as session:
            secret = open_session(session, PeopleRepository(session).get(user_id), "a browser")
        return {"Cookie": f"mapless-session-8400={secret}"}

    def token(self, user_id: str, scope: TokenScope, projects: list[str] | None = None) -> dict[str, str]:
        """Headers of a program with a token of somebody."""
        person = Principal("person", "x", user_id=user_id, credential="x", everywhere="admin")
        made = AccountService(self.services).make_token(person, ApiTokenCreate(name="t", scope=scope, projects=projects))
        return {"Authorization": f"Bearer {made.token}"}

    def worker_token(self, name: str) -> dict[str, str]:
        """Headers of a worker with a token of its own."""
        made = PeopleService(self.services).make_worker_token(WorkerTokenCreate(name=name))
        return {"Authorization": f"Bearer {made.token}"}


def launch(client: TestClient, project_id: str, name: str = "Corridor", **headers: str) -> dict[str, Any]:
    """An experiment in a project, as the API shows it."""
    response = client.post("/api/experiments", json={"name": name, "project_id": project_id}, headers=headers)
    assert response.status_code == 201, response.text
    experiment: dict[str, Any] = response.json()
    return experiment
