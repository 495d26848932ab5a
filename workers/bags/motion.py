"""What a recording tells of how a robot follows commands: delay, acceleration, top speeds, each with an interval of 95 %.

The model is that of the simulator (`sim.kernels.commands`): a command is followed after a delay, and no velocity changes
faster than its acceleration allows. Delay and acceleration are those with the least squares of measured less predicted
velocity, over a grid. The interval holds what fits about as well (profile likelihood), and what fits best to segments of
the recording drawn anew with replacement (bootstrap).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workers.bags.read import CLOCK, Bag, Commands, Motion, Reals
from workers.bags.results import Fitted

LONGEST_DELAY = 1.0
"""Seconds."""
_STEPS = 60_000
_FINEST = 0.01
_DELAYS = 51
_LEAST_SECONDS = 10.0
_SEGMENT_SECONDS = 5.0
_MOST_SEGMENTS = 60
_DRAWS = 400
_CHI_SQUARE = 3.84
"""Of one degree of freedom, 95 %."""
_HELD_SECONDS = 0.5
_BEYOND = 1.08
"""Commands of this many times a speed ask for more than it."""
_UNLIMITED = math.inf
_NOISE_FLOOR = 2e-3
"""Of a speed, as a share of its span: nothing is measured finer."""


@dataclass(frozen=True, eq=False)
class _Axis:
    """One velocity.

    Attributes:
        key, title, unit: of its acceleration.
        speed_key, speed_title, speed_unit: of its top speed.
        column: of velocities.
        accelerations: (k,) that are tried, the last one unlimited.
    """

    key: str
    title: str
    unit: str
    speed_key: str
    speed_title: str
    speed_unit: str
    column: int
    accelerations: Reals


_AXES = (
    _Axis(
        "robot.max_linear_acceleration",
        "Linear acceleration",
        "m/s²",
        "robot.max_linear_speed",
        "Top speed",
        "m/s",
        0,
        np.concatenate((np.geomspace(0.05, 10.0, 54), [_UNLIMITED])),
    ),
    _Axis(
        "robot.max_angular_acceleration",
        "Angular acceleration",
        "rad/s²",
        "robot.max_angular_speed",
        "Top turning rate",
        "rad/s",
        2,
        np.concatenate((np.geomspace(0.1, 30.0, 58), [_UNLIMITED])),
    ),
)


def fit_motion(bag: Bag) -> list[Fitted]:
    """Delay, accelerations and top speeds."""
    if bag.commands is None:
        reason = "Can't be told: there are no commands in the recording (geometry_msgs/Twist or TwistStamped)."
        found = [_unknown("command_delay", "Command delay", "s", reason)]
        found += [_unknown(axis.key, axis.title, axis.unit, reason) for axis in _AXES]
    else:
        found = _responses(bag.motion, bag.commands)
    return [*found, *(_top_speed(bag.motion, bag.commands, axis) for axis in _AXES)]


def _unknown(key: str, title: str, unit: str, reason: str) -> Fitted:
    return Fitted(key=key, title=title, unit=unit, value=None, low=None, high=None, note=reason)


@dataclass(frozen=True, eq=False)
class _Squares:
    """Squared errors of one velocity over the grid.

    Attributes:
        axis: which velocity.
        accelerations: (k,) that were tried.
        sums: (segments, delays, k) squared errors.
        counts: (segments,) of measurements.
        floor: squared error that is as good as none, of one measurement.
    """

    axis: _Axis
    accelerations: Reals
    sums: Reals
    counts: Reals
    floor: float


def _responses(motion: Motion, commands: Commands) -> list[Fitted]:
    """The delay, and an acceleration for each velocity that was commanded and changed."""
    start, end = max(motion.times[0], commands.times[0]), motion.times[-1]
    moving = [axis for axis in _AXES if _excited(motion, commands, axis)]
    why = None
    if end - start < _LEAST_SECONDS:
        why = f"Can't be told: commands and odometry go together for less than {_LEAST_SECONDS:.0f} s. Record for longer."
    elif not moving:
        why = (
            "Can't be told: commands hardly change, or the robot does not follow them. Record it as it starts, stops, turns."
        )
    if why is not None:
        return [_unknown("command_delay", "Command delay", "s", why)] + [
            _unknown(axis.key, axis.title, axis.unit, why) for axis in _AXES
        ]
    step = max(_FINEST, float(end - start) / _STEPS)
    delays = np.arange(0.0, LONGEST_DELAY + 1e-9, max(1, round(LONGEST_DELAY / (_DELAYS - 1) / step)) * step)
    squares = [_squares(motion, commands, axis, axis.accelerations, delays, start, step) for axis in moving]
    near, _ = _best(squares)
    delays = np.arange(max(0.0, delays[near] - 0.25), min(LONGEST_DELAY, delays[near] + 0.25) + 1e-9, step)
    squares = [_squares(motion, commands, each.axis, _around(each), delays, start, step) for each in squares]
    return _estimates(squares, delays, step)


def _excited(motion: Motion, commands: Commands, axis: _Axis) -> bool:
    asked, did = commands.velocities[:, axis.column], motion.velocities[:, axis.column]
    least = 0.05 if axis.column == 0 else 0.1
    changes = np.abs(np.diff(asked))
    return bool(np.ptp(did) > least and np.ptp(asked) > least and changes.sum() > 4.0 * least)


def _around(squares: _Squares) -> Reals:
    """Accelerations about the one that fits best, finely."""
    totals = squares.sums.sum(axis=0)
    best = squares.accelerations[int(np.argmin(totals.min(axis=0)))]
    if math.isinf(best):
        best = float(squares.accelerations[-2])
    return np.concatenate((best * np.geomspace(0.4, 2.5, 73), [_UNLIMITED]))


def _squares(
    motion: Motion,
    commands: Commands,
    axis: _Axis,
    accelerations: Reals,
    delays: Reals,
    start: float,
    step: float,
) -> _Squares:
    """Squared errors for every delay and acceleration, in each segment."""
    measured = np.flatnonzero(motion.times >= start)
    times, did = motion.times[measured], motion.velocities[measured, axis.column]
    ticks = np.arange(start, times[-1] + step, step)
    places = np.searchsorted(commands.times, ticks[:, None] - delays[None, :] + CLOCK, side="right") - 1
    asked = commands.velocities[np.maximum(places, 0), axis.column]
    count = int(np.clip((times[-1] - start) / _SEGMENT_SECONDS, 1, _MOST_SEGMENTS))
    segments = np.minimum(((times - start) / (times[-1] - start + 1e-9) * count).astype(int), count - 1)
    # Where it begins nobody knows what was commanded before.
    counted = times - start > LONGEST_DELAY + 0.5
    # Ticks before a measurement: it tells of the time that led there.
    before = np.searchsorted(ticks, times - CLOCK)
    sums, counts = np.zeros((count, len(delays), len(accelerations))), np.zeros(count)
    now, changes, tick = np.full(sums.shape[1:], float(did[0])), accelerations * step, 0
    for measurement in range(len(times)):
        while tick < before[measurement]:
            now = np.clip(asked[tick][:, None], now - changes, now + changes)
            tick += 1
        if counted[measurement]:
            sums[segments[measurement]] += (now - did[measurement]) ** 2
            counts[segments[measurement]] += 1.0
    return _Squares(axis, accelerations, sums, counts, (_NOISE_FLOOR * float(np.ptp(did))) ** 2)


def _best(squares: list[_Squares]) -> tuple[int, Reals]:
    """The delay that fits best, and how well each does: the profile of the likelihood, as a sum of squares."""
    profile = np.zeros(squares[0].sums.shape[1])
    for each in squares:
        totals = each.sums.sum(axis=0)
        profile += totals.min(axis=1) / _variance(each, totals)
    return int(np.argmin(profile)), profile


def _variance(squares: _Squares, totals: Reals) -> float:
    return max(float(totals.min()) / max(1.0, float(squares.counts.sum()) - 2.0), squares.floor)


def _estimates(squares: list[_Squares], delays: Reals, step: float) -> list[Fitted]:
    best, profile = _best(squares)
    fits = np.flatnonzero(profile - profile[best] <= _CHI_SQUARE)
    generator = np.random.default_rng(0)
    count = len(squares[0].counts)
    drawn_delays: list[float] = []
    drawn: dict[str, list[float]] = {each.axis.key: [] for each in squares}
    for _ in range(_DRAWS if count >= 4 else 0):
        rows = np.bincount(generator.integers(0, count, count), minlength=count).astype(float)
        profile_drawn = np.zeros(len(delays))
        totals = [np.tensordot(rows, each.sums, axes=(0, 0)) for each in squares]
        for each, total in zip(squares, totals, strict=True):
            profile_drawn += total.min(axis=1) / _variance(each, each.sums.sum(axis=0))
        at = int(np.argmin(profile_drawn))
        drawn_delays.append(delays[at])
        for each, total in zip(squares, totals, strict=True):
            drawn[each.axis.key].append(each.accelerations[int(np.argmin(total[at]))])
    low, high = _interval(drawn_delays, delays[fits])
    middle = float(np.mean(delays[profile - profile[best] <= 1e-6 * max(1.0, profile[best]) + 0.02]))
    delay = Fitted(
        key="command_delay",
        title="Command delay",
        unit="s",
        value=middle,
        low=max(0.0, low - step),
        high=high + step,
        note="From a command until the velocity that the odometry measures begins to follow it.",
    )
    found = {each.axis.key: _acceleration(each, drawn[each.axis.key], fits) for each in squares}
    return [delay] + [
        found.get(axis.key)
        or _unknown(axis.key, axis.title, axis.unit, "Can't be told: this velocity hardly changes in the recording.")
        for axis in _AXES
    ]


def _interval(drawn: list[float], fits: Reals) -> tuple[float, float]:
    """From the lowest to the highest of both: what fits, and 95 % of what was drawn."""
    values = np.sort(np.array(drawn)) if drawn else fits
    tail = int(0.025 * len(values))
    return float(min(values[tail], fits.min())), float(max(values[-1 - tail], fits.max()))


def _acceleration(squares: _Squares, drawn: list[float], delays: NDArray[np.int64]) -> Fitted:
    axis, tried = squares.axis, squares.accelerations
    totals = squares.sums.sum(axis=0)
    variance = _variance(squares, totals)
    profile = totals[delays].min(axis=0) / variance
    fits = tried[profile - profile.min() <= _CHI_SQUARE]
    low, high = _interval(drawn, fits)
    # Between two accelerations that are tried nobody looked.
    ratio = float(tried[1] / tried[0])
    told = {"key": axis.key, "title": axis.title, "unit": axis.unit, "low": low / ratio}
    if math.isinf(high):
        return Fitted(
            **told,
            value=None,
            high=None,
            note="No limit can be told: the robot follows commands about as fast as they come; it is at least this.",
        )
    value = float(tried[int(np.argmin(profile))])
    return Fitted(
        **told,
        value=value,
        high=high * ratio,
        note="The rate at which the measured velocity approaches what is commanded, speeding up and braking.",
    )


def _top_speed(motion: Motion, commands: Commands | None, axis: _Axis) -> Fitted:
    """The highest speed that was held for a while, and whether more was asked for."""
    speeds = motion.velocities[:, axis.column]
    usual = float(np.median(np.diff(motion.times)))
    width = max(3, round(_HELD_SECONDS / usual))
    if len(speeds) < width:
        width = 1
    held = np.abs(np.lib.stride_tricks.sliding_window_view(speeds, width).mean(axis=1))
    top = float(held.max())
    speeds = np.abs(speeds)
    # What the mean of so many measurements may be off by; the highest of many is more often too high.
    noise = 1.4826 * float(np.median(np.abs(np.diff(speeds)))) / math.sqrt(2.0)
    margin = 3.0 * noise / math.sqrt(width)
    told = {"key": axis.speed_key, "title": axis.speed_title, "unit": axis.speed_unit}
    least = 0.02 if axis.column == 0 else 0.05
    if top < least:
        return _unknown(**told, reason="Can't be told: the robot does not move this way in the recording.")
    if commands is not None:
        asked = np.abs(commands.at(motion.times - 0.5)[:, axis.column])
        recent = np.abs(commands.at(motion.times)[:, axis.column])
        with np.errstate(invalid="ignore"):
            limited = (np.minimum(asked, recent) > _BEYOND * top) & (speeds > 0.9 * top)
        if limited.sum() >= 10:
            there = speeds[limited]
            middle = float(np.median(there))
            error = 1.96 * 1.2533 * float(there.std()) / math.sqrt(len(there)) + _NOISE_FLOOR * middle
            return Fitted(
                **told, value=middle, low=middle - error, high=middle + error, note="More was asked for: it goes no faster."
            )
    return Fitted(
        **told,
        value=top,
        low=max(0.0, top - margin),
        high=None,
        note="The fastest in the recording; more was not asked for.",
    )
