"""Where frames stand to one another in a recording: the part of tf2 that is needed, in the plane."""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from workers.bags.cdr import Pose, Transform

_MOST_FRAMES = 100
"""From a frame up to the root of its tree."""


class Frames:
    """The tree of frames of a recording.

    Args:
        told: every transform that was sent, in order; of a static one the last counts at any time.
    """

    def __init__(self, told: Iterable[Transform]) -> None:
        self._edges: dict[str, list[Transform]] = {}
        for each in told:
            self._edges.setdefault(_bare(each.child), []).append(each)

    def pose(self, frame: str, within: str, at: float) -> NDArray[np.float64] | None:
        """(4, 4) how `frame` stands in `within` at a time; None where nothing leads from the one to the other."""
        frame, within = _bare(frame), _bare(within)
        up, down = self._to_root(frame, at), self._to_root(within, at)
        for common, matrix in up.items():
            if common in down:
                whole: NDArray[np.float64] = np.linalg.inv(down[common]) @ matrix
                return whole if np.isfinite(whole).all() else None
        return None

    def _to_root(self, frame: str, at: float) -> dict[str, NDArray[np.float64]]:
        """How the frame stands in itself and in each frame above, the nearest first."""
        found, matrix = {frame: np.eye(4)}, np.eye(4)
        while frame in self._edges and len(found) < _MOST_FRAMES:
            edges = self._edges[frame]
            edge = max((each for each in edges if each.stamp.seconds <= at), key=_seconds, default=edges[0])
            frame, matrix = _bare(edge.stamp.frame), _matrix(edge.pose) @ matrix
            if frame in found:
                break
            found[frame] = matrix
        return found


def _bare(frame: str) -> str:
    return frame.lstrip("/")


def _seconds(transform: Transform) -> float:
    return transform.stamp.seconds


def _matrix(pose: Pose) -> NDArray[np.float64]:
    x, y, z, w = np.array(pose.rotation) / max(math.hypot(*pose.rotation), 1e-9)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    matrix[:3, 3] = pose.position
    return matrix
