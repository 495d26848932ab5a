"""The parts of an installation, each looked at as it is: nothing is made, migrated or mended here."""

import os
import shutil
import ssl
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import httpx
from sqlalchemy import func, inspect, make_url, select, text
from sqlalchemy.orm import Session

from server.database import tables
from server.database.engine import Database
from server.database.migrate import head, revision
from server.doctor.findings import AilingError, Finding, look
from server.files import FileStore
from server.processes.listening import local_url
from server.settings import Settings
from server.version import commit, version
from sim.extending.discovery import installed
from workers.runtime.app import create_app

# Clocks of one lab differ by less; leases and waiting times are told by them.
_MAX_SKEW = 5.0
# What was stored lies in the past.
_MAX_FUTURE = 60.0
_PYTHON = (3, 11)
_FILE_MODE = 0o077


def examine(settings: Settings) -> list[Finding]:
    """Look at everything."""
    shown = make_url(settings.resolved_database_url).render_as_string(hide_password=True)
    broker = make_url(settings.resolved_broker_url.removeprefix("sqla+")).render_as_string(hide_password=True)
    parts: tuple[tuple[str, Callable[[], str], str], ...] = (
        ("versions", lambda: _versions(settings), "Restart the server, so that it runs what is installed here."),
        ("data", lambda: _data(settings), "Choose another place with MAPLESS_DATA_DIR, or give this user write access."),
        ("disk", lambda: _disk(settings), "Free checkpoints on the page Storage, or give the disk more space."),
        ("database", lambda: _database(settings), f"Start it, or point MAPLESS_DATABASE_URL at it; now: {shown}"),
        ("clock", lambda: _clock(settings), "Set the clocks by NTP on this machine and on the database's."),
        ("broker", lambda: _broker(settings), f"Start it, or point MAPLESS_BROKER_URL at it; now: {broker}"),
        ("store", lambda: _store(settings), "Make the place of MAPLESS_FILES_URL writable, or choose another."),
        ("extensions", _extensions, "Install it anew, or take it out of this environment and of MAPLESS_EXTENSIONS."),
        ("server", lambda: _server(settings), "The server's log says why; restart it if it stays so."),
    )
    return [look(name, check, advice) for name, check, advice in parts]


def _versions(settings: Settings) -> str:
    if sys.version_info < _PYTHON:
        raise AilingError(f"Python {sys.version.split()[0]}", "Install Python 3.11 or newer, and set the project up anew.")
    here = _named(version(), commit())
    token = _token(settings)
    answer = _ask(settings, "/api/version", token) if token else None
    if answer is not None and answer.status_code == httpx.codes.OK:
        running = answer.json()
        if (running["version"], running["commit"]) != (version(), commit()):
            there = _named(running["version"], running["commit"])
            raise AilingError(f"{here} is installed, {there} runs", "Restart the server, so that it runs what is installed.")
    return f"{here}, Python {sys.version.split()[0]}"


def _named(number: str, built_from: str | None) -> str:
    return f"{number} ({built_from})" if built_from else number


def _data(settings: Settings) -> str:
    directory = settings.data_dir
    if not directory.exists():
        _may_be_made(directory)
        return f"{directory} will be made at the first start"
    if not os.access(directory, os.W_OK | os.X_OK):
        raise PermissionError(f"No write access to {directory}")
    for name in ("token", "worker-token"):
        path = directory / name
        if path.exists() and path.stat().st_mode & _FILE_MODE:
            raise AilingError(f"Others may read {path}", f"Take it from them: chmod 600 {path}; then change the token.")
    return str(directory)


def _disk(settings: Settings) -> str:
    said, min_free = [], settings.min_free_disk_bytes
    for path in dict.fromkeys((_existing(settings.data_dir), Path(tempfile.gettempdir()))):
        free = shutil.disk_usage(path).free
        if free < min_free:
            raise OSError(f"{free / 2**30:.1f} GiB are free at {path}, {min_free / 2**30:.1f} should be")
        said.append(f"{free / 2**30:.0f} GiB free at {path}")
    return ", ".join(said)


def _database(settings: Settings) -> str:
    database = _opened(settings)
    if database is None:
        return "will be made at the first start"
    found = revision(database)
    if found is not None and found > head():
        raise AilingError(
            f"Its tables are of a newer version ({found}, this one knows {head()})",
            "Update the program, or use another database.",
        )
    # Whether it may be written to, and whether anybody holds its lock; nothing is changed.
    with database.write() as session:
        session.execute(text("SELECT 1"))
    name = database.engine.dialect.name
    if found is None:
        return f"{name}, empty: its tables will be made at the next start"
    return f"{name}, tables {found}" + ("" if found == head() else f", brought to {head()} at the next start")


