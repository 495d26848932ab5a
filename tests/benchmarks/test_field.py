"""The matrices at their smallest: what is kept is gone on with, and the docs and the package say the same."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.field.__main__ import main
from benchmarks.field.candidates import baselines, knows_the_map, of_the_default_robot, policies
from benchmarks.field.report import DOCS, success, tables, written
from benchmarks.field.results import Kept, drive, key_of, rows
from benchmarks.field.suites import BARN, FAMILIES, STARTS, TEN_STARTS, Piece, pieces, suite_of_piece
from sim.suites import load_suite
from workers.shipped.field import FieldRow, field
from workers.shipped.library import shipped_policies

SIZE = 3


def test_a_run_goes_on_with_what_was_kept_and_prints_what_all_of_it_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keep = tmp_path / "field.jsonl"

    def run(*arguments: str) -> str:
        main(["--only", "families", "--families", "clutter", "--keep", str(keep), "--size", str(SIZE), *arguments])
        return capsys.readouterr().out

    first = run("--policies", "simple", "--baselines", "go-to-goal")
    lines = keep.read_text().splitlines()
    # A policy, and the baseline with three sights.
    assert len(lines) == 4
    assert all(len(json.loads(line)["outcomes"]) == SIZE for line in lines)
    assert run("--policies", "simple", "--baselines", "go-to-goal").split("{")[0] == first.split("{")[0]
    assert keep.read_text().splitlines() == lines
    assert "| *Simple arena* | 3 | 1 |" in first
    assert json.loads(first.splitlines()[-1])["targets"] == {"clutter, best policy": 99.5}


def test_what_is_measured_anew_takes_the_place_of_what_was_and_the_rest_stays() -> None:
    old = field()
    first, second, *_ = old.rows
    again = first.model_copy(update={"episodes": 7, "arrivals": 7, "collisions": 0})
    other_seed = second.model_copy(update={"seed": 99})
    joined = old.model_copy(update={"date": "2030-01-01", "rows": (again, other_seed)}).in_place_of(old)
    assert joined.rows == (*old.rows[1:], again, other_seed)
    assert joined.date == "2030-01-01"


def test_pieces_are_the_same_scenarios_whatever_the_size() -> None:
    assert [(each.first, each.count) for each in pieces("families", "maze", 250)] == [(0, 100), (100, 100), (200, 50)]
    assert sum(each.count for each in pieces("barn", BARN, 1000)) == 300
    # A part of the frozen suite mixes its scenes, and no scenario is driven twice.
    seen = [suite_of_piece(each).arena_indices.tolist() for each in pieces("people", "people-500", 500)]
    assert sorted(index for piece in seen for index in piece) == list(range(500))
    assert len({index // 50 for index in seen[0]}) == 10


def test_ten_starts_are_beside_the_challenges_own_and_belong_to_their_worlds() -> None:
    suite = load_suite(BARN)
    found = [suite_of_piece(each) for each in pieces("barn", TEN_STARTS, 300)]
    assert [len(each) for each in found] == [100] * 30
    starts = np.concatenate([each.starts for each in found]).reshape(300, STARTS, 3)
    worlds = np.concatenate([each.arena_indices for each in found]).reshape(300, STARTS)
    assert (worlds == worlds[:, :1]).all()
    assert sorted(worlds[:, 0].tolist()) == list(range(300))
    aside = starts - suite.starts[0]
    assert np.abs(aside[..., :2]).max() == pytest.approx(0.3, abs=0.001)
    assert np.rad2deg(np.abs(aside[..., 2])).max() == pytest.approx(15.0, abs=0.05)
    assert len(np.unique(starts.reshape(-1, 3), axis=0)) == 3000


def test_of_ten_starts_the_world_is_what_is_independent() -> None:
    """Half of 20 worlds always, the other half never: as sure as 20 attempts are, not as 200."""
    key = {"part": "barn", "suite": TEN_STARTS, "driver": "a planner", "policy": None, "seed": None, "rays": 30}
    attempts = {"episodes": 200, "arrivals": 100, "collisions": 100, "spl": 0.5, "worst_tenth_spl": 0.0, "seconds": 5.0}
    row = FieldRow.model_validate({**key, **attempts, "field_of_view": 270.0, "worlds": [10, *[0] * 9, 10]})
    low, high = (float(end) for end in success([row]).split("[")[1].strip("]").split(", "))
    assert 25.0 < low < 28.0
    assert 72.0 < high < 75.0


def test_who_drives_where() -> None:
    everywhere = [(each.name, each.task_under(None).lidar.rays) for each in baselines(["VFH+", "MPPI"], "families")]  # type: ignore[arg-type]
    assert everywhere == [("VFH+", 30), ("VFH+", 60), ("VFH+", 120), ("MPPI", 60)]
    orca = "ORCA, told where people are"
    assert [len(baselines([orca], part)) for part in ("families", "barn", "people")] == [0, 0, 1]
    (simple,) = policies(["simple"], None)
    assert (simple.policy, simple.seed) == ("simple", 0)


def test_the_planner_with_the_map_scores_in_barn_and_what_was_kept_is_read_back(tmp_path: Path) -> None:
    (piece,) = pieces("barn", "barn-jackal-300", 1)
    kept = Kept(tmp_path / "field.jsonl")
    kept.add(drive(knows_the_map(), piece))
    (row,) = rows(iter(Kept(tmp_path / "field.jsonl")))
    assert row.episodes == 1
    assert row.score is not None
    assert 0.0 <= row.score <= 0.5
    again = Kept(tmp_path / "field.jsonl")
    assert again.get(key_of(knows_the_map(), piece), piece) is not None
    assert again.get(key_of(knows_the_map(), piece), Piece("barn", "barn-jackal-300", 0, 100)) is None


def test_the_docs_are_its_output() -> None:
    assert tables(field()) in DOCS.read_text()
    assert written(DOCS.read_text(), field()) == DOCS.read_text()
    with pytest.raises(ValueError, match="unpack"):
        written("a page without the marks", field())


def test_every_shipped_policy_of_the_default_robot_stands_in_every_family() -> None:
    measured = {(row.policy, row.suite) for row in field().rows if row.policy and row.part == "families"}
    shipped = policies([each.card.name for each in shipped_policies()], None)
    alike = {each.policy for each in of_the_default_robot(shipped)}
    assert alike == {"simple", "complex", "clutter", "thickets", "rooms", "crowd"}
    assert measured == {(policy, family) for policy in alike for family in FAMILIES}
