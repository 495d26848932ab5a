"""One line of a table as the paper prints them, and the names under which a training reports its own (pydantic only)."""

from collections.abc import Mapping

from pydantic import Field

from sim.config import Frozen

PREFIX = "table/"
"""Of the metrics that a training reports after its drives."""


class TableRow(Frozen):
    """What a table says of one method, over one drive of about 10,000 steps; None where the paper says nothing."""

    reward: float | None = Field(description="Mean per step.")
    episodes: float = Field(description="Target attempts.")
    success: float = Field(description="Part of them that arrived, 0 to 1.")
    collisions: float | None = Field(None, description="Part of them that ended in a collision, 0 to 1.")
    steps: float = Field(description="Per attempt, however it ended.")

    def metrics(self) -> dict[str, float]:
        """As a training reports it."""
        return {f"{PREFIX}{name}": value for name, value in self.model_dump().items() if value is not None}

    @classmethod
    def from_metrics(cls, metrics: Mapping[str, float]) -> "TableRow | None":
        """What a training has reported; None where it has not."""
        given = {name.removeprefix(PREFIX): value for name, value in metrics.items() if name.startswith(PREFIX)}
        return cls.model_validate(given) if given.keys() >= cls.model_fields.keys() else None


METRICS: tuple[str, ...] = tuple(f"{PREFIX}{name}" for name in TableRow.model_fields)
"""The names of all those metrics."""
