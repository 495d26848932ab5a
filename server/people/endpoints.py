"""Routes of people: signing in, one's own account, and what administrators do."""

from typing import Annotated

from fastapi import APIRouter, Depends, Header, Query, Request, Response, status

from server.errors import NotFoundError, UnauthorizedError
from server.http.paging import PartDep, WindowDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.people.accounts import AccountService
from server.people.invitations import InvitationService
from server.people.oidc.refusals import Refusal, in_words
from server.people.schemas import (
    Account,
    ApiToken,
    ApiTokenCreate,
    Invitation,
    InvitationAccept,
    InvitationCode,
    InvitationCreate,
    InvitationView,
    Member,
    MemberEdit,
    NewApiToken,
    NewInvitation,
    NewWorkerToken,
    PasswordChange,
    Person,
    PersonPatch,
    Session,
    SignIn,
    SignInOptions,
    WorkerToken,
    WorkerTokenCreate,
)
from server.people.service import PeopleService
from server.people.sign_in import SignInService
from server.schemas import Page
from server.security.cookies import clear_cookies, set_session
from server.security.permissions import ADMINISTRATE, INVITE, OPEN, OWN_ACCOUNT, SIGNED_IN, manage
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(tags=["people"])

_NO_CONTENT = status.HTTP_204_NO_CONTENT
Browser = Annotated[str, Header(alias="User-Agent", include_in_schema=False)]


async def _accounts(services: ServicesDep) -> AccountService:
    return AccountService(services)


async def _people(services: ServicesDep) -> PeopleService:
    return PeopleService(services)


async def _invitations(services: ServicesDep) -> InvitationService:
    return InvitationService(services)


async def _sign_in(services: ServicesDep) -> SignInService:
    return SignInService(services)


AccountsDep = Annotated[AccountService, Depends(_accounts)]
PeopleDep = Annotated[PeopleService, Depends(_people)]
InvitationsDep = Annotated[InvitationService, Depends(_invitations)]
SignInDep = Annotated[SignInService, Depends(_sign_in)]


@router.get("/api/sign-in", dependencies=[OPEN])
def get_sign_in_options(
    service: SignInDep,
    services: ServicesDep,
    refused: Annotated[Refusal | None, Query(description="Why the provider's sign-in failed.")] = None,
) -> SignInOptions:
    """How one may sign in here."""
    provider = services.provider.settings.title if services.provider is not None else None
    return SignInOptions(
        people=service.has_people(),
        provider=provider,
        refused=in_words(refused, provider) if refused is not None and provider is not None else None,
    )


@router.post("/api/sign-in", status_code=_NO_CONTENT, dependencies=[OPEN])
async def sign_in(
    credentials: SignIn,
    request: Request,
    response: Response,
    service: SignInDep,
    services: ServicesDep,
    browser: Browser = "",
) -> None:
    """Exchange name and password for a session, which a cookie keeps."""
    await services.login_limiter.turn(request)
    try:
        secret = await services.lanes.passwords.run(service.sign_in, credentials.name, credentials.password, browser)
    except UnauthorizedError:
        services.login_limiter.failed(request, credentials.password)
        raise
    set_session(response, request, services.settings, secret)


@router.post("/api/sign-out", status_code=_NO_CONTENT, dependencies=[SIGNED_IN])
def sign_out(response: Response, service: SignInDep, services: ServicesDep, principal: PrincipalDep) -> None:
    """End the session, and forget the login."""
    service.sign_out(principal)
    clear_cookies(response, services.settings)


@router.get("/api/account", dependencies=[SIGNED_IN])
def get_account(service: AccountsDep, principal: PrincipalDep) -> Account:
    """Who asks."""
    return service.get(principal)


@router.put("/api/account/password", status_code=_NO_CONTENT, responses=CONFLICT, dependencies=[OWN_ACCOUNT])
async def change_password(
    change: PasswordChange, service: AccountsDep, services: ServicesDep, principal: PrincipalDep
) -> None:
    """Set a new password, and sign out every other browser."""
    await services.lanes.passwords.run(service.change_password, principal, change)


@router.get("/api/account/sessions", dependencies=[OWN_ACCOUNT])
def list_sessions(service: AccountsDep, principal: PrincipalDep, part: PartDep) -> list[Session]:
    """The browsers that are signed in, the newest first."""
    return part.of(service.sessions(principal))


@router.delete(
    "/api/account/sessions/{session_id}", status_code=_NO_CONTENT, responses=NOT_FOUND, dependencies=[OWN_ACCOUNT]
)
def end_session(session_id: str, service: AccountsDep, principal: PrincipalDep) -> None:
    """Sign a browser out."""
    service.end_session(principal, session_id)


@router.get("/api/account/tokens", dependencies=[OWN_ACCOUNT])
def list_tokens(service: AccountsDep, principal: PrincipalDep, part: PartDep) -> list[ApiToken]:
    """One's tokens for programs, the newest first."""
    return part.of(service.tokens(principal))


@router.post(
    "/api/account/tokens",
    status_code=status.HTTP_201_CREATED,
    responses=NOT_FOUND | CONFLICT,
    dependencies=[OWN_ACCOUNT],
)
def make_token(request: ApiTokenCreate, service: AccountsDep, principal: PrincipalDep) -> NewApiToken:
    """A new token for programs, which is shown this once."""
    return service.make_token(principal, request)


