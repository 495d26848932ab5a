"""What a browser carries while its person is at the provider: sealed, for ten minutes, and nothing is kept here.

The cookie holds a secret from which *state*, *nonce* and PKCE's verifier are derived; it has to come along with the
provider's answer, which is how an answer that somebody else obtained is known (RFC 6749, section 10.12).
"""

import base64
import hashlib
import hmac
import time
from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from server.people.secret import new_secret
from server.security.secrets import Secrets

MAX_SECONDS = 600


class Journey(BaseModel):
    """One sign-in on its way.

    Attributes:
        secret: random, known to this browser and nobody else.
        ends: seconds since the epoch.
        back: path of the page that it leads to.
        invitation: code of a link that is accepted with it.
        connects: id of the account that the identity will belong to; of who is signed in.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    secret: str
    ends: float
    back: str
    invitation: str | None = None
    connects: str | None = None

    @property
    def state(self) -> str:
        """Ties the provider's answer to this browser."""
        return self._derived("state")

    @property
    def nonce(self) -> str:
        """Ties the ID token to this sign-in."""
        return self._derived("nonce")

    @property
    def verifier(self) -> str:
        """Ties the code to this sign-in: 64 characters of those that RFC 7636 allows."""
        return self._derived("verifier")

    def _derived(self, purpose: Literal["state", "nonce", "verifier"]) -> str:
        return hmac.new(self.secret.encode(), purpose.encode(), hashlib.sha256).hexdigest()


def begin(back: str, invitation: str | None, connects: str | None) -> Journey:
    """A new one; `back` is kept to a path of this server, whatever was sent."""
    path = "/" + back.replace("\\", "/").lstrip("/")
    return Journey(secret=new_secret(), ends=time.time() + MAX_SECONDS, back=path, invitation=invitation, connects=connects)


def seal(journey: Journey, secrets: Secrets) -> str:
    """The journey as a cookie that nobody else can make."""
    body = base64.urlsafe_b64encode(journey.model_dump_json().encode()).decode().rstrip("=")
    return f"{body}.{_signature(body, secrets)}"


def unseal(cookie: str, secrets: Secrets) -> Journey | None:
    """The journey of a cookie; None where it was not made here, or has ended."""
    body, _, signature = cookie.partition(".")
    if not hmac.compare_digest(signature.encode(errors="replace"), _signature(body, secrets).encode()):
        return None
    try:
        journey = Journey.model_validate_json(base64.urlsafe_b64decode(body + "=" * (-len(body) % 4)))
    except (ValueError, ValidationError):
        return None
    return journey if time.time() < journey.ends else None


def _signature(body: str, secrets: Secrets) -> str:
    key = hmac.new(secrets.token.encode(), b"mapless sign-in with a provider", hashlib.sha256).digest()
    return hmac.new(key, body.encode(errors="replace"), hashlib.sha256).hexdigest()
