"""Which openings a robot had better look into: edges of what its views show, and the ways to them that it knows.

As in training it keeps views (`views.py`). An opening is where two readings side by side of a view differ by more than
0.4 m, half way between their ends, if the body fits through; or the middle of up to ten that all read the LiDAR's range. It
is open while no other view has seen it: while in each of them one of the two readings beside it ends more than 0.2 m before
it, or the line to it leads through a gap that was found to be too narrow (`gaps.py`). Its gate is half way between where the
nearer of the two readings ends and the nearest end of the 30 on the other side, if that is less than three times the
distance that the robot keeps from obstacles away, else one and a half times that beside it. The newest 64 are remembered,
two within 0.4 m are one. Each view is linked to the one before it, and to the oldest and the nearest of each run of earlier
ones that the body can go to straight on (eight at most); by these links it is so and so far to every view, and on to its
openings.

Told are those by which the goal would be nearest if what was not seen were free, at least 1 m apart, the goal itself where a
view shows it among them. Where the body can't go straight on from the view the way is taken to be 1 m longer, and 8 m where
it leads through a gap that was found to be too narrow (`gaps.py`), through which no links lead; where a view shows the goal
and the body can't go straight on to it, and for each wall that a view shows between an opening and the goal, 4 m. A wall is
where 16 directions side by side read less than the LiDAR's range without a jump: from the end of the sixth straight to that
of the eleventh, the first one being every fifth direction of a view. For each half metre of the line from an opening to the
goal it is remembered whether a wall crosses it, at least 0.2 m from the line's ends; halves side by side are of one wall.
What is told is chosen anew where a view is kept, else every 16 steps. What was told first since then, an opening or the
goal, counts 0.04 m farther for each of these steps, unless the way to it was more than 0.2 m shorter than it had ever been
when it was told first. For each opening that is told:

| number   | what it is                                                                                     |
|----------|------------------------------------------------------------------------------------------------|
| sine     | of the bearing of the place to go to first                                                      |
| cosine   | likewise                                                                                        |
| nearness | 1 - its distance / range of the LiDAR, at least 0                                               |
| way      | w / (w + 1 m), w the metres from the newest view to the opening                                 |
| rest     | r / (r + 1 m), r the metres that it is taken to be from there to the goal                       |
| free     | 1 where the body can go there straight on from the view that saw it                             |

0 where there is none. The place to go to first is the gate, while that is in sight, more than 0.15 m away and nearer to the
opening than the robot is; else the last place on the way to the opening that is in sight.
"""

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .gaps import Gaps, crossed
from .observation import Reals, ray_angles, wrap
from .policy import Specification
from .views import DIRECTIONS, FULL_RANGE, KeptViews

JUMP = 0.4
SLACK = 0.2
SAME = 0.4
APART = 1.0
SLIM = 0.95
DETOUR = 4.0
THROUGH_GAP, ROUND_A_BEND, STRAIGHT_ON = 0, 1, 2
FARTHER = (8.0, 1.0, 0.0)
AT_HAND = 0.35
AT_GATE = 0.15
GATE_WIDTH = 3.0
FLAT_RUN = 10
OPENING_ROOM = 64
LINK_ROOM = 8
CHORD = 5
MARGIN = 0.2
HALF_METRE = 0.5
MOST_HALVES = 60
DUE = 0.04
NEARER = 0.2
PATIENCE = 16
NUMBERS = 6


@dataclass(frozen=True)
class _Opening:
    """A place beyond which nothing was seen yet.

    Attributes:
        place: (2,) metres.
        gate: (2,) metres, where the body goes through on its way there from the view.
        view: number of the view that saw it.
        access: how the body gets there from that: STRAIGHT_ON, ROUND_A_BEND, or THROUGH_GAP if at all.
        crossed: which half metres of the line from there to the goal walls cross.
    """

    place: Reals
    gate: Reals
    view: int
    access: int
    crossed: frozenset[int] = frozenset()

    @property
    def walls(self) -> int:
        """How many walls those are."""
        return sum(half - 1 not in self.crossed for half in self.crossed)


@dataclass
class _Patience:
    """Metres that an opening, or the goal, counts farther, and the least way to it when it was told first."""

    due: float = 0.0
    nearest: float = float("inf")

    def wait(self, way: float, steps: int) -> None:
        """It was told first for so many steps, with so long a way."""
        if way < self.nearest - NEARER:
            self.nearest = way
        else:
            self.due += DUE * steps


