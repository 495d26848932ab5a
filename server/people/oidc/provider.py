"""The provider as the server sees it: its description and keys, and a code exchanged for who somebody is."""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Mapping
from typing import Any
from urllib.parse import quote_plus

import httpx
from authlib.common.errors import AuthlibBaseError
from authlib.common.urls import add_params_to_uri
from authlib.oauth2.rfc6749.parameters import prepare_grant_uri
from authlib.oauth2.rfc7636 import create_s256_code_challenge
from authlib.oidc.core import CodeIDToken
from joserfc import jwt
from joserfc.errors import InvalidKeyIdError, JoseError
from joserfc.jwk import KeySet
from joserfc.jws import JWSRegistry

from server.people.oidc.identity import Identity, identity_of
from server.people.oidc.journey import Journey
from server.people.oidc.refusals import SignInRefusedError
from server.people.oidc.settings import OidcSettings, is_safe_url

logger = logging.getLogger(__name__)

# A person waits meanwhile.
_TIMEOUT = httpx.Timeout(10.0)
# Descriptions and keys change seldom; a key that is not known is asked for at once.
_KEPT_SECONDS = 3_600.0
# Who asks again and again does not make the server ask the provider as often.
_AGAIN_SECONDS = 5.0
# Clocks of two machines.
_LEEWAY_SECONDS = 60
# With a secret that both sides know, whoever has it could sign for anybody.
_ALGORITHMS = frozenset(
    {"RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512", "EdDSA", "Ed25519"}
)
_ENDPOINTS = ("authorization_endpoint", "token_endpoint", "jwks_uri")


