"""Where the robots of an evaluation drove: kept beside it, and served an arena at a time."""

import zlib
from collections import Counter

from server.errors import NotFoundError
from server.evaluations.schemas import EvaluationWays, PlaceSuccess, Way
from sim.config import ArenaFile, Frozen
from workers.job_protocol import Measurement, Point
from workers.reporting import EpisodeResult

MAX_BYTES = 4 * 2**20
"""Of the ways of one evaluation, compressed; where there is more, none are kept: its figures and episodes are."""


class KeptWays(Frozen):
    """What is kept; see `Measurement`. What came later is empty in those of before."""

    arenas: tuple[ArenaFile, ...]
    arena_indices: tuple[int, ...]
    targets: tuple[Point, ...]
    ways: tuple[tuple[Point, ...], ...]
    jerks: tuple[float, ...] = ()
    terms: tuple[str, ...] = ()
    returns: tuple[tuple[float, ...], ...] = ()


def packed(measurement: Measurement) -> bytes | None:
    """As the database keeps them; None where they would take too much room."""
    kept = KeptWays(
        arenas=measurement.arenas,
        arena_indices=measurement.arena_indices,
        targets=measurement.targets,
        ways=measurement.ways,
        jerks=measurement.jerks,
        terms=measurement.terms,
        returns=measurement.returns,
    )
    data = zlib.compress(kept.model_dump_json().encode())
    return data if len(data) <= MAX_BYTES else None


def unpacked(data: bytes) -> KeptWays:
    """What `packed` has packed."""
    return KeptWays.model_validate_json(zlib.decompress(data))


def ways_in(data: bytes, episodes: tuple[EpisodeResult, ...], arena: int | None) -> EvaluationWays:
    """Those in one of the suite's arenas.

    Args:
        data: as `packed`.
        episodes: of the evaluation.
        arena: which one, from 0; None for the one with the lowest success.

    Raises:
        NotFoundError: there is no such arena.
    """
    kept = unpacked(data)
    places = _places(kept, episodes)
    arena = places[0].arena if arena is None else arena
    if not 0 <= arena < len(kept.arenas):
        raise NotFoundError(f"This suite has {len(kept.arenas)} arenas, 0 to {len(kept.arenas) - 1}: there is no {arena}.")
    return EvaluationWays(
        places=places,
        arena=arena,
        geometry=kept.arenas[arena],
        ways=[
            Way(episode=index, outcome=episodes[index].outcome, target=kept.targets[index], points=kept.ways[index])
            for index, place in enumerate(kept.arena_indices)
            if place == arena
        ],
    )


def _places(kept: KeptWays, episodes: tuple[EpisodeResult, ...]) -> list[PlaceSuccess]:
    driven = Counter(kept.arena_indices)
    arrived = Counter(
        place for place, episode in zip(kept.arena_indices, episodes, strict=True) if episode.outcome == "arrival"
    )
    places = [
        PlaceSuccess(arena=index, name=kept.arenas[index].name, episodes=count, arrivals=arrived[index])
        for index, count in driven.items()
    ]
    return sorted(places, key=lambda place: (place.arrivals / place.episodes, place.arena))
