"""Faults of what everything needs: the server, its disk, the database, the broker."""

import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path

import psycopg

from benchmarks.backing import Backing
from benchmarks.chaos.kinds import Kind, Scene
from benchmarks.chaos.proxy import Proxy
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


def _database(scene: Scene) -> Backing:
    assert scene.stack.postgres is not None
    return scene.stack.postgres


def _broker(scene: Scene) -> Backing:
    assert scene.stack.redis is not None
    _need_broker(scene)
    return scene.stack.redis


def _database_proxy(scene: Scene) -> Proxy:
    assert scene.stack.database_proxy is not None
    return scene.stack.database_proxy


def _broker_proxy(scene: Scene) -> Proxy:
    assert scene.stack.broker_proxy is not None
    _need_broker(scene)
    return scene.stack.broker_proxy


def _kill_backing(of: Callable[[Scene], Backing], scene: Scene) -> None:
    backing = of(scene)
    backing.kill()
    time.sleep(scene.dice.uniform(0.0, _AWAY_SECONDS))
    backing.start()


def _restart_backing(of: Callable[[Scene], Backing], scene: Scene) -> None:
    backing = of(scene)
    backing.stop()
    backing.start()


def _stop_backing(of: Callable[[Scene], Backing], scene: Scene) -> None:
    frozen = of(scene).members()
    suspend(frozen)
    time.sleep(_AWAY_SECONDS)
    resume(frozen)


def _cut_proxy(of: Callable[[Scene], Proxy], scene: Scene) -> None:
    of(scene).cut()


def _refuse_proxy(of: Callable[[Scene], Proxy], scene: Scene) -> None:
    proxy = of(scene)
    proxy.refuse()
    time.sleep(_AWAY_SECONDS)
    proxy.open()


def _silence_proxy(of: Callable[[Scene], Proxy], scene: Scene) -> None:
    proxy = of(scene)
    proxy.silence()
    time.sleep(1.5 * scene.stack.lease_seconds)
    proxy.open()


def _backing_kinds(name: str, process: Callable[[Scene], Backing], proxy: Callable[[Scene], Proxy]) -> tuple[Kind, ...]:
    kinds = (
        ("killed", f"SIGKILL, started again within {_AWAY_SECONDS:g} s", partial(_kill_backing, process)),
        ("restarted", "ended in order, started again", partial(_restart_backing, process)),
        ("stopped", f"SIGSTOP, SIGCONT {_AWAY_SECONDS:g} s later", partial(_stop_backing, process)),
        ("cut", "every connection to it closed", partial(_cut_proxy, proxy)),
        ("refused", f"not reached for {_AWAY_SECONDS:g} s", partial(_refuse_proxy, proxy)),
        ("silent", "nothing carried for one and a half leases", partial(_silence_proxy, proxy)),
    )
    return tuple(
        Kind(f"{name} {did}", what, inject, "service", "closed", modes=("production",)) for did, what, inject in kinds
    )


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
        modes=("embedded",),
    ),
    *_backing_kinds("database", _database, _database_proxy),
    *_backing_kinds("broker", _broker, _broker_proxy),
)
"""Every kind that hits the whole service."""