@router.delete("/api/account/tokens/{token_id}", status_code=_NO_CONTENT, responses=NOT_FOUND, dependencies=[OWN_ACCOUNT])
def revoke_token(token_id: str, service: AccountsDep, principal: PrincipalDep) -> None:
    """Let a token open nothing any more."""
    service.revoke_token(principal, token_id)


@router.get("/api/people", dependencies=[ADMINISTRATE])
def list_people(service: PeopleDep, window: WindowDep) -> Page[Person]:
    """Everybody with an account, by name."""
    return service.page(window)


@router.patch("/api/people/{user_id}", responses=NOT_FOUND | CONFLICT, dependencies=[ADMINISTRATE])
def change_person(user_id: str, patch: PersonPatch, service: PeopleDep) -> Person:
    """Let somebody administrate or not, and close or open their account."""
    return service.change(user_id, patch)


@router.post(
    "/api/people/{user_id}/password-link",
    status_code=status.HTTP_201_CREATED,
    responses=NOT_FOUND,
    dependencies=[ADMINISTRATE],
)
def make_password_link(user_id: str, service: InvitationsDep, principal: PrincipalDep) -> NewInvitation:
    """A link by which somebody sets a new password."""
    return service.reset(principal, user_id)


@router.get("/api/projects/{project_id}/members", responses=NOT_FOUND, dependencies=[manage("project_id")])
def list_members(project_id: str, service: PeopleDep, window: WindowDep) -> Page[Member]:
    """The people of a project, by name; administrators of the installation may do everything without being listed."""
    return service.members(project_id, window)


@router.put("/api/projects/{project_id}/members/{user_id}", responses=NOT_FOUND, dependencies=[manage("project_id")])
def change_member(project_id: str, user_id: str, edit: MemberEdit, service: PeopleDep) -> Member:
    """Let a member do more, or less."""
    return service.set_role(project_id, user_id, edit.role)


@router.delete(
    "/api/projects/{project_id}/members/{user_id}",
    status_code=_NO_CONTENT,
    responses=NOT_FOUND,
    dependencies=[manage("project_id")],
)
def remove_member(project_id: str, user_id: str, service: PeopleDep) -> None:
    """Take somebody out of a project."""
    service.remove(project_id, user_id)


@router.get("/api/invitations", dependencies=[INVITE])
def list_invitations(service: InvitationsDep, principal: PrincipalDep, part: PartDep) -> list[Invitation]:
    """Invitations that still hold, to the projects that one administrates."""
    return part.of(service.open(principal))


@router.post(
    "/api/invitations",
    status_code=status.HTTP_201_CREATED,
    responses=NOT_FOUND | CONFLICT,
    dependencies=[INVITE],
)
def invite(request: InvitationCreate, service: InvitationsDep, principal: PrincipalDep) -> NewInvitation:
    """A link by which somebody joins, once."""
    return service.invite(principal, request)


@router.delete("/api/invitations/{invitation_id}", status_code=_NO_CONTENT, responses=NOT_FOUND, dependencies=[INVITE])
def withdraw_invitation(invitation_id: str, service: InvitationsDep, principal: PrincipalDep) -> None:
    """Let a link open nothing any more."""
    service.withdraw(principal, invitation_id)


@router.post("/api/invitations/look", responses=NOT_FOUND, dependencies=[OPEN])
async def look_at_invitation(
    code: InvitationCode, request: Request, service: InvitationsDep, services: ServicesDep
) -> InvitationView:
    """What a link is for."""
    try:
        return await services.lanes.accounts.run(service.look, code.code)
    except NotFoundError:
        services.login_limiter.failed(request, code.code, once=True)
        raise


@router.post(
    "/api/invitations/accept",
    status_code=_NO_CONTENT,
    responses=NOT_FOUND | CONFLICT,
    dependencies=[OPEN],
)
async def accept_invitation(
    acceptance: InvitationAccept,
    request: Request,
    response: Response,
    service: InvitationsDep,
    services: ServicesDep,
    principal: PrincipalDep,
    browser: Browser = "",
) -> None:
    """Join, or set the password, and be signed in."""
    try:
        secret = await services.lanes.passwords.run(service.accept, principal, acceptance, browser)
    except NotFoundError:
        services.login_limiter.failed(request, acceptance.code, once=True)
        raise
    if secret is not None:
        set_session(response, request, services.settings, secret)


@router.get("/api/worker-tokens", dependencies=[ADMINISTRATE])
def list_worker_tokens(service: PeopleDep, part: PartDep) -> list[WorkerToken]:
    """Tokens of workers' machines, by name."""
    return part.of(service.worker_tokens())


@router.post("/api/worker-tokens", status_code=status.HTTP_201_CREATED, responses=CONFLICT, dependencies=[ADMINISTRATE])
def make_worker_token(request: WorkerTokenCreate, service: PeopleDep) -> NewWorkerToken:
    """A new token for the workers of a machine, which is shown this once."""
    return service.make_worker_token(request)


@router.delete("/api/worker-tokens/{token_id}", status_code=_NO_CONTENT, responses=NOT_FOUND, dependencies=[ADMINISTRATE])
def revoke_worker_token(token_id: str, service: PeopleDep) -> None:
    """Let a workers' token open nothing any more; links that it opened are cut."""
    service.revoke_worker_token(token_id)
