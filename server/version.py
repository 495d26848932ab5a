"""Which version is running, and from which commit."""

import subprocess
from functools import cache
from importlib import metadata

from server.settings import PROJECT_ROOT

# Written by the container build, where there is no git.
_COMMIT_FILE = PROJECT_ROOT / "COMMIT"


@cache
def version() -> str:
    """The version of the installed distribution."""
    try:
        return metadata.version("mapless")
    except metadata.PackageNotFoundError:
        return "0+unknown"


@cache
def commit() -> str | None:
    """The short hash of the commit, with `-dirty` where files were changed since; None where it can't be told."""
    if _COMMIT_FILE.is_file():
        return _COMMIT_FILE.read_text().strip() or None
    if not (PROJECT_ROOT / ".git").exists():
        return None
    try:
        described = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--exclude", "*"],
            cwd=PROJECT_ROOT,
            capture_output=True,
            text=True,
            timeout=5,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return described.stdout.strip() or None
