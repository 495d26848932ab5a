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
from dataclasses import dataclass

import httpx

from benchmarks.load.plan import PagesTold, Plan, StreamsTold, read_plan, tell

_TIMEOUT = httpx.Timeout(30.0)


@dataclass(frozen=True)
class Page:
    """What a page asks for when it opens, and the stream of the changes of what it shows."""

    requests: tuple[str, ...]
    stream: str


def pages(plan: Plan, number: int) -> Iterator[Page]:
    """The pages that a browser opens: every other one is a run's, the rest experiments and their list."""
    dice = random.Random(number)
    while True:
        run_id, experiment_id = dice.choice(plan.run_ids), dice.choice(plan.experiment_ids)
        run = Page(
            (
                f"/api/runs/{run_id}",
                f"/api/runs/{run_id}/metrics",
                f"/api/runs/{run_id}/checkpoints",
                f"/api/runs/{run_id}/events",
                "/api/status",
            ),
            f"/api/events?follow=shown&run={run_id}",
        )
        experiment = Page(
            (f"/api/experiments/{experiment_id}", "/api/status"), f"/api/events?follow=shown&experiment={experiment_id}"
        )
        everything = Page(("/api/experiments", "/api/status"), "/api/events?follow=shown&reports=true")
        yield dice.choice((run, run, experiment, everything))


def first_wait(plan: Plan, number: int) -> float:
    """Seconds until a browser opens its first page, so that browsers do not walk in step."""
    return plan.page_seconds * number / plan.browsers


async def _open_pages(plan: Plan, number: int, client: httpx.AsyncClient, told: PagesTold, errors: Counter[str]) -> None:
    await asyncio.sleep(first_wait(plan, number))
    for page in pages(plan, number):
        if plan.over:
            return
        opened = time.perf_counter()
        answers = await asyncio.gather(*(client.get(path) for path in page.requests), return_exceptions=True)
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


async def _read_stream(plan: Plan, number: int, client: httpx.AsyncClient, told: StreamsTold) -> None:
    """The stream of each page, for as long as the page is open."""
    await asyncio.sleep(first_wait(plan, number))
    for page in pages(plan, number):
        until = min(time.time() + plan.page_seconds, plan.end)
        while time.time() < until:
            try:
                async with asyncio.timeout(until - time.time()), client.stream("GET", page.stream) as response:
                    response.raise_for_status()
                    async for block in response.aiter_raw():
                        told.bytes += len(block)
            except TimeoutError:
                break
            except httpx.HTTPError:
                pass
            told.ended += 1
            await asyncio.sleep(1.0)
        if plan.over:
            return


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
        for number in range(plan.browsers):
            group.create_task(_read_stream(plan, number, client, told))
    return told


def _headers(plan: Plan) -> dict[str, str]:
    return {"Authorization": f"Bearer {plan.token}"}


if __name__ == "__main__":
    tell(asyncio.run(open_pages(read_plan()) if sys.argv[1] == "pages" else read_streams(read_plan())))
