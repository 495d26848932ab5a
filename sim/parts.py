"""What is installed in parts: the simulator and the client always, the service and the trainers where they are asked for."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Literal

from sim.errors import MaplessError

Part = Literal["server", "worker"]

# What tells, by its absence alone, that a part was not installed; pyproject.toml lists all that each brings.
_MODULES: dict[str, Part] = {
    "alembic": "server",
    "authlib": "server",
    "argon2": "server",
    "celery": "server",
    "fastapi": "server",
    "fsspec": "server",
    "msgspec": "server",
    "optuna": "server",
    "orjson": "server",
    "prometheus_client": "server",
    "psycopg": "server",
    "pydantic_settings": "server",
    "safetensors": "server",
    "sqlalchemy": "server",
    "uvicorn": "server",
    "viser": "server",
    "websockets": "server",
    "zstandard": "server",
    "av": "worker",
    "mcap": "worker",
    "mcap_ros2": "worker",
    "onnx": "worker",
    "onnxruntime": "worker",
    "threadpoolctl": "worker",
    "torch": "worker",
}
_WORK: dict[Part, str] = {"server": "the service", "worker": "training, evaluating and exporting policies"}


class MissingPartError(MaplessError):
    """A part of Mapless is not installed that a command needs."""

    def __init__(self, part: Part) -> None:
        super().__init__(
            f"this needs the part for {_WORK[part]}, which is not installed here: pip install 'mapless[{part}]', "
            "or all of it with 'mapless[all]'"
        )


def require(part: Part) -> None:
    """Refuse at once what would find out later that a part is missing.

    Raises:
        MissingPartError: it is.
    """
    if any(find_spec(module) is None for module, brought_by in _MODULES.items() if brought_by == part):
        raise MissingPartError(part)


@contextmanager
def explained(part: Part) -> Iterator[None]:
    """Ends the process with one line where a command inside needs a part that is not installed.

    Args:
        part: that the command is of, where both parts bring the module that is missing.
    """
    try:
        yield
    except (MissingPartError, ModuleNotFoundError) as error:
        explain(error, part)
        raise


def explain(error: Exception, part: Part) -> None:
    """Ends the process with one line where an error says that a part is not installed; returns where it says something else.

    Args:
        error: that ended a command.
        part: that the command is of, where both parts bring the module that is missing.
    """
    if isinstance(error, MissingPartError):
        sys.exit(f"mapless: {error}")
    if isinstance(error, ModuleNotFoundError):
        brought_by = _MODULES.get((error.name or "").partition(".")[0])
        if brought_by is not None:
            sys.exit(f"mapless: {MissingPartError('worker' if 'worker' in (brought_by, part) else 'server')}")
