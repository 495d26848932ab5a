"""Writes the page of all settings from the code: `python -m server.written.settings_page docs/settings.md`."""

import sys
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined
from pydantic_settings import BaseSettings

from server.settings import PROJECT_ROOT, Settings
from workers.runtime.settings import WorkerSettings

_HEAD = """# All settings

Environment variables; what a command line says comes first, an empty variable counts as none. Lists and the like are
JSON. This page is written by `python -m server.written.settings_page docs/settings.md`; a test compares it with the code.
"""
_SECTIONS: tuple[tuple[str, str, type[BaseSettings]], ...] = (
    ("The server", "For `mapless up` and `mapless serve`; `mapless doctor` looks at what they lead to.", Settings),
    ("A worker", "For `mapless worker`; `mapless up` sets what its own workers need.", WorkerSettings),
)
_BOUNDS = (
    ("gt", "more than"),
    ("ge", "at least"),
    ("lt", "less than"),
    ("le", "at most"),
    ("min_length", "so many characters or more:"),
)


def page() -> str:
    """The page as it should be."""
    parts = [_HEAD]
    for title, lead, model in _SECTIONS:
        rows = [_row(name, field) for name, field in model.model_fields.items()]
        parts.append(f"## {title}\n\n{lead}\n\n| variable | default | meaning |\n|---|---|---|\n{''.join(rows)}")
    return "\n".join(parts)


def _row(name: str, field: FieldInfo) -> str:
    assert field.description is not None
    bounds = [f"{word} {_number(getattr(one, key))}" for one in field.metadata for key, word in _BOUNDS if hasattr(one, key)]
    meaning = field.description.rstrip(".") + (f"; {', '.join(bounds)}" if bounds else "")
    return f"| `MAPLESS_{name.upper()}` | {'needed' if field.is_required() else _default(field.default)} | {meaning}. |\n"


def _default(value: Any) -> str:
    if value is None or value is PydanticUndefined or value == ():
        return ""
    if isinstance(value, Path):
        return f"`{value.relative_to(PROJECT_ROOT) if value.is_relative_to(PROJECT_ROOT) else value}`"
    return _number(value) if isinstance(value, int | float) else f"`{value}`"


def _number(value: float) -> str:
    for power, unit in ((30, "GiB"), (20, "MiB"), (10, "KiB")):
        if isinstance(value, int) and value >= 2**20 and value % 2**power == 0:
            return f"{value} ({value >> power} {unit})"
    return f"{value:g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8")
