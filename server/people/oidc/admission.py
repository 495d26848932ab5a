"""Lets in whom the provider names: their account, found or made, and what its groups say they may do."""

import time

from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from server.audit.actor import Actor, acting, current_actor
from server.audit.repository import AuditRepository
from server.database import tables
from server.database.tables import Role
from server.errors import NotFoundError
from server.ids import new_id
from server.people.invitations import find_invitation, use_invitation
from server.people.oidc.identity import Identity
from server.people.oidc.journey import Journey
from server.people.oidc.refusals import SignInRefusedError
from server.people.oidc.settings import ADMINISTRATOR, OidcSettings, project_right
from server.people.repository import PeopleRepository
from server.people.sign_in import open_session
from server.projects.repository import ProjectRepository
from server.security.principal import Principal, at_least
from server.services import Services

# Names that are taken get a number; so many people of one name are somebody's attempt to fill the table.
_MOST_NAMESAKES = 1_000


class AdmissionService:
    """Opens sessions for people of the provider.

    Args:
        services: with the database.
        settings: whom the provider brings.
    """

    def __init__(self, services: Services, settings: OidcSettings) -> None:
        self._services = services
        self._settings = settings

    def admit(self, identity: Identity, journey: Journey, browser: str) -> str:
        """The secret of a new session.

        Raises:
            SignInRefusedError: they are not let in.
        """
        if not self._is_allowed(identity):
            raise SignInRefusedError("not_allowed")
        try:
            secret = self._admit(identity, journey, browser)
        except IntegrityError:
            # Two browsers of somebody new at once: the other was first, so that the account is there now.
            secret = self._admit(identity, journey, browser)
        self._services.gate.changed()
        return secret

    def _is_allowed(self, identity: Identity) -> bool:
        wanted = self._settings
        domain = identity.email.rpartition("@")[2] if identity.email is not None else None
        return (not wanted.domains or domain in wanted.domains) and (
            not wanted.groups or not wanted.groups.isdisjoint(identity.groups)
        )

    def _admit(self, identity: Identity, journey: Journey, browser: str) -> str:
        with self._services.database.write() as session:
            people = PeopleRepository(session)
            user = people.identified(identity.issuer, identity.subject)
            if journey.connects is not None:
                user = self._connect(people, identity, journey.connects, user)
            invitation = None
            if journey.invitation is not None:
                try:
                    invitation = find_invitation(session, journey.invitation, for_update=True)
                except NotFoundError as error:
                    raise SignInRefusedError("link") from error
                if invitation.user_id is not None:
                    raise SignInRefusedError("link")
            if user is None and invitation is None and not self._settings.strangers:
                raise SignInRefusedError("stranger")
            is_new = user is None
            user = user or self._create(people, identity)
            if user.disabled_at is not None:
                raise SignInRefusedError("closed")
            with acting(Actor(Principal("person", user.name, user_id=user.id), current_actor().address)):
                audit = AuditRepository(session)
                if is_new:
                    audit.add("person.created", target=user.id, name=user.name, details=f"by {self._settings.title}")
                elif journey.connects is not None:
                    audit.add("person.connected", target=user.id, name=user.name, details=f"with {self._settings.title}")
                if invitation is not None:
                    use_invitation(session, invitation, user)
                self._give_rights(session, user, identity)
            if identity.email is not None and people.with_email(identity.email) is None:
                user.email = identity.email
            return open_session(session, user, browser)

    def _connect(self, people: PeopleRepository, identity: Identity, user_id: str, owner: tables.User | None) -> tables.User:
        if owner is not None and owner.id != user_id:
            raise SignInRefusedError("taken")
        try:
            user = people.get(user_id)
        except NotFoundError as error:
            raise SignInRefusedError("closed") from error
        user.issuer, user.subject = identity.issuer, identity.subject
        return user

    def _create(self, people: PeopleRepository, identity: Identity) -> tables.User:
        for number in range(1, _MOST_NAMESAKES):
            suffix = "" if number == 1 else f"-{number}"
            name = identity.name[: 80 - len(suffix)] + suffix
            if people.named(name) is None:
                user = tables.User(
                    id=new_id(),
                    name=name,
                    issuer=identity.issuer,
                    subject=identity.subject,
                    admin=False,
                    created_at=time.time(),
                )
                people.add(user)
                return user
        raise SignInRefusedError("not_allowed")

    def _give_rights(self, session: Session, user: tables.User, identity: Identity) -> None:
        """Where the settings name a project, its role is what the groups say now, and none where they say nothing."""
        settings, people, audit = self._settings, PeopleRepository(session), AuditRepository(session)
        theirs = {right for group in identity.groups for right in settings.rights.get(group, ())}
        if settings.rules_administrators and user.admin != (ADMINISTRATOR in theirs):
            user.admin = ADMINISTRATOR in theirs
            audit.add("person.admin" if user.admin else "person.no_admin", target=user.id, name=user.name)
        roles: dict[str, Role | None] = {}
        for right in {right for rights in settings.rights.values() for right in rights}:
            named = project_right(right)
            if named is None:
                continue
            role, project = named
            best = roles.get(project.lower())
            roles[project.lower()] = role if right in theirs and (best is None or at_least(role, best)) else best
        for name, wanted in roles.items():
            found = ProjectRepository(session).named(name)
            if found is None or people.role(found.id, user.id) == wanted:
                continue
            if wanted is None:
                people.remove(found.id, user.id)
            else:
                people.set_role(found.id, user.id, wanted)
            audit.add(
                "member.removed" if wanted is None else "member.role",
                target=user.id,
                name=user.name,
                project_id=found.id,
                details=f"from {found.name}" if wanted is None else f"{wanted} in {found.name}",
            )