class Provider:
    """Asks the provider of the settings. Used on the event loop only; nobody waits for it on a thread.

    Args:
        settings: which provider, and what it calls us.
    """

    def __init__(self, settings: OidcSettings) -> None:
        self.settings = settings
        self._description = _Kept(self._describe)
        self._keys = _Kept(self._fetch_keys)

    async def address(self, journey: Journey, callback: str) -> str:
        """Where the browser goes to sign in.

        Raises:
            SignInRefusedError: the provider can't be reached, or describes itself wrongly.
        """
        description = await self._asked(self._description.get())
        url: str = prepare_grant_uri(
            description["authorization_endpoint"],
            client_id=self.settings.client_id,
            response_type="code",
            redirect_uri=callback,
            scope=self.settings.scopes,
            state=journey.state,
            nonce=journey.nonce,
            code_challenge=create_s256_code_challenge(journey.verifier),
            code_challenge_method="S256",
        )
        return url

    async def farewell(self, back: str) -> str | None:
        """Where the browser ends its session with the provider, which then leads `back`; None where it has no such page.

        By OpenID Connect RP-Initiated Logout 1.0, section 2. No ID token is kept here that could go along as a hint: the
        provider asks its visitor instead.

        Raises:
            SignInRefusedError: the provider can't be reached, or describes itself wrongly.
        """
        description = await self._asked(self._description.get())
        page = description.get("end_session_endpoint")
        if not isinstance(page, str) or not is_safe_url(page):
            return None
        url: str = add_params_to_uri(page, [("client_id", self.settings.client_id), ("post_logout_redirect_uri", back)])
        return url

    async def identify(self, journey: Journey, code: str, callback: str) -> Identity:
        """Whom a code stands for.

        Raises:
            SignInRefusedError: the provider can't be reached, refuses the code, or its answer does not hold.
        """
        identity: Identity = await self._asked(self._exchange(journey, code, callback))
        return identity

    async def _exchange(self, journey: Journey, code: str, callback: str) -> Identity:
        description = await self._description.get()
        token = await self._redeem(description, journey, code, callback)
        claims = await self._verified(token, description, journey)
        userinfo = description.get("userinfo_endpoint")
        if isinstance(userinfo, str) and is_safe_url(userinfo):
            async with httpx.AsyncClient(timeout=_TIMEOUT) as client:
                answer = await client.get(userinfo, headers={"Authorization": f"Bearer {token['access_token']}"})
            answer.raise_for_status()
            more: dict[str, Any] = answer.json()
            # Else the access token may be somebody else's (OpenID Connect Core 1.0, section 5.3.2).
            if more.get("sub") != claims["sub"]:
                raise ValueError("the user info is somebody else's")
            claims = {**more, **claims}
        return identity_of(claims, self.settings)

    async def _redeem(self, description: Mapping[str, Any], journey: Journey, code: str, callback: str) -> dict[str, Any]:
        """The tokens for a code (RFC 6749, sections 4.1.3 and 2.3.1)."""
        form = {
            "grant_type": "authorization_code",
            "code": code,
            "redirect_uri": callback,
            "code_verifier": journey.verifier,
        }
        client_id, secret = self.settings.client_id, self.settings.client_secret
        # What a provider takes that says nothing (OpenID Connect Discovery 1.0, section 3).
        ways = description.get("token_endpoint_auth_methods_supported", ["client_secret_basic"])
        auth = None
        if secret is not None and "client_secret_basic" in ways:
            auth = httpx.BasicAuth(quote_plus(client_id), quote_plus(secret))
        else:
            form |= {"client_id": client_id} if secret is None else {"client_id": client_id, "client_secret": secret}
        async with httpx.AsyncClient(timeout=_TIMEOUT, auth=auth) as client:
            answer = await client.post(description["token_endpoint"], data=form)
        if answer.status_code >= 500:
            answer.raise_for_status()
        tokens: dict[str, Any] = answer.json()
        if answer.is_error:
            raise ValueError(f"{tokens.get('error')}: {tokens.get('error_description')}")
        return tokens

    async def _verified(self, token: Mapping[str, Any], description: Mapping[str, Any], journey: Journey) -> dict[str, Any]:
        """The ID token's claims, by OpenID Connect Core 1.0, section 3.1.3.7."""
        algorithms = sorted(_ALGORITHMS.intersection(description.get("id_token_signing_alg_values_supported", ["RS256"])))
        registry = JWSRegistry(algorithms=algorithms, strict_check_header=False)
        try:
            decoded = jwt.decode(token["id_token"], await self._keys.get(), registry=registry)
        except InvalidKeyIdError:
            decoded = jwt.decode(token["id_token"], await self._keys.get(anew=True), registry=registry)
        claims = CodeIDToken(
            decoded.claims,
            decoded.header,
            {
                "iss": {"essential": True, "value": self.settings.issuer},
                "aud": {"essential": True, "value": self.settings.client_id},
            },
            {
                "nonce": journey.nonce,
                "client_id": self.settings.client_id,
                "access_token": token.get("access_token"),
            },
        )
        claims.validate(leeway=_LEEWAY_SECONDS)
        return dict(claims)

    async def _describe(self) -> dict[str, Any]:
        """OpenID Connect Discovery 1.0: what the provider says about itself."""
        url = self.settings.issuer.rstrip("/") + "/.well-known/openid-configuration"
        async with httpx.AsyncClient(timeout=_TIMEOUT) as client:
            answer = await client.get(url)
        answer.raise_for_status()
        description: dict[str, Any] = answer.json()
        if description.get("issuer") != self.settings.issuer:
            raise ValueError(f"{url} describes {description.get('issuer')!r}: MAPLESS_OIDC_ISSUER must be the same")
        for name in _ENDPOINTS:
            if not is_safe_url(str(description.get(name))):
                raise ValueError(f"{url} names no {name} with HTTPS")
        return description

    async def _fetch_keys(self) -> KeySet:
        description = await self._description.get()
        async with httpx.AsyncClient(timeout=_TIMEOUT) as client:
            answer = await client.get(description["jwks_uri"])
        answer.raise_for_status()
        return KeySet.import_key_set(answer.json())

    async def _asked(self, answer: Awaitable[Any]) -> Any:
        """The answer; every way in which it may be none becomes a refusal, with its reason in the log."""
        try:
            return await answer
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            logger.warning("%s does not answer: %s: %s", self.settings.issuer, type(error).__name__, error)
            raise SignInRefusedError("unreachable") from error
        except (AuthlibBaseError, JoseError, ValueError, KeyError, TypeError, AttributeError) as error:
            logger.warning("the answer of %s can't be used: %s: %s", self.settings.issuer, type(error).__name__, error)
            raise SignInRefusedError("unusable") from error


class _Kept:
    """Something that is fetched by whoever needs it first, for all who ask meanwhile, and kept for a while."""

    def __init__(self, fetch: Callable[[], Awaitable[Any]]) -> None:
        self._fetch = fetch
        self._task: asyncio.Task[Any] | None = None
        self._since = 0.0

    async def get(self, *, anew: bool = False) -> Any:
        """The thing, or what went wrong lately; `anew` for who has seen that it is out of date."""
        now = time.monotonic()
        task = self._task
        if task is not None and task.done():
            failed = task.cancelled() or task.exception() is not None
            if now - self._since > (_AGAIN_SECONDS if failed or anew else _KEPT_SECONDS):
                task = None
        if task is None:
            self._since = now
            task = self._task = asyncio.create_task(self._run())
        return await asyncio.shield(task)

    async def _run(self) -> Any:
        return await self._fetch()
