"""Choosing a velocity among half-planes of permitted ones: the linear programs of ORCA.

ORCA is *Optimal Reciprocal Collision Avoidance* (van den Berg, Guy, Lin and Manocha, "Reciprocal n-Body Collision
Avoidance", 2011); the programs are the incremental ones of de Berg et al., "Computational Geometry", chapter 4, as that
paper uses them. A half-plane is a row (nx, ny, b) of `lines` and permits the velocities v with n·v <= b, where n has
length 1. All is float64 with none but those floating-point freedoms that change no result, so that the same scene gives the
same velocities on every machine.
"""

import math

from sim.kernels.options import kernel

_PARALLEL = 1e-9
_SLACK = 1e-12  # m/s by which rounding may leave a half-plane


@kernel(inline="always")
def orca_line(px, py, wx, wy, radius, horizon, share, vx, vy, lines, n):
    """Write row n of `lines`: what another disc permits to ours.

    The other's centre is (px, py) from ours, further than `radius`, the sum of both radii; all in metres. Our velocity is
    (vx, vy) and (wx, wy) more than the other's, m/s. They shall not touch for `horizon` seconds. `share` is what we take
    upon us of the change of velocity: 0.5 where the other does as we do, else 1.
    """
    squared = px * px + py * py
    # Against the centre of the velocity obstacle's cut-off circle.
    cx = wx - px / horizon
    cy = wy - py / horizon
    length = math.sqrt(cx * cx + cy * cy)
    ahead = cx * px + cy * py
    if ahead < 0.0 and ahead * ahead > radius * radius * length * length:
        nx = -cx / length
        ny = -cy / length
        change = radius / horizon - length
        ux = -change * nx
        uy = -change * ny
    else:
        leg = math.sqrt(max(squared - radius * radius, 0.0))
        if px * cy - py * cx > 0.0:
            dx = (px * leg - py * radius) / squared
            dy = (px * radius + py * leg) / squared
        else:
            dx = -(px * leg + py * radius) / squared
            dy = -(py * leg - px * radius) / squared
        along = wx * dx + wy * dy
        ux = along * dx - wx
        uy = along * dy - wy
        nx = dy
        ny = -dx
    lines[n, 0] = nx
    lines[n, 1] = ny
    lines[n, 2] = nx * (vx + share * ux) + ny * (vy + share * uy)


@kernel(inline="always")
def _on_line(lines, i, speed, wish_x, wish_y, outwards, velocity):
    """The best velocity on the edge of half-plane i within those before it; False where there is none."""
    b = lines[i, 2]
    room = speed * speed - b * b
    if room < 0.0:
        return False
    dx = -lines[i, 1]
    dy = lines[i, 0]
    high = math.sqrt(room)
    low = -high
    for j in range(i):
        across = lines[j, 0] * dx + lines[j, 1] * dy
        free = lines[j, 2] - b * (lines[j, 0] * lines[i, 0] + lines[j, 1] * lines[i, 1])
        if abs(across) <= _PARALLEL:
            if free < 0.0:
                return False
        elif across > 0.0:
            high = min(high, free / across)
        else:
            low = max(low, free / across)
        if low > high:
            return False
    wish = wish_x * dx + wish_y * dy
    t = (high if wish > 0.0 else low) if outwards else min(max(wish, low), high)
    velocity[0] = b * lines[i, 0] + t * dx
    velocity[1] = b * lines[i, 1] + t * dy
    return True


@kernel(inline="always")
def _closest(lines, count, speed, wish_x, wish_y, outwards, velocity):
    """Write the velocity closest to the wish or, `outwards`, furthest in its direction; the first half-plane that fails.

    The wish has length 1 where it is a direction. Returns `count` where all half-planes hold.
    """
    size = math.sqrt(wish_x * wish_x + wish_y * wish_y)
    factor = speed if outwards else (speed / size if size > speed else 1.0)
    velocity[0] = factor * wish_x
    velocity[1] = factor * wish_y
    for i in range(count):
        if lines[i, 0] * velocity[0] + lines[i, 1] * velocity[1] > lines[i, 2] + _SLACK:
            x = velocity[0]
            y = velocity[1]
            if not _on_line(lines, i, speed, wish_x, wish_y, outwards, velocity):
                velocity[0] = x
                velocity[1] = y
                return i
    return count


@kernel(inline="always")
def choose_velocity(lines, hard, count, speed, wish_x, wish_y, scratch, velocity):
    """Write to `velocity` (2,) the permitted one, of at most `speed`, that is closest to the wish; m/s.

    Where not all of the first `count` half-planes can hold, the first `hard` do, which a velocity of 0 must satisfy, and the
    worst violation of the others is as small as it can be. `scratch` is overwritten and as large as `lines`.
    """
    failed = _closest(lines, count, speed, wish_x, wish_y, False, velocity)
    violation = 0.0
    for i in range(failed, count):
        if lines[i, 0] * velocity[0] + lines[i, 1] * velocity[1] - lines[i, 2] <= violation:
            continue
        for j in range(hard):
            for k in range(3):
                scratch[j, k] = lines[j, k]
        n = hard
        for j in range(hard, i):
            # Where half-plane j is violated no more than i.
            mx = lines[j, 0] - lines[i, 0]
            my = lines[j, 1] - lines[i, 1]
            size = math.sqrt(mx * mx + my * my)
            if size > _PARALLEL:
                scratch[n, 0] = mx / size
                scratch[n, 1] = my / size
                scratch[n, 2] = (lines[j, 2] - lines[i, 2]) / size
                n += 1
        x = velocity[0]
        y = velocity[1]
        if _closest(scratch, n, speed, -lines[i, 0], -lines[i, 1], True, velocity) < n:
            # Only rounding leads here: what there was is as good.
            velocity[0] = x
            velocity[1] = y
        violation = lines[i, 0] * velocity[0] + lines[i, 1] * velocity[1] - lines[i, 2]


@kernel(inline="always")
def free_part(lines, hard, vx, vy):
    """The largest part, 0 to 1, of a velocity that the first `hard` half-planes permit."""
    part = 1.0
    for i in range(hard):
        across = lines[i, 0] * vx + lines[i, 1] * vy
        if across > lines[i, 2]:
            part = min(part, lines[i, 2] / across)
    return max(part, 0.0)
