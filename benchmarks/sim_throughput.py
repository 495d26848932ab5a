"""Control steps per second of one core, ours beside others on the same worlds: 12 obstacles, 30 rays.

A step is everything that a training needs: physics, LiDAR, collision, reward, observation and reset. The contenders take
turns within one run, so that a busy machine slows all of them alike; rates count CPU time and are medians of the rounds.

    python -m benchmarks.sim_throughput --check

ir-sim (a simulator for the same purpose) is measured where it is installed: `pip install ir-sim`. It computes physics and
LiDAR only.
"""

import importlib
import math
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.report import finish, parser
from sim.arenas import Arena, Mover
from sim.config import FormulaTerm, PathProgressTerm, ProximityTerm, RewardConfig, TaskConfig, TimeTerm, preset_terms
from sim.engine.plain import PlainWorld
from sim.engine.world import World
from sim.kernels.commands import write_commands
from sim.kernels.step import step_usual_robots

TASK = TaskConfig()
SIX_TERMS = RewardConfig(
    terms=(
        *preset_terms("basic"),
        TimeTerm(),
        ProximityTerm(),
        FormulaTerm(formula="min(0, clearance - 0.3) * speed - 0.1 * abs(turning_rate)"),
    )
)
BY_PATH = RewardConfig(terms=(*preset_terms("basic"), PathProgressTerm()))
MAPS = 64
ROBOTS = (1, 16, 64, 256, 1024, 4096)
ROUNDS = 7
SECONDS = 0.15  # of CPU time, of one contender in one round
ACTIONS = 64  # precomputed batches of actions that are used in turn

# Pedestrians of a map, and with how many robots on all maps they are measured: with 1,024 a map has 16.
MOVERS, AMONG_MOVERS = 4, (256, 1024)

PLAIN, IRSIM, KERNEL, TERMS = "plain_pymunk", "ir_sim", "kernel_without_physics_256", "robots_256_five_terms_and_a_formula"
PATH = "robots_256_progress_along_the_shortest_path"


def arena(seed: int, movers: int = 0) -> Arena:
    """Six circles and six boxes anywhere in 10 x 10 m, and pedestrians."""
    rng = np.random.default_rng(seed)
    return Arena(
        f"clutter-{seed}",
        circles=np.column_stack([rng.uniform(-4.0, 4.0, (6, 2)), rng.uniform(0.2, 0.6, 6)]),
        boxes=np.column_stack(
            [rng.uniform(-4.0, 4.0, (6, 2)), rng.uniform(0.15, 0.6, (6, 2)), rng.uniform(0.0, math.pi, 6)]
        ),
        movers=(Mover("pedestrian", 0.25, 1.0),) * movers,
    )


def random_actions(robots: int) -> NDArray[np.float32]:
    """Batches (ACTIONS, robots, 2) of uniformly random actions."""
    return np.random.default_rng(0).uniform([0.0, -1.0], 1.0, (ACTIONS, robots, 2)).astype(np.float32)


def ours(robots: int, movers: int = 0, task: TaskConfig = TASK) -> tuple[Callable[[], None], World]:
    """A call that steps all robots once, with so many movers in every map."""
    world = World(task, [arena(seed, movers) for seed in range(min(MAPS, robots))], robots, seed=0)
    world.reset()
    actions = random_actions(robots)
    count = 0

    def step() -> None:
        nonlocal count
        world.step(actions[count % ACTIONS])
        count += 1

    return step, world


def kernel_only(robots: int) -> Callable[[], None]:
    """The same without the physics: commands integrated in NumPy, free of contact."""
    _, world = ours(robots)
    space, parameters = world._space, world._parameters  # noqa: SLF001 (what is left out is not public)
    actions, placed = random_actions(robots), np.zeros(robots, dtype=np.int32)
    count = 0

    def step() -> None:
        nonlocal count
        write_commands(actions[count % ACTIONS], world.robots, space.state, space.command, parameters)
        space.state[:robots] += TASK.control_period * space.command[:robots]
        step_usual_robots(0, robots, space.state, placed, world.robots, world.geometry, parameters)
        count += 1

    return step


def plain() -> Callable[[], None]:
    """One robot, one Space, public queries: `sim.engine.plain`, with a reset when an attempt ends."""
    _, start = ours(1)
    rng = np.random.default_rng(0)
    world: PlainWorld | None = None

    def step() -> None:
        nonlocal world
        if world is None:
            start.reset()
            pose, target = start.robots.poses[0].tolist(), start.robots.targets[0].tolist()
            world = PlainWorld(TASK, start.arenas[0], (pose[0], pose[1], pose[2]), (target[0], target[1]))
        if world.step(float(rng.random()), float(rng.uniform(-1.0, 1.0))).outcome != "none":
            world = None

    return step


