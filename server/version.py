"""Which version is running, and from which commit."""

import subprocess
import tomllib
from functools import cache
from importlib import metadata

from server.settings import PROJECT_ROOT

# Written by the container build, where there is no git.
_COMMIT_FILE = PROJECT_ROOT / "COMMIT"


@cache
def version() -> str:
    """The version in pyproject.toml, or that of the installed distribution where the project's directory is not there."""
    project = PROJECT_ROOT / "pyproject.toml"
    if project.is_file():
        return str(tomllib.loads(project.read_text())["project"]["version"])
    return metadata.version("mapless")


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
