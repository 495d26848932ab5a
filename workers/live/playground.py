"""One robot in an arena that people change while it drives: moved obstacles, another target, a push, a blind sector."""

import math
from dataclasses import replace

import numpy as np

from sim.arenas.document import to_arena
from sim.arrays import PolicyFunction
from sim.config import ArenaFile, ImportedArenaConfig, LidarConfig, RandomisationConfig, TaskConfig
from sim.drivers import Driver
from sim.errors import MaplessError, PlacementError
from workers.frames import Frame
from workers.live.blindness import Blinded
from workers.live.foresight import copy_of, field, foresee
from workers.live.showcase import Showcase
from workers.play_protocol import (
    PLACING,
    AnyAct,
    NumberedAct,
    PlayOrders,
    PlaySeen,
    PlaySettings,
    Push,
    PutMover,
    PutRobot,
    PutTarget,
    Steps,
)

# Shares of a push that are tried where there is no room for all of it.
_SHARES = (1.0, 0.75, 0.5, 0.25, 0.1)


class Playground:
    """A robot and its policy in an arena that changes.

    What stays as it is goes on bit for bit: where obstacles move, the robot, its speed and its attempt do not.

    Args:
        policy: who drives.
        task: robot, LiDAR, observation and reward; nothing of it is drawn at random here.
        arena: where, at first.
        gamma: discount of a step, for the value.
        step: of the policy's training, for the frames.

    Raises:
        ArenaError: the robot has no room in it.
    """

    def __init__(self, policy: PolicyFunction, task: TaskConfig, arena: ArenaFile, gamma: float, step: int) -> None:
        self._gamma, self._training_step = gamma, step
        self._task = task.model_copy(update={"randomisation": RandomisationConfig()})
        self._arena, self._settings = arena, PlaySettings()
        self._revision, self._done = 0, 0
        self._problem: str | None = None
        self._show = Showcase(self._task.model_copy(update={"arena": ImportedArenaConfig.of(arena)}), 1)
        self._policy = Blinded(policy, self._task)
        self._show.driver = Driver(self._policy, 1)

    def obey(self, orders: PlayOrders) -> None:
        """Take up what has changed; what can't be done is left undone, and `seen` says so."""
        new = self._revision == 0
        self._problem = None
        if (orders.arena, _disturbances(orders.settings)) != (self._arena, _disturbances(self._settings)):
            try:
                # What stands elsewhere now, the robot runs into or not, as in the world.
                self._show.world = copy_of(self._show.world, self._disturbed(orders.settings), to_arena(orders.arena))
                self._arena = orders.arena
            except MaplessError as error:
                self._problem = f"The arena stays as it was: {error}"
        self._settings = orders.settings
        self._policy.blind(orders.settings)
        for act in orders.acts:
            if act.number > self._done and (not new or isinstance(act.act, PLACING)):
                self._do(act)
        self._done = max([self._done, *(act.number for act in orders.acts)])
        self._revision = orders.revision

    @property
    def pace(self) -> float:
        """Simulated seconds for a second of wall time."""
        return 0.0 if self._settings.paused else self._settings.speed

    def advance(self, seconds: float) -> None:
        """Let wall time pass."""
        if self.pace > 0.0:
            self._show.advance(self._policy, seconds * self.pace)

    def frame(self) -> Frame:
        """This moment; blind rays have no length."""
        frame = self._show.frame(self._training_step, self.pace)
        return replace(frame, ranges=np.where(self._policy.rays, np.float32(0.0), frame.ranges))

    def seen(self) -> PlaySeen:
        """What it is about to do, and what it would do elsewhere where somebody wants to know."""
        driver = self._show.driver
        assert driver is not None
        arrows = field(self._show.world, self._policy) if self._settings.field else ()
        seen = foresee(self._show.world, driver, self._gamma)
        told = {"revision": self._revision, "sim_time": self._show.sim_time, "arrows": arrows, "problem": self._problem}
        return seen.model_copy(update=told)

    def _disturbed(self, settings: PlaySettings) -> TaskConfig:
        """The task with what the settings add to its own disturbances."""
        own = self._task.lidar
        lidar = LidarConfig.model_validate(
            {
                **own.model_dump(),
                "noise": min(0.5, math.hypot(own.noise, settings.noise)),
                "dropout": 1.0 - (1.0 - own.dropout) * (1.0 - settings.dropout),
            }
        )
        delay = min(5, self._task.command_delay + settings.delay)
        return self._task.model_copy(update={"lidar": lidar, "command_delay": delay})

    def _do(self, act: NumberedAct) -> None:
        try:
            self._do_one(act.act)
        except PlacementError as error:
            self._problem = f"There is no room: {error}"

    def _do_one(self, act: AnyAct) -> None:
        robots = self._show.world.robots
        match act:
            case PutRobot():
                self._place((act.x, act.y, math.radians(act.heading)), robots.targets[0].tolist())
            case PutTarget():
                self._place(robots.poses[0].tolist(), (act.x, act.y), at_rest=False)
            case PutMover():
                there = np.flatnonzero(self._show.world.movers.discs[0, :, 2] > 0.0)
                if act.index < len(there):
                    self._show.world.put_mover(int(there[act.index]), act.x, act.y)
                    self._show.look()
            case Push():
                self._push(act)
            case Steps():
                if self._settings.paused:
                    self._show.advance(self._policy, act.count * self._task.control_period)

    def _push(self, push: Push) -> None:
        """Shove the robot as far as there is room, at the speed that it has."""
        x, y, heading = self._show.world.robots.poses[0].tolist()
        target = self._show.world.robots.targets[0].tolist()
        towards = heading + math.radians(push.direction)
        for share in _SHARES:
            far = share * push.distance
            try:
                self._place((x + far * math.cos(towards), y + far * math.sin(towards), heading), target, at_rest=False)
            except PlacementError:
                continue
            return
        raise PlacementError("the robot stands against something there")

    def _place(self, pose: tuple[float, ...], target: tuple[float, ...], *, at_rest: bool = True) -> None:
        """Begin another attempt, everybody else going on as they do.

        Raises:
            PlacementError: there is no room.
        """
        world = self._show.world
        before = world.get_state()
        world.reset(poses=pose, targets=target)
        kept = world.get_state()
        for name, now in kept.items():
            moves = name.startswith("mover_") or (not at_rest and name in ("linear", "angular", "lateral"))
            if moves:
                now[...] = before[name]
        kept["bodies"][1:] = before["bodies"][1:]
        world.set_state(kept)
        driver = self._show.driver
        if driver is not None and at_rest:
            driver.forget(np.ones(1, np.bool_))
        self._show.look()


def _disturbances(settings: PlaySettings) -> tuple[float, float, int]:
    """What takes another world."""
    return settings.noise, settings.dropout, settings.delay
