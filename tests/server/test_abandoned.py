"""A question whose asker has left: it ends at the next look, and one that still waits is never begun."""

import asyncio
import threading
from collections.abc import Awaitable, Callable

import pytest
from anyio import CapacityLimiter, to_thread
from starlette.types import Message, Receive, Scope, Send

from server.http.abandoned import AbandonedRequestsMiddleware, stop_if_abandoned

SCOPE = {"type": "http", "method": "GET", "path": "/api/compare/curves", "headers": []}


async def ask(
    app: Callable[[Scope, Receive, Send], Awaitable[None]], leaves_after: float, method: str = "GET"
) -> list[Message]:
    """What a client has got that leaves after so many seconds."""
    sent: list[Message] = []
    body = iter([{"type": "http.request", "body": b"", "more_body": False}])

    async def receive() -> Message:
        for message in body:
            return message
        await asyncio.sleep(leaves_after)
        return {"type": "http.disconnect"}

    async def send(message: Message) -> None:
        sent.append(message)

    await AbandonedRequestsMiddleware(app)({**SCOPE, "method": method}, receive, send)
    return sent


async def answer(send: Send) -> None:
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"an answer"})


def test_work_under_way_ends_at_its_next_look() -> None:
    looks = 0

    def work() -> None:
        nonlocal looks
        while looks < 1_000:
            looks += 1
            stop_if_abandoned()
            threading.Event().wait(0.01)

    async def app(_scope: Scope, _receive: Receive, send: Send) -> None:
        await to_thread.run_sync(work)
        await answer(send)

    assert asyncio.run(ask(app, 0.1)) == []
    assert 1 < looks < 500


def test_work_that_waits_for_a_thread_is_never_begun() -> None:
    begun: list[int] = []

    async def all_of_them() -> None:
        limiter = CapacityLimiter(1)

        def work() -> None:
            begun.append(1)
            threading.Event().wait(0.5)

        async def app(_scope: Scope, _receive: Receive, send: Send) -> None:
            await to_thread.run_sync(work, limiter=limiter)
            await answer(send)

        await asyncio.gather(*(ask(app, 0.1) for _ in range(20)))

    asyncio.run(all_of_them())
    assert begun == [1]


def test_who_stays_gets_the_answer_and_sees_the_failure_itself() -> None:
    async def app(_scope: Scope, receive: Receive, send: Send) -> None:
        assert (await receive())["type"] == "http.request"
        await answer(send)

    assert [message["type"] for message in asyncio.run(ask(app, 60.0))] == ["http.response.start", "http.response.body"]

    async def broken(_scope: Scope, _receive: Receive, _send: Send) -> None:
        raise LookupError("the reason")

    with pytest.raises(LookupError, match="the reason"):
        asyncio.run(ask(broken, 60.0))


def test_what_changes_something_runs_to_its_end() -> None:
    ended: list[str] = []

    async def app(_scope: Scope, _receive: Receive, send: Send) -> None:
        await asyncio.sleep(0.3)
        ended.append("stored")
        await answer(send)

    asyncio.run(ask(app, 0.05, method="POST"))
    assert ended == ["stored"]
