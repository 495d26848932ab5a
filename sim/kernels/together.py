"""Robots that see one another: in its own copy of their arena each meets the others of its group as discs that move.

They stand in the last slots of a tile's discs, behind its movers, and so whatever senses movers senses them.
"""

import numpy as np

from sim.kernels.options import kernel

GONE = np.float32(-1.0)
ZERO = np.float32(0.0)


@kernel(inline="always")
def _own_tile(i, robots, p):
    """Row of the discs that robot i meets."""
    return robots.records[i].replica * p.replica_stride + robots.records[i].map


@kernel(inline="always")
def _slot(i, j, slots, p):
    """Which of robot i's discs robot j is, of the same group: the last of all slots, in the robots' order."""
    return slots - p.together + j - (i - i % p.together) + (1 if j < i else 0)


@kernel()
def see_one_another(state, robots, geometry, parameters):
    """Put every robot where it has come to, and how, among the discs that the others of its group meet.

    Args:
        state: (bodies, 3) x, y, angle in the Space, after the physics of a step.
        robots: `sim.kernels.bundles.Robots`; `poses` are still those before it.
        geometry: `sim.kernels.bundles.Geometry`, whose discs are written. Who is parked is gone, and keeps its last place.
        parameters: (1,) PARAMETERS.
    """
    p = parameters[0]
    discs = geometry.discs
    for i in range(robots.records.shape[0]):
        tile = _own_tile(i, robots, p)
        first = i - i % p.together
        for j in range(first, min(first + p.together, robots.records.shape[0])):
            if j == i:
                continue
            slot = _slot(i, j, discs.shape[1], p)
            if robots.records[j].parked:
                discs[tile, slot, 0] = robots.poses[j, 0]
                discs[tile, slot, 1] = robots.poses[j, 1]
                discs[tile, slot, 2] = GONE
                continue
            other = _own_tile(j, robots, p)
            x = np.float32(state[j, 0] - geometry.origins[other, 0])
            y = np.float32(state[j, 1] - geometry.origins[other, 1])
            discs[tile, slot, 0] = x
            discs[tile, slot, 1] = y
            discs[tile, slot, 2] = p.body
            discs[tile, slot, 3] = x - robots.poses[j, 0]
            discs[tile, slot, 4] = y - robots.poses[j, 1]


@kernel()
def see_others_placed(i, which, last, robots, geometry, p):
    """Write the discs of robot i's group as they stand between two steps, while some of it begin anew.

    Args:
        i: the robot.
        which: (N,) bool, those that begin anew, in their order.
        last: of them the last one that has its place; those after it are not there yet.
        robots: `sim.kernels.bundles.Robots`.
        geometry: `sim.kernels.bundles.Geometry`, whose discs are written.
        p: a row of PARAMETERS.
    """
    discs = geometry.discs
    tile = _own_tile(i, robots, p)
    first = i - i % p.together
    for j in range(first, min(first + p.together, robots.records.shape[0])):
        if j == i:
            continue
        slot = _slot(i, j, discs.shape[1], p)
        discs[tile, slot, 0] = robots.poses[j, 0]
        discs[tile, slot, 1] = robots.poses[j, 1]
        discs[tile, slot, 2] = GONE if robots.records[j].parked or (which[j] and j > last) else p.body
        if which[j]:
            discs[tile, slot, 3] = ZERO
            discs[tile, slot, 4] = ZERO
