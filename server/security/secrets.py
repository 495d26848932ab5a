"""The two tokens of an installation: from the settings, or generated once and kept in the data directory."""

import hashlib
import hmac
import os
import secrets
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import SecretStr

from server.settings import Settings

_TOKEN_BYTES = 24


@dataclass(frozen=True)
class Secrets:
    """The login token (people) and the worker token (workers); neither has the other's rights."""

    token: str = field(repr=False)
    worker_token: str = field(repr=False)

    @property
    def cookie(self) -> str:
        """What a browser keeps after login: derived from the token, which can't be had back from it."""
        return hmac.new(self.token.encode(), b"mapless login cookie", hashlib.sha256).hexdigest()


def load_secrets(settings: Settings) -> Secrets:
    """The tokens of the settings; one that is not set is read from the data directory, or made there at the first start.

    Raises:
        OSError: the data directory can't be written.
    """
    return Secrets(
        token=_given_or_kept(settings.token, settings.data_dir / "token"),
        worker_token=_given_or_kept(settings.worker_token, settings.data_dir / "worker-token"),
    )


def _given_or_kept(given: SecretStr | None, path: Path) -> str:
    if given is not None and given.get_secret_value():
        return given.get_secret_value()
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        # O_EXCL: of two processes that start at once, one makes the token and both use it.
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        return path.read_text().strip()
    with os.fdopen(descriptor, "w") as file:
        token = secrets.token_hex(_TOKEN_BYTES)
        file.write(token)
    return token