def ir_sim() -> Callable[[], None] | None:
    """One robot of ir-sim in the first arena; None where it is not installed."""
    try:
        irsim: Any = importlib.import_module("irsim")
    except ImportError:
        return None
    place = arena(0)
    obstacles = [
        f"  - {{shape: {{name: circle, radius: {r}}}, state: [{x}, {y}]}}" for x, y, r in place.circles.tolist()
    ] + [
        f"  - {{shape: {{name: rectangle, length: {2 * a}, width: {2 * b}}}, state: [{x}, {y}, {angle}]}}"
        for x, y, a, b, angle in place.boxes.tolist()
    ]
    walls = "[[-5, -5], [5, -5], [5, 5], [-5, 5], [-5, -5]]"
    world = f"""
world: {{height: 10, width: 10, step_time: {TASK.control_period}, offset: [-5, -5], collision_mode: stop}}
robot:
  - kinematics: {{name: diff}}
    shape: {{name: circle, radius: {TASK.robot.circumscribed_radius}}}
    state: [0, 0, 0]
    goal: [4, 4, 0]
    sensors:
      - {{name: lidar2d, range_min: 0, range_max: {TASK.lidar.range}, angle_range: {math.pi}, number: {TASK.lidar.rays}}}
obstacle:
{chr(10).join(obstacles)}
  - {{shape: {{name: linestring, vertices: {walls}}}, state: [0, 0, 0]}}
"""
    with TemporaryDirectory() as directory:
        path = Path(directory) / "world.yaml"
        path.write_text(world, "utf-8")
        env = irsim.make(str(path), display=False, log_level="ERROR")
    action = np.array([[0.1], [0.3]])
    return lambda: env.step(action)


def measure(cases: dict[str, tuple[Callable[[], None], int]]) -> dict[str, float]:
    """Median robot-steps per CPU second of each case, taken in turns."""
    calls = {}
    for name, (step, _) in cases.items():
        step()
        began = time.process_time()
        step()
        calls[name] = max(1, round(SECONDS / max(time.process_time() - began, 1e-6)))
    rates: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(ROUNDS):
        for name, (step, robots) in cases.items():
            began = time.process_time()
            for _ in range(calls[name]):
                step()
            rates[name].append(robots * calls[name] / (time.process_time() - began))
    return {name: statistics.median(values) for name, values in rates.items()}


def resident_bytes() -> int:
    """Memory of this process (Linux)."""
    return int(Path("/proc/self/statm").read_text("ascii").split()[1]) * 4096


def memory() -> dict[str, float]:
    """Bytes that a robot, an obstacle and a mover cost, each told from the growth of the process."""
    before = resident_bytes()
    crowd = ours(4096)
    robots = (resident_bytes() - before) / 4096
    before = resident_bytes()
    places = World(TASK, [arena(seed) for seed in range(512)], 1, seed=0)
    obstacles = (resident_bytes() - before) / (512 * 12)
    before = resident_bytes()
    walks = World(TASK, [Arena("walks", movers=(Mover("pedestrian", 0.1, 1.0),) * 16)] * 512, 1, seed=0)
    movers = (resident_bytes() - before) / (512 * 16)
    del crowd, places, walks
    return {"bytes_per_robot": round(robots), "bytes_per_obstacle": round(obstacles), "bytes_per_mover": round(movers)}


def main() -> None:
    """Measure, print, and compare with the targets."""
    options = parser(__doc__).parse_args()
    figures: dict[str, object] = dict(memory())
    cases = {f"robots_{n}": (ours(n)[0], n) for n in ROBOTS}
    cases |= {f"robots_{n}_among_movers": (ours(n, MOVERS)[0], n) for n in AMONG_MOVERS}
    cases |= {PLAIN: (plain(), 1), KERNEL: (kernel_only(256), 256)}
    cases[TERMS] = ours(256, task=TaskConfig(reward=SIX_TERMS))[0], 256
    cases[PATH] = ours(256, task=TaskConfig(reward=BY_PATH))[0], 256
    if (other := ir_sim()) is not None:
        cases[IRSIM] = (other, 1)
    rates = measure(cases)
    for name, rate in rates.items():
        print(f"{name:36s} {rate:12,.0f} steps/s")
    figures |= {name: round(rate) for name, rate in rates.items()}
    many = rates["robots_256"]
    figures |= {
        "to_plain_at_256": round(many / rates[PLAIN], 1),
        "to_plain_at_1": round(rates["robots_1"] / rates[PLAIN], 1),
        "to_kernel_at_256": round(many / rates[KERNEL], 2),
        "kept_at_4096": round(rates["robots_4096"] / many, 2),
        "kept_with_five_terms_and_a_formula": round(rates[TERMS] / many, 2),
        "kept_with_progress_along_the_shortest_path": round(rates[PATH] / many, 3),
    }
    for n in AMONG_MOVERS:
        figures[f"kept_among_movers_at_{n}"] = round(rates[f"robots_{n}_among_movers"] / rates[f"robots_{n}"], 2)
    targets = {"to_plain_at_256": 100.0, "to_plain_at_1": 8.0, "to_kernel_at_256": 0.5, "kept_at_4096": 0.67}
    targets |= {"kept_among_movers_at_1024": 0.8, "kept_with_five_terms_and_a_formula": 0.9}
    if IRSIM in rates:
        figures["to_ir_sim_at_256"] = round(many / rates[IRSIM], 1)
        targets["to_ir_sim_at_256"] = 500.0
    finish("sim_throughput", figures, at_least=targets, check=options.check)


if __name__ == "__main__":
    main()
