"""People, invitations and tokens in JSON."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from server.database.tables import Role, TokenScope
from server.schemas import Line, Schema

UserName = Annotated[
    str,
    StringConstraints(
        strip_whitespace=True, to_lower=True, min_length=1, max_length=80, pattern=r"^[A-Za-z0-9][A-Za-z0-9._@+-]*$"
    ),
]
Password = Annotated[str, StringConstraints(min_length=10, max_length=200)]
Id = Annotated[str, StringConstraints(max_length=16)]
Label = Annotated[Line, StringConstraints(max_length=80)]
Note = Annotated[str, StringConstraints(strip_whitespace=True, max_length=120, pattern=r"^[^\x00-\x1f\x7f]*$")]


class SignInOptions(Schema):
    """How one may sign in here."""

    people: bool = Field(description="There are accounts; without them the server's own token is all there is.")
    provider: str | None = Field(None, description="What the provider of identities is called; null where none is set up.")
    refused: str | None = Field(None, description="Why the provider's sign-in failed, in words.")


class SignIn(Schema):
    """Name and password of an account."""

    name: str = Field(min_length=1, max_length=254)
    password: str = Field(min_length=1, max_length=200)


class Account(Schema):
    """Who asks."""

    kind: Literal["owner", "person", "token"]
    name: str = Field(description='"owner" for who holds the token that the server printed at start.')
    email: str | None
    administrates: bool = Field(description="May administrate people, workers' tokens and the audit log.")
    people: bool = Field(description="There are accounts.")
    has_password: bool
    connected: bool = Field(description="An identity of a provider signs in to it.")
    may_launch: bool = Field(description="Is an editor in some project.")


class PasswordChange(Schema):
    """A new password. The other browsers that were signed in are signed out."""

    old: str = Field(max_length=200)
    new: Password


class Session(Schema):
    """A browser that was signed in."""

    id: str
    current: bool = Field(description="It is the one that asks.")
    created_at: float
    seen_at: float = Field(description="Lately: noted every ten minutes at most.")
    address: str
    browser: str


class ApiTokenCreate(Schema):
    """A token for programs."""

    name: Label
    scope: TokenScope = Field(description="`read` looks, `launch` launches and stops, `admin` does all that its owner may.")
    projects: list[Id] | None = Field(None, max_length=100, description="Ids; all of its owner's where it is null.")
    days: int | None = Field(90, ge=1, le=3_650, description="Until it ends by itself; null for never.")


class ApiToken(Schema):
    """A token for programs; the token itself is shown when it is made, and never again."""

    id: str
    name: str
    scope: TokenScope
    projects: list[str] | None
    created_at: float
    expires_at: float | None
    seen_at: float | None = Field(description="Last used, noted every ten minutes at most.")


class NewApiToken(ApiToken):
    """A token that was just made."""

    token: str = Field(description="To be copied now: only its hash is kept.")


class WorkerTokenCreate(Schema):
    """A token for the workers of a machine."""

    name: Label


class WorkerToken(Schema):
    """A token for the workers of a machine."""

    id: str
    name: str
    created_at: float
    seen_at: float | None = Field(description="Last used, noted every ten minutes at most.")


class NewWorkerToken(WorkerToken):
    """A worker token that was just made."""

    token: str = Field(description="To be copied now: only its hash is kept.")


class PersonRole(Schema):
    """What somebody may do in a project."""

    project_id: str
    project: str
    role: Role


class Person(Schema):
    """An account."""

    id: str
    name: str
    email: str | None
    admin: bool = Field(description="Administrates the installation.")
    disabled: bool
    created_at: float
    seen_at: float | None = Field(description="When a browser of theirs was last seen; null where none is signed in.")
    roles: list[PersonRole]


class PersonPatch(Schema):
    """What is changed of an account; what is absent stays as it is."""

    admin: bool | None = None
    disabled: bool | None = Field(None, description="Signed out everywhere, and not let in again.")


class Member(Schema):
    """Somebody who may see a project."""

    user_id: str
    name: str
    role: Role
    disabled: bool


class MemberEdit(Schema):
    """What somebody may do in the project."""

    role: Role


class InvitationCreate(Schema):
    """A link that lets somebody join."""

    project_id: Id | None = Field(None, description="Of the project that they join; null for none.")
    role: Role = Field("viewer", description="In that project.")
    admin: bool = Field(False, description="They administrate the installation.")
    note: Note = Field("", description="For whom it is, say.")
    days: int = Field(7, ge=1, le=30, description="Until it ends.")


class Invitation(Schema):
    """A link that lets somebody join once."""

    id: str
    project_id: str | None
    project: str | None
    role: Role | None
    admin: bool
    note: str
    invited_by: str
    expires_at: float


class NewInvitation(Invitation):
    """An invitation that was just made."""

    path: str = Field(description="The link on this server; only its hash is kept.")


class InvitationCode(Schema):
    """What an invitation's link ends with."""

    code: str = Field(min_length=1, max_length=100)


class InvitationView(Schema):
    """What an invitation is for, for who holds its link."""

    purpose: Literal["join", "password"]
    name: str | None = Field(description="Whose password it sets; null where somebody joins.")
    project: str | None
    role: Role | None
    admin: bool
    invited_by: str
    expires_at: float


class InvitationAccept(InvitationCode):
    """Who accepts: a new name and password, or nothing more where somebody is signed in."""

    name: UserName | None = None
    password: Password | None = None
