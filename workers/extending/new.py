"""Writes a new extension: a copy of the package in `template`, under its own name."""

import re
from pathlib import Path

_TEMPLATE = Path(__file__).parent / "template"
_TEMPLATE_NAME = "my_lab"
_NAME = re.compile(r"^[a-z][a-z0-9_]{0,29}$")


def write_package(name: str, directory: Path) -> Path:
    """Write it into a folder of its name.

    Raises:
        ValueError: the name can't be an extension's, or the folder is there already.
        OSError: the folder can't be made.
    """
    if not _NAME.match(name):
        raise ValueError(f"{name!r} can't be a name: take small letters, digits and _, a letter first, at most 30")
    folder = directory / name
    if folder.exists():
        raise ValueError(f"{folder} is there already: choose another name, or another place with --in")
    for source in sorted(path for path in _TEMPLATE.rglob("*") if path.is_file() and "__pycache__" not in path.parts):
        target = folder / str(source.relative_to(_TEMPLATE)).replace(_TEMPLATE_NAME, name)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(source.read_text(encoding="utf-8").replace(_TEMPLATE_NAME, name), encoding="utf-8")
    return folder
