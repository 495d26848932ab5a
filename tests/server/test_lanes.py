"""Work by kind: a short queue before what is slow, a refusal behind it, and nothing done for who has left."""

import asyncio
import inspect
import threading
from pathlib import Path

import httpx
import pytest

from server.app import ROUTERS
from server.errors import BusyError
from server.lanes import Lane
from server.security.declared import declared
from tests.server.test_serving import serving


def test_what_finds_the_queue_full_is_told_when_to_come_again() -> None:
    async def scenario() -> None:
        lane = Lane("exports", threads=2, queue=3)
        done = threading.Event()
        at_work = [asyncio.create_task(lane.run(done.wait)) for _ in range(5)]
        await asyncio.sleep(0.05)
        assert (lane.busy, lane.waiting) == (2, 3)
        with pytest.raises(BusyError, match="busy with other exports") as refused:
            await lane.run(done.wait)
        assert refused.value.retry_after == 10.0
        assert lane.refused == 1
        done.set()
        assert await asyncio.gather(*at_work) == [True] * 5
        assert (lane.busy, lane.waiting) == (0, 0)

    asyncio.run(scenario())


def test_who_leaves_the_queue_is_not_worked_for() -> None:
    async def scenario() -> None:
        lane = Lane("exports", threads=1, queue=3)
        done = threading.Event()
        begun: list[str] = []
        working = asyncio.create_task(lane.run(done.wait))
        await asyncio.sleep(0.05)
        left = asyncio.create_task(lane.run(begun.append, "left"))
        stayed = asyncio.create_task(lane.run(begun.append, "stayed"))
        await asyncio.sleep(0.05)
        left.cancel()
        done.set()
        await asyncio.gather(working, left, stayed, return_exceptions=True)
        assert begun == ["stayed"]

    asyncio.run(scenario())


def test_a_request_takes_no_thread_before_its_work() -> None:
    """FastAPI takes one for each dependency that is no coroutine, and none of ours waits for anything."""
    waiting = [route.dependant for router in ROUTERS for route, _ in declared(router)]
    seen, taking = 0, set()
    while waiting:
        for part in waiting.pop().dependencies:
            seen += 1
            if not (inspect.iscoroutinefunction(part.call) or inspect.iscoroutinefunction(type(part.call).__call__)):
                taking.add(repr(part.call))
            waiting.append(part)
    assert seen > 300
    assert taking == set()


def test_an_iterator_is_read_to_its_end() -> None:
    async def scenario() -> list[bytes]:
        return [block async for block in Lane("downloads", threads=1).each(iter([b"a", b"b", b"c"]))]

    assert asyncio.run(scenario()) == [b"a", b"b", b"c"]


def test_45_bundles_at_once_are_one_job_that_silences_nobody_and_is_dropped_when_all_have_left(tmp_path: Path) -> None:
    async def scenario(url: str) -> None:
        base, _, token = url.partition("/?token=")
        headers = {"Authorization": f"Bearer {token}"}
        limits = httpx.Limits(max_connections=100)
        async with httpx.AsyncClient(base_url=base, headers=headers, timeout=60, limits=limits) as browser:
            downloads = [asyncio.create_task(browser.get("/api/policies/simple/bundle")) for _ in range(45)]

            async def jobs() -> list[str]:
                return [job["state"] for job in (await browser.get("/api/jobs")).json()["items"]]

            states: list[str] = []
            while states != ["queued"]:
                states = await jobs()
            for _ in range(5):
                assert (await browser.get("/api/status", timeout=20)).status_code == 200
            assert await jobs() == ["queued"]
            for task in downloads:
                task.cancel()
            await asyncio.gather(*downloads, return_exceptions=True)
            while states != ["cancelled"]:
                states = await jobs()
                await asyncio.sleep(0.1)

    with serving(tmp_path) as (_, url):
        asyncio.run(asyncio.wait_for(scenario(url), 60.0))
