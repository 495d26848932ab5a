"""What a recording tells of the LiDAR: noise, dropouts, rate and jitter, each with an interval of 95 %.

Noise is what a beam's range changes by from one scan to the next while the robot stands: half its variance, beams apart at
which somebody walks by. A dropout is a beam without a return between two beams that met the same surface, in a scan between
two in which it returned itself: what reflects nothing at all is none.
"""

import math

import numpy as np
from numpy.typing import NDArray

from workers.bags.read import Bag, Motion, Reals, Scans
from workers.bags.results import Fitted
from workers.wording import counted

Z95 = 1.96
_STILL_METRES, _STILL_RADIANS = 0.003, 0.003
"""A robot that moves by less stands."""
_STILL_BEFORE_SECONDS, _STILL_AFTER_SECONDS = 0.6, 0.2
"""For so long it must stand about a scan, so that nothing sways any more."""
_FEWEST_CHANGES = 300
_FEWEST_LOOKS = 300
_CLIP = 4.0
"""Standard deviations beyond which a change is not noise: somebody walks by."""
_NEAR_LIMIT = 0.9
"""Share of the range above which a beam may well meet nothing."""
_SURFACE = 0.15
"""Two beams either side of a third meet one surface where their ranges differ by less, as a share."""
_GAP = 3.0
"""An interval of so many usual ones is a pause of the recording."""
_SCANS_OF_A_BLOCK = 10


def fit_sensing(bag: Bag) -> list[Fitted]:
    """Noise, dropout, rate and jitter of the scans."""
    return [_noise(bag.scans, bag.motion), _dropout(bag.scans), *_rate(bag.scans)]


def _noise(scans: Scans, motion: Motion) -> Fitted:
    told = {"key": "lidar.noise", "title": "LiDAR noise", "unit": "m"}
    still = _still(scans.times, motion)
    pairs = _pairs(still)
    met = scans.met()
    ranges = scans.ranges.astype(np.float64)
    first, second = ranges[pairs], ranges[pairs + 1]
    # By their mean, which says nothing of their difference.
    good = met[pairs] & met[pairs + 1]
    good[good] = 0.5 * (first[good] + second[good]) < _NEAR_LIMIT * scans.range_max
    changes = second[good] - first[good]
    if len(changes) < _FEWEST_CHANGES:
        return Fitted(
            **told,
            value=None,
            low=None,
            high=None,
            note="Can't be told: the robot stands in too few of the scans. Let it stand for a few seconds, and record that.",
        )
    kept = _unclipped(changes)
    squares = kept**2
    mean = float(squares.mean())
    error = Z95 * float(squares.std()) / math.sqrt(len(squares))
    low, high = math.sqrt(max(0.0, mean - error) / 2.0), math.sqrt((mean + error) / 2.0)
    note = f"From {counted(len(kept))} changes of beams between scans while the robot stood."
    return Fitted(**told, value=math.sqrt(mean / 2.0), low=low, high=high, note=note)


def _still(times: Reals, motion: Motion) -> NDArray[np.bool_]:
    """(n,) whether the robot stands about these times."""
    before, after = times - _STILL_BEFORE_SECONDS, times + _STILL_AFTER_SECONDS
    moved = np.abs(motion.pose_at(after) - motion.pose_at(before))
    still: NDArray[np.bool_] = np.hypot(moved[:, 0], moved[:, 1]) < _STILL_METRES
    still &= (moved[:, 2] < _STILL_RADIANS) & (before >= motion.times[0]) & (after <= motion.times[-1])
    return still


