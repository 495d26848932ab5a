"""What critics are told of the way: by hand round a wall, over the ends of episodes, and nothing that robots notice."""

import math

import numpy as np
import pytest

from sim.arenas import Arena, build_arenas
from sim.config import ArenaConfig, TaskConfig
from sim.engine.guidance import GUIDANCE_SIZE, Guidance
from sim.engine.paths import Paths, RobotPaths
from sim.engine.stretches import Crew
from sim.engine.world import World

CLEARANCE = TaskConfig().passable_clearance
# 10 x 10 m with a wall from the lower edge up to y = 2, 0.2 m thick.
WALL = Arena("wall", circles=np.empty((0, 3)), boxes=np.array([[0.0, -1.5, 0.1, 3.5, 0.0]]))
STAND = np.array([[0.0, 0.0]], np.float32)


def guided(task: TaskConfig, arena: Arena, start: list[float], target: list[float]) -> tuple[World, Guidance]:
    world = World(task, [arena], 1, seed=0, guides=True)
    world.reset(poses=[start], targets=[target])
    assert world.guidance is not None
    return world, world.guidance


def test_round_a_wall_by_hand() -> None:
    """From (-2, 0), facing up, to (2, 0): first to the wall's end, whose corner at (-0.1, 2) is passed at 0.2 m."""
    _, guidance = guided(TaskConfig(), WALL, [-2.0, 0.0, math.pi / 2], [2.0, 0.0])
    saturating, metres, sine, cosine, over = guidance.now[0].tolist()
    length = Paths([WALL], CLEARANCE).length(0, (-2.0, 0.0), (2.0, 0.0))
    assert metres * 20.0 == pytest.approx(length)
    assert saturating == pytest.approx(length / (length + 5.0))
    # To (-0.1, 2.2) it is 49 degrees from the x-axis, so 41 to the right of the heading, but for cells of 0.1 m.
    assert math.degrees(math.atan2(sine, cosine)) == pytest.approx(-41.0, abs=4.0)
    assert over == 0.0


def test_straight_where_the_target_is_in_sight() -> None:
    _, guidance = guided(TaskConfig(), WALL, [-2.0, 0.0, 0.0], [-2.0, 3.0])
    assert guidance.now[0].tolist() == pytest.approx([3.0 / 8.0, 3.0 / 20.0, 1.0, 0.0, 0.0], abs=1e-6)


def test_the_last_look_of_an_episode_is_kept_and_the_next_ones_begins_anew() -> None:
    world, guidance = guided(TaskConfig(step_limit=10), WALL, [-2.0, 0.0, 0.0], [-2.0, 3.0])
    for step in range(1, 10):
        world.step(STAND)
        assert guidance.now[0, 4] == pytest.approx(step / 10)
    world.step(STAND)
    assert world.robots.truncations[0]
    assert guidance.final[0].tolist() == pytest.approx([3.0 / 8.0, 3.0 / 20.0, 1.0, 0.0, 1.0], abs=1e-6)
    place, target = world.robots.poses[0, :2].tolist(), world.robots.targets[0].tolist()
    assert guidance.now[0, 1] * 20.0 == pytest.approx(Paths([WALL], CLEARANCE).length(0, place, target), rel=1e-5)
    assert guidance.now[0, 4] == 0.0


def test_an_arrival_shows_the_way_to_the_next_target() -> None:
    world, guidance = guided(TaskConfig(), WALL, [-2.0, 0.0, 0.0], [-1.76, 0.0])
    while not world.robots.outcomes[0]:
        world.step(np.array([[1.0, 0.0]], np.float32))
    assert world.robots.outcomes[0] == 1
    place, target = world.robots.poses[0, :2].tolist(), world.robots.targets[0].tolist()
    assert guidance.now[0, 1] * 20.0 == pytest.approx(Paths([WALL], CLEARANCE).length(0, place, target), rel=1e-5)
    assert guidance.now[0, 4] == 0.0


@pytest.mark.parametrize("restart", ["same step", "next step"])
def test_robots_do_not_notice(restart: str) -> None:
    """Guided or not, a world goes on alike, but for last bits, which two kernels round otherwise where an episode begins.

    One that goes on from a state is told what it was.
    """
    task = TaskConfig(arena=ArenaConfig(name="complex"), step_limit=20)
    arenas = build_arenas(task.arena)
    worlds = [World(task, arenas, 32, seed=1, restart=restart, guides=guides) for guides in (True, False)]  # type: ignore[arg-type]
    for world in worlds:
        world.reset()
    rng, ended = np.random.default_rng(0), 0
    for _ in range(60):
        actions = rng.uniform((0.0, -1.0), (1.0, 1.0), (32, 2)).astype(np.float32)
        for world in worlds:
            world.step(actions)
        ours, theirs = (world.robots for world in worlds)
        for name in ("observations", "rewards", "terminations", "truncations", "outcomes", "poses"):
            np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), atol=1e-5)
        over = ours.terminations | ours.truncations
        np.testing.assert_allclose(ours.final_observations[over], theirs.final_observations[over], atol=1e-5)
        ended += int(over.sum())
    assert ended > 60
    again = World(task, arenas, 32, seed=2, restart=restart, guides=True)  # type: ignore[arg-type]
    again.reset()
    again.set_state(worlds[0].get_state())
    assert again.guidance is not None
    assert worlds[0].guidance is not None
    np.testing.assert_array_equal(again.guidance.now, worlds[0].guidance.now)
    assert again.guidance.now.shape == (32, GUIDANCE_SIZE)


@pytest.mark.parametrize("threads", [1, 2])
def test_few_fields_are_as_good_as_many(threads: int) -> None:
    arena = build_arenas(ArenaConfig(name="complex"))[0]
    told = []
    for kept in (1000, 3, 1):
        world = World(TaskConfig(), [arena], 150, seed=1)
        world.reset()
        paths = RobotPaths(Paths([arena], CLEARANCE, kept * 4 * 100 * 100), 150)
        guidance, everybody = Guidance(TaskConfig(), paths, 150), np.ones(150, np.bool_)
        paths.look(world.robots, everybody, Crew(threads))
        guidance.tell(world.robots, everybody)
        told.append(guidance.now)
    np.testing.assert_array_equal(told[0], told[1])
    np.testing.assert_array_equal(told[0], told[2])
