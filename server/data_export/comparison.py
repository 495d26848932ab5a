"""A comparison's figures and curves as tables."""

from collections.abc import Iterator

from server.comparison.schemas import Comparison, Curves
from server.spreadsheets import csv_rows

_FIGURES = ("success", "steps_per_target", "reward")


def figure_rows(comparison: Comparison) -> bytes:
    """A row for each figure that an experiment has."""
    heading = ("experiment", "name", "figure", "value", "low", "high", "seeds", "episodes", "suite", "suite_hash")
    rows: list[tuple[object, ...]] = [heading]
    for one in comparison.experiments:
        for name in _FIGURES:
            figure = getattr(one, name)
            if figure is not None:
                measured = (figure.value, figure.low, figure.high, figure.seeds, figure.episodes)
                rows.append((one.id, one.name, name, *measured, one.suite, one.suite_hash))
    return csv_rows(rows)


def mean_rows(curves: Curves) -> Iterator[bytes]:
    """A row for each experiment and step: mean over seeds, its interval, and how many seeds have a value."""
    yield csv_rows([("experiment", "name", "metric", "step", "mean", "low", "high", "seeds")])
    for one in curves.experiments:
        columns = zip(curves.steps, one.mean, one.low, one.high, one.count, strict=True)
        yield csv_rows([(one.id, one.name, curves.name, *row) for row in columns])


def seed_rows(curves: Curves) -> Iterator[bytes]:
    """A row for each run and step; whether its points were thinned stands behind it where any were."""
    wide = any(of_seed.thinned for one in curves.experiments for of_seed in one.seeds)
    yield csv_rows([("experiment", "name", "seed", "metric", "step", "value", *(["thinned"] if wide else []))])
    for one in curves.experiments:
        for of_seed in one.seeds:
            said = (str(of_seed.thinned).lower(),) if wide else ()
            columns = zip(curves.steps, of_seed.values, strict=True)
            yield csv_rows([(one.id, one.name, of_seed.seed, curves.name, *row, *said) for row in columns])
