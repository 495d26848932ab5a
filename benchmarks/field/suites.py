"""What is driven: pieces of suites, small enough to be kept one by one."""

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from sim.arenas.families import BENCHMARKS
from sim.config import FamilyName
from sim.suites import Suite, SuiteRules, load_suite, suite_in, suite_places
from workers.shipped.field import Part

FAMILIES: tuple[FamilyName, ...] = tuple(
    name for name in get_args(FamilyName) if name not in ("mixed", "varied", "intricate", *BENCHMARKS)
)
BARN = "barn-jackal-300"
TEN_STARTS = f"{BARN}, ten starts"
"""Each of its worlds ten times, as the challenge drives them: here nothing else is random, so the robot stands elsewhere."""

FROZEN: dict[Part, tuple[str, ...]] = {"barn": (BARN, TEN_STARTS), "people": ("people-500", "heedless-500")}

STARTS = 10

PIECE = 100
"""Scenarios of a piece, at most."""

PATIENCE = 4.0
"""Attempts in families last so many times as long as the shortest path takes at top speed, at least 500 steps."""

_STARTS_SEED = 0x7BCFB791  # taken when the policy that ships had long been frozen
_ASIDE, _TURNED = 0.3, math.radians(15.0)  # at most, each way: metres along either axis, and of the heading

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
    if suite == TEN_STARTS:
        size = STARTS * min(size, len(load_suite(BARN)))
    elif part != "families":
        size = min(size, len(load_suite(suite)))
    for first in range(0, size, PIECE):
        yield Piece(part, suite, first, min(PIECE, size - first))


def rules_of(piece: Piece) -> SuiteRules:
    """What its suite asks for."""
    return SuiteRules(patience=PATIENCE) if piece.part == "families" else _frozen(piece.suite).rules


def _frozen(name: str) -> Suite:
    return ten_starts(load_suite(BARN)) if name == TEN_STARTS else load_suite(name)


def ten_starts(suite: Suite) -> Suite:
    """Every scenario ten times, one after the other, each from another place beside its own."""
    each = _chosen(suite, np.repeat(np.arange(len(suite)), STARTS))
    moved = np.random.default_rng(_STARTS_SEED).uniform(-1.0, 1.0, (len(each), 3)) * (_ASIDE, _ASIDE, _TURNED)
    return dataclasses.replace(each, name=TEN_STARTS, starts=(each.starts + moved).astype(each.starts.dtype))


def _chosen(suite: Suite, which: NDArray[np.int64]) -> Suite:
    """Its scenarios of these indices."""
    columns = ("arena_indices", "starts", "targets", "shortest_paths")
    return dataclasses.replace(suite, **{name: getattr(suite, name)[which] for name in columns})


@lru_cache(maxsize=1)
def suite_of_piece(piece: Piece) -> Suite:
    """The scenarios: of a family each in a map of its own, of a frozen suite in an order that mixes its kinds."""
    last = piece.first + piece.count
    if piece.part == "families":
        (family,) = (name for name in FAMILIES if name == piece.suite)
        places = suite_places(family, 1.0, piece.count, first=_FIRST_MAP + piece.first)
        return suite_in(f"field-{family}-{piece.first}-{piece.count}", places, piece.count, rules_of(piece))
    suite = _frozen(piece.suite)
    each = STARTS if piece.suite == TEN_STARTS else 1
    order = np.random.default_rng(0).permutation(len(suite) // each)
    which = (order[:, None] * each + np.arange(each)).ravel()[piece.first : last]
    return _chosen(suite, which)
