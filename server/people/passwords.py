"""Passwords, kept as argon2id hashes (RFC 9106)."""

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

_hasher = PasswordHasher()
# Of no password that anybody has: who does not exist takes as long to refuse as who does.
_NOBODY = _hasher.hash("nobody's password")


def hash_password(password: str) -> str:
    """The password's hash, with its parameters and a salt of its own; takes some 50 ms and 64 MiB."""
    return _hasher.hash(password)


def is_password(password: str, kept: str | None) -> bool:
    """Whether it is the one; in a time that does not tell whether there is one at all."""
    try:
        right = _hasher.verify(kept or _NOBODY, password)
    except (VerificationError, InvalidHashError):
        return False
    return right and kept is not None
