"""Links by which people join, or set a password anew: each opens once, and not for ever."""

import time

from sqlalchemy.orm import Session

from server.audit.actor import Actor, acting, current_actor
from server.audit.repository import AuditRepository
from server.database import tables
from server.errors import ConflictError, ForbiddenError, InvalidRequestError, NotFoundError
from server.ids import new_id
from server.people.passwords import hash_password
from server.people.repository import CredentialRepository, PeopleRepository
from server.people.schemas import (
    Invitation,
    InvitationAccept,
    InvitationCreate,
    InvitationView,
    NewInvitation,
)
from server.people.secret import hash_of, new_secret
from server.people.sign_in import open_session
from server.projects.repository import ProjectRepository
from server.security.principal import Principal
from server.services import Services

_DAY = 24 * 3600.0
_MAX_OPEN = 500
_GONE = "This link has been used already, was withdrawn, or has ended: ask for a new one."


class InvitationService:
    """Makes, shows, withdraws and accepts invitations."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def open(self, principal: Principal) -> list[Invitation]:
        """Those that still hold, of the projects that somebody administrates, the newest first."""
        projects = None
        if not principal.administrates:
            visible = principal.visible
            projects = None if visible is None else {each for each in visible if principal.has("admin", each)}
        with self._services.database.read() as session:
            return [_view(session, row) for row in CredentialRepository(session).open_invitations(projects, time.time())]

    def invite(self, principal: Principal, request: InvitationCreate) -> NewInvitation:
        """A link for somebody to join.

        Raises:
            NotFoundError: there is no such project.
            ForbiddenError: that much is not theirs to give.
            ConflictError: too many hold already.
        """
        if (request.admin or request.project_id is None) and not principal.administrates:
            raise ForbiddenError("This takes an administrator of the installation.")
        if request.project_id is not None:
            principal.require("admin", request.project_id)
        with self._services.database.write() as session:
            return add_invitation(session, principal.name, request)

    def reset(self, principal: Principal, user_id: str) -> NewInvitation:
        """A link by which somebody sets a new password.

        Raises:
            NotFoundError: there is no such person.
        """
        with self._services.database.write() as session:
            return add_reset(session, principal.name, PeopleRepository(session).get(user_id))

    def withdraw(self, principal: Principal, invitation_id: str) -> None:
        """Let a link open nothing any more.

        Raises:
            NotFoundError: there is none, or it is not theirs.
        """
        with self._services.database.write() as session:
            credentials = CredentialRepository(session)
            row = credentials.find_invitation(invitation_id)
            theirs = row is not None and (
                principal.administrates or (row.project_id is not None and principal.has("admin", row.project_id))
            )
            if row is None or not theirs:
                raise NotFoundError.of("invitation", invitation_id)
            AuditRepository(session).add(
                "invitation.withdrawn", target=row.id, name=row.note or None, project_id=row.project_id
            )
            credentials.withdraw(row)

    def look(self, code: str) -> InvitationView:
        """What a link is for.

        Raises:
            NotFoundError: it opens nothing (any more).
        """
        with self._services.database.read() as session:
            row = find_invitation(session, code)
            user = PeopleRepository(session).get(row.user_id) if row.user_id is not None else None
            return InvitationView(
                purpose="join" if user is None else "password",
                name=user.name if user else None,
                project=_project(session, row),
                role=row.role,
                admin=row.admin,
                invited_by=row.invited_by,
                expires_at=row.expires_at,
            )

    def accept(self, principal: Principal, request: InvitationAccept, browser: str) -> str | None:
        """Join, or set the password; the secret of a new session, None for who is signed in already.

        Raises:
            NotFoundError: the link opens nothing (any more).
            ConflictError: the name is taken.
            InvalidRequestError: name or password is missing.
        """
        # Ahead of the transaction: it takes its time.
        hashed = hash_password(request.password) if request.password is not None else None
        with self._services.database.write() as session:
            row = find_invitation(session, request.code, for_update=True)
            people = PeopleRepository(session)
            if row.user_id is not None:
                user = people.get(row.user_id)
                if hashed is None:
                    raise InvalidRequestError("Choose a password.")
                user.password_hash = hashed
                CredentialRepository(session).end_sessions(user.id)
                signed_in = False
            elif principal.kind == "person" and principal.user_id is not None:
                user, signed_in = people.get(principal.user_id), True
            else:
                user, signed_in = _join(people, request, hashed), False
            use_invitation(session, row, user)
            secret = None if signed_in else open_session(session, user, browser)
        self._services.gate.changed()
        return secret


def use_invitation(session: Session, row: tables.Invitation, user: tables.User) -> None:
    """Give somebody what an invitation promises, within the caller's transaction; it opens nothing any more."""
    user.admin = user.admin or row.admin
    if row.project_id is not None and row.role is not None:
        PeopleRepository(session).set_role(row.project_id, user.id, row.role)
    row.used_at = time.time()
    with acting(Actor(Principal("person", user.name, user_id=user.id), current_actor().address)):
        AuditRepository(session).add(
            "password.reset" if row.user_id is not None else "invitation.accepted",
            target=user.id,
            name=user.name,
            project_id=row.project_id,
            details=f"invited by {row.invited_by}",
        )


