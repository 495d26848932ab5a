"""Whom the provider says somebody is."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from server.people.oidc.settings import OidcSettings

# Of the columns that keep them; a subject has at most 255 characters (OpenID Connect Core 1.0, section 2).
_MAX_SUBJECT = 255
_MAX_EMAIL = 254
_MAX_NAME = 80
_MAX_GROUPS = 1_000


@dataclass(frozen=True, slots=True)
class Identity:
    """A person of the provider.

    Attributes:
        issuer: the provider.
        subject: its name for the person, which never changes and is given to nobody else.
        name: that the person would like to go by.
        email: None unless the provider has verified it.
        groups: that the provider counts the person among.
    """

    issuer: str
    subject: str
    name: str
    email: str | None
    groups: frozenset[str]


def identity_of(claims: Mapping[str, Any], settings: OidcSettings) -> Identity:
    """Read verified claims by the names that the settings give them.

    Raises:
        ValueError: the subject is none.
    """
    subject = claims.get("sub")
    if not isinstance(subject, str) or not 0 < len(subject) <= _MAX_SUBJECT or not subject.isprintable():
        raise ValueError("the subject is none that can be kept")
    email = claims.get(settings.email_claim)
    verified = claims.get("email_verified") is True and isinstance(email, str) and _is_email(email)
    named = claims.get(settings.name_claim)
    groups = claims.get(settings.groups_claim)
    groups = [groups] if isinstance(groups, str) else groups if isinstance(groups, list) else []
    return Identity(
        issuer=settings.issuer,
        subject=subject,
        name=_name(named if isinstance(named, str) else str(email or "")),
        email=str(email).lower() if verified else None,
        groups=frozenset(group for group in groups[:_MAX_GROUPS] if isinstance(group, str)),
    )


def _is_email(text: str) -> bool:
    return len(text) <= _MAX_EMAIL and text.isprintable() and 0 < text.find("@") < len(text) - 1


def _name(wished: str) -> str:
    """As accounts may be called: ASCII letters, digits and . _ @ + -, beginning with one of the former two."""
    kept = re.sub(r"[^A-Za-z0-9._@+-]+", "-", wished)
    return kept.lower().lstrip("._@+-").rstrip("-")[:_MAX_NAME] or "somebody"