@dataclass(frozen=True)
class _Lead:
    """An opening, or the goal if a view shows it.

    Attributes:
        opening: it, or where the goal is.
        way: metres to it by known ways.
        rest: metres that it is taken to be from there to the goal.
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
        """Metres that the way to the goal is taken to have."""
        return self.way + self.rest + self.farther + self.patience.due


class Openings(KeptViews):
    """The openings of one robot on its way to one goal.

    Args:
        specification: of a policy that is told openings.

    Attributes:
        kind: of the part that it makes the numbers of.
    """

    def __init__(self, specification: Specification) -> None:
        super().__init__(specification)
        (part,) = (part for part in specification.parts if part.remembered_by == "openings")
        self.kind, self._count = part.kind, part.size // NUMBERS
        self._slim = SLIM * specification.near
        self._near = specification.near
        # What a view keeps where a ray meets nothing, rounded as it is there.
        self._farthest = FULL_RANGE * specification.range / FULL_RANGE
        self._spacing = float(ray_angles(specification)[1] - ray_angles(specification)[0])
        self.clear()

    def clear(self) -> None:
        """Forget all: a new way begins."""
        super().clear()
        self._links: dict[int, set[int]] = {}
        self._gaps = Gaps(self._near, JUMP)
        self._through_gaps: set[int] = set()
        self._walls: list[Reals] = []
        self._slots: list[_Opening | None] = [None] * OPENING_ROOM
        self._patience = [_Patience() for _ in range(OPENING_ROOM)]
        self._patience_with_goal = _Patience()
        self._leads: list[_Lead] = []
        self._steps = 0
        self._ways: dict[int, float] = {}
        self._next: dict[int, int] = {}

    def see(self, ranges: ArrayLike, pose: ArrayLike, target: ArrayLike) -> Reals:
        """Keep a view where it is time to, and tell which openings to look into; once per control period.

        Args:
            ranges: (scan,) metres, as the policy sees them.
            pose: x, y in metres and heading in radians.
            target: x, y in metres, in the same frame.

        Returns:
            (6 * openings,).
        """
        scan, goal = np.asarray(ranges, np.float64)[: len(self._angles)], np.asarray(target, np.float64)
        here = np.asarray(pose, np.float64)
        is_kept = self.keep(scan, here)
        self._steps += 1
        if is_kept or self._steps >= PATIENCE:
            if self._leads:
                self._leads[0].patience.wait(self._leads[0].way, self._steps)
            if is_kept:
                self._look(goal)
            self._leads, self._steps = self._choose(goal), 0
        numbers = np.zeros((self._count, NUMBERS))
        for row, lead in zip(numbers, self._leads, strict=False):
            dx, dy = self._first_place(lead.opening, scan, here)
            bearing = np.arctan2(dy, dx) - here[2]
            nearness = 1.0 - min(np.hypot(dx, dy) / self._range, 1.0)
            row[:3] = np.sin(bearing), np.cos(bearing), nearness
            row[3:] = lead.way / (lead.way + 1.0), lead.rest / (lead.rest + 1.0), lead.opening.access == STRAIGHT_ON
        return numbers.reshape(-1)

    @property
    def _oldest(self) -> int:
        """Number of the oldest view that is remembered."""
        return self.kept - len(self.places)

    def _look(self, goal: Reals) -> None:
        """Link the newest view, close the openings that it shows, open those that it has, and measure the ways."""
        newest = self.kept - 1
        self._close_gaps(newest, goal)
        self._link(newest)
        self._walls = [*self._walls, self._find_walls()][-len(self.places) :]
        for slot, one in enumerate(self._slots):
            if one and (one.view < self._oldest or self._which_have_seen(one.place)[-1]):
                self._slots[slot] = None
            elif one:
                self._slots[slot] = replace(one, crossed=one.crossed | _crossed(self._walls[-1], one.place, goal))
        here = np.array(self.places[-1])
        for place, gate, is_free in self._edges():
            if not self._which_have_seen(place)[:-1].any():
                access = STRAIGHT_ON if is_free else ROUND_A_BEND
                access = THROUGH_GAP if self._gaps.lead_through(here, place) else access
                self._open(_Opening(place, gate, newest, access, _crossed(np.concatenate(self._walls), place, goal)))
        self._measure_ways(newest)
        if self._gaps.lead_through(here, goal):
            self._through_gaps.add(newest)

    def _close_gaps(self, newest: int, goal: Reals) -> None:
        """Let no opening, no sight of the goal and no link lead through a gap that the newest view found to be narrow."""
        for gap in self._gaps.measure(self.readings[-1], self._ends(np.arange(DIRECTIONS), self.readings[-1])):
            for slot, one in enumerate(self._slots):
                if one and one.view >= self._oldest and crossed(self._place_of(one.view), one.place, gap[None])[0]:
                    self._slots[slot] = replace(one, access=THROUGH_GAP)
            for number in range(self._oldest, newest):
                if crossed(self._place_of(number), goal, gap[None])[0]:
                    self._through_gaps.add(number)
                for other in [one for one in self._links[number] if self._oldest <= one < number - 1]:
                    if crossed(self._place_of(number), self._place_of(other), gap[None])[0]:
                        self._links[number].remove(other)
                        self._links[other].discard(number)

    def _find_walls(self) -> Reals:
        """Walls of the newest view, (walls, 2, 2): where each begins and ends, metres."""
        readings = self.readings[-1]
        chords = np.arange(0, DIRECTIONS, CHORD)
        along = readings[(chords[:, None] + np.arange(CHORD + 1)) % DIRECTIONS]
        is_solid = ((along > 0.0) & (along < self._farthest)).all(axis=1) & (np.abs(np.diff(along)) <= JUMP).all(axis=1)
        is_solid &= np.roll(is_solid, 1) & np.roll(is_solid, -1)
        ends = self._ends(chords, readings[chords])
        walls: Reals = np.stack((ends, np.roll(ends, -1, axis=0)), axis=1)[is_solid]
        return walls

    def _which_show(self, place: Reals, slack: float) -> Reals:
        """In which views neither of the two readings beside a place ends more than the slack before it, (views,) bool."""
        offsets = place - np.array(self.places)
        beside = (np.arctan2(offsets[:, 1], offsets[:, 0]) + np.pi) / (2.0 * np.pi) * DIRECTIONS - 0.5
        right, rows = np.floor(beside).astype(int), np.arange(len(offsets))
        readings = np.array(self.readings)
        sights = np.minimum(readings[rows, right % DIRECTIONS], readings[rows, (right + 1) % DIRECTIONS])
        shown: Reals = np.hypot(*offsets.T) <= sights + slack
        return shown

    def _which_have_seen(self, place: Reals) -> Reals:
        """In which views a place is shown, and not only through a gap that the body does not fit through, (views,) bool."""
        shown = self._which_show(place, SLACK)
        for row in np.flatnonzero(shown):
            shown[row] = not self._gaps.lead_through(np.array(self.places[row]), place)
        return shown

    def _link(self, newest: int) -> None:
        """Link the newest view to the one before, and to the oldest and the nearest of each run that it can go to."""
        self._links[newest] = set()
        self._links.pop(self._oldest - 1, None)
        if newest == self._oldest:
            return
        here, links = np.array(self.places[-1]), [newest - 1]
        run: list[int] = []
        for number in range(newest - 2, self._oldest - 2, -1):
            if number >= self._oldest and self._links_to(self._place_of(number)):
                run.append(number)
            elif run:
                nearest = min(run, key=lambda one: np.hypot(*(self._place_of(one) - here)))
                links += [run[-1]] if nearest == run[-1] else [run[-1], nearest]
                run = []
        for number in links[:LINK_ROOM]:
            self._links[newest].add(number)
            self._links[number].add(newest)

    def _links_to(self, place: Reals) -> bool:
        """Whether the body can go from the newest view to a place straight on, and through no narrow gap."""
        return self._is_passable(-1, place) and not self._gaps.lead_through(np.array(self.places[-1]), place)

    def _is_passable(self, row: int, place: Reals) -> bool:
        """Whether a view shows a place, and that the body can go there straight on."""
        offset = place - np.array(self.places[row])
        distance, angle = float(np.hypot(*offset)), float(np.arctan2(offset[1], offset[0]))
        right = int(np.floor((angle + np.pi) / (2.0 * np.pi) * DIRECTIONS - 0.5))
        readings = self.readings[row]
        if distance > min(readings[right % DIRECTIONS], readings[(right + 1) % DIRECTIONS]):
            return False
        return distance < self._slim or self._is_free(row, angle, distance)

    def _is_free(self, row: int, angle: float, until: float) -> bool:
        """Whether the body can go straight on from a view in a direction, for so many metres, as its readings show."""
        readings, off = self.readings[row], _angles(np.arange(DIRECTIONS)) - angle
        along, across = readings * np.cos(off), np.abs(readings * np.sin(off))
        return not ((readings < self._farthest) & (along > 0.0) & (along < until) & (across < self._slim)).any()

    def _place_of(self, number: int) -> Reals:
        """Where a view was kept, (2,) metres."""
        return np.array(self.places[number - self._oldest])

    def _edges(self) -> Iterator[tuple[Reals, Reals, bool]]:
        """Where the newest view's readings jump, or end at the LiDAR's range, their gates, and whether the way is free."""
        readings, run = self.readings[-1], 0
        ends = self._ends(np.arange(DIRECTIONS), readings)
        for k in range(DIRECTIONS):
            right, left = readings[k], readings[(k + 1) % DIRECTIONS]
            if right == 0.0 or left == 0.0:
                run = 0
                continue
            if abs(right - left) > JUMP:
                gate, fits = self._gate(ends, k, right < left)
                nearer, direction = min(right, left), (k + 1) % DIRECTIONS - 0.5
                if fits:
                    is_free = self._is_free(-1, float(_angles(direction)), nearer - self._near)
                    yield self._ends(direction, (right + left) / 2.0), gate, is_free
            run = run + 1 if right >= self._farthest else 0
            if run and (run == FLAT_RUN or left < self._farthest):
                if run > 1:
                    place = self._ends(k - run // 2, self._range)
                    yield place, place, self._is_free(-1, float(_angles(k - run // 2)), self._range)
                run = 0

    def _gate(self, ends: Reals, k: int, is_right: bool) -> tuple[Reals, bool]:
        """Where the body goes through between directions k and k + 1 of the newest view, and whether it fits."""
        near, beyond, step = (k, k + 1, 1) if is_right else (k + 1, k, -1)
        across = (beyond + step * np.arange(DIRECTIONS // 4)) % DIRECTIONS
        readings, edge = self.readings[-1][across], ends[near % DIRECTIONS]
        apart = np.hypot(*(ends[across] - edge).T)
        apart[(readings <= 0.0) | (readings >= self._farthest)] = np.inf
        least, widest = int(apart.argmin()), GATE_WIDTH * self._near
        if apart[least] >= widest:
            angle = float(_angles((k + 1) % DIRECTIONS - 0.5))
            return edge + step * widest / 2.0 * np.array((-np.sin(angle), np.cos(angle))), True
        return (edge + ends[across[least]]) / 2.0, bool(apart[least] >= 2.0 * self._slim)

    def _ends(self, directions: ArrayLike, readings: ArrayLike) -> Reals:
        """Where readings in directions of the newest view end, (..., 2) metres."""
        angles = _angles(directions)
        away: Reals = np.stack((np.cos(angles), np.sin(angles)), axis=-1) * np.asarray(readings)[..., None]
        ends: Reals = away + np.array(self.places[-1])
        return ends

    def _open(self, opening: _Opening) -> None:
        """Remember an opening: in place of the same one, in an empty slot, or in that of the one seen the longest ago.

        One that the body gets to more easily stays before the same one elsewhere.
        """
        taken = [one.view if one else -1 for one in self._slots]
        slots = enumerate(self._slots)
        same = next((k for k, one in slots if one and np.hypot(*(one.place - opening.place)) < SAME), None)
        known = None if same is None else self._slots[same]
        if known is None or opening.access >= known.access:
            slot = taken.index(min(taken)) if same is None else same
            self._slots[slot] = opening
            if same is None:
                self._patience[slot] = _Patience()

    def _measure_ways(self, newest: int) -> None:
        """How far it is from the newest view to every other one by links, and by which view it goes there (Dijkstra)."""
        self._ways, self._next = {newest: 0.0}, {}
        reached, queue = set(), [(0.0, newest)]
        while queue:
            way, one = heapq.heappop(queue)
            if one in reached:
                continue
            reached.add(one)
            for other in self._links[one]:
                farther = (
                    way + float(np.hypot(*(self._place_of(one) - self._place_of(other))))
                    if other >= self._oldest
                    else np.inf
                )
                if farther < self._ways.get(other, np.inf):
                    self._ways[other], self._next[other] = farther, one
                    heapq.heappush(queue, (farther, other))

    def _choose(self, goal: Reals) -> list[_Lead]:
        """The openings by which the goal would be nearest, the best one first."""
        found = []
        for row in np.flatnonzero(self._which_show(goal, 0.0)).tolist():
            number, is_free = row + self._oldest, self._is_passable(row, goal)
            farther = 0.0 if is_free else DETOUR
            if number in self._through_gaps:
                farther, is_free = FARTHER[THROUGH_GAP], False
            shown = _Opening(goal, goal, number, STRAIGHT_ON if is_free else ROUND_A_BEND)
            found.append(_Lead(shown, self._way(number, goal), 0.0, farther, self._patience_with_goal))
        for one, patience in zip(self._slots, self._patience, strict=True):
            if one:
                rest = float(np.hypot(*(goal - one.place))) + DETOUR * one.walls
                found.append(_Lead(one, self._way(one.view, one.place), rest, FARTHER[one.access], patience))
        chosen: list[_Lead] = []
        for lead in sorted(found, key=lambda lead: lead.whole):
            if all(np.hypot(*(lead.opening.place - other.opening.place)) >= APART for other in chosen):
                chosen.append(lead)
        return chosen[: self._count]

    def _way(self, view: int, place: Reals) -> float:
        """Metres from the newest view to a place that another one shows."""
        return self._ways.get(view, np.inf) + float(np.hypot(*(place - self._place_of(view))))

    def _first_place(self, opening: _Opening, scan: Reals, pose: Reals) -> Reals:
        """Metres to an opening's gate, or to the last place on the way there that is in sight, (2,)."""
        to: Reals = opening.place - pose[:2]
        gate: Reals = opening.gate - pose[:2]
        is_ahead = np.hypot(*(opening.place - opening.gate)) < np.hypot(*to) and np.hypot(*gate) > AT_GATE
        if is_ahead and self._is_in_sight(gate, scan, pose[2], 0.0, farthest=False):
            return gate
        if self._is_in_sight(to, scan, pose[2], SLACK, farthest=True):
            return to
        view: int | None = opening.view
        while view is not None:
            here = self._place_of(view) - pose[:2]
            if np.hypot(*here) < AT_HAND:
                return to
            if self._is_in_sight(here, scan, pose[2], 0.0, farthest=False):
                return here
            to, view = here, self._next.get(view)
        return to

    def _is_in_sight(self, to: Reals, scan: Reals, heading: float, slack: float, *, farthest: bool) -> bool:
        """Whether the farthest or the nearest of the three rays towards a place ends there or beyond."""
        distance = float(np.hypot(*to))
        off = np.abs(wrap(np.arctan2(to[1], to[0]) - heading - self._angles))
        ray = int(off.argmin())
        if distance >= self._range or off[ray] > self._spacing / 2.0 + 1e-9:
            return False
        beside = scan[(ray + np.array((-1, 0, 1))) % len(scan)]
        return bool(distance <= (beside.max() if farthest else beside.min()) + slack)


def _crossed(walls: Reals, place: Reals, goal: Reals) -> frozenset[int]:
    """Which half metres of the line from a place to the goal walls (n, 2, 2) cross."""
    length = float(np.hypot(*(goal - place)))
    if length <= 2.0 * MARGIN:
        return frozenset()
    cos, sin = (goal - place) / length
    x, y = np.moveaxis(walls - place, -1, 0)
    along, across = x * cos + y * sin, y * cos - x * sin
    meets = (across[:, 0] > 0.0) != (across[:, 1] > 0.0)
    (one, other), (left, right) = along[meets].T, across[meets].T
    where = (left * other - right * one) / (left - right)
    halves = (where[(where > MARGIN) & (where < length - MARGIN)] / HALF_METRE).astype(int)
    return frozenset(np.minimum(halves, MOST_HALVES - 1).tolist())


def _angles(directions: ArrayLike) -> Reals:
    """Where directions of a view point, radians."""
    angles: Reals = ((np.asarray(directions) + 0.5) / DIRECTIONS - 0.5) * 2.0 * np.pi
    return angles
