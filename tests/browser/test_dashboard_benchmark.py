"""The benchmark of the pages, in small: pages are drawn, and a report reaches the screen while another tab looks on."""

import json
import subprocess
import sys

import pytest

from tests.browser.conftest import ROOT

PAGES = ("list", "run, few checkpoints")
SMALL = "--experiments 10 --points 60 --long-experiments 1 --long-points 5000 --checkpoints 60 --live 2 --tabs 2 --seconds 5"


@pytest.mark.usefixtures("browser")  # where there is none, there is nothing to measure
def test_pages_are_measured_alone_and_while_runs_report() -> None:
    command = [sys.executable, "-m", "benchmarks.dashboard", *SMALL.split(), "--pages", *PAGES]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True, timeout=240)

    figures = json.loads(done.stdout.splitlines()[-1])
    for name in PAGES:
        assert figures[f"{name} drawn_ms"] > 0
        assert figures[f"{name} server_ms"] > 0
        assert figures[f"busy: {name} drawn_ms"] > 0
    assert figures["points_in_all"] > 5 * 20 * 5_000
    assert 1 < figures["bytes_a_point"] < 12
    assert 0 < figures["update_worst_s"] < 30
    for kind in ("short run", "long run"):
        assert 0 < figures[f"claim, {kind} worst_ms"] < 5_000
