"""`python -m benchmarks.load.browsers pages|streams`: what open pages ask of the server.

A browser has an event stream open and opens a page every so often; a page is all its requests to the API side by side, and
done when the last one is answered. Streams and pages are made by two processes, so that reading the ones does not delay the
clock of the others.
"""

import asyncio
import random
import sys
import time
from collections import Counter
from collections.abc import Iterator

import httpx

from benchmarks.load.plan import PagesTold, Plan, StreamsTold, read_plan, tell

_TIMEOUT = httpx.Timeout(30.0)


def pages(plan: Plan, dice: random.Random) -> Iterator[tuple[str, ...]]:
    """The requests of one page after another: every other one is a run's, the rest experiments and their list."""
    while True:
        run_id, experiment_id = dice.choice(plan.run_ids), dice.choice(plan.experiment_ids)
        yield dice.choice(
            (
                *2
                * (
                    (
                        f"/api/runs/{run_id}",
                        f"/api/runs/{run_id}/metrics",
                        f"/api/runs/{run_id}/checkpoints",
                        f"/api/runs/{run_id}/events",
                        "/api/status",
                    ),
                ),
                (f"/api/experiments/{experiment_id}", "/api/status"),
                ("/api/experiments", "/api/status"),
            )
        )


async def _open_pages(plan: Plan, number: int, client: httpx.AsyncClient, told: PagesTold, errors: Counter[str]) -> None:
    dice = random.Random(number)
    await asyncio.sleep(plan.page_seconds * dice.random())
    for requests in pages(plan, dice):
        if plan.over:
            return
        opened = time.perf_counter()
        answers = await asyncio.gather(*(client.get(path) for path in requests), return_exceptions=True)
        took = time.perf_counter() - opened
        told.seconds.append(took)
        for answer in answers:
            if isinstance(answer, BaseException):
                errors[type(answer).__name__] += 1
            elif answer.status_code != 200:
                errors[f"status {answer.status_code}"] += 1
        await asyncio.sleep(max(0.0, min(plan.page_seconds - took, plan.end - time.time())))


async def open_pages(plan: Plan) -> PagesTold:
    """All browsers' pages until the end of the plan."""
    told, errors = PagesTold(), Counter[str]()
    limits = httpx.Limits(max_connections=None, keepalive_expiry=2 * plan.page_seconds)
    async with (
        httpx.AsyncClient(
            base_url=plan.server_url, headers=_headers(plan), timeout=_TIMEOUT, limits=limits, trust_env=False
        ) as client,
        asyncio.TaskGroup() as group,
    ):
        for number in range(plan.browsers):
            group.create_task(_open_pages(plan, number, client, told, errors))
    return told.model_copy(update={"errors": dict(errors)})


async def _read_stream(plan: Plan, client: httpx.AsyncClient, told: StreamsTold) -> None:
    while not plan.over:
        try:
            async with asyncio.timeout(plan.end - time.time()), client.stream("GET", "/api/events") as response:
                response.raise_for_status()
                async for block in response.aiter_raw():
                    told.bytes += len(block)
        except TimeoutError:
            return
        except httpx.HTTPError:
            pass
        told.ended += 1
        await asyncio.sleep(1.0)


async def read_streams(plan: Plan) -> StreamsTold:
    """All browsers' streams until the end of the plan; one that ends is opened again."""
    told = StreamsTold()
    limits = httpx.Limits(max_connections=None)
    async with (
        httpx.AsyncClient(
            base_url=plan.server_url, headers=_headers(plan), timeout=_TIMEOUT, limits=limits, trust_env=False
        ) as client,
        asyncio.TaskGroup() as group,
    ):
        for _ in range(plan.browsers):
            group.create_task(_read_stream(plan, client, told))
    return told


def _headers(plan: Plan) -> dict[str, str]:
    return {"Authorization": f"Bearer {plan.token}"}


if __name__ == "__main__":
    tell(asyncio.run(open_pages(read_plan()) if sys.argv[1] == "pages" else read_streams(read_plan())))
