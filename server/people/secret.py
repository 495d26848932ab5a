"""Secrets that the service makes: too long to be guessed, so that a plain hash keeps them."""

import hashlib
import secrets

API_PREFIX = "mpl_"
WORKER_PREFIX = "mplw_"
_BYTES = 24


def new_secret(prefix: str = "") -> str:
    """192 random bits, safe in a URL; the prefix tells people, and programs that look for leaked ones, what it is."""
    return prefix + secrets.token_hex(_BYTES)


def hash_of(secret: str) -> str:
    """SHA-256, in hexadecimal digits."""
    return hashlib.sha256(secret.encode(errors="surrogateescape")).hexdigest()
