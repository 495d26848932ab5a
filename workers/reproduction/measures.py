"""What the claims compare: each measure's unit and margin, its value of a seed, and the paper's (pydantic only)."""

from collections.abc import Mapping, Sequence

from workers.reproduction.claims import Measure
from workers.reproduction.results import SeedResult
from workers.reproduction.rows import EVALUATE_EVERY
from workers.statistics.wording import Scale
from workers.training.table import TableRow

SCALES: Mapping[Measure, Scale] = {
    "success": Scale(unit="points", factor=100.0, decimals=1, margin=0.01, more_is_better=True),
    "reward": Scale(unit="reward per step", factor=1.0, decimals=2, margin=0.1, more_is_better=True),
    "steps": Scale(unit="steps per episode", factor=1.0, decimals=1, margin=1.0, more_is_better=False),
    "learned_at": Scale(unit="training steps", factor=1.0, decimals=0, margin=float(EVALUATE_EVERY), more_is_better=False),
}


def values_of(measure: Measure, seeds: Sequence[SeedResult], horizon: int = 0) -> list[float]:
    """The measure of each seed; who had not learned by the horizon counts as having learned there, which favours it."""

    def value(seed: SeedResult) -> float:
        match measure:
            case "success":
                return seed.measured.success
            case "reward":
                return seed.measured.reward or 0.0
            case "steps":
                return seed.measured.steps
            case "learned_at":
                return float(min(horizon, horizon if seed.learned_at is None else seed.learned_at))

    return [value(seed) for seed in seeds]


def paper_value(measure: Measure, row: TableRow) -> float | None:
    """The measure of a row of the paper; None where it gives no number."""
    match measure:
        case "success":
            return row.success
        case "reward":
            return row.reward
        case "steps":
            return row.steps
        case "learned_at":
            return None
