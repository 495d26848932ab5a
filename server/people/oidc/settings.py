"""What an installation is told of its provider of identities."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import cast
from urllib.parse import urlsplit

from server.database.tables import Role

ADMINISTRATOR = "administrator"
_RIGHT = re.compile(r"(viewer|editor|admin) in (\S.*)")


@dataclass(frozen=True, slots=True)
class OidcSettings:
    """The provider, and whom it brings.

    Attributes:
        issuer: its URL, as its ID tokens have it.
        client_id: what it calls this installation.
        client_secret: what it knows this installation by; None for a public client.
        scopes: asked for, separated by spaces.
        title: what the pages call it.
        name_claim: of the name that a new account gets.
        email_claim: of the e-mail address.
        groups_claim: of the groups.
        domains: of verified e-mail addresses that are let in; all where there are none.
        groups: that are let in; all where there are none.
        rights: what a group may do.
        strangers: whether who was not invited gets an account.
    """

    issuer: str
    client_id: str
    client_secret: str | None = field(repr=False)
    scopes: str
    title: str
    name_claim: str
    email_claim: str
    groups_claim: str
    domains: frozenset[str]
    groups: frozenset[str]
    rights: Mapping[str, tuple[str, ...]]
    strangers: bool

    @property
    def rules_administrators(self) -> bool:
        """Whether the provider's groups say who administrates the installation."""
        return any(ADMINISTRATOR in rights for rights in self.rights.values())


def project_right(right: str) -> tuple[Role, str] | None:
    """Role and project's name of a right such as `editor in Halls`; None where it is none."""
    match = _RIGHT.fullmatch(right)
    return (cast("Role", match[1]), match[2]) if match else None


def check_right(right: str) -> None:
    """Refuse what is no right.

    Raises:
        ValueError: it is neither `administrator` nor `ROLE in PROJECT`.
    """
    if right != ADMINISTRATOR and project_right(right) is None:
        raise ValueError(f"{right!r} is no right: say `administrator`, or `viewer in PROJECT` (or `editor`, `admin`)")


def is_safe_url(url: str) -> bool:
    """Whether secrets may be sent there: HTTPS, or this machine."""
    parts = urlsplit(url)
    return parts.scheme == "https" or (parts.scheme == "http" and parts.hostname in ("localhost", "127.0.0.1", "::1"))
