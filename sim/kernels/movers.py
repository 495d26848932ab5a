"""How movers go: where each wants to, and what walls, obstacles and the other movers leave of that.

Movers decide together, once in `DECISION` seconds, and keep their velocities until then. What they may not do is the same
for all kinds, and so no two of them ever overlap and none enters an obstacle, to the rounding of a float64:

- An obstacle is convex, so the plane through its nearest point keeps clear of it: the part of a velocity towards that point
  is at most the gap over the time until the next decision.
- Two movers keep to their sides of the plane between them: towards each other each goes at most half the gap (Zhou, Wang,
  Bandyopadhyay and Schwager, "Fast, On-line Collision Avoidance for Dynamic Vehicles Using Buffered Voronoi Cells", 2017).

Patrols and walkers keep their direction within that and slow down. Pedestrians give way early: they take the velocity
closest to their wish that also keeps them apart for `HORIZON` seconds (ORCA, `sim.kernels.avoidance`).

Timed movers are where their keyframes say, whatever is in the way, on the straight line between two of them.

Positions are kept in the arena's own frame, so that a mover's way does not depend on the tile that its arena is in.

Robots make no difference to a mover, unless it sees them. Then a robot is to it what another mover is, a disc that goes on
as it goes now: it keeps to its side of the plane between them, and so walks into no robot that stands; and a pedestrian
gives way in time, counting on the robot for the other half, as on a pedestrian.
"""

import math

import numpy as np

from sim.kernels.avoidance import choose_velocity, free_part, orca_line
from sim.kernels.commands import twist
from sim.kernels.options import kernel
from sim.kernels.random import uniform
from sim.kernels.records import MAX_ANGULAR, MAX_LINEAR, PATROL, PEDESTRIAN, TIMED, WALKER
from sim.kernels.surroundings import EXACT, SKIN, free_length, gap, obstacle_lines

DECISION = 0.6
"""Seconds between two decisions, a person's stride; one control period where that is longer."""

HORIZON = 2.0
"""Seconds for which pedestrians look ahead."""

_LINE_MARGIN = 0.05  # m beside a mover on the line to a new goal
_TRIES = 200  # places drawn for a start
_DIRECTIONS = 4  # looked into for a new goal
_STRIDE = 1.5  # m of free way that a new goal's direction should have
_ARRIVED = 0.02  # m
_STANDING = 0.1  # of its top speed: slower, a patrol loses patience
_TURNING = 0.5  # of its top speed: slower, a walker turns
_PATIENCE = 1.5  # s of standing before a patrol turns round
_DETOUR = 1.5  # times the straight way's time after which a pedestrian goes elsewhere
_HESITATION = 2.0  # s more, likewise
_REACHED = 0.3  # m from a corner of its route at which a pedestrian turns to the next

GUESTS = 16
"""Robots in one tile, at most, that its movers see: the first ones."""


@kernel(fastmath=EXACT, inline="always")
def _draw_goal(m, index, crowd, furthest):
    """Give mover m a goal in sight: somewhere on the way into a drawn direction, or at its end where `furthest`."""
    records = crowd.records
    record = records[m]
    keep = record.radius + _LINE_MARGIN
    longest = -1.0
    for _ in range(_DIRECTIONS):
        angle = 2.0 * math.pi * uniform(records, m)
        dx = math.cos(angle)
        dy = math.sin(angle)
        length = free_length(
            record.x, record.y, dx, dy, keep, index, crowd.bounds, crowd.circles, crowd.boxes, crowd.hulls, crowd.near
        )
        if length > longest:
            longest = length
            record.goal_x = dx
            record.goal_y = dy
        if length >= _STRIDE and not furthest:
            break
    distance = longest if furthest else longest * (0.5 + 0.5 * uniform(records, m))
    record.goal_x = record.x + distance * record.goal_x
    record.goal_y = record.y + distance * record.goal_y
    record.patience = _HESITATION + _DETOUR * distance / record.speed


@kernel(fastmath=EXACT)
def _turn(m, records):
    """Give walker m a new direction."""
    angle = 2.0 * math.pi * uniform(records, m)
    records[m].goal_x = math.cos(angle)
    records[m].goal_y = math.sin(angle)


