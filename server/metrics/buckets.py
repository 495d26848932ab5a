"""Buckets of neighbouring points: what is kept of a long series beside its chunks, and what a screen is sent."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from server.metrics.points import Points

# A summary has so many buckets at most, and at least half as many once a series is long: finer than any chart is wide.
MAX_BUCKETS = 2_048
# Widths that a summary is good enough for.
SUMMARY_WIDTH = MAX_BUCKETS // 2
_LEVEL = 3
BUCKET_BYTES = 28
"""Of one bucket before it is compressed: step int64, points and finite points int32 each, min, mean and max float32."""

_NONE = np.zeros(0, np.int64)
_ONE, _NOUGHT = np.ones(1, np.int64), np.zeros(1, np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Buckets:
    """A series in buckets, by step.

    Attributes:
        steps: (m,) int64, the last step of each bucket.
        sizes: (m,) int64, its points.
        finite: (m,) int64, those of them that are numbers.
        low: (m,) float64, the smallest of them; nan where there is none.
        mean: (m,) float64, their mean.
        high: (m,) float64, the largest of them.
    """

    steps: NDArray[np.int64]
    sizes: NDArray[np.int64]
    finite: NDArray[np.int64]
    low: NDArray[np.float64]
    mean: NDArray[np.float64]
    high: NDArray[np.float64]

    def __len__(self) -> int:
        return self.steps.size

    def __getitem__(self, part: slice | NDArray[np.intp]) -> "Buckets":
        return Buckets(
            self.steps[part], self.sizes[part], self.finite[part], self.low[part], self.mean[part], self.high[part]
        )

    @property
    def single(self) -> bool:
        """Whether every bucket is one point."""
        return bool((self.sizes == 1).all())

    @classmethod
    def of(cls, points: Points) -> "Buckets":
        """Every point a bucket of its own."""
        values = points.values.astype(np.float64)
        finite = np.isfinite(values)
        values = np.where(finite, values, np.nan)
        return cls(points.steps, np.ones(len(points), np.int64), finite.astype(np.int64), values, values, values)

    @classmethod
    def single_point(cls, step: int, value: float | None) -> "Buckets":
        """One point, of which the value is not known where it was no number."""
        values = np.array([np.nan if value is None else value], np.float64)
        return cls(np.array([step], np.int64), _ONE, _NOUGHT if value is None else _ONE, values, values, values)

    @classmethod
    def joined(cls, parts: Sequence["Buckets"]) -> "Buckets":
        """Buckets one after another."""
        columns = zip(*((p.steps, p.sizes, p.finite, p.low, p.mean, p.high) for p in parts), strict=True)
        steps, sizes, finite, low, mean, high = (np.concatenate(column) for column in columns)
        return cls(steps, sizes, finite, low, mean, high)

    def widened(self) -> "Buckets":
        """Neighbours together, a power of two of points each, so that at most `MAX_BUCKETS` are left."""
        width = 1
        while -(-int(self.sizes.sum()) // width) > MAX_BUCKETS:
            width *= 2
        groups = (np.cumsum(self.sizes) - self.sizes) // width
        return self._grouped(np.flatnonzero(np.diff(groups, prepend=-1)))

    def cut(self, limit: int, stops: NDArray[np.int64] = _NONE) -> "Buckets":
        """At most `limit` of them, as even in points as can be; the newest stands alone.

        Buckets keep what a person looks for and a selection of points would lose: the extremes as a band, the trend as the
        mean.

        Args:
            limit: at least 2, and two more for each stop.
            stops: steps at which a bucket ends, the one up to it standing alone too.
        """
        if len(self) <= limit:
            return self
        begins = np.cumsum(self.sizes) - self.sizes
        if not stops.size:
            wanted = np.linspace(0, begins[-1], limit, dtype=np.int64)
            return self._grouped(_distinct(np.searchsorted(begins, wanted)))
        after = np.searchsorted(self.steps, stops, side="right")
        alone = _distinct(np.sort(np.concatenate([after - 1, after])))
        # The first and the last bucket begin where they do anyway.
        alone = alone[(alone > 0) & (alone < len(self) - 1)]
        wanted = np.linspace(0, begins[-1], limit - alone.size, dtype=np.int64)
        return self._grouped(np.union1d(alone, np.searchsorted(begins, wanted)))

    def _grouped(self, starts: NDArray[np.intp]) -> "Buckets":
        if not starts.size:
            return self
        present = self.finite > 0
        finite = np.add.reduceat(self.finite, starts)
        if present.all():
            low, high = np.minimum.reduceat(self.low, starts), np.maximum.reduceat(self.high, starts)
            mean = np.add.reduceat(self.mean * self.finite, starts) / finite
        else:
            low = np.minimum.reduceat(np.where(present, self.low, np.inf), starts)
            high = np.maximum.reduceat(np.where(present, self.high, -np.inf), starts)
            mean = np.add.reduceat(np.where(present, self.mean * self.finite, 0.0), starts) / np.maximum(finite, 1)
            for array in (low, mean, high):
                array[finite == 0] = np.nan
        ends = np.append(starts[1:], len(self)) - 1
        # Rounding may push the mean of equal values a hair past them.
        return Buckets(self.steps[ends], np.add.reduceat(self.sizes, starts), finite, low, np.clip(mean, low, high), high)

    def encode(self) -> bytes:
        """As bytes, little-endian, field after field, compressed; the steps as differences."""
        steps = np.diff(self.steps, prepend=np.int64(0)).astype("<i8").tobytes()
        counts = (self.sizes.astype("<i4").tobytes(), self.finite.astype("<i4").tobytes())
        values = (each.astype("<f4").tobytes() for each in (self.low, self.mean, self.high))
        return zlib.compress(b"".join((steps, *counts, *values)), _LEVEL)

    @staticmethod
    def steps_in(data: bytes, count: int) -> NDArray[np.int64]:
        """The steps of the first `count` of the buckets that `encode` wrote, which stand before all else.

        Raises:
            ValueError: `data` holds fewer.
        """
        raw = zlib.decompressobj().decompress(data, 8 * count) if count else b""
        if len(raw) < 8 * count:
            raise ValueError(f"{len(raw)} bytes are not the steps of {count} buckets")
        return np.cumsum(np.frombuffer(raw, "<i8"))

    @classmethod
    def decode(cls, data: bytes, count: int) -> "Buckets":
        """The first `count` of the buckets that `encode` wrote.

        Raises:
            ValueError: `data` holds fewer.
        """
        raw = zlib.decompress(data)
        kept, rest = divmod(len(raw), BUCKET_BYTES)
        if rest or kept < count:
            raise ValueError(f"{len(raw)} bytes are not {count} buckets")
        sizes, finite = (np.frombuffer(raw, "<i4", kept, at * kept).astype(np.int64) for at in (8, 12))
        low, mean, high = (np.frombuffer(raw, "<f4", kept, at * kept).astype(np.float64) for at in (16, 20, 24))
        return cls(np.cumsum(np.frombuffer(raw, "<i8", kept)), sizes, finite, low, mean, high)[:count]


def _distinct(ordered: NDArray[np.intp]) -> NDArray[np.intp]:
    """Each of these numbers, which are in order, once."""
    kept: NDArray[np.bool_] = np.append(True, np.diff(ordered) > 0)[: ordered.size]
    return ordered[kept]
