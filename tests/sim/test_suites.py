"""Frozen suites, shortest paths, driving side by side, baselines."""

from pathlib import Path

import numpy as np
import pytest

import sim
from sim.arenas import Arena, build_arenas, free_distance
from sim.arenas.document import to_document
from sim.baselines import bearings, go_to_goal, random_policy
from sim.config import ArenaConfig, GeneratedArenaConfig, ImportedArenaConfig, ObservationName, TaskConfig
from sim.dwa import dynamic_window
from sim.errors import SuiteError
from sim.suite_builder import build_suite
from sim.suites import Situation, Suite, content_hash, load_suite, run_controller, run_suite, suite_for, suite_names
from sim.vector_env import NavigationVectorEnv

SIMPLE = TaskConfig()
COMPLEX = TaskConfig(arena=ArenaConfig(name="complex"))

HASHES = {
    "simple-200": "a4a8d01a0e689b5e6d55e0a0b51fe56ba9d967ed21afd1b68b8447c69b417016",
    "complex-200": "d83965c11e81fb0a12650ffc8d17ef283d1b282a725cfb5843992ecea7cbff87",
    "clutter-500": "645046dcb548e0964133b56604757fbd91c65942585dada333152c47054485dc",
}


@pytest.mark.parametrize("name", HASHES)
def test_a_suite_is_what_it_was_and_its_procedure_makes_it_again(name: str) -> None:
    suite = load_suite(name)
    assert suite.hash == HASHES[name]
    assert build_suite(name) == (Path(sim.__path__[0]) / "suite_data" / f"{name}.json").read_text("utf-8")


@pytest.mark.parametrize("name", HASHES)
def test_scenarios_fit_and_their_shortest_paths_are_no_shorter_than_a_crow_flies(name: str) -> None:
    suite = load_suite(name)
    assert len(suite) == int(name.rpartition("-")[2])
    for index, arena in enumerate(suite.arenas):
        here = suite.arena_indices == index
        assert free_distance(arena, suite.starts[here, :2]).min() >= 0.4
        assert free_distance(arena, suite.targets[here]).min() >= 0.4
    crow = np.hypot(*(suite.starts[:, :2] - suite.targets).T)
    assert crow.min() >= 0.5
    assert (suite.shortest_paths >= crow - 1e-4).all()
    assert (suite.shortest_paths <= 2.0 * crow).all()


def test_any_change_is_another_hash() -> None:
    arena, scenarios = Arena("a", circles=np.array([[1.0, 1.0, 0.3]])), [[0, 0.0, 0.0, 0.0, 2.0, 0.0, 2.0]]
    hashes = {
        content_hash((arena,), scenarios),
        content_hash((Arena("a", circles=np.array([[1.0, 1.0, 0.3001]])),), scenarios),
        content_hash((Arena("a", half_width=5.1, circles=arena.circles),), scenarios),
        content_hash((arena,), [[0, 0.0, 0.0, 0.0, 2.0, 0.0, 2.0001]]),
    }
    assert len(hashes) == 4


def test_an_unknown_suite_is_refused_with_the_known_ones() -> None:
    with pytest.raises(SuiteError, match="complex-200"):
        load_suite("hard-200")
    assert set(HASHES) <= set(suite_names())
    assert suite_for(COMPLEX).name == "complex-200"


def test_go_to_goal_always_arrives_where_nothing_is_in_the_way() -> None:
    table = run_suite(go_to_goal(SIMPLE), SIMPLE, load_suite("simple-200"))
    assert (table.outcomes == 1).all()
    # It ends 0.2 m before the target, and turns on the way.
    assert (table.path_lengths >= table.shortest_paths - 0.2).all()
    assert (table.path_lengths <= table.shortest_paths + 0.5).all()
    assert (table.steps * 0.05 >= table.path_lengths - 1e-9).all()


def test_the_baselines_are_far_from_solving_complex() -> None:
    suite = load_suite("complex-200")
    assert 0.2 < (run_suite(go_to_goal(COMPLEX), COMPLEX, suite).outcomes == 1).mean() < 0.5
    assert (run_suite(random_policy(), COMPLEX, suite).outcomes == 1).mean() < 0.1