@kernel(fastmath=EXACT)
def _next_waypoint(record, crowd):
    """Send a patrol on: to its round's next corner, or back to where it came from."""
    if record.waypoints:
        record.waypoint = (record.waypoint + record.way) % record.waypoints
        record.goal_x = crowd.waypoints[record.first_waypoint + record.waypoint, 0]
        record.goal_y = crowd.waypoints[record.first_waypoint + record.waypoint, 1]
    else:
        x = record.goal_x
        y = record.goal_y
        record.goal_x = record.other_x
        record.goal_y = record.other_y
        record.other_x = x
        record.other_y = y


@kernel(fastmath=EXACT, inline="always")
def _next_corner(record, crowd):
    """Send a pedestrian on along its route: to the next corner, after the last one to the first if it walks round."""
    if record.waypoint + 1 < record.waypoints:
        record.waypoint += 1
    elif record.way:
        record.waypoint = 0
    record.goal_x = crowd.waypoints[record.first_waypoint + record.waypoint, 0]
    record.goal_y = crowd.waypoints[record.first_waypoint + record.waypoint, 1]


@kernel(fastmath=EXACT)
def _draw_place(m, index, crowd):
    """Put mover m somewhere: at its route's or on its round if it has one, else anywhere within the walls."""
    records = crowd.records
    waypoints = crowd.waypoints
    record = records[m]
    if record.waypoints and record.kind == PEDESTRIAN:
        record.waypoint = min(1, record.waypoints - 1)
        record.x = waypoints[record.first_waypoint, 0]
        record.y = waypoints[record.first_waypoint, 1]
    elif record.waypoints:
        leg = int(uniform(records, m) * record.waypoints)
        part = uniform(records, m)
        a = record.first_waypoint + leg
        record.waypoint = (leg + 1) % record.waypoints
        b = record.first_waypoint + record.waypoint
        record.x = waypoints[a, 0] + part * (waypoints[b, 0] - waypoints[a, 0])
        record.y = waypoints[a, 1] + part * (waypoints[b, 1] - waypoints[a, 1])
    else:
        record.x = (2.0 * uniform(records, m) - 1.0) * (crowd.bounds[index, 0] - record.radius)
        record.y = (2.0 * uniform(records, m) - 1.0) * (crowd.bounds[index, 1] - record.radius)


@kernel(fastmath=EXACT)
def _follow(record, crowd, time, period):
    """Put a timed mover where it is `time` seconds after all were placed; it has come there at an even speed.

    Where its way begins anew elsewhere than it ended, it jumps, and has not moved.
    """
    first = record.first_waypoint
    last = first + record.waypoints - 1
    waypoints = crowd.waypoints
    jumps = False
    if record.way:
        end = crowd.times[last]
        rounds = math.floor(time / end)
        apart = math.hypot(waypoints[last, 0] - waypoints[first, 0], waypoints[last, 1] - waypoints[first, 1])
        jumps = apart > _ARRIVED and rounds > math.floor((time - period) / end)
        time -= rounds * end
    k = first + record.waypoint
    if time < crowd.times[k]:
        k = first
    while k < last - 1 and crowd.times[k + 1] <= time:
        k += 1
    record.waypoint = k - first
    part = min(max((time - crowd.times[k]) / (crowd.times[k + 1] - crowd.times[k]), 0.0), 1.0)
    x = waypoints[k, 0] + part * (waypoints[k + 1, 0] - waypoints[k, 0])
    y = waypoints[k, 1] + part * (waypoints[k + 1, 1] - waypoints[k, 1])
    record.vx = 0.0 if jumps else (x - record.x) / period
    record.vy = 0.0 if jumps else (y - record.y) / period
    record.x = x
    record.y = y


