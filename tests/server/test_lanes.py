"""Work by kind: a short queue before what is slow, a refusal behind it, and nothing done for who has left."""

import asyncio
import contextlib
import threading
import time
from collections.abc import Callable
from pathlib import Path

import anyio
import httpx
import psutil
import pytest

from server.errors import BusyError
from server.lanes import Lane
from server.processes import run_module
from tests.server.test_serving import serving

EXPORTS, QUEUE = 2, 8


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


def test_an_iterator_is_read_to_its_end() -> None:
    async def scenario() -> list[bytes]:
        return [block async for block in Lane("downloads", threads=1).each(iter([b"a", b"b", b"c"]))]

    assert asyncio.run(scenario()) == [b"a", b"b", b"c"]


def test_a_process_ends_with_the_request_that_it_works_for(tmp_path: Path) -> None:
    async def scenario() -> float:
        began = time.monotonic()
        with anyio.move_on_after(1.0):
            # A module of Python's own that would serve for ever.
            await anyio.to_thread.run_sync(
                lambda: run_module("http.server", "0", "--bind", "127.0.0.1", "--directory", str(tmp_path), timeout=60.0)
            )
        return time.monotonic() - began

    assert asyncio.run(scenario()) < 30.0
    assert str(tmp_path) not in str([process.info["cmdline"] for process in psutil.process_iter(["cmdline"])])


def exports_of(pid: int) -> int:
    """Processes that the server has started to export a policy."""
    found = 0
    for child in psutil.Process(pid).children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):
            found += "workers.export" in child.cmdline()
    return found


async def _until(what: str, seconds: float, true: Callable[[], bool]) -> None:
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline, what
        await asyncio.sleep(0.1)


def test_45_bundles_at_once_silence_nobody_and_are_not_made_for_who_has_left(tmp_path: Path) -> None:
    async def scenario(pid: int, url: str) -> None:
        base, _, token = url.partition("/?token=")
        headers = {"Authorization": f"Bearer {token}"}
        answers: list[httpx.Response] = []

        async def download(browser: httpx.AsyncClient) -> None:
            answers.append(await browser.get("/api/policies/simple/bundle"))

        limits = httpx.Limits(max_connections=100)
        async with httpx.AsyncClient(base_url=base, headers=headers, timeout=240, limits=limits) as browser:
            downloads = [asyncio.create_task(download(browser)) for _ in range(45)]
            await _until("nobody is refused", 60, lambda: len(answers) >= 45 - EXPORTS - QUEUE)
            assert exports_of(pid) <= EXPORTS
            for _ in range(5):
                status = await browser.get("/api/status", timeout=20)
                assert status.status_code == 200
            refused = [answer for answer in answers if answer.status_code == 503]
            assert len(refused) == 45 - EXPORTS - QUEUE
            assert {answer.headers["retry-after"] for answer in refused} == {"10"}
            for task in downloads:
                task.cancel()
            await asyncio.gather(*downloads, return_exceptions=True)
        await _until("work goes on for clients that left", 60, lambda: exports_of(pid) == 0)
        await asyncio.sleep(1.0)
        assert exports_of(pid) == 0

    with serving(tmp_path) as (process, url):
        asyncio.run(scenario(process.pid, url))
