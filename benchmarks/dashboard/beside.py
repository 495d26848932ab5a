"""The same curves in our pages, in TensorBoard and in Trackio, looked at in the same Chromium within one run.

    python -m benchmarks.dashboard.beside --runs 50 --points 2000
    python -m benchmarks.dashboard.beside --trackio ~/trackio/bin/python  # where `pip install trackio==0.43.0` has put it
    python -m benchmarks.dashboard.beside --points 100000 --patience 3600 --data-dir /data/lab --only ours tensorboard

TensorBoard is among the development packages, and is looked at as it samples by itself and with every point; Trackio has an
environment of its own. Each gets the same runs of 20 series. Of ours and TensorBoard one run's charts are opened, of all
three all runs over one another: drawn is when a person sees the first curve. Every page is opened once before that.
What is not there within the patience, or ends its server, is a row that says so. With `--data-dir` the data stays, and is
taken from there the next time.
"""

import argparse
import json
import math
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import psutil
from playwright.sync_api import Error as PlaywrightError

from benchmarks.dashboard.browser import PATIENCE_SECONDS, Cost, Tabs, tabs
from benchmarks.dashboard.data import SERIES, Sizes, make
from benchmarks.dashboard.server import Server, serving
from benchmarks.report import finish, parser
from server.data_export.event_file import event_file
from server.data_export.series import read_series
from server.database import tables
from server.database.engine import Database

_SEEDS = 5
_CURVES = "document.querySelectorAll('[data-testid=chart] canvas').length"
# A card of TensorBoard's that has a line on it, and one of Trackio's plots.
_CARD = "document.querySelector('scalar-card') && !document.querySelector('scalar-card mat-spinner') && (LINES)"
_LINES = "[...document.querySelectorAll('scalar-card line-chart')].some((one) => one.querySelector('canvas, path'))"
_PLOT = "document.querySelector('canvas')"
# As many trainings as our page compares.
_MOST_COMPARED = 50
_CONTENDERS = ("ours", "tensorboard", "tensorboard, all points", "trackio")
# A server that takes less than so much processor time in so long has nothing left to read.
_REST_MS = 100.0
_REST_SECONDS = 4.0

