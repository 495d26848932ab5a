"""Faults of what everything needs: the server, its disk, the database, the broker."""

import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import psycopg

from benchmarks.backing import Backing
from benchmarks.chaos.kinds import Kind, Scene
from benchmarks.chaos.proxy import Proxy
from benchmarks.chaos.stack import Stack
from benchmarks.processes import kill, resume, suspend

_AWAY_SECONDS = 2.0
_FULL_SECONDS = 3.0
_LOCK_SECONDS = 2.0
# Longer than SQLite waits for a lock (`server.database`), so that transactions fail.
_LONG_LOCK_SECONDS = 12.0


def _kill_server(scene: Scene) -> None:
    scene.stack.kill_server()
    time.sleep(scene.dice.uniform(0.0, _AWAY_SECONDS))
    scene.stack.start_server()


def _kill_server_for_long(scene: Scene) -> None:
    scene.stack.kill_server()
    time.sleep(scene.stack.lease_seconds + 1.0)
    scene.stack.start_server()


def _restart_server(scene: Scene) -> None:
    scene.stack.stop_server()
    scene.stack.start_server()


def _stop_server(scene: Scene) -> None:
    frozen = scene.stack.server_members()
    suspend(frozen)
    time.sleep(1.5 * scene.stack.lease_seconds)
    resume(frozen)


def _fill_server_disk(scene: Scene) -> None:
    scene.stack.disk.fill()
    time.sleep(_FULL_SECONDS)
    scene.stack.disk.free()


# -- SQLite -----------------------------------------------------------------------------------------------------------------


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    with closing(sqlite3.connect(path, isolation_level=None, timeout=30.0)) as database:
        database.execute("BEGIN IMMEDIATE")
        yield
        database.execute("ROLLBACK")


def _lock_database(scene: Scene, seconds: float) -> None:
    if scene.stack.postgres is None:
        with _locked(scene.stack.data / "mapless.db"):
            time.sleep(seconds)
    else:
        with psycopg.connect(host="127.0.0.1", port=scene.stack.postgres.port, user="postgres") as database:
            database.execute("LOCK TABLE runs IN ACCESS EXCLUSIVE MODE")
            time.sleep(seconds)


def _lock_broker(scene: Scene) -> None:
    """While a run wants to be taken up anew, so that somebody needs the broker."""
    with _locked(scene.stack.broker_path):
        _need_broker(scene)
        time.sleep(_LOCK_SECONDS)


def _need_broker(scene: Scene) -> None:
    trainer = scene.node.trainer()
    if trainer is not None:
        kill([trainer])


# -- PostgreSQL and Redis ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Part:
    """The database or the broker: its process, the proxy before it, and what makes somebody need it while it is away."""

    process: Callable[[Stack], Backing | None]
    proxy: Callable[[Stack], Proxy | None]
    need: Callable[[Scene], None]

    def _process(self, scene: Scene) -> Backing:
        process = self.process(scene.stack)
        assert process is not None
        return process

    def _proxy(self, scene: Scene) -> Proxy:
        proxy = self.proxy(scene.stack)
        assert proxy is not None
        return proxy

    def kill(self, scene: Scene) -> None:
        process = self._process(scene)
        process.kill()
        self.need(scene)
        time.sleep(scene.dice.uniform(0.0, _AWAY_SECONDS))
        process.start()

    def restart(self, scene: Scene) -> None:
        process = self._process(scene)
        process.stop()
        self.need(scene)
        process.start()

    def stop(self, scene: Scene) -> None:
        frozen = self._process(scene).members()
        suspend(frozen)
        self.need(scene)
        time.sleep(_AWAY_SECONDS)
        resume(frozen)

    def cut(self, scene: Scene) -> None:
        self._proxy(scene).cut()
        self.need(scene)

    def refuse(self, scene: Scene) -> None:
        proxy = self._proxy(scene)
        proxy.refuse()
        self.need(scene)
        time.sleep(_AWAY_SECONDS)
        proxy.open()

    def silence(self, scene: Scene) -> None:
        proxy = self._proxy(scene)
        proxy.silence()
        self.need(scene)
        time.sleep(1.5 * scene.stack.lease_seconds)
        proxy.open()

    def kinds(self, name: str, *, new_attempt: bool) -> tuple[Kind, ...]:
        ways = (
            ("killed", f"SIGKILL, started again within {_AWAY_SECONDS:g} s", self.kill),
            ("restarted", "ended in order, started again", self.restart),
            ("stopped", f"SIGSTOP, SIGCONT {_AWAY_SECONDS:g} s later", self.stop),
            ("cut", "every connection to it closed", self.cut),
            ("refused", f"not reached for {_AWAY_SECONDS:g} s", self.refuse),
            ("silent", "nothing carried for one and a half leases", self.silence),
        )
        return tuple(
            Kind(f"{name} {did}", what, inject, "service", "closed", new_attempt, ("production",))
            for did, what, inject in ways
        )


def _nothing(_scene: Scene) -> None:
    """Everything needs the database anyway."""


_DATABASE = _Part(lambda stack: stack.postgres, lambda stack: stack.database_proxy, _nothing)
_BROKER = _Part(lambda stack: stack.redis, lambda stack: stack.broker_proxy, _need_broker)

SERVICE_FAULTS = (
    Kind("server killed", f"SIGKILL, started within {_AWAY_SECONDS:g} s", _kill_server, "service", "closed"),
    Kind(
        "server killed for long", "SIGKILL, started a lease and a second later", _kill_server_for_long, "service", "closed"
    ),
    Kind("server restarted", "SIGTERM, started again", _restart_server, "service", "closed"),
    Kind("server stopped", "SIGSTOP, SIGCONT one and a half leases later", _stop_server, "service", "closed"),
    Kind("server's disk full", f"no byte left for {_FULL_SECONDS:g} s", _fill_server_disk, "service", "closed"),
    Kind(
        "database locked",
        f"a write lock held for {_LOCK_SECONDS:g} s",
        partial(_lock_database, seconds=_LOCK_SECONDS),
        "service",
        "closed",
    ),
    Kind(
        "database locked for long",
        f"a write lock held for {_LONG_LOCK_SECONDS:g} s",
        partial(_lock_database, seconds=_LONG_LOCK_SECONDS),
        "service",
        "closed",
    ),
    Kind(
        "broker locked",
        f"a write lock held for {_LOCK_SECONDS:g} s, and a trainer killed",
        _lock_broker,
        "service",
        "closed",
        new_attempt=True,
        modes=("embedded",),
    ),
    *_DATABASE.kinds("database", new_attempt=False),
    *_BROKER.kinds("broker", new_attempt=True),
)
"""Every kind that hits the whole service."""
