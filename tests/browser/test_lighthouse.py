"""Lighthouse finds a built page accessible and well made; how quick it is `benchmarks.pages` says."""

from pathlib import Path

import pytest

from benchmarks.dashboard.addresses import SMALL, addresses
from benchmarks.dashboard.data import Sizes, make
from benchmarks.dashboard.server import serving
from benchmarks.pages import POINTS, points

pytestmark = pytest.mark.browser


@pytest.mark.usefixtures("browser")  # where there is none, there is nothing to look with
def test_lighthouse_gives_a_full_page_its_points(tmp_path: Path) -> None:
    path, _ = addresses(make(tmp_path, Sizes(**SMALL)))["run"]
    with serving(tmp_path) as server:
        given = points(server, path)
    assert given["accessibility"] >= POINTS, given
    assert given["best-practices"] >= POINTS, given