_FILL_TRACKIO = """
import sys
from datetime import UTC, datetime
from pathlib import Path
import numpy as np
from trackio.sqlite_storage import SQLiteStorage
for path in sorted(Path(sys.argv[1]).glob("*.npz")):
    told = np.load(path)
    names = [name for name in told if name not in ("steps", "times")]
    columns = [told[name].tolist() for name in names]
    rows = [dict(zip(names, values)) for values in zip(*columns)]
    times = [datetime.fromtimestamp(at, UTC).isoformat() for at in told["times"]]
    for start in range(0, len(rows), 5_000):
        part = slice(start, start + 5_000)
        SQLiteStorage.bulk_log("lab", path.stem, rows[part], told["steps"][part].tolist(), times[part])
"""
_SHOW_TRACKIO = (
    "import sys, trackio; trackio.show('lab', open_browser=False, block_thread=True, server_port=int(sys.argv[1]))"
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure each, and print a row for each page."""
    options = _options(arguments)
    figures: dict[str, object] = {"runs": options.runs, "points": options.points, "series": len(SERIES)}
    with tempfile.TemporaryDirectory(prefix="mapless-beside-") as scratch:
        folder = options.data_dir or Path(scratch)
        run_ids, experiments = _made(folder, options.runs, options.points)
        print(f"{'':<38}{'server ms':>10}{'drawn ms':>10}{'longest ms':>11}{'tab MB':>8}{'kB':>8}{'server MB':>10}")
        for name in options.only:
            figures |= _contender(name, folder, run_ids, experiments, options)
    finish("dashboard beside others", figures, check=options.check)


def _contender(
    name: str, folder: Path, run_ids: Sequence[str], experiments: Sequence[str], options: argparse.Namespace
) -> dict[str, object]:
    """What one of them costs."""
    patience: float = options.patience
    if name == "ours":
        with serving(folder / "ours") as server, tabs(server, patience) as opened:
            return _look(name, server, opened, _ours(experiments, run_ids))
    if name != "trackio":
        # Not 0, which is said to mean all: its data server then keeps none.
        samples = options.points if name.endswith("all points") else 1_000
        command = [sys.executable, "-m", "tensorboard.main", "--logdir", str(folder / "events")]
        command += ["--samples_per_plugin", f"scalars={samples}"]
        with _serving([*command, "--port"], patience) as server, tabs(server, patience) as opened:
            return _look(name, server, opened, _tensorboard(run_ids))
    if options.trackio is None:
        return {}
    environment = {**os.environ, "TRACKIO_DIR": str(folder / "trackio"), "HF_HUB_OFFLINE": "1"}
    if not (folder / "trackio").exists():
        fill = [str(options.trackio), "-c", _FILL_TRACKIO, str(folder / "points")]
        subprocess.run(fill, env=environment, check=True)
    show = [str(options.trackio), "-c", _SHOW_TRACKIO]
    with _serving(show, patience, environment) as server, tabs(server, patience) as opened:
        return _look(name, server, opened, {"all runs": ("/?project=lab", _PLOT)})


def _made(folder: Path, runs: int, points: int) -> tuple[list[str], list[str]]:
    """The ids of the runs and of their trainings, which are made where they are not there.

    Raises:
        SystemExit: others are there.
    """
    marker, wanted = folder / "made.json", {"runs": runs, "points": points}
    if not marker.exists():
        began = time.monotonic()
        sizes = Sizes(experiments=0, long_experiments=runs // _SEEDS, long_points=points, checkpoints=1, live=0)
        lab = make(folder / "ours", sizes)
        made = {**wanted, "run_ids": _export(folder), "experiments": lab.long_experiments}
        marker.write_text(json.dumps(made))
        print(f"{lab.points:,} points made and exported in {time.monotonic() - began:.0f} s", file=sys.stderr, flush=True)
    told = json.loads(marker.read_text())
    if {key: told[key] for key in wanted} != wanted:
        sys.exit(f"{folder} holds {told['runs']} runs of {told['points']} points: name another folder.")
    return told["run_ids"], told["experiments"]


def _export(folder: Path) -> list[str]:
    """The runs as event files and as arrays; returns their names there, which are their ids."""
    database = Database(f"sqlite:///{folder / 'ours' / 'mapless.db'}")
    (folder / "points").mkdir()
    with database.read() as session:
        run_ids = [run.id for run in session.query(tables.Run).order_by(tables.Run.id)]
    for run_id in run_ids:
        events = folder / "events" / run_id
        events.mkdir(parents=True)
        pieces = list(read_series(database, run_id))
        with (events / "events.out.tfevents.1700000000.lab").open("wb") as file:
            file.writelines(event_file(1.7e9, pieces))
        whole: dict[str, Any] = {name: np.concatenate([part.values for of, part in pieces if of == name]) for name in SERIES}
        of_first = [part for of, part in pieces if of == SERIES[0]]
        steps, times = (np.concatenate([getattr(part, axis) for part in of_first]) for axis in ("steps", "times"))
        np.savez(folder / "points" / f"{run_id}.npz", steps=steps, times=times, **whole)
    database.dispose()
    return run_ids


def _ours(experiments: Sequence[str], run_ids: Sequence[str]) -> dict[str, tuple[str, str]]:
    shown = experiments[:_MOST_COMPARED]
    compared = "&".join(f"experiment={each}" for each in shown)
    return {
        "one run": (f"/runs/{run_ids[0]}", f"{_CURVES} >= 2"),
        "all runs" if len(shown) == len(experiments) else f"{_SEEDS * len(shown)} runs": (
            f"/compare?{compared}",
            f"{_CURVES} >= 3",
        ),
    }


def _tensorboard(run_ids: Sequence[str]) -> dict[str, tuple[str, str]]:
    ready = _CARD.replace("LINES", _LINES)
    return {"one run": (f"/?runFilter={run_ids[0]}#timeseries", ready), "all runs": ("/#timeseries", ready)}


def _look(name: str, server: Server, opened: Tabs, pages: dict[str, tuple[str, str]]) -> dict[str, object]:
    figures: dict[str, object] = {}
    for page, (path, ready) in pages.items():
        label = f"{name}: {page}"
        try:
            # What a server and a browser do but once is nobody's cost of a look.
            opened.visit(path, ready)
            cost: Cost = opened.visit(path, ready)
            memory = server.memory_mb()
        except (TimeoutError, psutil.Error, PlaywrightError) as error:
            why = str(error).partition("\n")[0]
            print(f"{label:<38}  {why}", flush=True)
            figures[f"{label} failed"] = why
            continue
        print(
            f"{label:<38}{cost.server_ms:>10.0f}{cost.drawn_ms:>10.0f}{cost.longest_ms:>11.0f}{cost.tab_mb:>8.0f}"
            f"{cost.kb:>8.0f}{memory:>10.0f}",
            flush=True,
        )
        figures |= {f"{label} server_ms": round(cost.server_ms), f"{label} drawn_ms": round(cost.drawn_ms)}
        figures |= {f"{label} longest_ms": round(cost.longest_ms), f"{label} tab_mb": round(cost.tab_mb)}
        figures |= {f"{label} kb": round(cost.kb), f"{label} server_mb": round(memory)}
    return figures


@contextmanager
def _serving(command: Sequence[str], patience: float, environment: dict[str, str] | None = None) -> Iterator[Server]:
    """Another tool's server on a free port, which is the last of its arguments; ended on leaving."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = subprocess.Popen([*command, str(port)], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        origin = f"http://127.0.0.1:{port}"
        deadline = time.monotonic() + patience
        while True:
            try:
                httpx.get(origin, timeout=5.0)
                break
            except httpx.TransportError:
                if time.monotonic() > deadline or process.poll() is not None:
                    raise
                time.sleep(0.2)
        server = Server(origin, "", psutil.Process(process.pid))
        began = time.monotonic()
        _wait_for_rest(server, patience)
        print(f"read what there is in {time.monotonic() - began:.0f} s", file=sys.stderr, flush=True)
        yield server
    finally:
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _wait_for_rest(server: Server, patience: float) -> None:
    """Until a server has read what there is: what it shows before that is not all."""
    deadline = time.monotonic() + patience
    before = -math.inf
    while (now := server.cpu_ms()) - before > _REST_MS and time.monotonic() < deadline:
        before = now
        time.sleep(_REST_SECONDS)


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    options = parser(__doc__)
    options.add_argument("--runs", type=int, default=50, help="in experiments of five")
    options.add_argument("--points", type=int, default=2_000, help="of each of the 20 series of a run")
    options.add_argument("--patience", type=float, default=PATIENCE_SECONDS, help="seconds to read all, and to draw a page")
    options.add_argument("--data-dir", type=Path, help="where the data is made; it stays there")
    options.add_argument("--only", nargs="+", choices=_CONTENDERS, default=list(_CONTENDERS), help="contenders")
    options.add_argument("--trackio", type=Path, help="a Python that has Trackio")
    return options.parse_args(arguments)


if __name__ == "__main__":
    main()
