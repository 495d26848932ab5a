"""Playgrounds: what changes changes at once, what does not goes on bit for bit, and what is foreseen comes."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from sim.config import ArenaFile, Circle, LidarConfig, Pedestrian, TaskConfig, Waypoint
from workers.frames import Frame
from workers.job_protocol import PlayJob, ShippedPolicyName
from workers.live.blindness import Blinded
from workers.live.playground import Playground
from workers.live.playing import open_playground
from workers.play_protocol import (
    AnyAct,
    NumberedAct,
    PlayOrders,
    PlaySettings,
    Push,
    PutMover,
    PutRobot,
    PutTarget,
    Steps,
)
from workers.shipped.library import shipped_policy

ROOM = ArenaFile(name="room", width=8.0, height=6.0)
PERIOD = TaskConfig().control_period
TOP = TaskConfig().robot.max_linear_speed


def ahead(observations: NDArray[np.float32]) -> NDArray[np.float32]:
    """Full speed, straight on."""
    return np.tile(np.array([1.0, 0.0], np.float32), (len(observations), 1))


class Hand:
    """Somebody who changes a playground."""

    def __init__(self, ground: Playground, arena: ArenaFile = ROOM) -> None:
        self.ground, self.arena = ground, arena
        self.acts: tuple[NumberedAct, ...] = ()
        self.settings = PlaySettings(paused=True)
        self.revision = 0

    def do(self, *acts: AnyAct) -> None:
        for act in acts:
            self.acts = (*self.acts, NumberedAct(number=len(self.acts) + 1, act=act))
        self.tell()

    def tell(self) -> None:
        self.revision += 1
        self.ground.obey(PlayOrders(revision=self.revision, arena=self.arena, settings=self.settings, acts=self.acts[-32:]))

    def frame(self) -> Frame:
        return self.ground.frame()


def straight(arena: ArenaFile = ROOM, **task: object) -> Hand:
    return Hand(Playground(ahead, TaskConfig.model_validate(task), arena, 0.99, 7), arena)


def test_it_stands_where_it_is_put_and_drives_a_step_at_a_time() -> None:
    hand = straight()
    hand.do(PutRobot(x=-3.0, y=1.0, heading=0.0), PutTarget(x=3.0, y=1.0))
    frame = hand.frame()
    assert (frame.poses[0].tolist(), frame.targets[0].tolist(), frame.step) == ([-3.0, 1.0, 0.0], [3.0, 1.0], 7)
    hand.ground.advance(5.0)
    assert hand.frame().poses[0].tolist() == [-3.0, 1.0, 0.0]
    hand.do(Steps(count=10))
    assert hand.frame().poses[0, 0] == pytest.approx(-3.0 + 10 * PERIOD * TOP, abs=1e-4)
    # What has been done is not done again.
    hand.tell()
    assert hand.frame().sim_time == pytest.approx(10 * PERIOD)


def test_an_obstacle_moves_and_the_robot_goes_on_as_it_did() -> None:
    moved, alone = straight(), straight()
    for hand in (moved, alone):
        hand.do(PutRobot(x=-3.0, y=0.0, heading=0.0), PutTarget(x=3.0, y=0.0), Steps(count=5))
    for place in (2.5, 2.0, 1.5):
        moved.arena = ROOM.model_copy(update={"circles": (Circle(x=0.0, y=place, radius=0.3),)})
        moved.do(Steps(count=3))
        alone.do(Steps(count=3))
    np.testing.assert_array_equal(moved.frame().poses, alone.frame().poses)
    assert moved.frame().rewards[0] == alone.frame().rewards[0]
    # And yet it is seen: straight up from the robot's side, 1.5 - 0.3 m away, once it is beside it.
    assert moved.frame().ranges.min() < alone.frame().ranges.min()


def test_what_is_foreseen_comes() -> None:
    archive, arena = (
        shipped_policy("complex").archive,
        ROOM.model_copy(update={"circles": (Circle(x=0.0, y=0.1, radius=0.5),)}),
    )
    hand = Hand(open_playground(archive, PlayJob(policy=ShippedPolicyName(name="complex"), arena=arena)), arena)
    hand.do(PutRobot(x=-2.5, y=0.0, heading=0.0), PutTarget(x=2.0, y=0.0))
    foreseen = hand.ground.seen()
    assert foreseen.outcome == "arrival"
    steps = round(foreseen.seconds / PERIOD)
    for _ in range(steps - 1):
        hand.do(Steps(count=1))
    assert hand.frame().outcomes[0] == 0
    hand.do(Steps(count=1))
    assert hand.frame().outcomes[0] == 1
    # Round the disc: its way keeps the robot's radius from the edge.
    way = np.array(foreseen.way)
    assert np.hypot(way[:, 0], way[:, 1] - 0.1).min() > 0.5 + 0.1


def test_the_value_is_the_discounted_reward_of_the_way_ahead() -> None:
    hand = straight(reward={"terms": [{"name": "time", "weight": 1.0}]})
    hand.do(PutRobot(x=-3.0, y=2.0, heading=0.0), PutTarget(x=3.0, y=-2.5))
    foreseen = hand.ground.seen()
    # A second pays 1, a step 0.2, and the one that ends it nothing: a geometric series.
    assert foreseen.outcome == "collision"
    steps = round(foreseen.seconds / PERIOD)
    assert steps == pytest.approx((7.0 - 0.2) / (TOP * PERIOD), abs=1.5)
    assert foreseen.value == pytest.approx(0.2 * (1.0 - 0.99 ** (steps - 1)) / (1.0 - 0.99), rel=1e-5)
    # What is told of the steps ahead is what is foreseen there.
    assert len(foreseen.values) == steps + 1
    assert (foreseen.values[0], foreseen.values[-1]) == (foreseen.value, 0.0)
    hand.do(Steps(count=1))
    foreseen = hand.ground.seen()
    hand.do(Steps(count=4))
    later = hand.ground.seen()
    assert later.value == pytest.approx(foreseen.values[4], rel=1e-5)
    assert later.sim_time == pytest.approx(foreseen.sim_time + 4 * PERIOD)
    assert later.seconds == pytest.approx(foreseen.seconds - 4 * PERIOD)


def test_pushes_go_as_far_as_there_is_room() -> None:
    hand = straight()
    hand.do(PutRobot(x=0.0, y=0.0, heading=0.0))
    hand.do(Push(direction=90.0, distance=0.4))
    assert hand.frame().poses[0].tolist() == pytest.approx([0.0, 0.4, 0.0])
    hand.do(PutRobot(x=3.7, y=0.0, heading=0.0), Push(direction=0.0, distance=0.4))
    # The wall is at 4 m, the robot 0.105 m wide: half of the push fits.
    assert 3.7 < hand.frame().poses[0, 0] < 4.0 - 0.1
    assert hand.ground.seen().problem is None


def test_somebody_is_put_elsewhere_and_walks_on() -> None:
    walks = Pedestrian(kind="pedestrian", speed=1.0, waypoints=(Waypoint(x=0.0, y=2.0), Waypoint(x=3.0, y=2.0)))
    arena = ROOM.model_copy(update={"movers": (walks,)})
    hand = straight(arena)
    hand.do(PutRobot(x=-3.0, y=-2.0, heading=0.0), PutMover(index=0, x=-2.0, y=0.0))
    assert hand.frame().movers[0, :2].tolist() == [-2.0, 0.0]
    hand.do(Steps(count=10))
    assert 0.2 < float(np.hypot(*(hand.frame().movers[0, :2] - np.array([-2.0, 0.0])))) < 2.5


def test_noise_and_delay_are_this_worlds_alone() -> None:
    hand = straight()
    hand.do(PutRobot(x=-3.0, y=0.0, heading=0.0), PutTarget(x=3.0, y=0.0))
    hand.settings = PlaySettings(paused=True, delay=3, noise=0.1)
    hand.do(Steps(count=3))
    # Three steps late: in the first three nothing was followed.
    assert hand.frame().poses[0, 0] == -3.0
    hand.do(Steps(count=1))
    assert hand.frame().poses[0, 0] == pytest.approx(-3.0 + PERIOD * TOP, abs=1e-4)


def test_a_new_worker_puts_things_where_they_are_and_repeats_nothing_else() -> None:
    hand = straight()
    hand.do(PutRobot(x=1.0, y=1.0, heading=90.0))
    late = Hand(straight().ground)
    late.revision, late.acts = (
        5,
        (
            *hand.acts,
            NumberedAct(number=2, act=Push()),
            NumberedAct(number=3, act=Steps(count=9)),
        ),
    )
    late.tell()
    assert late.frame().poses[0].tolist() == pytest.approx([1.0, 1.0, math.pi / 2])
    assert late.frame().sim_time == 0.0


def test_blind_rays_are_told_the_full_range_and_are_not_drawn() -> None:
    task = TaskConfig(lidar=LidarConfig(rays=30, field_of_view=180.0))
    heard: list[NDArray[np.float32]] = []

    def listen(observations: NDArray[np.float32]) -> NDArray[np.float32]:
        heard.append(observations)
        return ahead(observations)

    policy = Blinded(listen, task)
    policy.blind(PlaySettings(blind_width=60.0, blind_direction=90.0))
    # Rays at 60 to 90 degrees to the left: of steps of 180 / 29 degrees the last five.
    assert np.flatnonzero(policy.rays).tolist() == [25, 26, 27, 28, 29]
    seen = np.ones((1, 16), np.float32)
    policy(seen)
    # The default observation begins with ten nearnesses of three rays each; at the full range of 3.5 m it is 0.2 / 3.5.
    np.testing.assert_allclose(heard[0][0, :8], 1.0)
    np.testing.assert_allclose(heard[0][0, 8:10], 0.2 / 3.5, rtol=1e-6)
    policy.blind(PlaySettings())
    policy(seen)
    np.testing.assert_array_equal(heard[1], seen)


def test_arrows_stand_in_the_free_space_and_point_where_it_would_go() -> None:
    arena = ROOM.model_copy(update={"circles": (Circle(x=1.0, y=1.0, radius=0.5),)})
    hand = straight(arena)
    hand.settings = PlaySettings(paused=True, field=True)
    hand.do(PutRobot(x=-3.0, y=0.0, heading=0.0), PutTarget(x=3.0, y=0.0))
    arrows = np.array(hand.ground.seen().arrows)
    assert 100 < len(arrows) <= 400
    assert np.hypot(arrows[:, 0] - 1.0, arrows[:, 1] - 1.0).min() > 0.5
    # Straight on, which is towards the target it faces.
    towards = np.array([3.0, 0.0]) - arrows[:, :2]
    way = arrows[:, 2:] - arrows[:, :2]
    np.testing.assert_allclose(np.arctan2(*way.T[::-1]), np.arctan2(*towards.T[::-1]), atol=0.02)
    assert hand.ground.seen().model_copy(update={"arrows": ()}).problem is None
