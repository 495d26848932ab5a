"""Curves as NumPy arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from mapless_client.models import Json


@dataclass(frozen=True)
class Curve:
    """One metric of a run over its environment steps. All arrays have one length.

    A point may stand for a bucket of neighbours, where there were more than asked for: then `values` are means, `low` and
    `high` the extremes, `steps` the last step of each. Otherwise the three are equal.

    Attributes:
        name: of the metric.
        steps: int64, rising.
        values: float64, nan where a value was not finite.
        low: float64.
        high: float64.
    """

    name: str
    steps: NDArray[np.int64]
    values: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def curve(series: Json) -> Curve:
    """A series of the API's JSON; null is nan."""
    import numpy as np  # here, so that a command's help does not wait for it

    def numbers(key: str) -> NDArray[np.float64]:
        return np.array(series[key], dtype=np.float64)

    values = numbers("values")
    return Curve(
        name=series["name"],
        steps=np.array(series["steps"], dtype=np.int64),
        values=values,
        low=values if series["min"] is None else numbers("min"),
        high=values if series["max"] is None else numbers("max"),
    )