@kernel(fastmath=EXACT)
def place_movers(crowd):
    """Put every mover of every tile, at rest, somewhere clear of obstacles and of the movers before it.

    Args:
        crowd: `sim.kernels.bundles.Crowd`, whose records and discs are written.
    """
    records = crowd.records
    discs = crowd.discs
    slots = discs.shape[1]
    for m in range(records.shape[0]):
        tile = m // slots
        index = crowd.maps[tile]
        record = records[m]
        record.present = 0
        record.vx = 0.0
        record.vy = 0.0
        if record.kind == TIMED and record.radius > 0.0:
            record.present = 1
            record.waypoint = 0
            record.x = crowd.waypoints[record.first_waypoint, 0]
            record.y = crowd.waypoints[record.first_waypoint, 1]
        for _ in range(_TRIES if record.radius > 0.0 and record.kind != TIMED else 0):
            _draw_place(m, index, crowd)
            keep = record.radius + SKIN
            free = gap(record.x, record.y, index, crowd.bounds, crowd.circles, crowd.boxes) >= keep
            for other in range(tile * slots, m):
                apart = math.hypot(records[other].x - record.x, records[other].y - record.y)
                free = free and (not records[other].present or apart >= keep + records[other].radius)
            if free:
                record.present = 1
                break
        if record.present and record.kind != TIMED:
            if record.kind != PEDESTRIAN or not record.waypoints:
                record.way = 1
            record.patience = _PATIENCE
            if record.kind == WALKER:
                _turn(m, records)
            elif record.waypoints:
                record.goal_x = crowd.waypoints[record.first_waypoint + record.waypoint, 0]
                record.goal_y = crowd.waypoints[record.first_waypoint + record.waypoint, 1]
            else:
                record.other_x = record.x
                record.other_y = record.y
                _draw_goal(m, index, crowd, record.kind == PATROL)
                if record.kind == PATROL:
                    record.patience = _PATIENCE
        elif not record.present:
            record.x = 0.0
            record.y = 0.0
        k = m % slots
        discs[tile, k, 0] = record.x
        discs[tile, k, 1] = record.y
        discs[tile, k, 2] = record.radius if record.present else -1.0
        discs[tile, k, 3] = 0.0
        discs[tile, k, 4] = 0.0


@kernel(fastmath=EXACT, inline="always")
def _dividing_lines(m, first, slots, records, interval, lines, n, met):
    """Write, from row n on, the half-planes that keep mover m on its side of the others for `interval` seconds.

    Returns how many rows there are then, and how many of the others are listed in `met`: those that it could touch within
    `HORIZON` seconds.
    """
    record = records[m]
    count = 0
    for other in range(first, first + slots):
        if other == m or not records[other].present:
            continue
        px = records[other].x - record.x
        py = records[other].y - record.y
        apart = record.radius + records[other].radius
        squared = px * px + py * py
        far = apart + (record.speed + records[other].speed) * HORIZON
        met[count] = other
        count += (apart * apart < squared) & (squared < far * far)
        near = apart + SKIN
        far = near + 2.0 * record.speed * interval
        if squared < far * far:
            distance = max(math.sqrt(squared), 1e-9)
            lines[n, 0] = px / distance
            lines[n, 1] = py / distance
            lines[n, 2] = max(distance - near, 0.0) / (2.0 * interval)
            n += 1
    return n, count


@kernel(fastmath=EXACT)
def see_robots(crowd, robots, stride, parameters):
    """Note in `crowd.seen` where the robots of every tile are and how they drive, but for those that are parked.

    Args:
        crowd: `sim.kernels.bundles.Crowd`.
        robots: `sim.kernels.bundles.Robots`.
        stride: tiles between one replica of the pool and the next.
        parameters: (1,) PARAMETERS.
    """
    p = parameters[0]
    records = robots.records
    first = crowd.first_seen
    first[:] = 0
    for i in range(records.shape[0]):
        if not records[i].parked:
            first[records[i].replica * stride + records[i].map + 1] += 1
    for tile in range(first.shape[0] - 1):
        first[tile + 1] += first[tile]
    for i in range(records.shape[0]):
        if records[i].parked:
            continue
        tile = records[i].replica * stride + records[i].map
        forwards, aside, _ = twist(
            np.float64(records[i].linear), np.float64(records[i].lateral), np.float64(records[i].angular),
            robots.drawn[i, MAX_LINEAR], robots.drawn[i, MAX_ANGULAR], p,
        )  # fmt: skip
        cos = math.cos(np.float64(robots.poses[i, 2]))
        sin = math.sin(np.float64(robots.poses[i, 2]))
        row = first[tile]
        crowd.seen[row, 0] = robots.poses[i, 0]
        crowd.seen[row, 1] = robots.poses[i, 1]
        crowd.seen[row, 2] = forwards * cos - aside * sin
        crowd.seen[row, 3] = forwards * sin + aside * cos
        first[tile] += 1
    for tile in range(first.shape[0] - 1, 0, -1):
        first[tile] = first[tile - 1]
    first[0] = 0


