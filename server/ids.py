"""Names that the service gives to things: short, random, safe in a URL and in a file name."""

import secrets

# 60 bits: a collision among a million experiments has a chance of one in two million.
_LENGTH = 12
_ALPHABET = "0123456789abcdefghjkmnpqrstvwxyz"


def new_id() -> str:
    """Twelve characters of Crockford's base 32, lower case: no letter is taken for a digit."""
    return "".join(secrets.choice(_ALPHABET) for _ in range(_LENGTH))
