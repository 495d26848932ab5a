"""Installations with something of everything in them, in a directory or another store, and what is in them."""

import asyncio
import threading
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

from sqlalchemy import text

from server.app import create_services
from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.database.engine import Database
from server.experiments.service import ExperimentService
from server.files import FileStore
from server.settings import Settings
from sim.config import ArenaFile
from tests.server.filling import fill, rows
from workers.config import TrainingConfig


def quiet(_said: str) -> None:
    return


async def blocks(name: str) -> AsyncIterator[bytes]:
    yield f"the archive {name} ".encode() * 5_000


def store(settings: Settings) -> FileStore:
    return FileStore(settings.resolved_files_url, 10**9)


def keep(settings: Settings, *names: str) -> None:
    """Archives in the store, as the rows of checkpoints of these names say."""
    database = Database(settings.resolved_database_url)
    for name in names:
        file = asyncio.run(store(settings).write(name, blocks(name)))
        with database.write() as session:
            values = {"id": name, "size": file.size, "sha256": file.sha256}
            session.execute(text("UPDATE checkpoints SET size = :size, sha256 = :sha256 WHERE id = :id"), values)
    database.dispose()


def everything(settings: Settings) -> dict[str, Any]:
    """All rows and all files of an installation."""
    database = Database(settings.resolved_database_url)
    found = rows(database)
    database.dispose()
    kept = {path.name: path.read_bytes() for path in (*settings.arenas_dir.glob("*"), *settings.data_dir.glob("*token"))}
    files = store(settings)
    return {"rows": found, "files": kept | {name: b"".join(files.read(name)) for name in files.ids()}}


def installation(place: Path, database_url: str | None = None, files_url: str | None = None) -> Settings:
    """Two rows in every table, two checkpoints and an arena."""
    settings = Settings.model_validate({"data_dir": place, "database_url": database_url, "files_url": files_url})
    services = create_services(settings)
    fill(services.database)
    services.arenas.add(ArenaFile(name="room", width=6.0, height=6.0))
    services.database.dispose()
    keep(settings, "1checkpoints", "2checkpoints")
    return settings


class Writer:
    """Reports to an installation as its server would, all the time: numbers, and checkpoints that come and go.

    A run's row says how many numbers there are; both are written in one transaction.
    """

    def __init__(self, settings: Settings) -> None:
        self.services = create_services(settings)
        with self.services.database.write() as session:
            training = TrainingConfig().model_dump(mode="json")
            session.add(tables.Experiment(id="kept", name="kept", training=training))
            session.flush()
            session.add(tables.Run(id="kept", experiment_id="kept", seed=0, state="completed"))
        self.checkpoint("kept", "kept0")
        self._end = threading.Event()
        self.written = 0
        self._thread = threading.Thread(target=self._write)

    def checkpoint(self, run_id: str, name: str) -> None:
        file = asyncio.run(self.services.files.write(name, blocks(name)))
        with self.services.database.write() as session:
            CheckpointRepository(session).add(run_id, 1, file, None)

    def _write(self) -> None:
        training = TrainingConfig().model_dump(mode="json")
        experiments = ExperimentService(self.services)
        while not self._end.is_set():
            self.written += 1
            number = self.written
            with self.services.database.write() as session:
                session.add(tables.MetricRow(run_id="kept", seq=number, step=number, wall_time=0.5, values={"a": 0.1}))
                session.get_one(tables.Run, "kept").last_seq = number
                session.add(tables.Experiment(id=f"e{number}", name="goes", training=training))
                session.flush()
                session.add(tables.Run(id=f"r{number}", experiment_id=f"e{number}", seed=0, state="completed"))
            self.checkpoint(f"r{number}", f"c{number}")
            if number > 3:
                experiments.delete(f"e{number - 3}")
                experiments.remove(f"e{number - 3}")

    def __enter__(self) -> "Writer":
        self._thread.start()
        return self

    def wait_for(self, number: int) -> None:
        deadline = time.monotonic() + 60
        while self.written < number:
            assert self._thread.is_alive()
            assert time.monotonic() < deadline
            time.sleep(0.01)

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()
        self.services.database.dispose()