@kernel(fastmath=EXACT, inline="always")
def _lines_before_robots(record, tile, crowd, interval, lines, n):
    """Write, from row n on, the half-planes that keep a mover on its side of the robots for `interval` seconds.

    Returns how many rows there are then.
    """
    first = crowd.first_seen[tile]
    near = record.radius + crowd.robot_radius[0] + SKIN
    far = near + 2.0 * record.speed * interval
    for k in range(first, min(crowd.first_seen[tile + 1], first + GUESTS)):
        px = crowd.seen[k, 0] - record.x
        py = crowd.seen[k, 1] - record.y
        squared = px * px + py * py
        if squared < far * far:
            distance = max(math.sqrt(squared), 1e-9)
            lines[n, 0] = px / distance
            lines[n, 1] = py / distance
            lines[n, 2] = max(distance - near, 0.0) / (2.0 * interval)
            n += 1
    return n


@kernel(fastmath=EXACT, inline="always")
def _orca_lines_of_robots(record, tile, crowd, lines, n):
    """Write, from row n on, the half-planes that keep a mover and robots apart for `HORIZON` seconds, if these do as much.

    Returns how many rows there are then.
    """
    first = crowd.first_seen[tile]
    apart = record.radius + crowd.robot_radius[0]
    for k in range(first, min(crowd.first_seen[tile + 1], first + GUESTS)):
        px = crowd.seen[k, 0] - record.x
        py = crowd.seen[k, 1] - record.y
        vx = crowd.seen[k, 2]
        vy = crowd.seen[k, 3]
        squared = px * px + py * py
        far = apart + (record.speed + math.sqrt(vx * vx + vy * vy)) * HORIZON
        if apart * apart < squared and squared < far * far:
            orca_line(
                px, py, record.vx - vx, record.vy - vy, apart, HORIZON, 0.5, record.vx, record.vy, lines, n
            )  # fmt: skip
            n += 1
    return n


@kernel(fastmath=EXACT, inline="always")
def _orca_lines(m, met, count, records, lines, n):
    """Write, from row n on, the half-planes that keep mover m and `count` others in `met` apart for `HORIZON` seconds."""
    record = records[m]
    for k in range(count):
        other = records[met[k]]
        orca_line(
            other.x - record.x, other.y - record.y, record.vx - other.vx, record.vy - other.vy,
            record.radius + other.radius, HORIZON, 0.5 if other.kind == PEDESTRIAN else 1.0,
            record.vx, record.vy, lines, n + k,
        )  # fmt: skip


