"""All that is told of a recording at once: the scene, what was fitted, and which settings a training gets from it."""

import math
from pathlib import Path

import numpy as np

from sim.config import TaskConfig
from sim.config.sensing import MAX_DELAY
from workers.bags.motion import fit_motion
from workers.bags.read import Bag, Reals, read_bag
from workers.bags.results import MAX_MOMENTS, MAX_POINTS, BagReading, Fitted, LidarFacts, Setting, TopicChoice
from workers.bags.sensing import fit_sensing

_MOST_SCANS, _MOST_RAYS = 600, 90
_SQUARE = 0.05
"""Points nearer than this are drawn as one, metres."""
_LEAST_VIEW = 180.0
"""Degrees that trainings look at unless they are told otherwise: a LiDAR that sees less says so."""
_MOST: dict[str, float] = {
    "lidar.range": 30.0,
    "lidar.noise": 0.5,
    "lidar.dropout": 0.9,
    "lidar.rate": 100.0,
    "robot.max_linear_speed": 3.0,
    "robot.max_angular_speed": 6.0,
    "robot.max_linear_acceleration": 100.0,
    "robot.max_angular_acceleration": 100.0,
}
"""That a task may have of each."""


def tell(path: Path, choice: TopicChoice, scratch: Path) -> BagReading:
    """Read a recording, fit and draw it.

    Raises:
        BagError: see `read_bag`.
    """
    bag = read_bag(path, choice, scratch)
    fitted = (*fit_sensing(bag), *fit_motion(bag))
    facts = _facts(bag)
    motion, scans = bag.motion, bag.scans
    moments = _some(len(motion.times), MAX_MOMENTS)
    times = motion.times[moments]
    asked = bag.commands.at(times) if bag.commands is not None else np.full((len(times), 3), np.nan)
    kept, rays = _some(len(scans.times), _MOST_SCANS), _some(len(scans.bearings), _MOST_RAYS)
    ranges, met = scans.ranges[np.ix_(kept, rays)], scans.met()[np.ix_(kept, rays)]
    return BagReading(
        seconds=round(bag.seconds, 3),
        topics=bag.topics,
        notes=bag.notes,
        times=_rounded(times),
        path=tuple((x, y, heading) for x, y, heading in np.round(motion.poses[moments], 3).tolist()),
        forwards=_rounded(motion.velocities[moments, 0]),
        turning=_rounded(motion.velocities[moments, 2]),
        asked_forwards=_known(asked[:, 0]),
        asked_turning=_known(asked[:, 2]),
        points=_points(bag),
        scan_times=_rounded(scans.times[kept]),
        scan_bearings=tuple(np.round(scans.bearings[rays], 4).tolist()),
        scans=tuple(_known(np.where(hits, row, np.nan)) for hits, row in zip(met, ranges, strict=True)),
        lidar_at=scans.at,
        goals=tuple((t, x, y) for t, x, y in np.round(bag.goals, 3).tolist()),
        lidar=facts,
        fitted=fitted,
        settings=tuple(settings_of(fitted, facts)),
    )


def _some(count: int, most: int) -> Reals:
    """Places of at most so many, evenly spread, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


def _rounded(numbers: Reals) -> tuple[float, ...]:
    return tuple(np.round(numbers, 3).tolist())


def _known(numbers: Reals) -> tuple[float | None, ...]:
    return tuple(None if math.isnan(number) else round(number, 2) for number in numbers.astype(float).tolist())


def _facts(bag: Bag) -> LidarFacts:
    bearings = bag.scans.bearings
    middle = math.degrees(0.5 * (bearings[0] + bearings[-1]))
    return LidarFacts(
        beams=len(bearings),
        field_of_view=round(min(360.0, math.degrees(abs(bearings[-1] - bearings[0]))), 1),
        looks=round((middle + 180.0) % 360.0 - 180.0, 1),
        range=round(bag.scans.range_max, 2),
    )


def _points(bag: Bag) -> tuple[tuple[float, float], ...]:
    """What the LiDAR met, in the odometry's frame."""
    scans = bag.scans
    inside = np.flatnonzero((scans.times >= bag.motion.times[0]) & (scans.times <= bag.motion.times[-1]))
    if not len(inside):
        return ()
    kept = inside[_some(len(inside), _MOST_SCANS)]
    poses = bag.motion.pose_at(scans.times[kept])
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    ahead, aside = scans.at
    x, y = poses[:, 0] + cos * ahead - sin * aside, poses[:, 1] + sin * ahead + cos * aside
    angles = poses[:, 2][:, None] + scans.bearings[None, :]
    met = scans.met()[kept]
    ranges = np.where(met, scans.ranges[kept], 0.0)
    found = np.stack((x[:, None] + ranges * np.cos(angles), y[:, None] + ranges * np.sin(angles)), axis=-1)[met]
    square = _SQUARE
    while True:
        cells = np.unique(np.round(found / square).astype(np.int64), axis=0)
        if len(cells) <= MAX_POINTS:
            return tuple((px, py) for px, py in np.round(cells * square, 2).tolist())
        square *= 1.5


def settings_of(fitted: tuple[Fitted, ...], facts: LidarFacts) -> list[Setting]:
    """What a training begins with, of what is known; the rest stays as the form has it."""
    period = TaskConfig().control_period
    found = [Setting(path=("lidar", "range"), title="LiDAR range", value=min(facts.range, _MOST["lidar.range"]))]
    if facts.field_of_view < _LEAST_VIEW - 1.0:
        found.append(Setting(path=("lidar", "field_of_view"), title="LiDAR field of view", value=facts.field_of_view))
    for each in fitted:
        if each.key == "command_delay" and each.low is not None and each.high is not None:
            least, most = (min(MAX_DELAY, steps) for steps in (int(each.low / period + 1e-6), math.ceil(each.high / period)))
            # A delay is a whole number of steps: trainings draw one of those on either side.
            found.append(
                Setting(path=("randomisation", "command_delay"), title="Command delay (control steps)", value=(least, most))
            )
        elif each.value is not None and each.key in _MOST:
            value = float(f"{min(each.value, _MOST[each.key]):.4g}")
            found.append(Setting(path=tuple(each.key.split(".")), title=each.title, value=value))
    return found
