"""People and what they sign in with, in SQL."""

from collections.abc import Collection, Sequence

from sqlalchemy import Row, delete, func, or_, select, update
from sqlalchemy.orm import Session

from server.database import tables
from server.database.tables import Role
from server.errors import NotFoundError
from server.http.paging import Window


class PeopleRepository:
    """Reads and writes accounts and memberships within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def any(self) -> bool:
        """Whether there are accounts at all."""
        return self._session.scalar(select(tables.User.id).limit(1)) is not None

    def add(self, user: tables.User) -> None:
        """Add an account."""
        self._session.add(user)
        self._session.flush()

    def get(self, user_id: str) -> tables.User:
        """The account.

        Raises:
            NotFoundError: there is none.
        """
        user = self._session.get(tables.User, user_id)
        if user is None:
            raise NotFoundError.of("person", user_id)
        return user

    def named(self, name: str) -> tables.User | None:
        """The account of that name, in any case."""
        return self._session.scalar(select(tables.User).where(tables.User.name == name.strip().lower()))

    def identified(self, issuer: str, subject: str) -> tables.User | None:
        """The account of somebody whom a provider of identities knows."""
        row = tables.User
        return self._session.scalar(select(row).where(row.issuer == issuer, row.subject == subject))

    def with_email(self, email: str) -> tables.User | None:
        """The account of that e-mail address."""
        return self._session.scalar(select(tables.User).where(tables.User.email == email))

    def administrators(self) -> int:
        """How many may administrate the installation, and sign in."""
        query = select(func.count()).where(tables.User.admin, tables.User.disabled_at.is_(None))
        return self._session.scalar(query) or 0

    def page(self, window: Window) -> tuple[Sequence[tables.User], int]:
        """Accounts by name, and how many there are."""
        total = self._session.scalar(select(func.count()).select_from(tables.User)) or 0
        query = select(tables.User).order_by(tables.User.name).limit(window.limit).offset(window.offset)
        return self._session.scalars(query).all(), total

    def roles(self, user_ids: Collection[str]) -> Sequence[Row[str, str, str, Role]]:
        """(user, project, the project's name, role) of every membership of the people, by the project's name."""
        query = (
            select(tables.Membership.user_id, tables.Project.id, tables.Project.name, tables.Membership.role)
            .join(tables.Project, tables.Project.id == tables.Membership.project_id)
            .where(tables.Membership.user_id.in_(user_ids))
            .order_by(func.lower(tables.Project.name))
        )
        return self._session.execute(query).all()

    def members(self, project_id: str, window: Window) -> tuple[Sequence[Row[tables.User, Role]], int]:
        """The people of a project with their roles, by name, and how many there are."""
        here = tables.Membership.project_id == project_id
        total = self._session.scalar(select(func.count()).select_from(tables.Membership).where(here)) or 0
        query = (
            select(tables.User, tables.Membership.role)
            .join(tables.Membership, tables.Membership.user_id == tables.User.id)
            .where(here)
            .order_by(tables.User.name)
            .limit(window.limit)
            .offset(window.offset)
        )
        return self._session.execute(query).all(), total

    def role(self, project_id: str, user_id: str) -> Role | None:
        """What somebody may do in a project; None where they are not of it."""
        membership = self._session.get(tables.Membership, (project_id, user_id))
        return membership.role if membership else None

    def set_role(self, project_id: str, user_id: str, role: Role) -> None:
        """Let somebody do that much in a project."""
        self._session.merge(tables.Membership(project_id=project_id, user_id=user_id, role=role))

    def remove(self, project_id: str, user_id: str) -> bool:
        """Take somebody out of a project; whether they were in it."""
        query = delete(tables.Membership).where(
            tables.Membership.project_id == project_id, tables.Membership.user_id == user_id
        )
        return bool(self._session.execute(query).rowcount)  # type: ignore[attr-defined]


class CredentialRepository:
    """Reads and writes sessions, tokens and invitations within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, credential: tables.LoginSession | tables.ApiToken | tables.WorkerToken | tables.Invitation) -> None:
        """Add one."""
        self._session.add(credential)

    def session(self, *, hashed: str | None = None, session_id: str | None = None) -> tables.LoginSession | None:
        """A browser's session, by its secret's hash (the one before included) or by its id."""
        row = tables.LoginSession
        wanted = row.id == session_id if hashed is None else or_(row.hash == hashed, row.previous_hash == hashed)
        return self._session.scalar(select(row).where(wanted))

    def sessions(self, user_id: str, since: float) -> Sequence[tables.LoginSession]:
        """The browsers of somebody that end after a moment, the newest first."""
        row = tables.LoginSession
        query = select(row).where(row.user_id == user_id, row.expires_at > since).order_by(row.created_at.desc(), row.id)
        return self._session.scalars(query).all()

    def last_seen(self, user_ids: Collection[str]) -> dict[str, float]:
        """When a browser of each of the people was last seen."""
        row = tables.LoginSession
        query = select(row.user_id, func.max(row.seen_at)).where(row.user_id.in_(user_ids)).group_by(row.user_id)
        return {each[0]: each[1] for each in self._session.execute(query)}

    def end_sessions(self, user_id: str, *, only: str | None = None, but: str | None = None) -> int:
        """Sign out the browsers of somebody: one of them, or all but one; how many it were."""
        query = delete(tables.LoginSession).where(tables.LoginSession.user_id == user_id)
        if only is not None:
            query = query.where(tables.LoginSession.id == only)
        if but is not None:
            query = query.where(tables.LoginSession.id != but)
        return int(self._session.execute(query).rowcount)  # type: ignore[attr-defined]

    def sweep(self, now: float) -> None:
        """Forget sessions and invitations that have ended."""
        self._session.execute(delete(tables.LoginSession).where(tables.LoginSession.expires_at <= now))
        self._session.execute(delete(tables.Invitation).where(tables.Invitation.expires_at <= now))

    def rotate(self, session_id: str, old: str, new: str, now: float) -> bool:
        """Exchange a session's secret; whether nobody else was quicker."""
        row = tables.LoginSession
        query = update(row).where(row.id == session_id, row.hash == old)
        changed = self._session.execute(query.values(hash=new, previous_hash=old, rotated_at=now))
        return bool(changed.rowcount)  # type: ignore[attr-defined]

    def api_token(self, *, hashed: str | None = None, token_id: str | None = None) -> tables.ApiToken | None:
        """A token that was not revoked, by its hash or by its id."""
        row = tables.ApiToken
        wanted = row.id == token_id if hashed is None else row.hash == hashed
        return self._session.scalar(select(row).where(wanted, row.revoked_at.is_(None)))

    def api_tokens(self, user_id: str) -> Sequence[tables.ApiToken]:
        """Somebody's tokens that were not revoked, the newest first."""
        row = tables.ApiToken
        query = select(row).where(row.user_id == user_id, row.revoked_at.is_(None))
        return self._session.scalars(query.order_by(row.created_at.desc(), row.id)).all()

    def worker_token(self, *, hashed: str | None = None, token_id: str | None = None) -> tables.WorkerToken | None:
        """A workers' token that was not revoked, by its hash or by its id."""
        row = tables.WorkerToken
        wanted = row.id == token_id if hashed is None else row.hash == hashed
        return self._session.scalar(select(row).where(wanted, row.revoked_at.is_(None)))

    def worker_tokens(self) -> Sequence[tables.WorkerToken]:
        """The workers' tokens that were not revoked, by name."""
        row = tables.WorkerToken
        return self._session.scalars(select(row).where(row.revoked_at.is_(None)).order_by(row.name, row.id)).all()

    def invitation(self, hashed: str, now: float, *, for_update: bool = False) -> tables.Invitation | None:
        """The invitation of that hash, unless it was used or has ended; `for_update` locks it where there are row locks."""
        row = tables.Invitation
        query = select(row).where(row.hash == hashed, row.used_at.is_(None), row.expires_at > now)
        return self._session.scalar(query.with_for_update() if for_update else query)

    def open_invitations(self, projects: Collection[str] | None, now: float) -> Sequence[tables.Invitation]:
        """Invitations to these projects (to all and to none where it is None) that still hold, the newest first."""
        row = tables.Invitation
        query = select(row).where(row.used_at.is_(None), row.expires_at > now, row.user_id.is_(None))
        if projects is not None:
            query = query.where(row.project_id.in_(projects))
        return self._session.scalars(query.order_by(row.created_at.desc(), row.id)).all()

    def find_invitation(self, invitation_id: str) -> tables.Invitation | None:
        """The invitation of that id."""
        return self._session.get(tables.Invitation, invitation_id)

    def withdraw(self, invitation: tables.Invitation) -> None:
        """Let an invitation's link open nothing any more."""
        self._session.delete(invitation)
