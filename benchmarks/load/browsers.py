"""`python -m benchmarks.load.browsers pages|streams`: what open pages ask of the server.

A browser has an event stream open and opens a page every so often; a page is all its requests to the API side by side, and
done when the last one is answered. Streams and pages are made by two processes, so that reading the ones does not delay the
clock of the others.
"""

import asyncio
import random
import sys
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from dataclasses import dataclass

from benchmarks.load.http import Browser, LostError
from benchmarks.load.lag import watch_lag
from benchmarks.load.plan import PagesTold, Plan, StreamsTold, await_beginning, read_plan, tell

_STATUS = "/api/status"


@dataclass(frozen=True)
class Page:
    """What a page asks for when it opens, of the thing with this id, and the stream of the changes of what it shows."""

    routes: tuple[str, ...]
    stream: str
    id: str = ""


_RUN = tuple(f"/api/runs/{{id}}{part}" for part in ("", "/metrics", "/checkpoints", "/events"))


def pages(plan: Plan, number: int) -> Iterator[Page]:
    """The pages that a browser opens: every other one is a run's, the rest experiments and their list."""
    dice = random.Random(number)
    while True:
        run_id, experiment_id = dice.choice(plan.run_ids), dice.choice(plan.experiment_ids)
        run = Page((*_RUN, _STATUS), "/api/events?follow=shown&run={id}", run_id)
        experiment = Page(("/api/experiments/{id}", _STATUS), "/api/events?follow=shown&experiment={id}", experiment_id)
        everything = Page(("/api/experiments", _STATUS), "/api/events?follow=shown&reports=true")
        yield dice.choice((run, run, experiment, everything))


def first_wait(plan: Plan, number: int) -> float:
    """Seconds until a browser opens its first page, so that browsers do not walk in step."""
    return plan.page_seconds * number / plan.browsers


async def _open_pages(plan: Plan, number: int, told: PagesTold) -> None:
    await asyncio.sleep(first_wait(plan, number))
    with closing(Browser(plan.server_url, plan.token)) as browser:
        for page in pages(plan, number):
            if plan.over:
                break
            opened = time.perf_counter()
            await asyncio.gather(*(_ask(browser, page, route, told) for route in page.routes))
            took = time.perf_counter() - opened
            told.seconds.append(took)
            told.opened.append(plan.seconds - (plan.end - time.time()) - took)
            await asyncio.sleep(max(0.0, min(plan.page_seconds - took, plan.end - time.time())))
        told.asked_again += browser.asked_again


async def _ask(browser: Browser, page: Page, route: str, told: PagesTold) -> None:
    asked = time.perf_counter()
    try:
        status = await browser.get(route.replace("{id}", page.id))
    except (LostError, OSError, TimeoutError) as error:
        told.errors[type(error).__name__] += 1
    else:
        if status != 200:
            told.errors[f"status {status}"] += 1
    told.routes[route].append(time.perf_counter() - asked)


async def open_pages(plan: Plan) -> PagesTold:
    """All browsers' pages until the end of the plan."""
    told = PagesTold()
    async with asyncio.TaskGroup() as group:
        group.create_task(watch_lag(plan, told.lags))
        for number in range(plan.browsers):
            group.create_task(_open_pages(plan, number, told))
    return told


async def _read_stream(plan: Plan, number: int, told: StreamsTold) -> None:
    """The stream of each page, for as long as the page is open."""
    await asyncio.sleep(first_wait(plan, number))
    browser = Browser(plan.server_url, plan.token)

    def count(received: int) -> None:
        told.bytes += received

    for page in pages(plan, number):
        until = min(time.time() + plan.page_seconds, plan.end)
        while (left := until - time.time()) > 0.0:
            with suppress(OSError):
                if await browser.follow(page.stream.replace("{id}", page.id), count, left):
                    break
            told.ended += 1
            await asyncio.sleep(1.0)
        if plan.over:
            return


async def read_streams(plan: Plan) -> StreamsTold:
    """All browsers' streams until the end of the plan; one that ends is opened again."""
    told = StreamsTold()
    async with asyncio.TaskGroup() as group:
        group.create_task(watch_lag(plan, told.lags))
        for number in range(plan.browsers):
            group.create_task(_read_stream(plan, number, told))
    return told


if __name__ == "__main__":
    beginning = await_beginning(read_plan())
    tell(asyncio.run(open_pages(beginning)) if sys.argv[1] == "pages" else asyncio.run(read_streams(beginning)))
