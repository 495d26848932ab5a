"""Tables and reports of a comparison."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal
from urllib.parse import urlencode

from server.comparison.service import ComparisonService
from server.printing.look import Look
from server.printing.report import Report
from server.printing.tables import TableName, printed
from server.printing.text import comma_separated, latex, markdown
from server.services import Services
from server.version import commit, version

TextFormat = Literal["latex", "markdown", "csv"]

SUFFIXES: dict[TextFormat, str] = {"latex": "tex", "markdown": "md", "csv": "csv"}
_WRITERS = {"latex": latex, "markdown": markdown, "csv": comma_separated}
# Of curves in a report: as many as its charts have room for.
_POINTS = 240
# Of those that are smoothed, or a part of which is shown: as many as the page has, where each counts.
_PAGE_POINTS = 400
# What the page shows at first.
_USUAL = ("eval/success_rate", "train/success_rate", "train/return", "eval/steps")


@dataclass(frozen=True)
class Wanted:
    """What is compared, and how, as the page's address says it.

    Attributes:
        experiment_ids: in order.
        margin: success rates that differ by less are equivalent.
        base: what the others are held against; None for what is usual.
        every_pair: hold each against all before it instead.
    """

    experiment_ids: Sequence[str]
    margin: float
    base: str | None
    every_pair: bool

    def address(self, look: Look) -> str:
        """Of the page that shows it, without the host."""
        base = "pairs" if self.every_pair else self.base
        query = [*(("experiment", each) for each in self.experiment_ids), ("margin", f"{self.margin:g}")]
        return f"/compare?{urlencode([*query, *([('base', base)] if base else []), *look.address()])}"


class PrintingService:
    """Prints comparisons."""

    def __init__(self, services: Services) -> None:
        self._comparisons = ComparisonService(services)

    def table(self, wanted: Wanted, name: TableName, text_format: TextFormat) -> str:
        """One of the tables.

        Raises:
            As `ComparisonService.compare`.
        """
        comparison = self._comparisons.compare(
            wanted.experiment_ids, wanted.margin, wanted.base, every_pair=wanted.every_pair
        )
        return _WRITERS[text_format](printed(comparison, name))

    def report(self, wanted: Wanted, look: Look, host: str) -> str:
        """Everything in one HTML file.

        Args:
            wanted: what is compared.
            look: how its curves are.
            host: where the service is reached, without a slash at its end.

        Raises:
            As `ComparisonService.compare`.
        """
        ids = wanted.experiment_ids
        points = _PAGE_POINTS if look.smooth or look.zoom else _POINTS
        made = time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())
        return Report(
            comparison=self._comparisons.compare(ids, wanted.margin, wanted.base, every_pair=wanted.every_pair),
            profiles=self._comparisons.profiles(ids),
            curves=[
                self._comparisons.curves(ids, name, points, across=look.across, logarithmic=look.log_x)
                for name in look.metrics or _USUAL
            ],
            look=look,
            link=host + wanted.address(look),
            made=f"Made {made} by Mapless {version()}{f' ({commit()})' if commit() else ''}.",
        ).html()