def _clock(settings: Settings) -> str:
    database = _opened(settings)
    if database is None:
        return "nothing to compare with yet"
    with database.read() as session:
        if database.engine.dialect.name == "postgresql":
            began = time.time()
            skew = float(session.scalar(text("SELECT extract(epoch FROM clock_timestamp())")) or 0.0) - began
            if abs(skew) > _MAX_SKEW:
                raise OSError(f"The database's clock is {skew:+.1f} s from this one")
        newest = _newest(session)
    if newest is not None and newest > time.time() + _MAX_FUTURE:
        raise AilingError(
            f"What is stored is {newest - time.time():.0f} s from the future: this clock was set back",
            "Set the clock by NTP. Times of what was stored meanwhile stay wrong; no run is lost.",
        )
    return "agrees with the database"


def _newest(session: Session) -> float | None:
    """The newest moment in the database; None where there are no tables yet, or nothing in them."""
    there = set(inspect(session.connection()).get_table_names())
    columns = (tables.Worker.last_seen, tables.Run.created_at)
    known = [session.scalar(select(func.max(one))) for one in columns if one.class_.__tablename__ in there]
    return max((moment for moment in known if moment is not None), default=None)


def _broker(settings: Settings) -> str:
    url = settings.resolved_broker_url
    if url.startswith("sqla+sqlite"):
        path = make_url(url.removeprefix("sqla+")).database or ""
        if not Path(path).exists():
            return "embedded, will be made at the first start"
    with create_app(url).connection_for_write() as connection:
        connection.ensure_connection(max_retries=1, timeout=3.0)
        if connection.transport.driver_type == "sql":
            # It connects to anything; what it can read shows when a queue is asked for its size.
            connection.default_channel._size(f"{settings.queue_prefix}cpu")  # noqa: SLF001 (as `server.doorbell` does)
        return f"{connection.transport.driver_type} answers"


def _store(settings: Settings) -> str:
    url = settings.resolved_files_url
    local = "://" not in url
    if local and not Path(url).exists():
        _may_be_made(Path(url))
        return f"{url} will be made at the first start"
    FileStore(url, settings.max_checkpoint_bytes).probe()
    return f"{url}: written, read and removed"


def _extensions() -> str:
    found = installed()
    if found.refused:
        raise OSError("; ".join(f"{one.name} is refused: {one.reason}" for one in found.refused))
    return ", ".join(f"{one.name} {one.version}" for one in found.extensions) or "none"


def _server(settings: Settings) -> str:
    answer = _ask(settings, "/readyz", None)
    if answer is None:
        return f"not running at {local_url(settings)}"
    if answer.status_code != httpx.codes.OK:
        wrong = [f"{name}: {found}" for name, found in answer.json()["checks"].items() if found != "ok"]
        raise OSError(f"{local_url(settings)} is not ready ({', '.join(wrong)})")
    return f"{local_url(settings)} is ready{_public(settings)}"


def _public(settings: Settings) -> str:
    """Whether the address that people use leads to this server; a machine may be unable to look at itself from outside."""
    if settings.public_url is None:
        return ""
    url = settings.resolved_public_url
    try:
        # As a worker would: a lab may have a certificate authority of its own.
        answer = httpx.get(f"{url}/healthz", timeout=5.0, trust_env=False, verify=ssl.create_default_context())
    except httpx.TransportError as error:
        return f"; whether {url} leads to it can't be seen from here ({error})"
    own = _ask(settings, "/healthz", None)
    if own is None or (answer.status_code, answer.text) != (own.status_code, own.text):
        raise AilingError(
            f"{local_url(settings)} is ready, but at {url} something else answers (status {answer.status_code})",
            f"Have the proxy pass on what comes to {url}/ to {local_url(settings)}, as docs/security.md shows.",
        )
    return f", {url} leads to it"


def _opened(settings: Settings) -> Database | None:
    """The database; None where it is a file that is not there yet, which opening would make."""
    url = make_url(settings.resolved_database_url)
    if url.get_backend_name() == "sqlite" and url.database and not Path(url.database).exists():
        return None
    return Database(settings.resolved_database_url)


def _ask(settings: Settings, path: str, token: str | None) -> httpx.Response | None:
    """What the server answers; None where there is none."""
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    try:
        return httpx.get(local_url(settings) + path, headers=headers, timeout=5.0, trust_env=False)
    except httpx.TransportError:
        return None


def _token(settings: Settings) -> str | None:
    """The login token, where there is one; none is made here."""
    if settings.token is not None:
        return settings.token.get_secret_value()
    try:
        return (settings.data_dir / "token").read_text().strip()
    except OSError:
        return None


def _may_be_made(path: Path) -> None:
    """Raise where a folder at this path can't be made."""
    parent = _existing(path)
    if not parent.is_dir() or not os.access(parent, os.W_OK):
        raise PermissionError(f"{path} can't be made: {parent} is no folder that this user may write to")


def _existing(path: Path) -> Path:
    """The path itself, or the nearest folder above it that is there."""
    return next(one for one in (path, *path.parents) if one.exists())
