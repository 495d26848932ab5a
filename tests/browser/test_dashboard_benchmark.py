"""The benchmark of the pages, in small: every page is drawn, and a report reaches the screen while others look on."""

import json
import subprocess
import sys

import pytest

from benchmarks.dashboard.pages import PAGES
from tests.browser.conftest import ROOT

SMALL = "--experiments 8 --points 60 --long-experiments 2 --long-points 5000 --checkpoints 60 --live 2 --tabs 2 --seconds 5"


@pytest.mark.usefixtures("browser")  # where there is none, there is nothing to measure
def test_every_page_is_measured_alone_and_while_runs_report() -> None:
    command = [sys.executable, "-m", "benchmarks.dashboard", *SMALL.split()]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True, timeout=240)

    figures = json.loads(done.stdout.splitlines()[-1])
    for name in PAGES:
        assert figures[f"{name} drawn_ms"] > 0
        assert figures[f"{name} server_ms"] > 0
        assert figures[f"busy: {name} drawn_ms"] > 0
    assert figures["points_in_all"] > 10 * 20 * 5_000
    assert 1 < figures["bytes_a_point"] < 12
    assert 0 < figures["update_worst_s"] < 30
    assert 0 < figures["claim_ms"] < 5_000
