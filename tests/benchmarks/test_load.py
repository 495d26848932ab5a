"""A small form of the load benchmark: synthetic runs, browsers and a watched run against one server, and nothing gives way.

How quickly pages come is the benchmark's to say, with a core for the server alone.
"""

import signal
import subprocess
import sys

import psutil
import pytest

from benchmarks.load.__main__ import load
from benchmarks.load.served import Database
from benchmarks.processes import kill, tree
from benchmarks.service import wait_for
from tests.conftest import POSTGRES, require_service


@pytest.mark.parametrize("database", ["sqlite", pytest.param("postgresql", marks=pytest.mark.services)])
def test_a_small_lab_is_carried(database: Database) -> None:
    if database == "postgresql":
        require_service("PostgreSQL", *POSTGRES)
    figures = load(database=database, runs=6, series=43, batches=1.0, browsers=4, views=1, seconds=12.0, page_seconds=3.0)
    assert figures["leases_lost"] == figures["items_not_acknowledged"] == figures["errors"] == 0, figures
    for name in ("batches_per_second", "pages", "page_p95_milliseconds", "frames_sent", "view_frames_per_second"):
        value = figures[name]
        assert isinstance(value, int | float)
        assert value > 0, figures


def test_who_ends_it_ends_all_that_it_has_started() -> None:
    command = (sys.executable, "-m", "benchmarks.load", "--runs=1", "--browsers=1", "--views=0")
    with subprocess.Popen(command) as process:
        try:
            wait_for(lambda: len(tree(process.pid)) >= 6, seconds=60.0)
            started = tree(process.pid)[1:]
            process.send_signal(signal.SIGTERM)
            assert process.wait(30) == 1
            _, left = psutil.wait_procs(started, timeout=10)
            assert not left
        finally:
            kill(tree(process.pid))
