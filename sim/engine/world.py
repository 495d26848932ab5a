"""The engine below the Gymnasium interfaces: many robots, each alone in its arena or in a group, stepped together."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.actions import action_layout, fastest_way, twists
from sim.arenas import Arena, free_distance
from sim.arenas.freespace import SPAWN_MARGIN, FreeSpace, free_space
from sim.config import DwellPart, KnownPart, OpeningsPart, RandomisationConfig, ReachPart, TaskConfig, TrailPart, WayPart
from sim.engine.added_parts import AddedParts
from sim.engine.disturbances import longest_delay, quantity_spans
from sim.engine.footprint import rectangle_clearance
from sim.engine.guidance import Guidance
from sim.engine.map_sampling import MapSampling, samples_by_learnability
from sim.engine.movers import Movers
from sim.engine.parameters import pack_parameters
from sim.engine.paths import PathProgress, Paths, RobotPaths
from sim.engine.physics import ROBOTS_PER_TILE, TiledSpace, tile_origins
from sim.engine.rewards import Formulas, reads_changes
from sim.engine.shapes import pack_shapes
from sim.engine.stretches import Crew
from sim.errors import ArenaError, PlacementError
from sim.extending.expression import QUANTITIES
from sim.extending.observing import Sight
from sim.kernels.bundles import Geometry, Robots
from sim.kernels.commands import write_commands
from sim.kernels.disturbances import rays_ahead
from sim.kernels.dwell import STAY_NUMBERS
from sim.kernels.openings import LEAD_NUMBERS
from sim.kernels.options import bound
from sim.kernels.random import seed_streams
from sim.kernels.reach import TOGETHER
from sim.kernels.records import (
    ARRIVAL,
    DISTANCE_NOISE,
    FIELD_OF_VIEW,
    HEADING_NOISE,
    MAX_ANGULAR,
    MAX_LINEAR,
    RATE,
    ROBOT,
)
from sim.kernels.room import GAP_ROOM, LINK_ROOM, LONG_TRAIL_ROOM, MAX_LEADS, OPENING_ROOM, SHORT_TRAIL_ROOM, VIEW_ROOM
from sim.kernels.step import reset_robots, step_any_robots, step_usual_robots
from sim.kernels.together import see_one_another
from sim.kernels.views import VIEW_DIRECTIONS
from sim.lidar import drawn_ray_angles, padded, ray_angles
from sim.observations import observation_size, reach_directions
from sim.streams import ENVIRONMENT, Stream

Restart = Literal["same step", "next step", "reset"]
"""When a robot whose episode has ended begins the next one: in that step, in the one after it whatever its action, or when
`World.reset` is called."""


def spawn_space(task: TaskConfig, arena: Arena) -> FreeSpace:
    """Where this task's robots start and their targets stand in an arena.

    Raises:
        ArenaError: there is no such place.
    """
    passable = task.passable_clearance
    return free_space(arena, passable=passable, clearance=passable + SPAWN_MARGIN)


class World:
    """Robots in a pool of arenas: LiDAR, physics, outcomes, rewards, observations and resets.

    A robot goes on after an arrival, with a new target, unless that ends the episode; after a collision or a time-out it
    starts anew, in an arena drawn from the pool. Its fate depends on the seed and its own index, never on the number of
    robots. Robots see movers, which take no notice of them unless they are made to, and one another only where the task puts
    them together.

    Robots that are together are groups by their order, the last one as many as are left. A group stays in its arena, the
    first groups in the first ones; in its copy of it each robot meets the others as movers, as discs around their bodies.

    Movers that see robots go otherwise for each robot that is among them: there is then a copy of the arenas for every robot
    and arena, in which a robot is alone if `reset` is told arenas, and meets few others where it draws them.

    Args:
        task: robot, LiDAR, observation, reward and limits.
        arenas: the pool.
        robots: how many.
        seed: of all that is random; None takes one from the operating system.
        stream: of random numbers, see `sim.streams`.
        arrival_ends: whether an arrival ends the episode.
        restart: when the next episode begins.
        respawn: False saves looking for free space where every pose and target is given: robots then stay where they end,
            and all copies of an arena have the same movers.
        guides: whether `guidance` is kept.

    Raises:
        ArenaError: the robot does not fit into an arena.

    Attributes:
        task: what all of it follows.
        arenas: the pool.
        robots: the arrays of all robots, overwritten by every step.
        movers: what moves beside them.
        crew: the threads that follow the physics of each step, with the same result bit for bit however many they are.
        guidance: what they would have to know of the shortest paths; None unless asked for.
    """

    def __init__(
        self,
        task: TaskConfig,
        arenas: Sequence[Arena],
        robots: int,
        *,
        seed: int | None = None,
        stream: Stream = ENVIRONMENT,
        arrival_ends: bool = False,
        restart: Restart = "same step",
        respawn: bool = True,
        guides: bool = False,
    ) -> None:
        self.task = task
        groups = -(-robots // task.together)
        # No group leaves its arena: the others would stand empty.
        self.arenas = tuple(arenas[:groups] if respawn and task.together > 1 else arenas)
        watched = any(mover.sees_robots for arena in self.arenas for mover in arena.movers)
        if watched and task.together > 1:
            raise ArenaError("here people give way to one robot, not to several: have no robots together")
        in_copies = watched or task.together > 1
        crowding = (1 if in_copies else ROBOTS_PER_TILE) * len(self.arenas)
        replicas = math.ceil(robots / crowding)
        if respawn and task.together > 1:
            replicas = task.together * -(-groups // len(self.arenas))
        origins = tile_origins(self.arenas, replicas)
        self._sampling = (
            MapSampling(len(self.arenas)) if respawn and samples_by_learnability(task, len(self.arenas)) else None
        )
        nowhere = np.empty((0, 2), dtype=np.float32)
        spaces = [spawn_space(task, arena) if respawn else FreeSpace(nowhere, nowhere, 0.0) for arena in self.arenas]
        bounds, circles, boxes = shapes = pack_shapes(self.arenas)
        self.movers = Movers(
            self.arenas,
            shapes,
            origins,
            task.control_period,
            alike=not respawn or task.together > 1,
            robots=robots,
            robot_radius=task.passable_clearance,
            others=task.together - 1,
        )
        spans = quantity_spans(task)
        fields = np.full(robots if task.randomisation.field_of_view else 1, spans[FIELD_OF_VIEW, 0])
        angles = drawn_ray_angles(task.lidar, fields)
        lidars = len(task.lidar.mount.places)
        ray_cos, ray_sin = padded(np.cos(angles), lidars), padded(np.sin(angles), lidars)
        believed = drawn_ray_angles(task.lidar, task.lidar.field_of_view)
        directions = reach_directions(task)
        directions = np.resize(directions, 2 * len(directions) + TOGETHER) if len(directions) else directions
        ray_x, ray_y, scan = np.empty((3, ray_cos.shape[1] // lidars), dtype=np.float32)
        self.geometry = Geometry(
            bounds=bounds,
            circles=circles,
            boxes=boxes,
            starts=np.concatenate([space.starts for space in spaces]),
            targets=np.concatenate([space.targets for space in spaces]),
            start_offsets=np.cumsum([0, *(len(space.starts) for space in spaces)], dtype=np.int32),
            target_offsets=np.cumsum([0, *(len(space.targets) for space in spaces)], dtype=np.int32),
            chances=self._sampling.chances if self._sampling else np.empty(0),
            origins=origins,
            ray_angles=ray_angles(task.lidar),
            scan_cos=np.cos(believed).astype(np.float32),
            scan_sin=np.sin(believed).astype(np.float32),
            reach_cos=np.cos(directions).astype(np.float32),
            reach_sin=np.sin(directions).astype(np.float32),
            ray_x=ray_x,
            ray_y=ray_y,
            scan=scan,
            near=np.empty(1 + max(table.shape[1] for table in (*shapes[1:], self.movers.discs)), dtype=np.int32),
            discs=self.movers.discs,
        )
        numbers, action_size = observation_size(task), action_layout(task.robot).size
        self._formulas = formulas = Formulas(task, robots)
        asks_for_paths = guides or bool(task.reward.weight("path_progress"))
        self._paths = paths = RobotPaths(Paths(self.arenas, task.path_clearance), robots) if asks_for_paths else None
        self._added_parts, self._path_progress = AddedParts(task), PathProgress(task, paths, robots)
        self.guidance = Guidance(task, paths, robots) if guides and paths else None
        sees_actions = bool(self._added_parts) or any(part.name == "actions" for part in task.observation.parts)
        trails = [part.memory for part in task.observation.parts if isinstance(part, TrailPart)]
        sees_trail = bool(trails)
        sees_ways = any(
            isinstance(part, TrailPart | WayPart | ReachPart | KnownPart | OpeningsPart | DwellPart)
            for part in task.observation.parts
        )
        stays = robots if any(isinstance(part, DwellPart) for part in task.observation.parts) else 0
        knows = any(isinstance(part, KnownPart | OpeningsPart) for part in task.observation.parts)
        looks = robots if any(isinstance(part, OpeningsPart) for part in task.observation.parts) else 0
        drifts, holds = spans[[DISTANCE_NOISE, HEADING_NOISE]].any(), spans[RATE].any()
        self.robots = Robots(
            records=np.zeros(robots, dtype=ROBOT),
            poses=np.zeros((robots, 3), dtype=np.float32),
            targets=np.zeros((robots, 2), dtype=np.float32),
            ranges=np.zeros((robots, task.lidar.scan_size), dtype=np.float32),
            observations=np.zeros((robots, numbers), dtype=np.float32),
            final_observations=np.zeros((robots, numbers), dtype=np.float32),
            rewards=np.zeros(robots, dtype=np.float32),
            terms=np.zeros((robots, len(task.reward.terms)), dtype=np.float32),
            quantities=np.zeros((len(QUANTITIES) if len(formulas) else 0, robots), dtype=np.float32),
            terminations=np.zeros(robots, dtype=np.bool_),
            truncations=np.zeros(robots, dtype=np.bool_),
            outcomes=np.zeros(robots, dtype=np.uint8),
            drawn=np.tile(spans[:, 0], (robots, 1)),
            ray_cos=ray_cos,
            ray_sin=ray_sin,
            ahead=np.array([rays_ahead(row[: task.lidar.rays], 1.0) for row in angles], dtype=np.int32),
            drift=np.zeros((robots if drifts else 0, 3)),
            pending=np.zeros((robots, longest_delay(task), action_size), dtype=np.float32),
            commands=np.zeros((robots if sees_actions else 0, action_size), dtype=np.float32),
            trail=np.zeros(
                (robots if sees_trail else 0, LONG_TRAIL_ROOM if "long" in trails else SHORT_TRAIL_ROOM, 2), dtype=np.float32
            ),
            crumbs=np.zeros(robots if sees_trail else 0, dtype=np.int32),
            reach=np.zeros((robots, len(directions)) if len(directions) else (0, 0), dtype=np.float32),
            stays=np.zeros((stays, STAY_NUMBERS), dtype=np.float32),
            view_places=np.zeros((robots if knows else 0, VIEW_ROOM, 2), dtype=np.float32),
            views=np.zeros((robots if knows else 0, VIEW_ROOM, VIEW_DIRECTIONS), dtype=np.uint8),
            views_kept=np.zeros(robots if knows else 0, dtype=np.int32),
            view_links=np.zeros((looks, VIEW_ROOM, LINK_ROOM), dtype=np.int32),
            view_ways=np.zeros((looks, VIEW_ROOM), dtype=np.float32),
            view_next=np.zeros((looks, VIEW_ROOM), dtype=np.int32),
            view_sights=np.zeros((looks, VIEW_ROOM), dtype=np.uint8),
            opening_places=np.zeros((looks, OPENING_ROOM, 2), dtype=np.float32),
            opening_gates=np.zeros((looks, OPENING_ROOM, 2), dtype=np.float32),
            opening_views=np.zeros((looks, OPENING_ROOM), dtype=np.int32),
            opening_access=np.zeros((looks, OPENING_ROOM), dtype=np.uint8),
            view_walls=np.zeros((looks, VIEW_ROOM), dtype=np.int32),
            opening_walls=np.zeros((looks, OPENING_ROOM), dtype=np.int64),
            opening_dues=np.zeros((looks, OPENING_ROOM + 1), dtype=np.float32),
            opening_nearest=np.zeros((looks, OPENING_ROOM + 1), dtype=np.float32),
            gaps=np.zeros((looks, GAP_ROOM, 4), dtype=np.float32),
            gaps_found=np.zeros(looks, dtype=np.int32),
            followed=np.zeros((looks, 2), dtype=np.int32),
            leads=np.zeros((looks, MAX_LEADS, LEAD_NUMBERS), dtype=np.float32),
            held_ranges=np.zeros((robots if holds else 0, task.lidar.scan_size), dtype=np.float32),
            scan_ages=np.zeros(robots if holds else 0, dtype=np.int32),
        )
        # What extensions see of a step that ends an episode, and how far it was, has to be seen before the next one begins.
        # Who begins anew has to be clear of the others, wherever they have come to.
        # So has the map of an attempt that is over.
        sees_ends = bool(self._added_parts) or bool(self._path_progress) or guides or self._sampling is not None
        self._looks_back = sees_ends or task.together > 1
        starts_anew = restart == "same step" and not self._looks_back
        self._parameters = pack_parameters(task, arrival_ends=arrival_ends, starts_anew=starts_anew)
        usual_drive = task.robot.drive.name == "differential" and not self._parameters[0]["mounted"]
        self._is_usual = usual_drive and not sees_ways
        self._action_size = action_size
        self._parameters["replica_stride"] = len(self.arenas)
        own_pace = fastest_way(task.robot, spans[MAX_LINEAR, 1], spans[MAX_ANGULAR, 1])
        others_pace = max(self.movers.fastest, own_pace if task.together > 1 else 0.0)
        self._parameters["closing"] = (own_pace + others_pace) * task.control_period
        self._alone = task.together > 1 or (watched and not respawn)
        self.robots.records["replica"] = np.arange(robots) // crowding
        if respawn and task.together > 1:
            maps = (np.arange(robots) // task.together % len(self.arenas)).astype(np.int32)
            self.robots.records["map"], self.robots.records["replica"] = maps, self._replicas_of_their_own(maps)
        self._space = TiledSpace(self.arenas, origins, robots, task.robot, len(self.movers))
        self._placed = np.zeros(robots, dtype=np.int32)
        self.crew = Crew()
        self._geometries = [self.geometry]
        self._restart, self._stream = restart, stream
        self.seed(seed)

    def __len__(self) -> int:
        return len(self.robots.records)

    def seed(self, seed: int | None) -> None:
        """Start every robot's and mover's generator anew; None takes a seed from the operating system."""
        self.robots.records["random"] = seed_streams(seed, len(self), key=self._stream)
        self.movers.seed(seed, self._stream)

    def reset(
        self, *, poses: ArrayLike | None = None, targets: ArrayLike | None = None, arenas: ArrayLike | None = None
    ) -> None:
        """Begin a new episode for every robot, and place all movers anew; what is not given is drawn.

        A pose that is drawn is clear of movers; one that is given may be where a mover starts.

        Args:
            poses: (N, 3) x, y, heading, or one pose for all.
            targets: (N, 2) x, y, or one target for all.
            arenas: (N,) indices into the pool for robots placed by `poses`; by default they stay where they are.

        Raises:
            PlacementError: a pose or target is not finite, or touches an obstacle or a wall.
        """
        n = len(self)
        maps = self.robots.records["map"] if arenas is None else np.broadcast_to(np.asarray(arenas, dtype=np.int32), (n,))
        if arenas is not None and ((maps < 0) | (maps >= len(self.arenas))).any():
            raise PlacementError(f"arenas must be between 0 and {len(self.arenas) - 1}")
        together = self.task.together
        if (maps != maps[np.arange(n) // together * together]).any():
            raise PlacementError(f"robots that are together, {together} one after another, need one arena")
        if targets is not None and poses is None and len(self.arenas) > 1:
            raise PlacementError("targets without poses make sense in a single arena only: give poses too")
        placed = self._placements("poses", poses, 3, maps)
        aimed = self._placements("targets", targets, 2, maps)
        self.robots.records["map"] = maps
        if self._alone and arenas is not None:
            self.robots.records["replica"] = self._replicas_of_their_own(maps)
        self.robots.records["parked"] = 0
        self.movers.place()
        space = self._space
        self.movers.write_places(space.state[len(self) : -1])
        everybody = np.ones(n, dtype=np.bool_)
        reset_robots(everybody, placed, aimed, self.robots, self.geometry, self._parameters, space.state)
        space.put_all()
        self._see_added_parts(everybody, begins=True)
        self._find_paths_from_here(everybody)

    def _find_paths_from_here(self, which: NDArray[np.bool_]) -> None:
        """Look for the paths of some robots (N,) that begin anew."""
        if self._paths is not None:
            self._paths.look(self.robots, which, self.crew)
            self._path_progress.begin(which)
            self._guide(which)

    def _guide(self, which: NDArray[np.bool_]) -> None:
        if self.guidance is not None:
            self.guidance.tell(self.robots, which)

    def _replicas_of_their_own(self, maps: NDArray[np.int32]) -> NDArray[np.int32]:
        """(N,) copies of their arenas (N,) in which robots are alone.

        Raises:
            PlacementError: an arena has fewer copies than robots.
        """
        order = np.argsort(maps, kind="stable")
        ranks = np.empty(len(maps), dtype=np.int32)
        ranks[order] = np.arange(len(maps)) - np.searchsorted(maps[order], maps[order])
        copies = len(self.geometry.origins) // len(self.arenas)
        if ranks.max(initial=0) >= copies:
            raise PlacementError(
                f"robots that movers or other robots see need a copy of an arena each: there are {copies}, and "
                f"{ranks.max() + 1} robots in one; spread them evenly over the arenas"
            )
        return ranks

    def reset_with(self, options: Mapping[str, ArrayLike] | None) -> None:
        """`reset`, with its arguments as Gymnasium passes them.

        Raises:
            PlacementError: an option is not known, or `reset` refuses it.
        """
        options = options or {}
        if unknown := options.keys() - {"poses", "targets", "arenas"}:
            raise PlacementError(f"unknown reset options {sorted(unknown)}; known are poses, targets and arenas")
        self.reset(poses=options.get("poses"), targets=options.get("targets"), arenas=options.get("arenas"))

    def _placements(self, name: str, values: ArrayLike | None, columns: int, maps: NDArray[np.int32]) -> NDArray[np.float32]:
        """Requested poses or targets, (N, columns), checked; NaN where none is requested."""
        if values is None:
            return np.full((len(self), columns), np.nan, dtype=np.float32)
        try:
            array = np.broadcast_to(np.asarray(values, dtype=np.float32), (len(self), columns)).copy()
        except ValueError as error:
            raise PlacementError(f"{name} must have shape ({len(self)}, {columns})") from error
        if not np.isfinite(array).all():
            raise PlacementError(f"{name} must be finite")
        for index in np.unique(maps):
            here = np.flatnonzero(maps == index)
            bad = here[~self._fits(self.arenas[index], array[here])]
            if len(bad):
                raise PlacementError(
                    f"{name}[{bad[0]}] = {array[bad[0]].tolist()} touches an obstacle or a wall "
                    f"of arena {self.arenas[index].name!r}"
                )
        if columns == 3:
            beyond = np.abs(array[:, 2]) > np.pi
            array[beyond, 2] = np.arctan2(np.sin(array[beyond, 2]), np.cos(array[beyond, 2]))
        return array

    def _fits(self, arena: Arena, places: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Whether poses (n, 3) have room for the body, or targets (n, 2) are free."""
        robot = self.task.robot
        if places.shape[1] == 2:
            return free_distance(arena, places) > 0.0
        if robot.half_extents is None:
            return free_distance(arena, places[:, :2]) > robot.inscribed_radius
        return np.array([rectangle_clearance(arena, pose, *robot.half_extents) > 0.0 for pose in places])

    def step(self, actions: NDArray[np.float32]) -> None:
        """Drive every robot for one control period.

        Args:
            actions: (N, A) float32 fractions of the robot's limits, see `sim.actions`; clipped.
                What it is makes no difference to robots that begin their next episode in this step.

        Raises:
            ValueError: an action is not finite, or there is not one for each robot.
            FormulaError: a formula of the reward is not.
            ObservationError: a number that an extension makes of an observation is not.
        """
        space = self._space
        write, _ = self._kernels
        actions = np.ascontiguousarray(actions, dtype=np.float32)
        if actions.shape != (shape := (len(self), self._action_size)):
            raise ValueError(f"actions have the shape {shape}, not {actions.shape}")
        ended = self.robots.terminations | self.robots.truncations if self._restart == "next step" else None
        if ended is not None:
            self.robots.records["parked"][ended] = 1
        self.movers.look(self.robots, self._parameters)
        invalid = write(actions, self.robots, space.state, space.command, self._parameters)
        if invalid >= 0:
            raise ValueError(f"the action of robot {invalid} is not finite: {actions[invalid].tolist()}")
        if len(self.movers):
            self.movers.step(space.command, len(self))
        space.step(self.task.control_period)
        if self.task.together > 1:
            see_one_another(space.state, self.robots, self.geometry, self._parameters)
        self._follow()
        self._formulas.add(self.robots)
        if self._paths is not None:
            self._paths.look(self.robots, self.robots.records["parked"] == 0, self.crew)
            self._path_progress.add(self.robots)
        if self._looks_back:
            self._look_back()
        if ended is not None and ended.any():
            self._begin(ended)

    def _follow(self) -> None:
        """What follows a step's physics, on several threads where robots see what takes long, and not one another."""
        robots, space, (_, step) = len(self), self._space, self._kernels
        if self.crew.threads == 1 or self._is_usual or self.task.together > 1:
            count = step(0, robots, space.state, self._placed, self.robots, self.geometry, self._parameters)
            if count:
                space.put(self._placed[:count])
            return
        parts = self.crew.stretches(robots)
        while len(self._geometries) < len(parts):
            self._geometries.append(self.geometry.with_scratch_of_its_own())

        def follow(part: int) -> int:
            geometry = self._geometries[part]
            count: int = step(*parts[part], space.state, self._placed, self.robots, geometry, self._parameters)
            return count

        for (first, _), count in zip(parts, self.crew.share(follow, len(parts)), strict=True):
            if count:
                space.put(self._placed[first : first + count])

    @cached_property
    def _kernels(self) -> tuple[Callable[..., Any], Callable[..., Any]]:
        """What writes the commands of a step, and what follows its physics, for this world's arrays."""
        actions, space = np.zeros((len(self), self._action_size), np.float32), self._space
        step = step_usual_robots if self._is_usual else step_any_robots
        return (
            bound(write_commands, actions, self.robots, space.state, space.command, self._parameters),
            bound(step, 0, len(self), space.state, self._placed, self.robots, self.geometry, self._parameters),
        )

    def _begin(self, which: NDArray[np.bool_]) -> None:
        """Begin the next episode of some robots (N,), which are parked."""
        self.robots.records["parked"][which] = 0
        drawn = np.full((len(self), 3), np.nan, dtype=np.float32)
        reset_robots(which, drawn, drawn, self.robots, self.geometry, self._parameters, self._space.state)
        self._space.put(np.flatnonzero(which).astype(np.int32))
        self._see_added_parts(which, begins=True)
        self._find_paths_from_here(which)

    def _look_back(self) -> None:
        """What follows a step where extensions see: their parts, also of the episodes that ended, and the next episodes."""
        robots = self.robots
        self._see_added_parts(robots.records["parked"] == 0, begins=False)
        self._path_progress.begin(robots.outcomes == ARRIVAL)
        if self._sampling is not None and len(over := np.flatnonzero(robots.outcomes)):
            self._sampling.learn(robots.records["map"][over].tolist(), (robots.outcomes[over] == ARRIVAL).tolist())
        self._guide(robots.records["parked"] == 0)
        ended = robots.terminations | robots.truncations
        if not ended.any():
            return
        robots.final_observations[ended] = robots.observations[ended]
        if self.guidance is not None:
            self.guidance.keep(robots, ended)
        if self._restart == "same step":
            results = [robots.rewards, robots.terms, robots.terminations, robots.truncations, robots.outcomes]
            results += [robots.records[name] for name in ("steps", "attempt_reward", "path_length", "min_clearance")]
            kept = [result[ended] for result in results]
            self._begin(ended)
            for result, values in zip(results, kept, strict=True):
                result[ended] = values

    def _see_added_parts(self, which: NDArray[np.bool_], *, begins: bool) -> None:
        """Write what extensions see for some robots (N,); where an episode begins, it stands for earlier moments too."""
        rows = np.flatnonzero(which)
        if not self._added_parts or not len(rows):
            return
        robots = self.robots
        poses = robots.poses[rows]
        if robots.drift.shape[0]:
            believed = poses + robots.drift[rows]
            believed[:, 2] = np.arctan2(np.sin(believed[:, 2]), np.cos(believed[:, 2]))
            poses = believed.astype(np.float32)
        sight = Sight(
            ranges=robots.ranges[rows],
            poses=poses,
            targets=robots.targets[rows],
            speeds=self.followed()[rows],
            actions=robots.commands[rows],
        )
        for name, values in self._added_parts.seen(sight).items():
            places = self._added_parts.places[name]
            for place in places if begins else places[:1]:
                robots.observations[rows, place] = values

    @property
    def fields_of_view(self) -> NDArray[np.float64]:
        """(N,) degrees that each robot's rays cover in this episode."""
        fields: NDArray[np.float64] = self.robots.drawn[:, FIELD_OF_VIEW]
        return fields

    def followed(self) -> NDArray[np.float32]:
        """(N, A) commands that were followed in the last step: late, and limited by accelerations."""
        # The last number of an action is kept as `angular`, whatever it turns the robot by.
        names = (*action_layout(self.task.robot).names[:-1], "angular")
        return np.stack([self.robots.records[name] for name in names], axis=1)

    def twists(self) -> NDArray[np.float32]:
        """(N, 3) speeds forwards and to the left, m/s, and turning rate, rad/s, of the middle of each body in the last step.

        Zero for robots that started anew in it.
        """
        fastest, turning = self.robots.drawn[:, [MAX_LINEAR, MAX_ANGULAR]].T
        return twists(self.task.robot, self.followed(), fastest, turning).astype(np.float32)

    def put_mover(self, slot: int, x: float, y: float) -> None:
        """Put what moves somewhere else in the first copy of the first arena; it goes on from there.

        Args:
            slot: its row of `movers.discs`.
            x: metres.
            y: metres.
        """
        self.movers.put(slot, x, y)
        self.movers.write_places(self._space.state[len(self) : -1])
        self._space.put_all()

    def tiles(self) -> NDArray[np.int32]:
        """(N,) which copy of an arena each robot is in: a row of the movers' discs; modulo the arenas it is the arena."""
        records = self.robots.records
        tiles: NDArray[np.int32] = records["replica"] * np.int32(len(self.arenas)) + records["map"]
        return tiles

    def velocities(self, which: NDArray[np.int64]) -> NDArray[np.float32]:
        """(n, 2) of some robots in the last step, m/s and rad/s."""
        records, drawn = self.robots.records[which], self.robots.drawn[which]
        fractions = np.stack([records["linear"], records["angular"]], axis=1)
        velocities: NDArray[np.float32] = (fractions * drawn[:, [MAX_LINEAR, MAX_ANGULAR]]).astype(np.float32)
        return velocities

    def park(self, which: NDArray[np.bool_] | NDArray[np.int64]) -> None:
        """Leave robots standing, at next to no cost, until the next `reset`; their outcomes stay 0."""
        self.robots.records["parked"][which] = 1

    def _state(self) -> dict[str, NDArray[np.generic]]:
        """The arrays that the future depends on; those that have nothing to say in this task are left out."""
        unread = {"last_linear", "last_angular", "last_lateral"} if not reads_changes(self.task.reward) else set()
        if self.task.robot.drive.name != "omnidirectional":
            unread |= {"lateral", "last_lateral"}
        names = (name for name in ROBOT.names or () if name not in unread)
        state: dict[str, NDArray[np.generic]] = {name: self.robots.records[name] for name in names}
        drawn = self.task.randomisation
        constant = {"records", "terms", "quantities", "reach"} | (set() if drawn != RandomisationConfig() else {"drawn"})
        constant |= set() if drawn.field_of_view else {"ray_cos", "ray_sin", "ahead"}
        arrays: dict[str, NDArray[np.generic]] = self.robots._asdict()
        # Zeros behind the rays were not part of it when there was one LiDAR only.
        rays = self.task.lidar.rays if len(self.task.lidar.mount.places) == 1 else None
        arrays |= {"ray_cos": self.robots.ray_cos[:, :rays], "ray_sin": self.robots.ray_sin[:, :rays]}
        state |= {name: array for name, array in arrays.items() if array.size and name not in constant}
        state["bodies"] = self._space.state
        return state | self.movers.state() | (self._sampling.state() if self._sampling else {})

    def get_state(self) -> dict[str, NDArray[np.generic]]:
        """Everything that the future depends on, as plain arrays."""
        return {name: array.copy() for name, array in self._state().items()}

    def set_state(self, state: Mapping[str, NDArray[np.generic]]) -> None:
        """Go on from what `get_state` gave, bit for bit.

        Raises:
            ValueError: the state is of another task or number of robots.
        """
        targets = self._state()
        # The terms of the last step and the reach were part of it once.
        state = {name: array for name, array in state.items() if name not in ("terms", "reach")}
        if state.keys() != targets.keys():
            raise ValueError(f"not a state of this environment: {sorted(state.keys() ^ targets.keys())} do not match")
        for name, target in targets.items():
            if state[name].shape != target.shape:
                raise ValueError(
                    f"{name} has shape {state[name].shape}, not {target.shape}: another task or number of robots"
                )
        for name, target in targets.items():
            target[...] = state[name]
        self._space.put_all()
        self._find_paths_from_here(np.ones(len(self), np.bool_))