def _pairs(still: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The first of two scans that follow one another while it stands; no scan is in two pairs."""
    found, at = [], 0
    while at + 1 < len(still):
        if still[at] and still[at + 1]:
            found.append(at)
            at += 2
        else:
            at += 1
    return np.array(found, np.int64)


def _unclipped(changes: Reals) -> Reals:
    """Without what is no noise."""
    spread = 1.4826 * float(np.median(np.abs(changes)))
    kept = changes
    for _ in range(5):
        bound = _CLIP * max(spread, 1e-6)
        kept = changes[np.abs(changes) <= bound]
        if not len(kept):
            return changes
        found = float(np.sqrt(np.mean(kept**2)))
        if abs(found - spread) < 1e-3 * found:
            break
        spread = found
    return kept


def _dropout(scans: Scans) -> Fitted:
    told = {"key": "lidar.dropout", "title": "LiDAR dropout", "unit": "of beams"}
    met = scans.met() & (scans.ranges < _NEAR_LIMIT * scans.range_max)
    ranges = np.where(met, scans.ranges, 0.0)
    left, right = ranges[1:-1, :-2], ranges[1:-1, 2:]
    both = met[1:-1, :-2] & met[1:-1, 2:]
    with np.errstate(invalid="ignore"):
        surface = both & (np.abs(left - right) < _SURFACE * np.maximum(left, right))
    looked = surface & met[:-2, 1:-1] & met[2:, 1:-1]
    # Whatever is no return counts, not what returned from further away than is looked at.
    lost = looked & ~scans.met()[1:-1, 1:-1]
    looks, losses = looked.sum(axis=1).astype(float), lost.sum(axis=1).astype(float)
    count = float(looks.sum())
    if count < _FEWEST_LOOKS:
        return Fitted(
            **told,
            value=None,
            low=None,
            high=None,
            note="Can't be told: too few beams meet a surface beside others that do. Record among walls, for longer.",
        )
    share = float(losses.sum()) / count
    effective = count / _design_effect(looks, losses, share)
    middle = (share + Z95**2 / (2.0 * effective)) / (1.0 + Z95**2 / effective)
    half = Z95 / (1.0 + Z95**2 / effective) * math.sqrt(share * (1.0 - share) / effective + (Z95 / (2.0 * effective)) ** 2)
    note = (
        f"{counted(losses.sum())} of {counted(count)} beams that returned before and after, and whose neighbours did, "
        "did not."
    )
    return Fitted(**told, value=share, low=max(0.0, middle - half), high=middle + half, note=note)


def _design_effect(looks: Reals, losses: Reals, share: float) -> float:
    """How much more the losses vary from scan to scan than if each beam were lost by itself; at least 1."""
    blocks = max(1, len(looks) // _SCANS_OF_A_BLOCK)
    edges = np.linspace(0, len(looks), blocks + 1).astype(int)[:-1]
    n, k = np.add.reduceat(looks, edges), np.add.reduceat(losses, edges)
    n, k = n[n > 0], k[n > 0]
    expected = n * share * (1.0 - share)
    if len(n) < 3 or expected.sum() <= 0.0:
        return 1.0
    return max(1.0, float(((k - n * share) ** 2).sum() / expected.sum()))


def _rate(scans: Scans) -> list[Fitted]:
    intervals = np.diff(scans.times)
    usual = float(np.median(intervals))
    whole = intervals[intervals < _GAP * usual]
    period = float(whole.mean())
    spread = float(whole.std())
    count = len(whole)
    pauses = len(intervals) - count
    error = Z95 * spread * math.sqrt(_long_run(whole) / count)
    note = f"From {counted(count)} intervals between scans" + (
        f"; {counted(pauses)} longer pauses are left out." if pauses else "."
    )
    rate = Fitted(
        key="lidar.rate",
        title="LiDAR rate",
        unit="scans per second",
        value=1.0 / period,
        low=1.0 / (period + error),
        high=1.0 / max(period - error, 1e-6),
        note=note,
    )
    margin = Z95 * _spread_error(whole, spread)
    jitter = Fitted(
        key="scan jitter",
        title="Jitter of scans",
        unit="s",
        value=spread,
        low=max(0.0, spread - margin),
        high=spread + margin,
        note="Standard deviation of the time between two scans; there is no such setting, trainings see scans on time.",
    )
    return [rate, jitter]


def _long_run(intervals: Reals) -> float:
    """Variance of a sum of intervals over that of as many independent ones; rather too large than too small.

    A stamp that is late makes the next interval short, and the sum knows nothing of it.
    """
    return max(0.0, 1.0 + 2.0 * _correlation(intervals, 1)) + 2.0 / math.sqrt(len(intervals))


def _correlation(values: Reals, lag: int) -> float:
    deviations = values - values.mean()
    total = float(deviations @ deviations)
    return float(deviations[lag:] @ deviations[:-lag]) / total if total > 0.0 else 0.0


def _spread_error(values: Reals, spread: float) -> float:
    """Standard error of a standard deviation, by the fourth moment, of values that correlate with those before."""
    if spread <= 0.0:
        return 0.0
    fourth = float(np.mean((values - values.mean()) ** 4))
    correlated = 1.0 + 2.0 * sum(_correlation(values, lag) ** 2 for lag in (1, 2, 3))
    return math.sqrt(max(fourth - spread**4, 0.0) * correlated / len(values)) / (2.0 * spread)
