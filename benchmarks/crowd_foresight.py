"""How far ahead a robot must know where people will walk to get through crowd-200: a bound for every policy.

python -m benchmarks.crowd_foresight
python -m benchmarks.crowd_foresight --whole

A planner that knows the map and where all pedestrians are searches the next seconds by beam search and takes the first
action of the best plan, at every step anew. It is told the truth about these seconds, or extrapolates everybody's velocity.
With `--whole` one search over the whole episode says which scenarios can be solved at all: a plan is a proof, none found is
not. A plan of 1 s is too short to steer by, whatever it knows.
"""

import math
from collections.abc import Callable

import numba as nb
import numpy as np
from numpy.typing import NDArray

from benchmarks.report import finish, parser
from sim.config import LidarConfig, ObservationConfig, TaskConfig
from sim.engine.shapes import pack_shapes
from sim.engine.world import World
from sim.kernels.sensing import clearance_at
from sim.suites import EpisodeTable, Situation, Suite, load_suite, run_controller
from sim.suites.scenarios import scenario_world

Floats = NDArray[np.float32]

TASK = TaskConfig(
    lidar=LidarConfig(rays=60, field_of_view=360.0), observation=ObservationConfig.preset("improved", batches=30)
)
KEEP = 0.21  # m from everything: the collision distance and a little
EXTRAPOLATED = 4.0  # s
FORESIGHT = (1.0, 2.0, 3.0, 4.0)  # s
WIDTH, WHOLE_WIDTH = 150, 3000  # plans kept after each step

# Of two plans that end in the same cell with the same heading one is kept.
_CELL, _CELLS, _HEADINGS = 0.03, 420, 64


