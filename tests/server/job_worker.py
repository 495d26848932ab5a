"""A job worker as it is, whose requests go straight into the application under test."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
from fastapi.testclient import TestClient

from server.services import Services
from tests.nursery import keeper
from tests.server.harness import WORKER_TOKEN
from workers.job_protocol import JobKind
from workers.runtime.fitness import Fitness
from workers.runtime.jobs.__main__ import Takes, places
from workers.runtime.jobs.client import JobClient
from workers.runtime.jobs.forks import Forks
from workers.runtime.jobs.place import Place
from workers.runtime.sight import ServerSight

_AS_WORKER = {"Authorization": f"Bearer {WORKER_TOKEN}"}


class _Http:
    """The tests' client with the workers' token."""

    def __init__(self, client: TestClient) -> None:
        self._client = client

    def request(self, method: str, url: str, *, headers: dict[str, str], **more: Any) -> httpx.Response:
        response: httpx.Response = self._client.request(method, url, headers={**headers, **_AS_WORKER}, **more)
        return response

    def stream(self, method: str, url: str, **more: Any) -> Any:
        return self._client.stream(method, url, headers=_AS_WORKER, **more)


class DirectClient(JobClient):
    """A worker's client without a network."""

    def __init__(self, client: TestClient) -> None:
        self._http = _Http(client)  # type: ignore[assignment]


@contextmanager
def working(client: TestClient, services: Services, work_dir: Path, kinds: tuple[JobKind, ...] = ()) -> Iterator[None]:
    """Does jobs for as long as the block lasts, of these kinds where any are given."""
    work_dir.mkdir(exist_ok=True)
    ending = threading.Event()
    forks = Forks(keeper().door)
    at_work = [
        Place(
            f"w@host/jobs{index}",
            takes.kinds,
            takes.long,
            DirectClient(client),
            work_dir,
            Fitness(work_dir, 0),
            ServerSight("the application"),
            forks,
            ending,
        )
        for index, takes in enumerate([Takes(kinds, long=True)] if kinds else places(2)[:2])
    ]
    threads = [threading.Thread(target=place.run) for place in at_work]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        ending.set()
        assert client.portal is not None
        client.portal.call(services.board.close)
        for thread in threads:
            thread.join()
        forks.close()
        services.board.closed = False
