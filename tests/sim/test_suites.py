"""Frozen suites, shortest paths, driving side by side, baselines."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import sim
from sim.arenas import Arena, Mover, build_arenas, free_distance
from sim.arenas.document import to_document
from sim.baselines.dwa import dynamic_window
from sim.baselines.simple import bearing_reader, go_to_goal, random_policy
from sim.config import (
    ArenaConfig,
    ArenaFile,
    GeneratedArenaConfig,
    ImportedArenaConfig,
    MoversConfig,
    ObservationConfig,
    ObservationName,
    TaskConfig,
)
from sim.envs.vector import NavigationVectorEnv
from sim.errors import PlacementError, SuiteError
from sim.frozen import MEANINGS
from sim.suites import (
    EpisodeTable,
    Situation,
    Suite,
    content_hash,
    load_suite,
    run_controller,
    run_suite,
    suite_for,
    suite_in,
    suite_names,
    suite_of,
    suite_places,
)
from sim.suites.builder import build_suite, suite_text
from sim.suites.scores import barn_score

SIMPLE = TaskConfig()
COMPLEX = TaskConfig(arena=ArenaConfig(name="complex"))

HASHES = {
    "barn-20": "5779fccd38ec0c72368f6f87be1d4ec8c5bd0ec2021d1ad012e18f9a8e8eacdc",
    "simple-200": "a4a8d01a0e689b5e6d55e0a0b51fe56ba9d967ed21afd1b68b8447c69b417016",
    "complex-200": "d83965c11e81fb0a12650ffc8d17ef283d1b282a725cfb5843992ecea7cbff87",
    "clutter-500": "645046dcb548e0964133b56604757fbd91c65942585dada333152c47054485dc",
    "crowd-200": "6803dc58212205462590fcd5c59f0172d5622471ac5eb5d15eacfc97f7e51d69",
}


RULED = {
    "barn-jackal-300": "e25f1bc8b59f93eb9dd30e6d6e89284acd2f6c3aa0fe660bf6a881f85784f175",
    "heedless-500": "d967f1e4c8ce5263a46f4bb172ae8d6ddcbf858973962eebe80ed784356ff1ab",
    "people-500": "bac9cb7e17cb703061f5804d7d853198cab0d1b97f0289925a868626a5a72529",
}


@pytest.mark.parametrize("name", [*HASHES, *RULED])
def test_a_suite_is_what_it_was_and_its_procedure_makes_it_again(name: str) -> None:
    suite = load_suite(name)
    assert suite.hash == (HASHES | RULED)[name]
    assert build_suite(name) == (Path(sim.suites.__path__[0]) / "data" / f"{name}.json").read_text("utf-8")


def test_a_suite_of_other_maps_is_drawn_as_the_frozen_one_was() -> None:
    movers = MoversConfig(count=4, kind="pedestrian", speed=1.0)
    places = suite_places("clutter", 0.3, 40, movers)
    assert suite_in("crowd-200", places, 200).hash == HASHES["crowd-200"]
    others = suite_places("clutter", 0.3, 4, movers, first=40)
    assert not {place.seed for place in others} & {place.seed for place in places}
    suite = suite_in("others", others, 8)
    assert suite.arena_indices.tolist() == [0, 0, 1, 1, 2, 2, 3, 3]


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


def test_barn_worlds_are_driven_from_their_own_start_to_their_own_goal() -> None:
    suite = load_suite("barn-20")
    assert len(suite.arenas) == 20
    assert (suite.starts == [0.0, -4.0, 1.5708]).all()
    assert (suite.targets == [0.0, 6.0]).all()
    assert ((suite.shortest_paths >= 10.0) & (suite.shortest_paths < 10.5)).all()
    table = run_controller(dynamic_window(SIMPLE), SIMPLE, suite)
    assert not (table.outcomes == 2).any()
    assert 0.5 < (table.outcomes == 1).mean() < 0.8  # without a map it gets stuck in dead ends


def test_the_barn_score_worked_by_hand() -> None:
    # 10 m at 0.25 m/s is 40 s. 200 steps: 40 s, better than twice that counts as 80 s; 600 steps: 120 s; 1700: 340 s, beyond
    # eight times; and a collision.
    table = EpisodeTable(
        outcomes=np.array([1, 1, 1, 2], dtype=np.uint8),
        steps=np.array([200, 600, 1700, 200], dtype=np.int32),
        rewards=np.zeros(4),
        path_lengths=np.full(4, 10.0),
        shortest_paths=np.full(4, 10.0),
        min_clearances=np.zeros(4, dtype=np.float32),
    )
    assert barn_score(table, SIMPLE) == pytest.approx([0.5, 1 / 3, 0.125, 0.0])


def walled(name: str, **own: object) -> ArenaFile:
    box = {"x": 0.0, "y": 0.0, "length": 2.0, "width": 0.2, "angle": 90.0}
    return ArenaFile.model_validate({"name": name, "width": 6.0, "height": 5.0, "boxes": [box], **own})


START, TARGET = {"x": -2.0, "y": 0.0, "heading": 90.0}, {"x": 2.0, "y": 0.0}


def test_arena_files_with_a_start_and_a_target_are_a_suite() -> None:
    documents = [walled("one", start=START, target=TARGET), walled("two", start=TARGET, target={"x": 2.0, "y": 2.0})]
    suite = suite_of("mine", documents)
    assert suite.starts.tolist() == [[-2.0, 0.0, 1.5708], [2.0, 0.0, 0.0]]
    assert suite.arena_indices.tolist() == [0, 1]
    assert suite.shortest_paths[1] == 2.0
    # Round the end of the wall, 1 m up, with the body's 0.105 m round its corners.
    assert 2.0 * np.hypot(1.9, 1.0) < suite.shortest_paths[0] < 2.0 * np.hypot(2.0, 1.105) + 0.05
    assert suite_of("mine", documents[::-1]).hash != suite.hash
    again = json.loads(suite_text("mine", documents))
    assert (again["name"], again["hash"], len(again["arenas"])) == ("mine", suite.hash, 2)
    # A training on such an arena is measured on its own scenario first, and then on others that are drawn in it.
    drawn = suite_for(TaskConfig(arena=ImportedArenaConfig.of(documents[0])))
    assert (drawn.starts[0].tolist(), drawn.targets[0].tolist(), len(drawn)) == ([-2.0, 0.0, 1.5708], [2.0, 0.0], 200)


@pytest.mark.parametrize(
    ("own", "reason"),
    [
        ({"start": START}, "without a start and a target"),
        ({"start": {"x": 0.0, "y": 0.5}, "target": TARGET}, "needs 0.20 m"),
        (
            {"start": START, "target": TARGET, "boxes": [{"x": 0.0, "y": 0.0, "length": 0.2, "width": 5.0}]},
            "no path",
        ),
    ],
)
def test_arena_files_that_make_no_scenario_are_refused(own: dict[str, object], reason: str) -> None:
    with pytest.raises(PlacementError, match=reason):
        suite_of("mine", [walled("one", **own)])


def test_any_change_is_another_hash() -> None:
    arena, scenarios = Arena("a", circles=np.array([[1.0, 1.0, 0.3]])), [[0, 0.0, 0.0, 0.0, 2.0, 0.0, 2.0]]
    hashes = {
        content_hash((arena,), scenarios),
        content_hash((Arena("a", circles=np.array([[1.0, 1.0, 0.3001]])),), scenarios),
        content_hash((Arena("a", half_width=5.1, circles=arena.circles),), scenarios),
        content_hash((arena,), [[0, 0.0, 0.0, 0.0, 2.0, 0.0, 2.0001]]),
        content_hash((Arena("a", circles=arena.circles, movers=(Mover("walker", 0.25, 1.0),)),), scenarios),
        content_hash((Arena("a", circles=arena.circles, movers=(Mover("walker", 0.25, 1.1),)),), scenarios),
    }
    assert len(hashes) == 6


def test_an_unknown_suite_is_refused_with_the_known_ones() -> None:
    with pytest.raises(SuiteError, match="complex-200"):
        load_suite("hard-200")
    assert {*HASHES, *RULED} <= set(suite_names())
    assert MEANINGS.keys() == {*suite_names()}, "each says what it asks of a policy"
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


def every_fourth(suite: Suite) -> Suite:
    """Enough scenarios for a slow controller."""
    part = {name: getattr(suite, name)[::4] for name in ("arena_indices", "starts", "targets", "shortest_paths")}
    return dataclasses.replace(suite, **part)


def test_the_dynamic_window_touches_nothing_and_beats_the_blind() -> None:
    table = run_controller(dynamic_window(COMPLEX), COMPLEX, every_fourth(load_suite("complex-200")))
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
        robots=np.zeros(1, dtype=np.int64),
        velocities=np.zeros((1, 2), dtype=np.float32),
        discs=np.zeros((1, 0, 5), dtype=np.float32),
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
    task = TaskConfig(observation=ObservationConfig.preset(observation))
    envs = NavigationVectorEnv(task, 300, seed=0)
    observations, _ = envs.reset()
    dx, dy = (envs.targets - envs.poses[:, :2]).T
    expected = np.arctan2(dy, dx) - envs.poses[:, 2]
    assert np.cos(bearing_reader(task)(observations) - expected).min() > 1.0 - 1e-6


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


def test_a_training_among_movers_is_measured_among_movers() -> None:
    movers = MoversConfig(count=3, kind="walker", speed=0.7)
    suite = suite_for(TaskConfig(arena=ArenaConfig(name="complex", movers=movers)))
    assert (suite.name, len(suite)) == ("complex-3-walker-200", 200)
    assert suite.arenas[0].movers == (Mover("walker", 0.25, 0.7),) * 3
    suite = suite_for(TaskConfig(arena=GeneratedArenaConfig(name="rooms", difficulty=0.3, movers=movers)))
    assert suite.name == "rooms-0.3-3-walker-200"
    assert all(len(arena.movers) == 3 for arena in suite.arenas)


def test_an_imported_arena_is_its_own_suite() -> None:
    document = to_document(Arena("Hall", 4.0, 3.0, boxes=np.array([[0.0, 0.0, 0.1, 2.0, 0.0]])))
    task = TaskConfig(arena=ImportedArenaConfig.of(document))
    suite = suite_for(task)
    assert (suite.name, len(suite), len(suite.arenas)) == ("Hall-200", 200, 1)
    table = run_suite(go_to_goal(task), task, suite)
    assert 0.2 < (table.outcomes == 1).mean() < 1.0


def test_a_suite_that_was_tampered_with_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    text = build_suite("simple-200").replace("1.", "2.", 1)
    (tmp_path / "simple-200.json").write_text(text, "utf-8")
    monkeypatch.setattr("sim.frozen._FOLDER", tmp_path)
    load_suite.cache_clear()
    with pytest.raises(SuiteError, match="have changed"):
        load_suite("simple-200")
    monkeypatch.undo()
    load_suite.cache_clear()
    assert isinstance(load_suite("simple-200"), Suite)
