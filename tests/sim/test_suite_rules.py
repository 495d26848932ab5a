"""What a suite asks of a robot is said in words, and what differs with it."""

import pytest

from sim.config import CentredMount, JackalConfig, LidarConfig, SingleMount, TaskConfig
from sim.errors import SuiteError
from sim.suite_rules import SuiteLidar, SuiteRules, frozen_rules
from sim.suites import load_suite


def reason(rules: SuiteRules, task: TaskConfig) -> str:
    with pytest.raises(SuiteError) as refused:
        rules.check("mine-9", task)
    return str(refused.value)


def test_rules_of_a_frozen_suite_are_read_without_its_arenas() -> None:
    for name in ("barn-jackal-300", "simple-200"):
        assert frozen_rules(name) == load_suite(name).rules


def test_another_robot_is_named_and_one_of_the_same_name_by_what_differs() -> None:
    rules = SuiteRules(robot=JackalConfig(max_linear_acceleration=20.0))
    assert "is for the robot Jackal-like, and this policy drives TurtleBot3 Burger:" in reason(rules, TaskConfig())
    assert "drives one that differs (linear acceleration 20, not 0):" in reason(rules, TaskConfig(robot=JackalConfig()))


def test_distances_and_where_the_lidar_is_are_said_in_metres() -> None:
    task = TaskConfig(arrival_distance=0.2)
    said = reason(SuiteRules(arrival_distance=1.0), task)
    assert "has arrival distances of 1 m, and this policy was trained with 0.2 m" in said
    lidar = SuiteLidar(mount=SingleMount(x=0.055))
    assert "at (0.055, 0) m, and this policy's is at (0, 0) m" in reason(SuiteRules(lidar=lidar), task)
    # In the middle it may be anywhere.
    moved = task.model_copy(update={"lidar": LidarConfig(mount=SingleMount(x=0.1))})
    SuiteRules(lidar=SuiteLidar(mount=CentredMount())).check("mine-9", moved)
