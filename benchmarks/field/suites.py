"""What is driven: pieces of suites, small enough to be kept one by one."""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import get_args

import numpy as np

from sim.arenas.families import BENCHMARKS
from sim.config import FamilyName
from sim.suites import Suite, SuiteRules, load_suite, suite_in, suite_places
from workers.shipped.field import Part

FAMILIES: tuple[FamilyName, ...] = tuple(
    name for name in get_args(FamilyName) if name not in ("mixed", "varied", "intricate", *BENCHMARKS)
)
FROZEN: dict[Part, tuple[str, ...]] = {"barn": ("barn-jackal-300",), "people": ("people-500", "heedless-500")}

PIECE = 100
"""Scenarios of a piece, at most."""

PATIENCE = 4.0
"""Attempts in families last so many times as long as the shortest path takes at top speed, at least 500 steps."""

_FIRST_MAP = 100_000  # of the maps that are drawn here: no training, no suite and no choice of a recipe has met them


@dataclass(frozen=True)
class Piece:
    """Some of the scenarios of a suite.

    Attributes:
        part: of the matrix.
        suite: family or frozen suite.
        first: of its scenarios, from 0.
        count: how many from there.
    """

    part: Part
    suite: str
    first: int
    count: int


def pieces(part: Part, suite: str, size: int) -> Iterator[Piece]:
    """The first scenarios of a suite, piece by piece; a frozen one may have fewer."""
    if part != "families":
        size = min(size, len(load_suite(suite)))
    for first in range(0, size, PIECE):
        yield Piece(part, suite, first, min(PIECE, size - first))


def rules_of(piece: Piece) -> SuiteRules:
    """What its suite asks for."""
    return SuiteRules(patience=PATIENCE) if piece.part == "families" else load_suite(piece.suite).rules


@lru_cache(maxsize=1)
def suite_of_piece(piece: Piece) -> Suite:
    """The scenarios: of a family each in a map of its own, of a frozen suite in an order that mixes its kinds."""
    last = piece.first + piece.count
    if piece.part == "families":
        (family,) = (name for name in FAMILIES if name == piece.suite)
        places = suite_places(family, 1.0, piece.count, first=_FIRST_MAP + piece.first)
        return suite_in(f"field-{family}-{piece.first}-{piece.count}", places, piece.count, rules_of(piece))
    suite = load_suite(piece.suite)
    which = np.random.default_rng(0).permutation(len(suite))[piece.first : last]
    columns = ("arena_indices", "starts", "targets", "shortest_paths")
    return dataclasses.replace(suite, **{name: getattr(suite, name)[which] for name in columns})
