"""Names of files that people download."""

import re
import unicodedata

_LENGTH = 60


def slug(name: str) -> str:
    """An experiment's name in characters that every file system takes."""
    ascii_name = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^a-z0-9]+", "-", ascii_name.lower()).strip("-")[:_LENGTH] or "experiment"
