"""The parts of my_lab, each as Mapless uses it: by its configuration."""

from pathlib import Path

import numpy as np
import pytest

from my_lab import extension
from sim.extending.control import TaskConfig, drive, load_suite
from sim.extending.testing import found, make_arenas, make_controller, rewards_of, seen_by
from workers.extending.testing import checkpoint_of, train, training_of


def test_mapless_takes_the_extension() -> None:
    assert (extension.name, extension.version) in found()


def test_gentle_turns_cost_what_is_beyond_the_limit() -> None:
    """A full turn of the default robot, 1 rad/s, is 0.5 more than the limit; a tenth of it is less."""
    assert rewards_of({"name": "my_lab.gentle", "limit": 0.5}, linear=0.5, angular=1.0) == pytest.approx(-0.5)
    assert rewards_of({"name": "my_lab.gentle", "limit": 0.5}, linear=0.5, angular=0.1) == 0.0


def test_the_opening_is_away_from_the_wall() -> None:
    """Half a metre beside the left wall of an arena 10 m wide, which rays to the left meet: the freest are to the right."""
    bearing, room = seen_by({"name": "my_lab.opening"}, pose=(0.0, 4.5, 0.0), target=(2.0, 4.0))
    assert -0.5 <= bearing < 0.0
    assert room == 1.0


@pytest.mark.parametrize("difficulty", [0.0, 1.0])
def test_pillars_stand_apart(difficulty: float) -> None:
    for arena in make_arenas({"name": "my_lab.pillars", "difficulty": difficulty, "radius": 0.3}, count=5):
        assert len(arena.circles) >= 4
        assert np.all(arena.circles[:, 2] == 0.3)


def test_the_timid_baseline_arrives_where_nothing_is_in_the_way() -> None:
    task = TaskConfig()
    outcomes = drive(make_controller({"name": "my_lab.timid"}, task), task, load_suite("simple-200"))
    assert (outcomes == "arrival").mean() > 0.95


def test_reinforce_trains_a_gated_network_and_resumes_bit_for_bit(tmp_path: Path) -> None:
    parts = [{"name": "ranges"}, {"name": "distance"}, {"name": "bearing"}, {"name": "my_lab.opening", "frames": 2}]
    training = training_of(
        {"name": "my_lab.reinforce", "robots": 16, "rollout_steps": 8, "network": {"name": "my_lab.gated"}},
        steps=2_048,
        task=TaskConfig.model_validate({"observation": {"parts": parts}}),
    )
    whole = train(training, tmp_path / "whole")
    first = train(training, tmp_path / "first", stop_at=1_024)
    second = train(training, tmp_path / "second", resume=first)
    one, other = checkpoint_of(whole), checkpoint_of(second)
    assert one.keys() == other.keys()
    assert all(np.array_equal(one[name], other[name]) for name in one)
