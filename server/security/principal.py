"""Who sends a request, and what may be done in whose name."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from fastapi import Depends
from starlette.requests import HTTPConnection

from server.database.tables import Role, TokenScope
from server.errors import ForbiddenError, NotFoundError

_RANKS: dict[Role, int] = {"viewer": 0, "editor": 1, "admin": 2}
# The most that a token of that scope may do in any project.
_SCOPES: dict[TokenScope, Role] = {"read": "viewer", "launch": "editor", "admin": "admin"}

_SCOPE_KEY = "mapless.principal"


@dataclass(frozen=True, slots=True)
class Principal:
    """Who sends a request.

    Attributes:
        kind: `owner` holds the token that the server printed at start, `person` signed in with a browser, `token` is one
            of a person's own, `worker` and `scraper` are programs with doors of their own, `anonymous` is everybody else.
        name: as the audit log has it.
        user_id: of the account, where there is one.
        credential: id of the session or the token.
        administrates: people, workers and the audit log of the whole installation.
        everywhere: the role in every project; None where `roles` says all.
        roles: by project.
    """

    kind: Literal["owner", "person", "token", "worker", "scraper", "anonymous"]
    name: str
    user_id: str | None = None
    credential: str | None = None
    administrates: bool = False
    everywhere: Role | None = None
    roles: Mapping[str, Role] = field(default_factory=dict)

    @property
    def person(self) -> str:
        """Whom it comes from, whichever way they signed in: an account, or all who hold the owner's token."""
        return self.user_id or self.kind

    @property
    def visible(self) -> frozenset[str] | None:
        """The projects that may be seen; None for all."""
        return None if self.everywhere is not None else frozenset(self.roles)

    def role_in(self, project_id: str) -> Role | None:
        """The role in a project; None where not even its existence is to be known."""
        return self.everywhere or self.roles.get(project_id)

    def has(self, role: Role, project_id: str) -> bool:
        """Whether that much may be done in a project."""
        return at_least(self.role_in(project_id), role)

    def has_anywhere(self, role: Role) -> bool:
        """Whether that much may be done in some project."""
        return at_least(self.everywhere, role) or any(at_least(own, role) for own in self.roles.values())

    def require(self, role: Role, project_id: str) -> None:
        """Refuse what is more than may be done in a project.

        Raises:
            NotFoundError: the project may not even be seen.
            ForbiddenError: the role is too low.
        """
        own = self.role_in(project_id)
        if own is None:
            raise NotFoundError.of("project", project_id)
        if not at_least(own, role):
            raise ForbiddenError(f"This takes the role {role} in the project, and yours is {own}.")


OWNER = Principal("owner", "owner", administrates=True, everywhere="admin")
WORKER = Principal("worker", "workers' token")
ANONYMOUS = Principal("anonymous", "anonymous")
SCRAPER = Principal("scraper", "metrics token")


def at_least(role: Role | None, wanted: Role) -> bool:
    """Whether a role includes another."""
    return role is not None and _RANKS[role] >= _RANKS[wanted]


def capped(role: Role, scope: TokenScope) -> Role:
    """What is left of a role within a token's scope."""
    return min(role, _SCOPES[scope], key=_RANKS.__getitem__)


def set_principal(connection: HTTPConnection, principal: Principal) -> None:
    """Say who sends it; before anything else looks at the request."""
    connection.scope[_SCOPE_KEY] = principal


def principal_of(connection: HTTPConnection) -> Principal:
    """Who sends it; nobody where nobody said."""
    principal: Principal = connection.scope.get(_SCOPE_KEY, ANONYMOUS)
    return principal


async def _principal(connection: HTTPConnection) -> Principal:
    return principal_of(connection)


PrincipalDep = Annotated[Principal, Depends(_principal)]
