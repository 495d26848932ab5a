"""The Dynamic Window Approach (Fox, Burgard and Thrun 1997): the classical local planner that policies are compared with.

From its full scan (a policy sees the minima of batches only) it predicts the arcs of a grid of commands of the robot's own
drive and drives the best of those that keep clear. It knows no map and has no memory, so it can get stuck where the way
leads away from the target.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sim.actions import action_layout, twists
from sim.config import AckermannDrive, AnyRobotConfig, OmnidirectionalDrive, TaskConfig
from sim.kernels.window import choose_all
from sim.lidar import drawn_ray_angles, ray_origins
from sim.suites import Situation

Floats = NDArray[np.float32]

HORIZON = 2.4
"""Seconds that an arc is looked ahead."""

MARGIN = 0.04
"""Metres that an arc keeps from obstacles on top of the collision distance."""

LINEAR_SAMPLES, BACKWARD_SAMPLES, LATERAL_SAMPLES = 5, 2, 5
TURNING_SAMPLES = 15
"""Speeds forwards, backwards where the robot reverses, to the sides, and turning rates or steering angles that are tried."""

# Weights of the objective, the best of eight tried on random clutter that is in no suite (docs/suites.md).
HEADING, CLEARANCE, SPEED, PROGRESS = 0.1, 0.3, 0.1, 1.0


def dynamic_window(
    task: TaskConfig, weights: tuple[float, float, float, float] = (HEADING, CLEARANCE, SPEED, PROGRESS)
) -> Callable[[Situation], Floats]:
    """The planner as a controller for `sim.suites.run_controller`.

    Args:
        task: its robot, LiDAR and limits.
        weights: of heading, clearance, speed and progress in the objective.
    """
    angles = drawn_ray_angles(task.lidar, [task.lidar.field_of_view])[0]
    centred = task.lidar.mount.name == "centre"
    leftward = np.arange(len(angles)) >= len(angles) // 2 if centred else np.sin(angles) > 0.0
    rays = angles, ray_origins(task.lidar, [(0.0, 0.0, 0.0)])[0], leftward
    grid = _grid(task.robot)
    keep = task.passable_clearance + MARGIN
    steps = max(1, round(HORIZON / task.control_period))

    def act(situation: Situation) -> Floats:
        dx, dy = (situation.targets - situation.poses[:, :2]).astype(np.float64).T
        bearing = np.arctan2(dy, dx) - situation.poses[:, 2]
        actions = np.zeros((len(situation.poses), action_layout(task.robot).size), dtype=np.float32)
        choose_all(
            situation.ranges,
            task.lidar.range,
            rays,
            np.stack([bearing, np.hypot(dx, dy)], axis=1),
            grid,
            task.robot.max_linear_speed,
            task.control_period,
            steps,
            keep,
            np.array(weights),
            actions,
        )
        return actions

    return act


def _grid(robot: AnyRobotConfig) -> tuple[Floats, NDArray[np.float64], NDArray[np.float64], Floats]:
    """What is tried of a drive's commands, see `sim.kernels.window.choose_all`."""
    drive = robot.drive
    forwards = np.arange(1, LINEAR_SAMPLES + 1) / LINEAR_SAMPLES
    backwards = -drive.reverse * np.arange(1, BACKWARD_SAMPLES + 1) / BACKWARD_SAMPLES if drive.reverse else np.empty(0)
    turning = 2.0 * np.arange(TURNING_SAMPLES) / (TURNING_SAMPLES - 1) - 1.0
    linear = np.concatenate([forwards, backwards])
    axes = [linear, turning]
    stuck = np.array([[0.0, 1.0], [0.0, -1.0]], dtype=np.float32)
    if isinstance(drive, OmnidirectionalDrive):
        axes = [np.concatenate([[0.0], linear]), np.linspace(-1.0, 1.0, LATERAL_SAMPLES), turning]
        stuck = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]], dtype=np.float32)
    if isinstance(drive, AckermannDrive) and drive.reverse:
        # A car cannot turn on the spot: it backs away, with its nose towards the side with more room.
        stuck = np.array([[-drive.reverse, -1.0], [-drive.reverse, 1.0]], dtype=np.float32)
    commands = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    motions = twists(robot, commands)
    moves = np.hypot(motions[:, 0], motions[:, 1]) > 0.0
    commands, motions = commands[moves], motions[moves]
    shares = commands[:, 0].copy()
    if isinstance(drive, OmnidirectionalDrive):
        shares = np.minimum(np.hypot(motions[:, 0], motions[:, 1]) / robot.max_linear_speed, 1.0)
    return commands.astype(np.float32), motions, shares, stuck
