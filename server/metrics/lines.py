"""Series as they are read and kept: what is known of a beginning as buckets, and every point from there on."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from server.metrics.buckets import Buckets
from server.metrics.points import Points


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """One series.

    Attributes:
        before: the buckets of its beginning; None where every point is there.
        points: those behind it. Of points that the buckets know none is looked at.
    """

    before: Buckets | None
    points: Points

    @property
    def buckets(self) -> Buckets:
        """All of it, every point a bucket of its own."""
        if self.before is None or not len(self.before):
            return Buckets.of(self.points)
        fresh = self.points[self._known(self.points) :]
        return Buckets.joined([self.before, Buckets.of(fresh)]) if len(fresh) else self.before

    @property
    def newest(self) -> int:
        """Its last step; -1 where it has none."""
        steps = self.points.steps if len(self.points) or self.before is None else self.before.steps
        return int(steps[-1]) if steps.size else -1

    def followed(self, fresh: Points) -> "Line":
        """The series, and these points in place of all that it has from the first of them on; buckets stay."""
        return Line(self.before, self.points.followed(fresh[self._known(fresh) :]))

    def arrays(self) -> Iterator[NDArray[Any]]:
        """What it holds."""
        points, before = self.points, self.before
        yield from (points.steps, points.times, points.values)
        if before is not None:
            yield from (before.steps, before.sizes, before.finite, before.low, before.mean, before.high)

    def _known(self, points: Points) -> int:
        """How many of these points the buckets know."""
        if self.before is None or not len(self.before):
            return 0
        return int(np.searchsorted(points.steps, self.before.steps[-1], side="right"))


def grown(lines: Mapping[str, Line], fresh: Mapping[str, Points]) -> dict[str, Line]:
    """The series, by name, each from the first of its fresh points on by those alone; series that lie alike share where."""
    followed = dict(lines)
    for name, points in fresh.items():
        line = lines.get(name)
        followed[name] = Line(None, points) if line is None else line.followed(points)
    return sharing_places({name: followed[name] for name in sorted(followed)})


def cut_lines(lines: Mapping[str, Line], limit: int) -> dict[str, Buckets]:
    """Series at most `limit` (at least 2) buckets wide, by name; no two are there in full at a time."""
    return {name: line.buckets.cut(limit) for name, line in lines.items()}


def sharing_places(lines: Mapping[str, Line]) -> dict[str, Line]:
    """The same series: what was reported together has where it lies once, which is most of the bytes that it would take."""
    places: list[Points] = []
    grids: list[Buckets] = []
    return {
        name: Line(None if line.before is None else _gridded(line.before, grids), _placed(line.points, places))
        for name, line in lines.items()
    }


def _gridded(buckets: Buckets, grids: list[Buckets]) -> Buckets:
    """These buckets on the first of the grids that is theirs, which they add where there is none."""
    for known in grids:
        alike = ((known.steps, buckets.steps), (known.sizes, buckets.sizes), (known.finite, buckets.finite))
        if all(np.array_equal(one, other) for one, other in alike):
            return Buckets(known.steps, known.sizes, known.finite, buckets.low, buckets.mean, buckets.high)
    grids.append(buckets)
    return buckets


def _placed(points: Points, places: list[Points]) -> Points:
    """These points at the first of the places that are theirs, which they add where there is none."""
    for known in places:
        if np.array_equal(known.steps, points.steps) and np.array_equal(known.times, points.times):
            return Points(known.steps, known.times, points.values)
    # What is a part of more would keep all of it.
    own = Points(points.steps.copy(), points.times.copy(), points.values)
    places.append(own)
    return own
