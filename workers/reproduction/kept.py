"""A campaign's figures as a file: what the page is made of, and what another campaign need not train again."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from sim.config import Frozen
from workers.config import TrainingConfig
from workers.errors import OtherTrainingError
from workers.reproduction.curves import CURVE_BINS, Floats, binned
from workers.reproduction.outcome import Outcome, SeedDone
from workers.reproduction.results import SeedResult, Trained
from workers.reproduction.rows import Row

_DECIMALS = 3


class Kept(Frozen):
    """What was measured, and of what.

    Attributes:
        trainings: what every row was trained with, by its id.
        seconds: wall time of all of it.
        results: by row.
        curves: of the same seeds, in `CURVE_BINS` bins of the training's steps; None where a seed has no value.
    """

    trainings: Mapping[str, TrainingConfig]
    seconds: float
    results: Mapping[str, tuple[SeedResult, ...]]
    curves: Mapping[str, tuple[tuple[float | None, ...], ...]]


def write_figures(path: Path, outcome: Outcome, rows: Sequence[Row]) -> None:
    """Writes a whole campaign's figures; seeds that failed are left out."""
    trained = {row.id: outcome.of_row(row.id) for row in rows}
    kept = Kept(
        trainings={row.id: row.training for row in rows},
        seconds=outcome.seconds,
        results={row: tuple(one.result for one in seeds) for row, seeds in trained.items()},
        curves={row: tuple(_thinned(one) for one in seeds) for row, seeds in trained.items()},
    )
    path.write_text(f"{kept.model_dump_json()}\n")


def read_figures(path: Path, rows: Sequence[Row]) -> tuple[tuple[SeedDone, ...], float]:
    """What that file holds of these rows, and the seconds that it took.

    Raises:
        OtherTrainingError: it can't be read, or a row was trained with other settings.
    """
    try:
        kept = Kept.model_validate_json(path.read_text())
    except (OSError, ValidationError) as error:
        raise OtherTrainingError(f"{path} holds no figures of a campaign that this version can read: {error}") from None
    done = []
    for row in rows:
        if kept.trainings.get(row.id, row.training) != row.training:
            raise OtherTrainingError(f"{path} holds {row.id} trained with other settings")
        for result, curve in zip(kept.results.get(row.id, ()), kept.curves.get(row.id, ()), strict=True):
            done.append(SeedDone(row=row.id, seed=result.seed, trained=_whole(result, curve)))
    return tuple(done), kept.seconds


def _edges(steps: int) -> Floats:
    return np.linspace(0.0, steps, CURVE_BINS + 1)


def _thinned(trained: Trained) -> tuple[float | None, ...]:
    values = binned(trained.curve_steps, trained.curve, _edges(trained.result.steps)).tolist()
    return tuple(round(value, _DECIMALS) if value == value else None for value in values)


def _whole(result: SeedResult, curve: Sequence[float | None]) -> Trained:
    """The curve by the middles of its bins: binned once more it stays as it is."""
    edges = _edges(result.steps)
    points = [
        (round(middle), value)
        for middle, value in zip((edges[1:] + edges[:-1]) / 2, curve, strict=True)
        if value is not None
    ]
    return Trained(result=result, curve_steps=tuple(step for step, _ in points), curve=tuple(value for _, value in points))