@nb.njit(nogil=True)
def search(
    pose: NDArray[np.float64],
    target: NDArray[np.float64],
    index: int,
    bounds: Floats,
    circles: Floats,
    boxes: Floats,
    forecast: Floats,
    width: int,
    seen: NDArray[np.int32],
    stamp: int,
) -> tuple[float, float, bool]:
    """The first action of the plan that comes nearest to the target, and whether a plan arrives.

    Args:
        pose: (3,) x, y, heading.
        target: (2,).
        index: of the arena.
        bounds: of all arenas, `sim.engine.shapes.pack_shapes`.
        circles: likewise.
        boxes: likewise.
        forecast: (steps, K, 3) x, y, radius of the movers after each step; a radius below zero is none.
        width: plans kept.
        seen: (cells * cells * headings,) scratch, whose numbers are below `stamp`.
        stamp: the first of as many numbers as there are steps.
    """
    plans = pose.copy().reshape(1, 3)
    first = np.full(1, -1)
    best = 4
    for step in range(len(forecast)):
        found = np.empty((6 * len(plans), 3))
        begun = np.empty(6 * len(plans), np.int64)
        left = np.empty(6 * len(plans))
        count = 0
        for plan in range(len(plans)):
            x, y, heading = plans[plan]
            for action in (1, 0, 2, 4, 3, 5):
                turn = 0.2 * (action % 3 - 1)
                way = 0.05 * (1 - action // 3) * (math.sin(0.5 * turn) / (0.5 * turn) if turn else 1.0)
                px, py = x + way * math.cos(heading + 0.5 * turn), y + way * math.sin(heading + 0.5 * turn)
                pointing = (heading + turn) % (2.0 * math.pi)
                cell = int((px + 0.5 * _CELL * _CELLS) / _CELL) * _CELLS + int((py + 0.5 * _CELL * _CELLS) / _CELL)
                key = cell * _HEADINGS + int(pointing / (2.0 * math.pi) * _HEADINGS) % _HEADINGS
                if seen[key] == stamp + step:
                    continue
                hit = False
                for k in range(forecast.shape[1]):
                    radius = forecast[step, k, 2]
                    if radius > 0.0 and math.hypot(forecast[step, k, 0] - px, forecast[step, k, 1] - py) < radius + KEEP:
                        hit = True
                        break
                if hit:
                    continue
                distance = math.hypot(target[0] - px, target[1] - py)
                begin = action if step == 0 else first[plan]
                if distance < 0.2:
                    return 1.0 - begin // 3, begin % 3 - 1.0, True
                if clearance_at(np.float32(px), np.float32(py), index, bounds, circles, boxes) < KEEP:
                    continue
                seen[key] = stamp + step
                away = abs((math.atan2(target[1] - py, target[0] - px) - pointing + math.pi) % (2.0 * math.pi) - math.pi)
                found[count] = px, py, pointing
                begun[count], left[count] = begin, distance + 0.05 * away
                count += 1
        if count == 0:
            return 1.0 - best // 3, best % 3 - 1.0, False
        order = np.argsort(left[:count])
        best = begun[order[0]]
        if count > width:
            # Half of them the nearest, half spread over the rest.
            spread = np.arange(width - width // 2) * (count - width // 2) // (width - width // 2) + width // 2
            order = np.concatenate((order[: width // 2], order[spread]))
        plans, first = found[order], begun[order]
    return 1.0 - best // 3, best % 3 - 1.0, False


class Planner:
    """The search on a suite; `forecast` says what it is told, from the step and the copies of arenas that robots are in."""

    def __init__(self, suite: Suite, forecast: Callable[[int, World], Floats], width: int) -> None:
        self._shapes = pack_shapes(suite.arenas)
        self._forecast, self._width = forecast, width
        self._seen = np.zeros(_CELLS * _CELLS * _HEADINGS, np.int32)
        self._stamp = 1
        self._step = -1
        self._world: World

    def watch(self, active: NDArray[np.int64], world: World, actions: Floats) -> None:
        """Sees everything: the observer of `run_controller`."""
        self._step += 1
        self._world = world

    def act(self, situation: Situation) -> Floats:
        """The controller of `run_controller`."""
        active = np.flatnonzero(self._world.robots.records["parked"] == 0)
        tiles, maps = self._world.tiles()[active], self._world.robots.records["map"][active]
        forecast = self._forecast(self._step, self._world)
        return np.array(
            [
                self.plan(pose, target, int(maps[i]), forecast[:, tiles[i]])[:2]
                for i, (pose, target) in enumerate(zip(situation.poses, situation.targets, strict=True))
            ],
            dtype=np.float32,
        )

    def plan(
        self, pose: NDArray[np.floating], target: NDArray[np.floating], index: int, forecast: Floats
    ) -> tuple[float, float, bool]:
        """`search` from a pose."""
        self._stamp += len(forecast)
        bounds, circles, boxes = self._shapes
        return search(
            pose.astype(np.float64), target.astype(np.float64), index, bounds, circles, boxes,
            np.ascontiguousarray(forecast), self._width, self._seen, self._stamp - len(forecast),
        )  # fmt: skip


def ways(suite: Suite, steps: int) -> Floats:
    """(steps + 1, tiles, K, 3) where all movers are at the start and after each step: robots make no difference to them."""
    world = scenario_world(TASK, suite.arenas, len(suite))
    world.reset(poses=suite.starts, targets=suite.targets, arenas=suite.arena_indices)
    world.park(np.arange(len(suite)))
    discs = [world.movers.discs[..., :3].copy()]
    for _ in range(steps):
        world.step(np.zeros((len(suite), 2), np.float32))
        discs.append(world.movers.discs[..., :3].copy())
    return np.array(discs)


def extrapolated(steps: int) -> Callable[[int, World], Floats]:
    """Every mover goes on as it did in the last step."""

    def forecast(_: int, world: World) -> Floats:
        discs = world.movers.discs
        ahead = np.repeat(discs[None, ..., :3], steps, axis=0)
        ahead[..., :2] += np.arange(1, steps + 1, dtype=np.float32)[:, None, None, None] * discs[None, ..., 3:5]
        return ahead

    return forecast


def surprise(truth: Floats, steps: int) -> float:
    """How far from where its last step pointed to a mover is after some steps, metres: the median."""
    positions = truth[..., :2]
    expected = positions[1:-steps] + steps * (positions[1:-steps] - positions[: -steps - 1])
    return float(np.median(np.hypot(*np.moveaxis(positions[1 + steps :] - expected, -1, 0))))


def foretold(truth: Floats, steps: int) -> Callable[[int, World], Floats]:
    """Every mover goes where it will go."""
    return lambda now, _: truth[now + 1 : now + 1 + steps]


def drive(suite: Suite, forecast: Callable[[int, World], Floats]) -> EpisodeTable:
    """Every scenario, with that planner."""
    planner = Planner(suite, forecast, WIDTH)
    return run_controller(planner.act, TASK, suite, planner.watch)


def main() -> None:
    """Drive the suite with each planner."""
    arguments = parser(__doc__)
    arguments.add_argument("--whole", action="store_true", help="also search whole episodes")
    options = arguments.parse_args()
    suite = load_suite("crowd-200")
    steps = {seconds: round(seconds / TASK.control_period) for seconds in (*FORESIGHT, EXTRAPOLATED)}
    truth = ways(suite, TASK.step_limit + max(steps.values()))
    figures: dict[str, object] = {}

    def note(name: str, success: float) -> None:
        figures[name] = round(100.0 * success, 1)
        print(f"{name}: {figures[name]} %", flush=True)

    figures["metres off after 2 s at the same velocity, median"] = round(surprise(truth, steps[2.0]), 2)
    table = run_controller(lambda situation: np.zeros((len(situation.poses), 2), np.float32), TASK, suite)
    note("standing still, not hit within 100 steps", float((table.steps > 100).mean()))
    table = drive(suite, extrapolated(steps[EXTRAPOLATED]))
    note("velocities extrapolated", float((table.outcomes == 1).mean()))
    for seconds in FORESIGHT:
        table = drive(suite, foretold(truth, steps[seconds]))
        note(f"{seconds:g} s of foresight", float((table.outcomes == 1).mean()))
    if options.whole:
        planner = Planner(suite, lambda *_: truth, WHOLE_WIDTH)
        solved = [
            planner.plan(start, target, int(index), truth[1 : 1 + TASK.step_limit, index])[2]
            for start, target, index in zip(suite.starts, suite.targets, suite.arena_indices, strict=True)
        ]
        note("the whole episode known", float(np.mean(solved)))
    finish("crowd_foresight", figures, check=options.check)


if __name__ == "__main__":
    main()
