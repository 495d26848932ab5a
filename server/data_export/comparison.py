"""A comparison's figures and curves as tables."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

from server.comparison.schemas import Comparison, Curves
from server.data_export.columns import FIGURES, MEANS, SEEDS, THINNED, Column, heading
from server.data_export.parquet import about, parquet, row_blocks
from server.spreadsheets import csv_rows

_FIGURES = ("success", "steps_per_target", "reward")
_ROWS_AT_ONCE = 10_000


@dataclass(frozen=True, slots=True)
class Table:
    """One of a comparison; its rows can be read once.

    Attributes:
        name: of its file, without an ending.
        columns: of each row.
        rows: one after another.
    """

    name: str
    columns: Sequence[Column]
    rows: Iterable[Sequence[object]]

    def csv(self) -> Iterator[bytes]:
        """As CSV, block by block."""
        yield csv_rows([heading(self.columns)])
        rows = iter(self.rows)
        while some := list(islice(rows, _ROWS_AT_ONCE)):
            yield csv_rows(some)

    def parquet(self) -> Iterator[bytes]:
        """As Parquet, block by block."""
        return parquet(self.columns, row_blocks(self.columns, self.rows), about(self.name))


def tables_of(comparison: Comparison, curves: Curves) -> tuple[Table, ...]:
    """All of a comparison."""
    wide = any(of_seed.thinned for one in curves.experiments for of_seed in one.seeds)
    return (
        Table("figures", FIGURES, _figures(comparison)),
        Table("curves", MEANS, _means(curves)),
        Table("seeds", (*SEEDS, THINNED) if wide else SEEDS, _seeds(curves, wide=wide)),
    )


def _figures(comparison: Comparison) -> Iterator[Sequence[object]]:
    """A row for each figure that an experiment has."""
    for one in comparison.experiments:
        for name in _FIGURES:
            figure = getattr(one, name)
            if figure is not None:
                measured = (figure.value, figure.low, figure.high, figure.seeds, figure.episodes)
                yield (one.id, one.name, name, *measured, one.suite, one.suite_hash)


def _means(curves: Curves) -> Iterator[Sequence[object]]:
    """A row for each experiment and step: mean over seeds, its interval, and how many seeds have a value."""
    for one in curves.experiments:
        columns = zip(curves.steps, one.mean, one.low, one.high, one.count, strict=True)
        yield from ((one.id, one.name, curves.name, *row) for row in columns)


def _seeds(curves: Curves, *, wide: bool) -> Iterator[Sequence[object]]:
    """A row for each run and step; whether its points were thinned stands behind it where any were."""
    for one in curves.experiments:
        for of_seed in one.seeds:
            said = (of_seed.thinned,) if wide else ()
            columns = zip(curves.steps, of_seed.values, strict=True)
            yield from ((one.id, one.name, of_seed.seed, curves.name, *row, *said) for row in columns)
