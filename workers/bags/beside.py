"""What a policy would have done in a robot's recording: the program that drives robots, fed message by message.

The robot did something else, and went elsewhere: at every moment the policy sees what the robot saw there, is told the speed
that the robot had, and its command goes nowhere. What it commanded last, and what it remembers, are its own.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from sim.arrays import Floats
from workers.bags.read import Bag, Reals
from workers.bags.results import BagBeside, Parting
from workers.checkpoints import read_policy
from workers.errors import BagError
from workers.export.graph import observation_graph
from workers.export.ros2.mapless_navigator.navigator import Command, Navigator, Safety, State
from workers.export.ros2.mapless_navigator.observation import Scan, ray_angles, wrap
from workers.export.ros2.mapless_navigator.policy import Policy, Specification, read_safetensors
from workers.export.specification import pack_weights, specify, specify_task
from workers.job_protocol import PlayedPolicy, UploadedPolicy
from workers.onnx_policy import OnnxPolicy
from workers.wording import counted

MAX_COMMANDS = 36_000
"""Of one comparison: two hours of a policy that commands five times a second."""

_IDLE = (State.NO_GOAL, State.ARRIVED, State.NO_ODOMETRY, State.STALE_ODOMETRY, State.NO_SCAN, State.STALE_SCAN)
"""What the policy says nothing in."""
_STATES = tuple(State)
# How far ahead it is looked where both would be, and how long there is no other parting about one.
_AHEAD_SECONDS = 1.0
_AROUND_SECONDS = 1.5
# Of a robot, metres before its middle: who turns away on the spot parts, too.
_NOSE = 0.3
# Nearer to one another than this they do not part, metres.
_PARTED = 0.1
_MOST_PARTINGS = 10


class _Foreign(Policy):
    """Somebody's ONNX file, as the robot's program takes a policy."""

    def __init__(self, graph: bytes, policy: UploadedPolicy) -> None:
        assert policy.task is not None
        self.specification = specify_task(policy.task, "onnx", None, b"")
        self._foreign = OnnxPolicy(graph, policy.task)

    def memory(self, robots: int) -> Floats:
        """See `Policy.memory`."""
        return np.zeros((robots, self._foreign.memory_size), np.float32)

    def step(self, observations: Floats, memory: Floats) -> tuple[Floats, Floats]:
        """See `Policy.step`."""
        return self._foreign.step(observations, memory)


def robots_policy(archive: Path, policy: PlayedPolicy) -> Policy:
    """A policy as it runs on a robot.

    Raises:
        ArchiveError: the archive is not one that this release reads.
        ExportError: it can't leave for a robot.
        ForeignPolicyError: an uploaded one can't be run.
    """
    if isinstance(policy, UploadedPolicy):
        return _Foreign(archive.read_bytes(), policy)
    manifest, read = read_policy(archive)
    weights = pack_weights(read.weights)
    specification = specify(manifest, read.description, weights)
    graph = b"" if specification.formula else observation_graph(read, specification, manifest)
    return Policy(specification, read_safetensors(weights), graph)


def beside(bag: Bag, policy: Policy, name: str, progress: Callable[[float], None]) -> BagBeside:
    """Hold a policy beside what a robot did.

    Args:
        bag: the recording.
        policy: as it runs on a robot.
        name: of the policy, for people.
        progress: told the share that is done, 0 to 1.

    Raises:
        BagError: it needs a second LiDAR.
        PolicyFileError: it sees what only an extension's code makes.
    """
    specification = policy.specification
    if len(specification.mounts) > 1:
        raise BagError("this policy looks through two LiDARs, and a recording is read with one: choose another policy")
    period = specification.control_period
    start = max(bag.scans.times[0], bag.motion.times[0])
    times = start + period * np.arange(max(1, int((bag.seconds - start) / period) + 1))
    notes = _notes(bag, specification)
    if len(times) > MAX_COMMANDS:
        times = times[:MAX_COMMANDS]
        notes.append(
            f"The recording is longer than {counted(MAX_COMMANDS)} commands of this policy: the first of them are shown."
        )
    commands = _commands(bag, policy, times, progress)
    would = np.array([(each.linear, each.angular) for each in commands])
    did = _did(bag, times, period)
    states = tuple(_STATES.index(each.state) for each in commands)
    told = np.array([each.state not in _IDLE for each in commands])
    furthest = _AHEAD_SECONDS * (specification.max_linear_speed + float(np.abs(did[:, 0]).max())) + 2.0 * _NOSE
    apart = _apart(np.where(told[:, None], would, did), did, period)
    return BagBeside(
        policy=name,
        period=period,
        notes=tuple(notes),
        times=_rounded(times),
        forwards=_rounded(would[:, 0]),
        turning=_rounded(would[:, 1]),
        did_forwards=_rounded(did[:, 0]),
        did_turning=_rounded(did[:, 1]),
        states=states,
        reasons=tuple(state.value for state in _STATES),
        driving=tuple(each.state is State.DRIVING for each in commands),
        partings=tuple(_partings(times, apart, period, furthest)),
    )


def _rounded(numbers: Reals) -> tuple[float, ...]:
    return tuple(np.round(numbers, 3).tolist())


def _commands(bag: Bag, policy: Policy, times: Reals, progress: Callable[[float], None]) -> list[Command]:
    """One for each of the times."""
    scans, motion = bag.scans, bag.motion
    # Bearings are against the heading already, however the LiDAR is mounted.
    safety = replace(Safety.of(policy.specification), sensor_yaw=0.0, second_sensor_yaw=0.0)
    navigator = Navigator(policy, safety)
    angle_min, increment = float(scans.bearings[0]), float(scans.bearings[1] - scans.bearings[0])
    newest_scans = np.searchsorted(scans.times, times, side="right") - 1
    newest_poses = np.searchsorted(motion.times, times, side="right") - 1
    goal, found = 0, []
    for number, now in enumerate(times.tolist()):
        scan, at = int(newest_scans[number]), int(newest_poses[number])
        measured = Scan(angle_min, increment, scans.range_min, scans.range_max, scans.ranges[scan].astype(np.float64))
        navigator.set_scan(float(scans.times[scan]), measured)
        x, y, heading = motion.poses[at].tolist()
        forwards, left, turning = motion.velocities[at].tolist()
        navigator.set_odometry(float(motion.times[at]), x, y, heading, (forwards, left, turning))
        while goal < len(bag.goals) and bag.goals[goal, 0] <= now:
            navigator.set_goal(float(bag.goals[goal, 1]), float(bag.goals[goal, 2]))
            goal += 1
        found.append(navigator.command(now))
        progress(number / len(times))
    return found


def _did(bag: Bag, times: Reals, period: float) -> Reals:
    """(n, 2) mean measured velocities, forwards and turning, in the period after each of the times."""
    motion = bag.motion
    first, last = (np.searchsorted(motion.times, edge, side="right") for edge in (times, times + period))
    found = np.empty((len(times), 2))
    for out, column in enumerate((0, 2)):
        values = motion.velocities[:, column]
        sums = np.concatenate(([0.0], np.cumsum(values)))
        counts = last - first
        nearby = np.interp(times + period, motion.times, values)
        found[:, out] = np.where(counts > 0, (sums[last] - sums[first]) / np.maximum(counts, 1), nearby)
    return found


def _notes(bag: Bag, specification: Specification) -> list[str]:
    """What is not as the policy needs it, or knew it."""
    notes, scans = [], bag.scans
    rays = wrap(ray_angles(specification) + specification.mounts[0][2])
    gaps = np.abs(wrap(rays[:, None] - scans.bearings[None, :])).min(axis=1)
    missing = int((gaps > Safety.of(specification).max_gap).sum())
    covered = math.degrees(abs(scans.bearings[-1] - scans.bearings[0]))
    if missing:
        notes.append(
            f"{missing} of the {len(rays)} rays of this policy, over {math.degrees(specification.field_of_view):.0f}°, "
            f"have no beam of this LiDAR, which covers {covered:.0f}°: the robot's program would stand still."
        )
    if scans.range_max < specification.range - 0.05:
        notes.append(
            f"This policy was trained to see {specification.range:g} m; this LiDAR sees {scans.range_max:g} m, and what is "
            "further away is taken for free."
        )
    fastest = float(np.abs(bag.motion.velocities[:, 0]).max())
    if fastest > 1.1 * specification.max_linear_speed:
        notes.append(
            f"The robot drove up to {fastest:.2f} m/s; this policy goes {specification.max_linear_speed:g} m/s at most."
        )
    if specification.drive != "differential":
        notes.append(
            f"This policy is for a robot with another drive ({specification.drive}): only two of its numbers are shown."
        )
    return notes


def _apart(would: Reals, did: Reals, period: float) -> Reals:
    """(n,) metres between the noses of both, a second after each moment: what was commanded from then on, and what was done.

    Both begin where the robot was, and follow their velocities at once. At the end of the recording the second is shorter.

    Args:
        would: (n, 2) the policy's commands, forwards and turning; what the robot did where it commands nothing.
        did: (n, 2) the robot's velocities.
        period: seconds between two of them.
    """
    between = _nose_after(would, period) - _nose_after(did, period)
    return np.hypot(between[:, 0], between[:, 1])


def _nose_after(velocities: Reals, period: float) -> Reals:
    """(n, 2) where the nose of a robot is that stood at the origin a second before, facing along x."""
    steps = max(1, math.ceil(_AHEAD_SECONDS / period - 1e-9))
    place, heading = np.zeros((len(velocities), 2)), np.zeros(len(velocities))
    for step in range(steps):
        lasts = min(period, _AHEAD_SECONDS - step * period)
        # Behind the last moment nothing is known of either.
        then = np.zeros_like(velocities)
        then[: len(velocities) - step] = velocities[step:]
        middle = heading + 0.5 * lasts * then[:, 1]
        place += lasts * then[:, :1] * np.column_stack([np.cos(middle), np.sin(middle)])
        heading += lasts * then[:, 1]
    nose: Reals = place + _NOSE * np.column_stack([np.cos(heading), np.sin(heading)])
    return nose


def _partings(times: Reals, apart: Reals, period: float, furthest: float) -> list[Parting]:
    """The moments from which they come furthest apart, none near another; the furthest first."""
    left = apart.copy()
    around = max(1, round(_AROUND_SECONDS / period))
    found: list[Parting] = []
    while len(found) < _MOST_PARTINGS and len(left) and left.max() > _PARTED:
        at = int(np.argmax(left))
        start, end = max(0, at - around), min(len(times), at + around + 1)
        found.append(
            Parting(
                at=round(float(times[at]), 3),
                start=round(float(times[start]), 3),
                end=round(float(times[end - 1]), 3),
                metres=round(float(left[at]), 2),
                share=min(1.0, round(float(left[at]) / furthest, 3)),
            )
        )
        left[max(0, at - 2 * around) : end + around] = 0.0
    return found
