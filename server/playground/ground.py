"""One playground: what stands where, who asked for what, and what its worker says; every change is checked here.

Called from the event loop and from the threads of 3D scenes: a lock is held for as long as a few numbers change.
"""

import math
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from server.errors import MisplacedError
from server.live.drivers import Driven
from server.live.scoreboard import Score, Scoreboard
from server.live.settings import RECEIVING_SECONDS
from server.playground.schemas import (
    AnyChange,
    Choose,
    Moment,
    Playground,
    PlaygroundSettings,
    PutBox,
    PutCircle,
    Remove,
    Standing,
    Thing,
)
from sim.arenas import free_distance
from sim.arenas.document import to_arena
from sim.config import ArenaFile, Box, Circle, ImportedArenaConfig, Start, Target, TaskConfig
from workers.frames import Frame
from workers.job_protocol import PlayedPolicy, PlayJob
from workers.play_protocol import (
    MAX_ACTS,
    MAX_OBSTACLES,
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
from workers.scene.stage import StagePicture

_T = TypeVar("_T")
_DECIMALS = 3
# Of seconds: what a sum of steps may be off by.
_ROUNDING = 1e-6
# Frames that are remembered: what the picture may be behind, and twice as much.
_MOMENTS = 30
# What was seen coming lately: the picture may be of before the last time.
_SIGHTS = 4


@dataclass
class Ground:
    """A policy in an arena that its owner changes.

    Attributes:
        id: under which its live view goes.
        owner: who opened it (`owner_of`).
        title: of the policy.
        policy: which one.
        sha256: of its archive.
        task: robot and LiDAR.
        arena: what stands in it now.
    """

    id: str
    owner: str
    title: str
    policy: PlayedPolicy
    sha256: str
    task: TaskConfig
    arena: ArenaFile
    used_at: float = field(default_factory=time.monotonic)

    def __post_init__(self) -> None:
        self._lock = threading.Lock()
        # Of another server's playground of the same worker nothing is left: revisions begin at 1.
        self._revision, self._acts, self._settings = 1, tuple[NumberedAct, ...](), PlaygroundSettings()
        self._chosen = Choose()
        self._first = self.arena
        self._frame: Frame | None = None
        self._frame_at = float("-inf")
        self._scores = Scoreboard()
        # The newest last; the picture shows one of them.
        self._moments: deque[tuple[Frame, Score]] = deque(maxlen=_MOMENTS)
        self._sights: deque[PlaySeen] = deque(maxlen=_SIGHTS)
        self._shown: float | None = None

    # -- who watches ------------------------------------------------------------------------------------------------------

    @property
    def driven(self) -> Driven:
        """What a worker is asked to do for it."""
        return Driven(PlayJob(policy=self.policy, arena=self._first), self.sha256, f"Playground: {self.title}", self)

    @property
    def empty_task(self) -> TaskConfig:
        """The place without what stands in it, which the stage draws."""
        walls = self._first.model_copy(update={"circles": (), "boxes": ()})
        return self.task.model_copy(update={"arena": ImportedArenaConfig.of(walls)})

    # -- its worker -------------------------------------------------------------------------------------------------------

    def orders(self, revision: int) -> PlayOrders | None:
        """What a worker has to know that has those of `revision`; None where nothing is new."""
        with self._lock:
            if revision >= self._revision:
                return None
            settings = PlaySettings.model_validate(self._settings.model_dump(include=set(PlaySettings.model_fields)))
            return PlayOrders(revision=self._revision, arena=self.arena, settings=settings, acts=self._acts)

    def take_frame(self, frame: Frame) -> None:
        """A moment has arrived."""
        with self._lock:
            if self._frame is not None and frame.sim_time < self._frame.sim_time:
                # Another worker has begun anew.
                self._moments.clear()
                self._sights.clear()
                self._shown = None
            self._frame, self._frame_at = frame, time.monotonic()
            self.used_at = self._frame_at
            self._scores.update(frame)
            self._moments.append((frame, self._scores.score("live", None)))

    def take_seen(self, seen: PlaySeen) -> None:
        """What is about to happen has arrived."""
        with self._lock:
            self._sights.append(seen)

    # -- its owner --------------------------------------------------------------------------------------------------------

    def configure(self, settings: PlaygroundSettings) -> None:
        """Other settings."""
        with self._lock:
            self._settings = settings
            self._revision += 1

    def change(self, change: AnyChange) -> None:
        """Do what somebody wants, whether in the page or in the 3D view.

        Raises:
            MisplacedError: it can't be there, or there is no such thing.
        """
        with self._lock:
            self.used_at = time.monotonic()
            match change:
                case Choose():
                    self._chosen = self._known(change)
                case PutCircle():
                    self._put_circle(change)
                case PutBox():
                    self._put_box(change)
                case Remove():
                    self._remove(change)
                case PutRobot() | PutTarget() | PutMover():
                    self._check_place(change)
                    self._act(change)
                case Push() | Steps():
                    self._act(change)

    def view(self) -> Playground:
        """Everything for the page."""
        with self._lock:
            self.used_at = time.monotonic()
            seen = self._sights[-1] if self._sights else None
            return Playground(
                **self._moment().model_dump(),
                id=self.id,
                policy=self.title,
                geometry=self.arena,
                settings=self._settings,
                chosen=self._chosen,
                driving=time.monotonic() - self._frame_at < RECEIVING_SECONDS,
                problem=seen.problem if seen else None,
            )

    def moment(self) -> ArenaFile:
        """The arena as it stands, with the robot's place as the start and its target.

        Raises:
            MisplacedError: nothing has driven yet.
        """
        with self._lock:
            if self._frame is None:
                raise MisplacedError("The robot has not driven yet: wait until it does.")
            robot, target = _robot(self._frame), _target(self._frame)
            start = Start(x=robot.x, y=robot.y, heading=robot.heading)
            return self.arena.model_copy(update={"start": start, "target": Target(x=target.x, y=target.y)})

    def shown_moment(self) -> Moment:
        """What there is to say of the moment that the picture shows."""
        with self._lock:
            return self._moment()

    def _moment(self) -> Moment:
        """Of what is shown; of the newest where nothing is."""
        frame, score = self._shown_frame()
        seen = self._seen_by(frame)
        driven = frame.sim_time - seen.sim_time if frame is not None and seen is not None else 0.0
        step = max(0, int(driven / self.task.control_period + _ROUNDING))
        values = (seen.values or (seen.value,)) if seen is not None else ()
        over = seen is not None and seen.outcome is not None and driven > seen.seconds + self.task.control_period
        return Moment(
            sim_time=round(frame.sim_time, _DECIMALS) if frame else 0.0,
            robot=_robot(frame) if frame else None,
            target=_target(frame) if frame else None,
            movers=[_mover(row) for row in frame.movers] if frame else [],
            reward=round(float(frame.rewards[0]), _DECIMALS) if frame else 0.0,
            arrivals=score.arrivals,
            collisions=score.collisions,
            timeouts=score.timeouts,
            value=round(values[min(step, len(values) - 1)], _DECIMALS) if values else None,
            outcome=seen.outcome if seen else None,
            seconds=None
            if seen is None
            else seen.seconds
            if seen.outcome is None
            else round(max(0.0, seen.seconds - max(0.0, driven)), _DECIMALS),
            outdated=seen is None or seen.revision < self._revision or over,
        )

    def _shown_frame(self) -> tuple[Frame | None, Score]:
        """The newest of the moment that is shown, with how attempts had ended by then."""
        for frame, score in reversed(self._moments):
            if self._shown is None or frame.sim_time <= self._shown:
                return frame, score
        return self._frame, self._scores.score("live", None)

    def _seen_by(self, frame: Frame | None) -> PlaySeen | None:
        """What it saw coming then, or last before."""
        known = [seen for seen in self._sights if frame is None or seen.sim_time <= frame.sim_time + _ROUNDING]
        return known[-1] if known else self._sights[-1] if self._sights else None

    # -- the 3D view ------------------------------------------------------------------------------------------------------

    def shown(self, sim_time: float) -> None:
        """The picture is of that moment now."""
        with self._lock:
            self._shown = sim_time

    def picture(self) -> StagePicture:
        """What its stage draws."""
        with self._lock:
            seen = self._seen_by(self._shown_frame()[0])
            return StagePicture(
                circles=np.array([(c.x, c.y, c.radius) for c in self.arena.circles]).reshape(-1, 3),
                boxes=to_arena(self.arena).boxes,
                chosen=None if self._chosen.thing is None else (self._chosen.thing, self._chosen.index),
                way=np.array(seen.way if seen else ()).reshape(-1, 2),
                arrows=np.array(seen.arrows if seen and self._settings.field else ()).reshape(-1, 4),
                outcome=seen.outcome if seen else None,
            )

    def put(self, thing: str, index: int, x: float, y: float, heading: float) -> None:
        """Something was dragged in the 3D view; what can't be there stays where it was.

        Args:
            thing: see `Thing`.
            index: among those of its kind.
            x: metres.
            y: metres.
            heading: degrees; of a target, somebody who moves and a round obstacle it says nothing.
        """
        x, y, heading = (round(float(value), _DECIMALS) for value in (x, y, heading))
        if not all(map(math.isfinite, (x, y, heading))):
            return
        try:
            self.change(self._dragged(thing, index, x, y, heading))
        except (MisplacedError, ValueError, IndexError):
            # A hand that drags goes through walls, and past what is no longer there.
            return

    def choose(self, thing: str | None, index: int) -> None:
        """Something was clicked in the 3D view."""
        try:
            self.change(Choose.model_validate({"thing": thing, "index": index}))
        except (MisplacedError, ValueError):
            return

    # ---------------------------------------------------------------------------------------------------------------------

    def _dragged(self, thing: str, index: int, x: float, y: float, heading: float) -> AnyChange:
        if thing == "robot":
            return PutRobot(x=x, y=y, heading=heading)
        if thing == "target":
            return PutTarget(x=x, y=y)
        if thing == "mover":
            return PutMover(index=index, x=x, y=y)
        if thing == "circle":
            return PutCircle(index=index, x=x, y=y, radius=self.arena.circles[index].radius)
        box = self.arena.boxes[index]
        return PutBox(index=index, x=x, y=y, length=box.length, width=box.width, angle=heading)

    def _act(self, act: PutRobot | PutTarget | PutMover | Push | Steps) -> None:
        number = self._acts[-1].number + 1 if self._acts else 1
        self._acts = (*self._acts[1 - MAX_ACTS :], NumberedAct(number=number, act=act))
        self._revision += 1

    def _check_place(self, act: PutRobot | PutTarget | PutMover) -> None:
        room = float(free_distance(to_arena(self.arena), (act.x, act.y)))
        if isinstance(act, PutMover) and (self._frame is None or act.index >= len(self._frame.movers)):
            raise MisplacedError(f"There is nobody number {act.index + 1} who moves.")
        needed = self.task.robot.inscribed_radius if isinstance(act, PutRobot) else 0.0
        if room <= needed:
            raise MisplacedError(
                f"There is no room at ({act.x:g}, {act.y:g}): it is {max(room, 0.0):.2f} m from a wall or an obstacle."
            )

    def _put_circle(self, circle: PutCircle) -> None:
        placed = Circle(x=circle.x, y=circle.y, radius=circle.radius)
        self._within(circle.x, circle.y)
        circles = self._placed(self.arena.circles, circle.index, placed)
        self._now("circle", circle.index, len(circles), {"circles": circles})

    def _put_box(self, box: PutBox) -> None:
        placed = Box(x=box.x, y=box.y, length=box.length, width=box.width, angle=box.angle)
        self._within(box.x, box.y)
        boxes = self._placed(self.arena.boxes, box.index, placed)
        self._now("box", box.index, len(boxes), {"boxes": boxes})

    def _placed(self, things: tuple[_T, ...], index: int | None, thing: _T) -> tuple[_T, ...]:
        if index is None:
            if len(self.arena.circles) + len(self.arena.boxes) >= MAX_OBSTACLES:
                raise MisplacedError(f"There are {MAX_OBSTACLES} obstacles already: remove one first.")
            return (*things, thing)
        if index >= len(things):
            raise MisplacedError(f"There is no obstacle number {index + 1} of that kind.")
        return (*things[:index], thing, *things[index + 1 :])

    def _now(self, thing: Thing, index: int | None, count: int, update: dict[str, object]) -> None:
        self.arena = self.arena.model_copy(update=update)
        self._revision += 1
        if index is None:
            self._chosen = Choose(thing=thing, index=count - 1)

    def _within(self, x: float, y: float) -> None:
        if abs(x) > 0.5 * self.arena.width or abs(y) > 0.5 * self.arena.height:
            raise MisplacedError(f"({x:g}, {y:g}) is outside the walls.")

    def _remove(self, remove: Remove) -> None:
        name = "circles" if remove.thing == "circle" else "boxes"
        things = getattr(self.arena, name)
        if remove.index >= len(things):
            raise MisplacedError(f"There is no obstacle number {remove.index + 1} of that kind.")
        self.arena = self.arena.model_copy(update={name: (*things[: remove.index], *things[remove.index + 1 :])})
        self._chosen = Choose()
        self._revision += 1

    def _known(self, choice: Choose) -> Choose:
        movers = len(self._frame.movers) if self._frame else 0
        counts = {"mover": movers, "circle": len(self.arena.circles), "box": len(self.arena.boxes)}
        if choice.thing is not None and choice.index >= counts.get(choice.thing, 1):
            raise MisplacedError(f"There is no {choice.thing} number {choice.index + 1}.")
        return choice


def _robot(frame: Frame) -> Standing:
    x, y, heading = frame.poses[0].tolist()
    return Standing(x=round(x, _DECIMALS), y=round(y, _DECIMALS), heading=round(math.degrees(heading), 1))


def _target(frame: Frame) -> Standing:
    x, y = frame.targets[0].tolist()
    return Standing(x=round(x, _DECIMALS), y=round(y, _DECIMALS))


def _mover(row: "np.ndarray[tuple[int], np.dtype[np.float32]]") -> Standing:
    x, y, radius = (round(value, _DECIMALS) for value in row.tolist())
    return Standing(x=x, y=y, radius=radius)
