"""What the server computes for what a page asks: processor time and statements, without files, sockets and browsers.

    python -m benchmarks.dashboard.requests --check
    python -m benchmarks.dashboard.requests --experiments 10 --long-points 10000 --pages list compare

Chromium opens every page of a lab's database, and what each asks of the API is noted. Then this process asks its own
application the same, one request after another: first with nothing kept of any answer, and once more. Medians of several
rounds; code, statements and files of the database were used before.
"""

import argparse
import asyncio
import statistics
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.parse import urlsplit

from fastapi import FastAPI
from sqlalchemy import event
from starlette.types import Message, Scope

from benchmarks.dashboard.browser import tabs
from benchmarks.dashboard.data import Lab, Sizes, ask_sizes, make
from benchmarks.dashboard.pages import PAGES, visits
from benchmarks.dashboard.server import serving
from benchmarks.report import finish, parser
from server.app import create_app
from server.metrics.cache import AnswerCache
from server.metrics.kept import KeptSeries
from server.recent import Recent
from server.services import Services
from server.settings import Settings

_MOST_MS = 100.0
_TOKEN = "benchmark-requests-token-that-is-long-enough"
# A page that has asked nothing for so long is done.
_REST_MS = 1_500
_ASKED = "performance.getEntriesByType('resource').map(({ name }) => name).filter((name) => name.includes('/api/'))"
# The change stream never ends.
_ENDLESS = "/api/events"


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print, and with `--check` fail where a page's data costs too much."""
    options = _options(arguments)
    with tempfile.TemporaryDirectory(prefix="mapless-requests-") as scratch:
        folder = Path(scratch)
        sizes = Sizes(options.experiments, options.points, options.long_experiments, options.long_points, live=0)
        asked = _asked(folder, make(folder, sizes), options.pages)
        figures = asyncio.run(_measure(folder, asked, options.rounds))
    targets = {f"{name} first_ms": _MOST_MS for name in options.pages}
    finish("requests", figures, at_most=targets, check=options.check)


def _asked(folder: Path, lab: Lab, names: Sequence[str]) -> dict[str, list[str]]:
    """What pages ask of the API, by name of the page: addresses with what stands behind the question mark."""
    asked: dict[str, list[str]] = {}
    with serving(folder) as server, tabs(server) as opened:
        for visit in visits(lab, names):
            page = opened.open(visit.path, visit.ready)
            opened.drawn(page)
            page.wait_for_timeout(_REST_MS)
            urls = [urlsplit(url) for url in page.evaluate(_ASKED)]
            asked[visit.name] = [f"{url.path}?{url.query}" for url in urls if url.path != _ENDLESS]
            page.context.close()
    return asked


async def _measure(folder: Path, asked: Mapping[str, Sequence[str]], rounds: int) -> dict[str, object]:
    """Ask the application, and print a row for each page."""
    settings = {"data_dir": folder, "token": _TOKEN, "worker_token": _TOKEN[::-1]}
    app = create_app(Settings.model_validate(settings))
    print(f"{'page':<28}{'asks':>6}{'first ms':>10}{'again ms':>10}{'statements':>12}")
    figures: dict[str, object] = {}
    async with app.router.lifespan_context(app):
        services: Services = app.state.services
        statements = _Statements(services)
        for name, addresses in asked.items():
            await _ask(app, addresses)
            first, again = [], []
            for _ in range(rounds):
                services.compared, services.series, services.curves = Recent(8), KeptSeries(), AnswerCache()
                before = statements.count
                first.append(await _ask(app, addresses))
                told = statements.count - before
                again.append(await _ask(app, addresses))
            milliseconds = statistics.median(first), statistics.median(again)
            print(f"{name:<28}{len(addresses):>6}{milliseconds[0]:>10.0f}{milliseconds[1]:>10.0f}{told:>12}", flush=True)
            figures |= {f"{name} first_ms": round(milliseconds[0]), f"{name} again_ms": round(milliseconds[1])}
            figures |= {f"{name} statements": told, f"{name} asks": len(addresses)}
    return figures


class _Statements:
    """Counts what is asked of the database, but for what begins transactions."""

    def __init__(self, services: Services) -> None:
        self.count = 0
        event.listen(services.database.engine, "before_cursor_execute", self._note)

    def _note(self, _connection: object, _cursor: object, statement: str, *_: object) -> None:
        self.count += not statement.startswith(("PRAGMA", "BEGIN"))


async def _ask(app: FastAPI, addresses: Sequence[str]) -> float:
    """Ask for all of them; milliseconds of processor time of this process."""
    began = time.process_time()
    for address in addresses:
        await _get(app, address)
    return 1000 * (time.process_time() - began)


async def _get(app: FastAPI, address: str) -> None:
    """Ask as a browser would.

    Raises:
        RuntimeError: the answer is no answer.
    """
    path, _, query = address.partition("?")
    headers = {"host": "127.0.0.1", "authorization": f"Bearer {_TOKEN}", "accept-encoding": "gzip, deflate, br, zstd"}
    scope: Scope = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": "GET",
        "scheme": "http",
        "path": path,
        "raw_path": path.encode(),
        "query_string": query.encode(),
        "root_path": "",
        "headers": [(name.encode(), value.encode()) for name, value in headers.items()],
        "client": ("127.0.0.1", 1),
        "server": ("127.0.0.1", 80),
        "state": {},
    }
    status = 0

    async def receive() -> Message:
        await asyncio.Event().wait()
        raise AssertionError

    async def send(message: Message) -> None:
        nonlocal status
        status = message.get("status", status)

    await app(scope, receive, send)
    if status != 200:
        raise RuntimeError(f"{address} was answered with {status}")


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    options = parser(__doc__)
    ask_sizes(options)
    options.add_argument("--rounds", type=int, default=5, help="medians of so many count")
    options.add_argument("--pages", nargs="+", choices=PAGES, default=list(PAGES), help="that are measured")
    return options.parse_args(arguments)


if __name__ == "__main__":
    main()
