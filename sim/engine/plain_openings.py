"""Which openings one robot had better look into, in plain Python: the reference of `sim.kernels.openings`."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, groupby

import numpy as np
from numpy.typing import NDArray

from sim.config import LidarConfig, OpeningsPart
from sim.engine.plain_narrow_gaps import PlainGaps, crosses
from sim.engine.plain_views import Place, PlainView, PlainViews, angle_of, end_of, wrapped
from sim.kernels.find_openings import FLAT_RUN, GATE_WIDTH, SAME_OPENING, SLACK
from sim.kernels.openings import APART, AT_GATE, AT_HAND
from sim.kernels.patience import DUE, NEARER, PATIENCE
from sim.kernels.room import (
    DETOUR,
    FARTHER,
    LINK_ROOM,
    MAX_LEADS,
    OPENING_KINDS,
    OPENING_ROOM,
    ROUND_A_BEND,
    STRAIGHT_ON,
    THROUGH_GAP,
    VIEW_ROOM,
)
from sim.kernels.views import FREE_SIGHT, FULL_RANGE, NO_SIGHT, SIGHT, SIGHT_THROUGH_GAP, SLIM, VIEW_DIRECTIONS
from sim.kernels.walls import CHORD_DIRECTIONS, CHORDS, JUMP, MARGIN, WALL_BITS, WALL_SPACING
from sim.lidar import ray_angles

_SIGHTS = {SIGHT: DETOUR, FREE_SIGHT: 0.0, SIGHT_THROUGH_GAP: FARTHER[THROUGH_GAP]}
"""Metres that the target is taken to be farther, by how a view shows it."""


@dataclass(frozen=True)
class _Opening:
    """A place beyond which nothing was seen yet.

    Attributes:
        place: metres.
        gate: where the body goes through on its way there from the view, metres.
        view: number of the view that it was seen from.
        access: how the body gets there from that, see `sim.kernels.room`.
        crossed: pieces of the line from there to the target that walls cross, numbered from the opening on.
    """

    place: Place
    gate: Place
    view: int
    access: int
    crossed: frozenset[int] = frozenset()

    @property
    def walls(self) -> int:
        """How many walls those are: pieces side by side are of one."""
        return sum(piece - 1 not in self.crossed for piece in self.crossed)


@dataclass
class _Patience:
    """What is known of an opening, or of the target, since it was told first.

    Attributes:
        due: metres that it counts farther.
        nearest: the least way to it that there was then, metres.
    """

    due: float = 0.0
    nearest: float = math.inf

    def wait(self, way: float, steps: int) -> None:
        """After so many steps in which it was told first, with so long a way, metres: was the robot coming nearer?"""
        if way < self.nearest - NEARER:
            self.nearest = way
        else:
            self.due += DUE * steps


@dataclass(frozen=True)
class _Lead:
    """An opening, or the target if a view shows it.

    Attributes:
        opening: it, or where the target is.
        way: metres to it by known ways.
        rest: metres that are taken to be left from there.
        farther: metres that it counts farther since the body does not get there straight on.
        patience: with it.
    """

    opening: _Opening
    way: float
    rest: float
    farther: float
    patience: _Patience

    @property
    def whole(self) -> float:
        """Metres that the way to the target is taken to have."""
        return self.way + self.rest + self.farther + self.patience.due


@dataclass
class PlainOpenings:
    """The openings of one attempt.

    Attributes:
        lidar: of the robot.
        near: metres, see `sim.observations.near_distance`.
        views: that it keeps.
    """

    lidar: LidarConfig
    near: float
    views: PlainViews
    _gaps: PlainGaps = field(init=False)
    _links: list[list[int]] = field(default_factory=list)
    _sights: list[int] = field(default_factory=list)
    _slots: list[_Opening | None] = field(default_factory=lambda: [None] * OPENING_ROOM)
    _patience: list[_Patience] = field(default_factory=lambda: [_Patience() for _ in range(OPENING_ROOM)])
    _patience_with_target: _Patience = field(default_factory=_Patience)
    _leads: list[_Lead] = field(default_factory=list)
    _chosen_at: int = 0
    _ways: dict[int, float] = field(default_factory=dict)
    _next: dict[int, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._gaps = PlainGaps(self.near)

    @property
    def _remembered(self) -> range:
        """Numbers of the views that are remembered."""
        count = len(self.views.kept)
        return range(max(0, count - VIEW_ROOM), count)

    @property
    def _farthest(self) -> float:
        """What a view keeps where a ray meets nothing, metres; rounded as it is there."""
        return FULL_RANGE * self.lidar.range / FULL_RANGE

    def follow(self, step: int, target: Place, *, is_kept: bool) -> None:
        """Choose what is told after so many steps: where a view was kept in the last of them, and else every 16."""
        if is_kept or step - self._chosen_at >= PATIENCE:
            if self._leads:
                self._leads[0].patience.wait(self._leads[0].way, step - self._chosen_at)
            if is_kept:
                self._look(target)
            self._leads, self._chosen_at = self._choose(target), step

    def _look(self, target: Place) -> None:
        """Link the newest view, close the openings that it shows, open those that it has, and measure the ways."""
        newest = self.views.kept[-1]
        self._close_gaps(newest, target)
        self._links.append(self._links_of(newest))
        for slot, opening in enumerate(self._slots):
            if opening and (opening.view not in self._remembered or self._has_seen(newest, opening.place)):
                self._slots[slot] = None
            elif opening:
                crossed = opening.crossed.union(self._walls_across(newest, opening.place, target))
                self._slots[slot] = replace(opening, crossed=crossed)
        for place, gate, is_free in self._edges(newest):
            if not any(self._has_seen(self.views.kept[number], place) for number in self._remembered[:-1]):
                access = STRAIGHT_ON if is_free else ROUND_A_BEND
                access = THROUGH_GAP if self._gaps.lead_through(newest.place, place) else access
                views = (self.views.kept[number] for number in self._remembered)
                crossed = frozenset(chain.from_iterable(self._walls_across(view, place, target) for view in views))
                self._open(_Opening(place, gate, self._remembered[-1], access, crossed))
        self._measure_ways()
        self._sights.append(self._sight_of(newest, target))

    def _close_gaps(self, newest: PlainView, target: Place) -> None:
        """Let no opening, no sight of the target and no link lead through a gap that the newest view found to be narrow."""
        for gap in self._gaps.measure(newest):
            for slot, opening in enumerate(self._slots):
                if opening and crosses(self.views.kept[opening.view].place, opening.place, gap):
                    self._slots[slot] = replace(opening, access=THROUGH_GAP)
            for number in self._remembered[:-1]:
                place = self.views.kept[number].place
                if self._sights[number] != NO_SIGHT and crosses(place, target, gap):
                    self._sights[number] = SIGHT_THROUGH_GAP
                the_way_it_came, others = self._links[number][:1], self._links[number][1:]
                open_ones = (other for other in others if not crosses(place, self.views.kept[other].place, gap))
                self._links[number] = [*the_way_it_came, *open_ones]

    def _sight_of(self, view: PlainView, target: Place) -> int:
        if not self._shows(view, target, 0.0):
            return NO_SIGHT
        if self._gaps.lead_through(view.place, target):
            return SIGHT_THROUGH_GAP
        return FREE_SIGHT if self._is_passable(view, target) else SIGHT

    def _walls_across(self, view: PlainView, place: Place, target: Place) -> Iterator[int]:
        """Pieces of the line from a place to the target that walls of a view cross."""
        solid = [self._is_solid(view, chord) for chord in range(CHORDS)]
        length = math.dist(place, target)
        for chord in range(CHORDS):
            if not (solid[chord - 1] and solid[chord] and solid[(chord + 1) % CHORDS]) or length <= 2.0 * MARGIN:
                continue
            ends = [(chord + k) * CHORD_DIRECTIONS % VIEW_DIRECTIONS for k in (0, 1)]
            (one_along, one_across), (other_along, other_across) = (
                _along_and_across(end_of(view, k, view.readings[k]), place, target) for k in ends
            )
            if (one_across > 0.0) != (other_across > 0.0):
                along = (one_across * other_along - other_across * one_along) / (one_across - other_across)
                if MARGIN < along < length - MARGIN:
                    yield min(int(along / WALL_SPACING), WALL_BITS - 1)

    def _is_solid(self, view: PlainView, chord: int) -> bool:
        """Whether all readings of a chord met something, and one thing."""
        readings = np.take(view.readings, CHORD_DIRECTIONS * chord + np.arange(CHORD_DIRECTIONS + 1), mode="wrap")
        meets = (readings > 0.0) & (readings < self._farthest)
        return bool(meets.all() and (np.abs(np.diff(readings)) <= JUMP).all())

    def _links_of(self, newest: PlainView) -> list[int]:
        """The view before it, and the oldest and the nearest of each run of earlier ones that it can go to."""
        *earlier, _ = self._remembered
        if not earlier:
            return []
        links = [earlier[-1]]
        in_sight = groupby(reversed(earlier[:-1]), key=lambda number: self._links_to(newest, self.views.kept[number].place))
        for run in (list(numbers) for is_passable, numbers in in_sight if is_passable):
            nearest = min(run, key=lambda number: math.dist(self.views.kept[number].place, newest.place))
            links += [run[-1]] if nearest == run[-1] else [run[-1], nearest]
        return links[:LINK_ROOM]

    def _links_to(self, view: PlainView, place: Place) -> bool:
        shown = self._shows(view, place, 0.0) and self._is_passable(view, place)
        return shown and not self._gaps.lead_through(view.place, place)

    def _edges(self, view: PlainView) -> Iterator[tuple[Place, Place, bool]]:
        """Places where a view's readings jump, or end at the LiDAR's range, their gates, and whether the way is free."""
        run = 0
        for k, (right, left) in enumerate(zip(view.readings, np.roll(view.readings, -1), strict=True)):
            if right == 0.0 or left == 0.0:
                run = 0
                continue
            if abs(right - left) > JUMP:
                gate, fits = self._gate(view, k)
                nearer, direction = min(right, left), (k + 1) % VIEW_DIRECTIONS - 0.5
                if fits:
                    is_free = self._is_free(view, float(angle_of(direction)), nearer - self.near)
                    yield end_of(view, direction, (right + left) / 2.0), gate, is_free
            run = run + 1 if right >= self._farthest else 0
            if run and (run == FLAT_RUN or left < self._farthest):
                if run > 1:
                    place = end_of(view, k - run // 2, self.lidar.range)
                    is_free = self._is_free(view, float(angle_of(k - run // 2)), self.lidar.range)
                    yield place, place, is_free
                run = 0

    def _gate(self, view: PlainView, k: int) -> tuple[Place, bool]:
        """Where the body goes through between directions k and k + 1, and whether it fits."""
        following = (k + 1) % VIEW_DIRECTIONS
        is_right = view.readings[k] < view.readings[following]
        near, beyond, step = (k, following, 1) if is_right else (following, k, -1)
        edge = end_of(view, near, view.readings[near])
        across = ((beyond + step * n) % VIEW_DIRECTIONS for n in range(VIEW_DIRECTIONS // 4))
        posts = [end_of(view, j, view.readings[j]) for j in across if 0.0 < view.readings[j] < self._farthest]
        post = min(posts, key=lambda place: math.dist(edge, place), default=None)
        widest = GATE_WIDTH * self.near
        if post is None or math.dist(edge, post) >= widest:
            angle = float(angle_of((k + 1) % VIEW_DIRECTIONS - 0.5))
            post = edge[0] - step * widest * math.sin(angle), edge[1] + step * widest * math.cos(angle)
        gate = (edge[0] + post[0]) / 2.0, (edge[1] + post[1]) / 2.0
        return gate, math.dist(edge, post) >= 2.0 * SLIM * self.near

    def _open(self, opening: _Opening) -> None:
        """Remember an opening: in place of the same one, in an empty slot, or in that of the one seen the longest ago.

        One that the body gets to more easily stays before the same one elsewhere.
        """
        taken = [-1 if one is None else one.view for one in self._slots]
        slots = enumerate(self._slots)
        same = next((k for k, one in slots if one and math.dist(one.place, opening.place) < SAME_OPENING), None)
        known = None if same is None else self._slots[same]
        if known is None or opening.access >= known.access:
            slot = taken.index(min(taken)) if same is None else same
            self._slots[slot] = opening
            if same is None:
                self._patience[slot] = _Patience()

    def _has_seen(self, view: PlainView, place: Place) -> bool:
        """Whether a view shows a place, and not only through a gap that the body does not fit through."""
        return self._shows(view, place, SLACK) and not self._gaps.lead_through(view.place, place)

    def _shows(self, view: PlainView, place: Place, slack: float) -> bool:
        """Whether neither of the two readings beside a place ends more than the slack before it."""
        dx, dy = place[0] - view.place[0], place[1] - view.place[1]
        k = math.floor((math.atan2(dy, dx) + math.pi) / math.tau * VIEW_DIRECTIONS - 0.5)
        sight = min(view.readings[k % VIEW_DIRECTIONS], view.readings[(k + 1) % VIEW_DIRECTIONS])
        return bool(math.hypot(dx, dy) <= sight + slack)

    def _is_free(self, view: PlainView, angle: float, until: float) -> bool:
        """Whether the body can go straight on from a view in a direction, for so many metres, as its readings show."""
        off = angle_of(np.arange(VIEW_DIRECTIONS)) - angle
        along, across = view.readings * np.cos(off), np.abs(view.readings * np.sin(off))
        meets = (view.readings < self._farthest) & (along > 0.0) & (along < until) & (across < SLIM * self.near)
        return not meets.any()

    def _is_passable(self, view: PlainView, place: Place) -> bool:
        """Whether the body can go straight on from a view to a place that it shows."""
        distance = math.dist(view.place, place)
        angle = math.atan2(place[1] - view.place[1], place[0] - view.place[0])
        return distance < SLIM * self.near or self._is_free(view, angle, distance)

    def _measure_ways(self) -> None:
        """How far it is from the newest view to every other one by links, and by which view it goes there (Dijkstra)."""
        neighbours: dict[int, set[int]] = {number: set() for number in self._remembered}
        for one in self._remembered:
            for other in self._links[one]:
                if other in neighbours:
                    neighbours[one].add(other)
                    neighbours[other].add(one)
        self._ways = dict.fromkeys(self._remembered, math.inf)
        self._ways[self._remembered[-1]] = 0.0
        self._next, left = {}, set(self._remembered)
        while left:
            one = min(left, key=lambda number: self._ways[number])
            left.remove(one)
            for other in neighbours[one]:
                way = self._ways[one] + math.dist(self.views.kept[one].place, self.views.kept[other].place)
                if way < self._ways[other]:
                    self._ways[other], self._next[other] = way, one

    def _choose(self, target: Place) -> list[_Lead]:
        """The openings by which the target would be nearest, the best one first."""
        found = []
        for number in self._remembered:
            sight = self._sights[number]
            if sight != NO_SIGHT:
                shown = _Opening(target, target, number, STRAIGHT_ON if sight == FREE_SIGHT else ROUND_A_BEND)
                found.append(_Lead(shown, self._way_to(shown), 0.0, _SIGHTS[sight], self._patience_with_target))
        for one, patience in zip(self._slots, self._patience, strict=True):
            if one is not None:
                rest = math.dist(one.place, target) + DETOUR * one.walls
                found.append(_Lead(one, self._way_to(one), rest, FARTHER[one.access], patience))
        chosen: list[_Lead] = []
        for lead in sorted(found, key=lambda lead: lead.whole):
            if all(math.dist(lead.opening.place, other.opening.place) >= APART for other in chosen):
                chosen.append(lead)
        return chosen[:MAX_LEADS]

    def _way_to(self, opening: _Opening) -> float:
        """Metres from the newest view to a place that another one shows."""
        return self._ways[opening.view] + math.dist(self.views.kept[opening.view].place, opening.place)

    def seen(self, ranges: NDArray[np.float64], pose: Sequence[float], part: OpeningsPart) -> NDArray[np.float64]:
        """Which openings a robot at a pose had better look into, given its scan, metres: a part's numbers.

        Returns:
            (6 * count,).
        """
        numbers = np.zeros((part.count, OPENING_KINDS))
        for row, lead in zip(numbers, self._leads, strict=False):
            dx, dy = self._first_place(lead.opening, ranges, pose)
            bearing = math.atan2(dy, dx) - pose[2]
            row[:] = (
                math.sin(bearing),
                math.cos(bearing),
                1.0 - min(math.hypot(dx, dy) / self.lidar.range, 1.0),
                lead.way / (lead.way + 1.0),
                lead.rest / (lead.rest + 1.0),
                float(lead.opening.access == STRAIGHT_ON),
            )
        return numbers.reshape(-1)

    def _first_place(self, opening: _Opening, ranges: NDArray[np.float64], pose: Sequence[float]) -> Place:
        """Metres to an opening's gate, or to the last place on the way there that is in sight."""
        to = opening.place[0] - pose[0], opening.place[1] - pose[1]
        gate = opening.gate[0] - pose[0], opening.gate[1] - pose[1]
        is_ahead = math.dist(opening.gate, opening.place) < math.hypot(*to) and math.hypot(*gate) > AT_GATE
        if is_ahead and self._is_in_sight(gate, ranges, pose[2], 0.0, farthest=False):
            return gate
        if self._is_in_sight(to, ranges, pose[2], SLACK, farthest=True):
            return to
        view: int | None = opening.view
        while view is not None:
            place = self.views.kept[view].place
            here = place[0] - pose[0], place[1] - pose[1]
            if math.hypot(*here) < AT_HAND:
                return to
            if self._is_in_sight(here, ranges, pose[2], 0.0, farthest=False):
                return here
            to, view = here, self._next.get(view)
        return to

    def _is_in_sight(self, to: Place, ranges: NDArray[np.float64], heading: float, slack: float, *, farthest: bool) -> bool:
        """Whether the farthest or the nearest of the three rays towards a place ends there or beyond."""
        distance = math.hypot(*to)
        angles = ray_angles(self.lidar) + self.lidar.mount.places[0][2]
        off = np.abs(wrapped(math.atan2(to[1], to[0]) - heading - angles))
        ray = int(off.argmin())
        if distance >= self.lidar.range or off[ray] > (angles[1] - angles[0]) / 2.0:
            return False
        beside = [ranges[(ray + k) % len(angles)] for k in (-1, 0, 1)]
        return bool(distance <= (max(beside) if farthest else min(beside)) + slack)


def _along_and_across(place: Place, begin: Place, end: Place) -> tuple[float, float]:
    """Metres of a place along the line from one to another, and to the left of it."""
    length = math.dist(begin, end)
    cos, sin = (end[0] - begin[0]) / length, (end[1] - begin[1]) / length
    x, y = place[0] - begin[0], place[1] - begin[1]
    return x * cos + y * sin, y * cos - x * sin
