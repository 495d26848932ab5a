"""Routes of signing in with the provider: to it, and back from it."""

import logging
from typing import Annotated

from fastapi import APIRouter, Header, Query, Request, Response, status
from fastapi.responses import RedirectResponse
from pydantic import StringConstraints

from server.errors import NotFoundError, TooManyAttemptsError, UnauthorizedError
from server.http.problems import NOT_FOUND
from server.people.oidc.admission import AdmissionService
from server.people.oidc.journey import MAX_SECONDS, begin, seal, unseal
from server.people.oidc.provider import Provider
from server.people.oidc.refusals import ProviderUnusableError, Refusal, SignInRefusedError, in_words
from server.people.oidc.schemas import ProviderAddress, ProviderSignIn
from server.security.cookies import clear_journey, journey_cookie_name, set_journey, set_session
from server.security.permissions import OPEN, SIGNED_IN
from server.security.principal import PrincipalDep
from server.services import Services, ServicesDep

logger = logging.getLogger(__name__)
router = APIRouter(tags=["people"])

CALLBACK = "/api/sign-in/provider/callback"
"""What the provider has to know as this installation's redirect URI, below the address that browsers use."""
Told = Annotated[str, Query(), StringConstraints(max_length=4_000)]


@router.post("/api/sign-in/provider", responses=NOT_FOUND, dependencies=[OPEN])
async def go_to_provider(
    wanted: ProviderSignIn, request: Request, response: Response, services: ServicesDep, principal: PrincipalDep
) -> ProviderAddress:
    """Where to send the browser, which is given a cookie to come back with."""
    provider = _provider(services)
    if wanted.connect and principal.user_id is None:
        raise UnauthorizedError("Sign in first: the identity is connected with your account.")
    journey = begin(wanted.back, wanted.invitation, principal.user_id if wanted.connect else None)
    try:
        url = await provider.address(journey, _callback(request))
    except SignInRefusedError as error:
        raise ProviderUnusableError(in_words(error.reason, provider.settings.title)) from error
    set_journey(response, request, services.settings, seal(journey, services.secrets), MAX_SECONDS)
    return ProviderAddress(url=url)


@router.get(
    CALLBACK,
    status_code=status.HTTP_303_SEE_OTHER,
    response_class=RedirectResponse,
    responses=NOT_FOUND,
    dependencies=[OPEN],
)
async def come_from_provider(
    request: Request,
    services: ServicesDep,
    code: Told = "",
    state: Told = "",
    error: Told = "",
    iss: Told = "",
    browser: Annotated[str, Header(alias="User-Agent", include_in_schema=False)] = "",
) -> Response:
    """Signs in whom the provider sends back, and leads to the page that they came from; refusals lead to it too."""
    provider = _provider(services)
    journey = unseal(request.cookies.get(journey_cookie_name(services.settings), ""), services.secrets)
    try:
        if journey is None or journey.state != state or (iss and iss != provider.settings.issuer):
            raise SignInRefusedError("stale")
        if error or not code:
            logger.info("%s sends somebody back: %s", provider.settings.issuer, ascii(error)[:200])
            raise SignInRefusedError("stopped")
        await services.login_limiter.turn(request)
        identity = await provider.identify(journey, code, _callback(request))
        admission = AdmissionService(services, provider.settings)
        secret = await services.lanes.accounts.run(admission.admit, identity, journey, browser)
    except SignInRefusedError as refused:
        reason: Refusal = refused.reason
        if reason == "unusable":
            try:
                services.login_limiter.failed(request, code)
            except TooManyAttemptsError:
                reason = "busy"
        connects = journey is not None and journey.connects is not None
        response = _redirect(f"{'/account' if connects else '/'}?refused={reason}")
    except TooManyAttemptsError:
        response = _redirect("/?refused=busy")
    else:
        assert journey is not None
        response = _redirect(journey.back)
        set_session(response, request, services.settings, secret)
    clear_journey(response, services.settings)
    return response


@router.get("/api/sign-in/provider/end", responses=NOT_FOUND, dependencies=[SIGNED_IN])
async def leave_provider(request: Request, services: ServicesDep) -> ProviderAddress:
    """Where the browser ends its session with the provider, for who signs out here; its page asks, and leads back."""
    provider = _provider(services)
    try:
        url = await provider.farewell(str(request.base_url))
    except SignInRefusedError as error:
        raise ProviderUnusableError(in_words(error.reason, provider.settings.title)) from error
    if url is None:
        raise NotFoundError(f"{provider.settings.title} has no page that ends a session: close the browser.")
    return ProviderAddress(url=url)


def _redirect(path: str) -> Response:
    return RedirectResponse(path, status_code=status.HTTP_303_SEE_OTHER)


def _provider(services: Services) -> Provider:
    if services.provider is None:
        raise NotFoundError("No provider of identities is set up here: MAPLESS_OIDC_ISSUER names one.")
    return services.provider


def _callback(request: Request) -> str:
    """By the name under which the browser reaches this server, also behind a trusted proxy."""
    return str(request.base_url).rstrip("/") + CALLBACK