@kernel(fastmath=EXACT, inline="always")
def _decide(tile, crowd, interval, lines, scratch, chosen):
    """Choose the velocities of a tile's movers for the next `interval` seconds."""
    records = crowd.records
    index = crowd.maps[tile]
    slots = crowd.discs.shape[1]
    first = tile * slots
    velocity = chosen[slots]
    for k in range(slots):
        m = first + k
        record = records[m]
        if not record.present:
            continue
        if record.kind == TIMED:
            chosen[k, 0] = record.vx
            chosen[k, 1] = record.vy
            continue
        hard = obstacle_lines(
            record.x, record.y, record.radius, record.speed * interval, interval, index,
            crowd.bounds, crowd.circles, crowd.boxes, crowd.hulls, crowd.near, lines,
        )  # fmt: skip
        hard, met = _dividing_lines(m, first, slots, records, interval, lines, hard, crowd.met)
        if crowd.sees[m]:
            hard = _lines_before_robots(record, tile, crowd, interval, lines, hard)

        if record.kind == WALKER:
            part = free_part(lines, hard, record.speed * record.goal_x, record.speed * record.goal_y)
            for _ in range(_DIRECTIONS if part < _TURNING else 0):
                _turn(m, records)
                part = free_part(lines, hard, record.speed * record.goal_x, record.speed * record.goal_y)
                if part >= _TURNING:
                    break
            chosen[k, 0] = part * record.speed * record.goal_x
            chosen[k, 1] = part * record.speed * record.goal_y
            continue

        record.patience -= interval
        gx = record.goal_x - record.x
        gy = record.goal_y - record.y
        distance = math.sqrt(gx * gx + gy * gy)
        if record.kind == PEDESTRIAN and record.waypoints:
            if distance < _REACHED and (record.way or record.waypoint + 1 < record.waypoints) and record.waypoints > 1:
                _next_corner(record, crowd)
                gx = record.goal_x - record.x
                gy = record.goal_y - record.y
                distance = math.sqrt(gx * gx + gy * gy)
        elif distance < _ARRIVED or (record.patience <= 0.0 and record.kind == PEDESTRIAN):
            if record.kind == PATROL:
                _next_waypoint(record, crowd)
            else:
                _draw_goal(m, index, crowd, False)
            gx = record.goal_x - record.x
            gy = record.goal_y - record.y
            distance = math.sqrt(gx * gx + gy * gy)
        pace = min(record.speed, distance / interval) / max(distance, 1e-9)
        vx = pace * gx
        vy = pace * gy
        if record.kind == PATROL:
            part = free_part(lines, hard, vx, vy)
            if part >= _STANDING:
                record.patience = _PATIENCE
            elif record.patience <= 0.0:
                record.way = -record.way
                record.patience = _PATIENCE
                _next_waypoint(record, crowd)
            chosen[k, 0] = part * vx
            chosen[k, 1] = part * vy
            continue

        _orca_lines(m, crowd.met, met, records, lines, hard)
        count = hard + met
        if crowd.sees[m]:
            count = _orca_lines_of_robots(record, tile, crowd, lines, count)
        choose_velocity(lines, hard, count, record.speed, vx, vy, scratch, velocity)
        part = free_part(lines, hard, velocity[0], velocity[1])
        chosen[k, 0] = part * velocity[0]
        chosen[k, 1] = part * velocity[1]
    for k in range(slots):
        if records[first + k].present:
            records[first + k].vx = chosen[k, 0]
            records[first + k].vy = chosen[k, 1]


@kernel(fastmath=EXACT)
def move_movers(crowd, period, between, command, robots):
    """Let every mover go on for one control period.

    Args:
        crowd: `sim.kernels.bundles.Crowd`, whose records, discs and steps are updated.
        period: seconds of this step.
        between: steps from one decision to the next.
        command: (bodies, 3) vx, vy, angular velocity; the rows after the first `robots` are written.
        robots: how many bodies are robots.
    """
    records = crowd.records
    discs = crowd.discs
    slots = discs.shape[1]
    if crowd.steps[0] % between == 0:
        for tile in range(discs.shape[0]):
            _decide(tile, crowd, between * period, crowd.lines[0], crowd.lines[1], crowd.chosen)
    crowd.steps[0] += 1
    for tile in range(discs.shape[0]):
        for k in range(slots):
            m = tile * slots + k
            record = records[m]
            x = record.x
            y = record.y
            if record.kind == TIMED and record.present:
                _follow(record, crowd, crowd.steps[0] * period, period)
                command[robots + m, 0] = (record.x - x) / period
                command[robots + m, 1] = (record.y - y) / period
            else:
                command[robots + m, 0] = record.vx
                command[robots + m, 1] = record.vy
                record.x = x + period * record.vx
                record.y = y + period * record.vy
            discs[tile, k, 0] = record.x
            discs[tile, k, 1] = record.y
            discs[tile, k, 3] = period * record.vx
            discs[tile, k, 4] = period * record.vy