def add_invitation(session: Session, invited_by: str, request: InvitationCreate) -> NewInvitation:
    """An invitation within the caller's transaction.

    Raises:
        NotFoundError: there is no such project.
        ConflictError: too many hold already.
    """
    credentials, now, secret = CredentialRepository(session), time.time(), new_secret()
    credentials.sweep(now)
    if len(credentials.open_invitations(None, now)) >= _MAX_OPEN:
        raise ConflictError(f"{_MAX_OPEN} invitations are open already: withdraw some.")
    project = ProjectRepository(session).get(request.project_id) if request.project_id is not None else None
    row = tables.Invitation(
        id=new_id(),
        hash=hash_of(secret),
        project_id=request.project_id,
        role=request.role if project else None,
        admin=request.admin,
        note=request.note,
        invited_by=invited_by,
        expires_at=now + request.days * _DAY,
    )
    credentials.add(row)
    rights = [f"{row.role} in {project.name}"] if project else []
    AuditRepository(session).add(
        "invitation.made",
        target=row.id,
        name=row.note or None,
        project_id=row.project_id,
        details=", ".join([*rights, *(["administrator"] if row.admin else [])]) or None,
    )
    session.flush()
    return NewInvitation(**_view(session, row).model_dump(), path=f"/join#{secret}")


def add_reset(session: Session, by: str, user: tables.User) -> NewInvitation:
    """A link by which somebody sets a new password, within the caller's transaction."""
    secret = new_secret()
    row = tables.Invitation(
        id=new_id(),
        hash=hash_of(secret),
        user_id=user.id,
        admin=False,
        note="",
        invited_by=by,
        expires_at=time.time() + _DAY,
    )
    CredentialRepository(session).add(row)
    AuditRepository(session).add("password.reset_link", target=user.id, name=user.name)
    session.flush()
    return NewInvitation(**_view(session, row).model_dump(), path=f"/join#{secret}")


def _join(people: PeopleRepository, request: InvitationAccept, hashed: str | None) -> tables.User:
    if request.name is None or hashed is None:
        raise InvalidRequestError("Choose a name and a password.")
    if people.named(request.name) is not None:
        raise ConflictError(f"There is somebody called {request.name} already: choose another name.")
    user = tables.User(id=new_id(), name=request.name, password_hash=hashed, admin=False)
    people.add(user)
    return user


def find_invitation(session: Session, code: str, *, for_update: bool = False) -> tables.Invitation:
    """The invitation of a link's code; `for_update` for who will use it.

    Raises:
        NotFoundError: the link opens nothing (any more).
    """
    row = CredentialRepository(session).invitation(hash_of(code), time.time(), for_update=for_update)
    if row is None:
        raise NotFoundError(_GONE)
    return row


def _project(session: Session, row: tables.Invitation) -> str | None:
    return ProjectRepository(session).get(row.project_id).name if row.project_id is not None else None


def _view(session: Session, row: tables.Invitation) -> Invitation:
    return Invitation(
        id=row.id,
        project_id=row.project_id,
        project=_project(session, row),
        role=row.role,
        admin=row.admin,
        note=row.note,
        invited_by=row.invited_by,
        expires_at=row.expires_at,
    )
