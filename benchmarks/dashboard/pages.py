"""The pages that are measured: where they are, when they are drawn, and what they should cost at most."""

from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.dashboard.data import Lab

# By name: milliseconds until all is drawn, and of the longest task.
PAGES: dict[str, tuple[float, float]] = {
    "list": (500, 100),
    "experiment": (700, 50),
    "run, few checkpoints": (900, 100),
    "run, many checkpoints": (1_000, 100),
    "compare": (1_000, 50),
    "compare's picker": (500, 50),
    "paper": (700, 50),
}

_ROWS = "document.querySelectorAll('[data-testid=experiment]').length > 0"
_CURVES = "document.querySelectorAll('[data-testid=chart] canvas').length"
_RUN = f"{_CURVES} >= 2 && document.querySelector('[data-testid=vitals]')"


@dataclass(frozen=True)
class Visit:
    """A page to be opened.

    Attributes:
        name: of the page.
        paths: its addresses; several show different trainings.
        ready: JavaScript that is true once what a person came for is there.
    """

    name: str
    paths: Sequence[str]
    ready: str

    @property
    def path(self) -> str:
        """The first of its addresses."""
        return self.paths[0]

    def at(self, index: int) -> str:
        """The address of one of several visits."""
        return self.paths[index % len(self.paths)]

    @classmethod
    def of_run(cls, run_id: str) -> "Visit":
        """A run's page."""
        return cls("run", [f"/runs/{run_id}"], _RUN)


def visits(lab: Lab, names: Sequence[str]) -> list[Visit]:
    """The pages of these names over a lab."""
    compared = "&".join(f"experiment={each}" for each in lab.long_experiments)
    with_checkpoints = f"{_RUN} && document.querySelectorAll('[data-testid=checkpoint]').length > 0"
    pages = [
        Visit("list", ["/"], _ROWS),
        Visit("experiment", [f"/experiments/{each}" for each in lab.long_experiments], f"{_CURVES} >= 3"),
        Visit("run, few checkpoints", [f"/runs/{lab.few}"], with_checkpoints),
        Visit("run, many checkpoints", [f"/runs/{lab.many}"], with_checkpoints),
        Visit(
            "compare",
            [f"/compare?{compared}"],
            f"{_CURVES} >= 3 && document.querySelector('[data-testid=figures] tbody tr')",
        ),
        Visit("compare's picker", ["/compare"], _ROWS),
        Visit("paper", ["/reproduction"], "document.querySelectorAll('[data-testid=claim]').length > 0"),
    ]
    return [page for page in pages if page.name in names]


def warming(lab: Lab) -> list[Visit]:
    """Pages of the same kinds that show other trainings: opened before anything is measured."""
    short = lab.experiments[:2]
    compared = "&".join(f"experiment={each}" for each in short)
    return [
        Visit("list", ["/policies"], "document.querySelector('main h1, main h2')"),
        Visit("experiment", [f"/experiments/{short[0]}"], f"{_CURVES} >= 3"),
        Visit.of_run(lab.short),
        Visit("compare", [f"/compare?{compared}"], f"{_CURVES} >= 3"),
    ]
