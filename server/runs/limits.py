"""Limits of runs that may be under way at a time. Its own imports are light: the settings have them."""

from dataclasses import dataclass
from typing import Literal

Limit = Literal["person limit", "experiment limit"]


@dataclass(frozen=True)
class Limits:
    """How many runs may be under way at a time.

    Attributes:
        person: of one person; None for any number. What was launched with the installation's own token is one person's.
        experiment: of an experiment that has no limit of its own; None for any number.
    """

    person: int | None = None
    experiment: int | None = None