def test_the_dynamic_window_touches_nothing_and_beats_the_blind() -> None:
    suite = load_suite("complex-200")
    table = run_controller(dynamic_window(COMPLEX), COMPLEX, suite)
    assert not (table.outcomes == 2).any()
    assert (table.outcomes == 1).mean() > 0.95
    assert table.min_clearances.min() > 0.0


def test_the_dynamic_window_turns_where_it_cannot_go() -> None:
    # A wall 0.22 m ahead, closer than it keeps, and open to the left: turn left on the spot.
    ranges = np.full((1, 30), 3.5, dtype=np.float32)
    ranges[0, :20] = 0.22
    situation = Situation(
        observations=np.zeros((1, 16), dtype=np.float32),
        ranges=ranges,
        poses=np.zeros((1, 3), dtype=np.float32),
        targets=np.array([[2.0, 0.0]], dtype=np.float32),
    )
    linear, angular = dynamic_window(SIMPLE)(situation)[0]
    assert linear == 0.0
    assert angular > 0.0


def test_a_suite_run_side_by_side_is_each_scenario_on_its_own() -> None:
    suite = load_suite("complex-200")
    policy = go_to_goal(COMPLEX)
    table = run_suite(policy, COMPLEX, suite)
    for index in (0, 17, 199):
        envs = NavigationVectorEnv(COMPLEX, 1, seed=1)
        observations, _ = envs.reset(options={"poses": suite.starts[index], "targets": suite.targets[index]})
        while not envs.outcomes[0]:
            observations, *_ = envs.step(policy(observations))
        assert envs.outcomes[0] == table.outcomes[index]
        assert envs.attempt_steps[0] == table.steps[index]
        assert envs.attempt_rewards[0] == pytest.approx(table.rewards[index], rel=1e-5)
        assert envs.attempt_path_lengths[0] == pytest.approx(table.path_lengths[index], rel=1e-6)
        assert envs.attempt_min_clearances[0] == pytest.approx(table.min_clearances[index], abs=1e-5)


@pytest.mark.parametrize("observation", ["paper", "improved"])
def test_the_bearing_can_be_read_from_an_observation(observation: ObservationName) -> None:
    task = TaskConfig(observation=observation)
    envs = NavigationVectorEnv(task, 300, seed=0)
    observations, _ = envs.reset()
    dx, dy = (envs.targets - envs.poses[:, :2]).T
    expected = np.arctan2(dy, dx) - envs.poses[:, 2]
    assert np.cos(bearings(task, observations) - expected).min() > 1.0 - 1e-6


def test_a_generated_arena_is_measured_on_maps_that_no_training_has() -> None:
    small, large = (TaskConfig(arena=GeneratedArenaConfig(name="rooms", difficulty=0.3, maps=maps)) for maps in (2, 50))
    suite = suite_for(small)
    assert (suite.name, len(suite), len(suite.arenas)) == ("rooms-0.3-200", 200, 20)
    # How many maps a training has makes no difference to the scenarios; the difficulty does.
    assert suite_for(large).hash == suite.hash
    assert suite_for(TaskConfig(arena=GeneratedArenaConfig(name="rooms", difficulty=0.4))).hash != suite.hash
    trained = {arena.boxes.tobytes() for arena in build_arenas(large.arena)}
    assert not trained & {arena.boxes.tobytes() for arena in suite.arenas}
    assert np.isfinite(suite.shortest_paths).all()


def test_an_imported_arena_is_its_own_suite() -> None:
    document = to_document(Arena("Hall", 4.0, 3.0, boxes=np.array([[0.0, 0.0, 0.1, 2.0, 0.0]])))
    task = TaskConfig(arena=ImportedArenaConfig.of(document))
    suite = suite_for(task)
    assert (suite.name, len(suite), len(suite.arenas)) == ("Hall-200", 200, 1)
    table = run_suite(go_to_goal(task), task, suite)
    assert 0.2 < (table.outcomes == 1).mean() < 1.0


def test_a_suite_that_was_tampered_with_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "suite_data").mkdir()
    text = build_suite("simple-200").replace("1.", "2.", 1)
    (tmp_path / "suite_data" / "simple-200.json").write_text(text, "utf-8")
    monkeypatch.setattr("sim.suites.resources.files", lambda _: tmp_path)
    load_suite.cache_clear()
    with pytest.raises(SuiteError, match="have changed"):
        load_suite("simple-200")
    monkeypatch.undo()
    load_suite.cache_clear()
    assert isinstance(load_suite("simple-200"), Suite)
