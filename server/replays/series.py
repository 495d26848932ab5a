"""What the charts beside a replay show: a robot's episode as numbers over time."""

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from server.replays.schemas import ChartedSeries, ChartName
from sim.actions import ActionComponent, action_layout
from sim.config import TaskConfig
from sim.lidar import drawn_ray_angles
from workers.replays.recording import Track

MAX_POINTS = 600
"""Of each series; a longer episode is shown by moments evenly apart."""
# A ray looks ahead where it points no further to either side; where none does, the one that comes nearest stands for them.
_AHEAD = np.radians(15.0)
_DIGITS = 4


def times(track: Track, task: TaskConfig) -> list[float]:
    """Seconds since the start, of each point of `series_of`."""
    return [round(float(moment) * task.control_period, _DIGITS) for moment in _kept(track)]


def series_of(track: Track, task: TaskConfig) -> list[ChartedSeries]:
    """All that is charted of an episode, `MAX_POINTS` numbers each at most; the first and the last moment are among them.

    Args:
        track: what the robot did.
        task: robot, LiDAR and reward.
    """
    kept = _kept(track)
    forwards, left, turning = track.twists.T
    found: list[tuple[ChartName, str, str, NDArray[np.floating]]] = []
    found.append(("ahead", "range ahead", "m", _range_ahead(track, task)))
    for component, asked in zip(action_layout(task.robot).components, track.commands.T, strict=True):
        found.append((_chart(component), "asked for", component.unit.rstrip(","), asked))
    found.append(("linear", "driven", "m/s", forwards))
    if left.any():
        found.append(("lateral", "driven", "m/s", left))
    found.append(("turning", "driven", "rad/s", turning))
    found.append(("value", "return to come", "", track.values()))
    found.append(("reward", "all", "", track.terms.sum(axis=1)))
    found += [("reward", name, "", term) for name, term in zip(_term_names(task), track.terms.T, strict=True)]
    return [
        ChartedSeries(chart=chart, name=name, unit=unit, values=[round(float(value), _DIGITS) for value in values[kept]])
        for chart, name, unit, values in found
    ]


def _kept(track: Track) -> NDArray[np.int64]:
    last = len(track.poses) - 1
    return np.unique(np.linspace(0, last, min(MAX_POINTS, last + 1)).round().astype(np.int64))


def _chart(component: ActionComponent) -> ChartName:
    return "turning" if component.name == "angular" else component.name


def _range_ahead(track: Track, task: TaskConfig) -> NDArray[np.float32]:
    angles = drawn_ray_angles(task.lidar, track.fields_of_view)
    aside = np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi)
    ahead = aside <= np.maximum(_AHEAD, aside.min(axis=1, keepdims=True))
    nearest: NDArray[np.float32] = np.where(ahead, track.ranges, np.inf).min(axis=1)
    return nearest


def _term_names(task: TaskConfig) -> list[str]:
    """Of the reward's terms; of several of one name, each with its number."""
    names = [term.name for term in task.reward.terms]
    many, met = Counter(names), Counter[str]()
    for place, name in enumerate(names):
        met[name] += 1
        if many[name] > 1:
            names[place] = f"{name} {met[name]}"
    return names
