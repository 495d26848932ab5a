"""What a step gives today, bit for bit: rewards, observations, movers and disturbances as they were when this was recorded.

Whoever writes the step anew proves with these that nothing has changed; `tests.references` says what other processors do.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sim.arenas import build_task_arenas
from sim.config import TaskConfig
from sim.engine.plain import PlainWorld
from sim.envs.point_goal import PointGoalVectorEnv
from sim.envs.vector import NavigationVectorEnv
from sim.kernels.records import ARRIVAL
from tests.references import check, digest

FILE = Path(__file__).parent / "references.json"
ROBOTS, STEPS, PART = 24, 120, 20

COMPLEX = {"name": "complex"}
CROWDED = [{"count": 6, "kind": kind, "speed": 1.0} for kind in ("pedestrian", "walker", "patrol")]
EVERYTHING = {
    "lidar": {"noise": 0.02, "dropout": 0.05, "rate": 2.5},
    "odometry": {"distance_noise": 0.1, "heading_noise": 0.2},
    "randomisation": {
        "range": [1.0, 3.5],
        "field_of_view": [120.0, 180.0],
        "rate": [1.0, 5.0],
        "noise": [0.0, 0.03],
        "dropout": [0.0, 0.1],
        "distance_noise": [0.0, 0.2],
        "heading_noise": [0.0, 0.3],
        "command_delay": [0, 3],
        "max_linear_speed": [0.15, 0.3],
        "max_angular_speed": [0.5, 1.5],
    },
}
# Paths are short and limits low, so that every outcome occurs.
SHORT = {"step_limit": 60, "arrival_distance": 1.0}

CASES: dict[str, dict[str, Any]] = {
    **{
        f"{observation} observation, {reward} reward": {"observation": observation, "reward": {"name": reward}}
        for observation in ("paper", "improved")
        for reward in ("basic", "clearance", "alignment")
    },
    "four frames": {"frames": 4},
    "paper's frames": {"frames": 2, "observation": "paper"},
    "other coefficients": {
        "reward": {"name": "clearance", "arrival": 7.0, "collision": -3.0, "progress": 11.0, "penalty": 0.5},
        "collision_distance": 0.3,
    },
    "sixty rays around": {"lidar": {"rays": 60, "batches": 20, "field_of_view": 360.0, "range": 6.0}},
    **{f"movers, {movers['kind']}": {"arena": COMPLEX | {"movers": movers}} for movers in CROWDED},
    "disturbances": EVERYTHING,
    "disturbances, paper observation, alignment reward": EVERYTHING
    | {"observation": "paper", "reward": {"name": "alignment"}, "frames": 3},
    "a rectangular robot in generated maps": {
        "robot": {"name": "jackal"},
        "arena": {"name": "clutter", "maps": 3, "seed": 5, "movers": CROWDED[0]},
        "collision_distance": 0.0,
    },
    "limits of acceleration": {"robot": {"name": "waffle", "max_linear_acceleration": 0.3, "max_angular_acceleration": 1.0}},
    "a late command": {"command_delay": 2},
}


def actions(seed: int) -> np.ndarray:
    """Commands that a robot keeps for a second or so, (STEPS, ROBOTS, 2): it comes far, and turns."""
    drawn = np.random.default_rng(seed).uniform([0.2, -0.6], [1.0, 0.6], (STEPS // 6, ROBOTS, 2))
    return np.repeat(drawn, 6, axis=0).astype(np.float32)


def steered(envs: NavigationVectorEnv, action: np.ndarray) -> np.ndarray:
    """The same commands, but for every other robot, which drives straight to its target: it arrives, or meets something."""
    (dx, dy), heading = (envs.targets - envs.poses[:, :2]).T, envs.poses[:, 2]
    bearing = np.arctan2(dy, dx) - heading
    towards = np.stack([np.ones(ROBOTS), np.clip(2.0 * np.arctan2(np.sin(bearing), np.cos(bearing)), -1.0, 1.0)], axis=1)
    return np.where(np.arange(ROBOTS)[:, None] % 2 == 0, towards, action).astype(np.float32)


def four_terms(envs: NavigationVectorEnv) -> NDArray[np.float32]:
    """The terms of one of the paper's rewards as they were when every reward had four: the basic one's penalty was zero."""
    terms = np.zeros((ROBOTS, 4), np.float32)
    terms[:, : envs.reward_terms.shape[1]] = envs.reward_terms
    return terms


def steps(envs: NavigationVectorEnv) -> tuple[list[str], set[int]]:
    """A hash for every `PART` steps, and the outcomes that occurred."""
    observations, _ = envs.reset(seed=11)
    found: list[NDArray[np.generic]] = [observations]
    outcomes: set[int] = set()
    hashes: list[str] = []
    for number, action in enumerate(actions(7), start=1):
        observations, rewards, terminations, truncations, _ = envs.step(steered(envs, action))
        found += [observations, rewards, terminations, truncations]
        found += [envs.final_observations.copy(), four_terms(envs), envs.outcomes.copy()]
        found += [envs.poses.copy(), envs.targets.copy(), envs.ranges.copy(), envs.discs.copy(), envs.velocities()]
        outcomes |= set(envs.outcomes.tolist())
        if number % PART == 0:
            hashes.append(digest(found))
            found = []
    state = envs.get_state() | {"terms": four_terms(envs)}
    return [*hashes, digest([array for _, array in sorted(state.items())])], outcomes


@pytest.mark.parametrize("name", CASES)
def test_steps_are_those_that_were_recorded(name: str) -> None:
    task = TaskConfig.model_validate({"arena": COMPLEX, **SHORT, **CASES[name]})
    hashes, outcomes = steps(NavigationVectorEnv(task, ROBOTS))
    assert outcomes >= {0, 1}
    assert len(outcomes) > 2
    check(FILE, name, hashes, lambda: hold_against_the_plain_twin(task))


def test_a_point_goals_steps_are_those_that_were_recorded() -> None:
    task = TaskConfig.model_validate({"arena": COMPLEX, **SHORT})
    hashes, outcomes = steps(PointGoalVectorEnv(task, ROBOTS, max_episode_steps=60))
    assert outcomes == {0, 1, 2, 3}
    check(FILE, "point goal", hashes, lambda: hold_against_the_plain_twin(task))


def hold_against_the_plain_twin(task: TaskConfig) -> None:
    """Robots of the task without movers, disturbances and frames, each beside its `PlainWorld`, to their first end."""
    plain_task = TaskConfig.model_validate(
        {
            "arena": COMPLEX,
            "observation": task.observation,
            "reward": task.reward,
            "lidar": {"rays": task.lidar.rays, "field_of_view": task.lidar.field_of_view},
            **SHORT,
        }
    )
    envs = NavigationVectorEnv(plain_task, ROBOTS)
    envs.reset(seed=11)
    arena = build_task_arenas(plain_task)[0]
    poses, targets = envs.poses.astype(float).tolist(), envs.targets.astype(float).tolist()
    twins = [PlainWorld(plain_task, arena, tuple(pose), tuple(target)) for pose, target in zip(poses, targets, strict=True)]
    going = set(range(ROBOTS))
    for drawn in actions(7):
        action = steered(envs, drawn)
        before = {i: twins[i].distance for i in going}
        observations, rewards, *_ = envs.step(action)
        for i in sorted(going):
            expected = twins[i].step(*action[i].tolist())
            seen = envs.final_observations[i] if envs.outcomes[i] > ARRIVAL else observations[i]
            if envs.outcomes[i] or expected.outcome != "none":
                going.discard(i)
                continue
            # A ray may graze an edge, a bearing of half a turn round to either side: most numbers are what they should be.
            assert np.mean(np.abs(seen - expected.observation) < 1e-3) >= 0.8
            assert rewards[i] == pytest.approx(expected.reward, abs=0.05 + 0.02 * abs(before[i] - twins[i].distance) * 500.0)


@pytest.mark.parametrize("name", [name for name in CASES if "reward" in name])
def test_the_plain_twin_agrees_where_nothing_is_recorded(name: str) -> None:
    hold_against_the_plain_twin(TaskConfig.model_validate({"arena": COMPLEX, **SHORT, **CASES[name]}))
