"""The arrays that the kernels work on, in bundles that Numba takes as arguments."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Integers = NDArray[np.int32]


class Geometry(NamedTuple):
    """All arenas of a pool, padded to the same number of shapes; metres, in each arena's own frame.

    Attributes:
        bounds: (M, 2) half width, half height.
        circles: (M, C, 3), see `CIRCLE_COLUMNS`.
        boxes: (M, B, 6), see `BOX_COLUMNS`.
        starts, targets: (cells, 2) lower left corners of the free cells of all arenas, one after another.
        start_offsets, target_offsets: (M + 1,) where each arena's cells begin.
        chances: (M,) float64 that an episode begins in an arena or one before it; (0,) where all are as likely.
        origins: (tiles, 2) float64, centre of each tile in the Space.
        ray_angles: (rays,) float64 where the rays of a LiDAR point that the policy believes in, radians against its axis.
        scan_cos, scan_sin: (scan,) directions of those of each LiDAR in turn against the robot's heading.
        reach_cos, reach_sin: (2 * directions + TOGETHER,) of what is told of the reach, likewise, from right to left,
            beginning behind, and round again, so that what lies on both sides of that is one stretch; (0,) where nobody
            sees it.
        ray_x, ray_y: (rays or some more, see `sim.lidar.padded`) scratch for those of one LiDAR's rays in its arena.
        scan: likewise, for what they read.
        near: (most shapes of a kind + 1,) scratch for those that one robot may see.
        discs: (tiles, K, 5) movers as they are now, see `DISC_COLUMNS`.
    """

    bounds: Floats
    circles: Floats
    boxes: Floats
    starts: Floats
    targets: Floats
    start_offsets: Integers
    target_offsets: Integers
    chances: Doubles
    origins: Doubles
    ray_angles: Doubles
    scan_cos: Floats
    scan_sin: Floats
    reach_cos: Floats
    reach_sin: Floats
    ray_x: Floats
    ray_y: Floats
    scan: Floats
    near: Integers
    discs: Floats

    def with_scratch_of_its_own(self) -> "Geometry":
        """The same arenas for another thread."""
        return self._replace(
            ray_x=np.empty_like(self.ray_x),
            ray_y=np.empty_like(self.ray_y),
            scan=np.empty_like(self.scan),
            near=np.empty_like(self.near),
        )


class Crowd(NamedTuple):
    """All movers, and what they walk among.

    Attributes:
        records: (tiles * K,) of `sim.kernels.records.MOVER`, K for each tile; a radius below zero is an empty slot.
        discs: (tiles, K, 5) what the robots meet, see `DISC_COLUMNS`.
        waypoints: (W, 2) float64 of all patrols and timed ways, metres.
        times: (W,) float64 when a timed way is there, seconds.
        maps: (tiles,) the arena of each tile.
        bounds, circles, boxes, origins: see `Geometry`.
        hulls: (M, 3, C + B) float64 x, y, radius of a disc round every circle and box; far away for an empty slot.
        near, met: (C + B + 1,) and (K + 1,) scratch for the obstacles and for the others that one mover has to look at.
        steps: (1,) taken since all were placed.
        sees: (tiles * K,) whether a mover sees robots.
        robot_radius: (1,) metres that a robot is taken to fill around its centre.
        seen: (N, 4) float64 x, y in the arena's frame, vx, vy of the robots at the last decision, tile by tile; (0, 4) where
            no mover sees any.
        first_seen: (tiles + 1,) where each tile's begin.
        lines, chosen: scratch for half-planes, (2, n, 3), and for the velocities of a tile's movers, (K + 1, 2).
    """

    records: NDArray[np.void]
    discs: Floats
    waypoints: Doubles
    times: Doubles
    maps: Integers
    bounds: Floats
    circles: Floats
    boxes: Floats
    origins: Doubles
    hulls: Doubles
    near: Integers
    met: Integers
    steps: NDArray[np.int64]
    sees: NDArray[np.bool_]
    robot_radius: Doubles
    seen: Doubles
    first_seen: NDArray[np.int64]
    lines: Doubles
    chosen: Doubles


class Robots(NamedTuple):
    """All robots; row i of every array is robot i.

    Attributes:
        records: (N,) of `sim.kernels.records.ROBOT`.
        poses: (N, 3) x, y, heading in the arena's frame; heading in [-pi, pi].
        targets: (N, 2).
        ranges: (N, scan) metres, of each LiDAR one after the other.
        observations: (N, numbers), after the step and after a reset that it caused; see `sim.observations`.
        final_observations: (N, numbers), the last ones of the episodes that ended in this step.
        rewards: (N,) of this step.
        terms: (N, terms) the reward's terms, in the configuration's order.
        quantities: (Q, N) what formulas read, see `sim.extending.expression.QUANTITIES`; (0, N) without formulas.
        terminations, truncations: (N,) bool.
        outcomes: (N,) how the attempt that ended in this step ended; 0 where none did.
        drawn: (N, 10) what differs from robot to robot in this episode, in the order of `QUANTITIES`.
        ray_cos, ray_sin: (N, scan or some more) directions of each robot's rays against its heading, behind those of each
            LiDAR zeros, see `sim.lidar.padded`; one row where all are alike.
        ahead: (N, 2) first, and one past the last, of the rays that tell how free the way ahead is; (1, 2) likewise. Where
            LiDARs are mounted elsewhere, their directions tell.
        drift: (N, 3) how far the believed pose is from the true one; (0, 3) where it never is.
        pending: (N, delay, A) actions that wait to be followed, the next one first; none where nothing is delayed.
        commands: (N, A) what was commanded last, whenever it is followed; (0, A) where nobody sees it.
        trail: (N, TRAIL_ROOM, 2) x, y of the crumbs of this attempt, where the robot believed to be when it dropped them,
            crumb n in row n modulo the room; (0, TRAIL_ROOM, 2) where nobody sees them.
        crumbs: (N,) how many were dropped; (0,) likewise.
        reach: (N, 2 * directions + TOGETHER) scratch for the metres that the robot could go straight on, in those of
            `Geometry.reach_cos`; (0, 0) where nobody sees them.
        stays: (N, STAY_NUMBERS) where it believed to be when it began to stay about there, and for how many steps, see
            `sim.kernels.dwell`; (0, STAY_NUMBERS) where nobody sees them.
        view_places: (N, VIEW_ROOM, 2) x, y of where views of this attempt were kept, as `trail`; (0, VIEW_ROOM, 2) where
            nobody sees since when it knows what it sees.
        views: (N, VIEW_ROOM, VIEW_DIRECTIONS) uint8, what the first LiDAR read from there in each direction, FULL_RANGE at
            its range, 0 where no ray pointed; (0, ...) likewise.
        views_kept: (N,) how many were kept; (0,) likewise.
        view_links: (N, VIEW_ROOM, LINK_ROOM) numbers of earlier views that a view is linked to, behind them -1; (0, ...)
            where nobody sees openings.
        view_ways: (N, VIEW_ROOM) metres from the newest view to each other one by links; (0, ...) likewise.
        view_next: (N, VIEW_ROOM) number of the view by which it goes there, -1 for the newest; (0, ...) likewise.
        view_sights: (N, VIEW_ROOM) uint8, how it shows the target, see `sim.kernels.views`; (0, ...) likewise.
        view_walls: (N, VIEW_ROOM) bits, which chords of it are walls, see `sim.kernels.walls`; (0, ...) likewise.
        opening_places: (N, OPENING_ROOM, 2) x, y of openings, as `trail`; (0, ...) likewise.
        opening_gates: (N, OPENING_ROOM, 2) x, y of where the body goes through on its way from that view; (0, ...) likewise.
        opening_views: (N, OPENING_ROOM) number of the view that saw it, -1 where there is no opening; (0, ...) likewise.
        opening_access: (N, OPENING_ROOM) uint8, how the body gets there from that view, see `sim.kernels.room`; (0, ...)
            likewise.
        opening_walls: (N, OPENING_ROOM) bits, where walls cross the line from there to the target; (0, ...) likewise.
        opening_dues: (N, OPENING_ROOM + 1) metres that it counts farther, see `sim.kernels.patience`, behind them the
            target; (0, ...) likewise.
        opening_nearest: (N, OPENING_ROOM + 1) metres on known ways to it, the least when it was told first; (0, ...)
            likewise.
        gaps: (N, GAP_ROOM, 4) x, y of both ends of lines across gaps, see `sim.kernels.narrow_gaps`; (0, ...) likewise.
        gaps_found: (N,) how many were found; (0,) likewise.
        followed: (N, 2) row of what is told first, -1 for none, and steps since it was chosen; (0, 2) likewise.
        leads: (N, MAX_LEADS, LEAD_NUMBERS) those that are told, view -1 where there is none; (0, ...) likewise.
        held_ranges: (N, scan) the last scan; (0, scan) where every step has a new one.
        scan_ages: (N,) steps since this episode's first scan; (0,) likewise.
    """

    records: NDArray[np.void]
    poses: Floats
    targets: Floats
    ranges: Floats
    observations: Floats
    final_observations: Floats
    rewards: Floats
    terms: Floats
    quantities: Floats
    terminations: NDArray[np.bool_]
    truncations: NDArray[np.bool_]
    outcomes: NDArray[np.uint8]
    drawn: Doubles
    ray_cos: Floats
    ray_sin: Floats
    ahead: Integers
    drift: Doubles
    pending: Floats
    commands: Floats
    trail: Floats
    crumbs: Integers
    reach: Floats
    stays: Floats
    view_places: Floats
    views: NDArray[np.uint8]
    views_kept: Integers
    view_links: Integers
    view_ways: Floats
    view_next: Integers
    view_sights: NDArray[np.uint8]
    view_walls: Integers
    opening_places: Floats
    opening_gates: Floats
    opening_views: Integers
    opening_access: NDArray[np.uint8]
    opening_walls: NDArray[np.int64]
    opening_dues: Floats
    opening_nearest: Floats
    gaps: Floats
    gaps_found: Integers
    followed: Integers
    leads: Floats
    held_ranges: Floats
    scan_ages: Integers
