"""What the robots of an evaluation did, moment by moment, and its file (NumPy only: the server draws it)."""

import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from sim.config import ArenaFile
from workers.reporting import EvaluationResult

_ARENAS = TypeAdapter(tuple[ArenaFile, ...])

_GONE = 0.001  # m, the radius that is drawn of what was there at first and is no more


@dataclass(frozen=True, eq=False)
class Track:
    """One episode of n steps: n + 1 moments, a control period apart; the last is where it ended.

    Attributes:
        arena: where.
        poses: (n + 1, 3) float32: x, y, heading.
        ranges: (n + 1, rays) float32, metres.
        fields_of_view: (n + 1,) float32, degrees that the rays cover.
        target: (2,) float32.
        movers: (n + 1, movers, 3) float32: x, y, radius.
        commands: (n + 1, A) float32: what was asked for in the step that led there, see `sim.actions`, in m/s, rad/s, rad.
        twists: (n + 1, 3) float32: speeds forwards and to the left, m/s, and turning rate, rad/s, in that step.
        terms: (n + 1, terms) float32: of the reward for that step. All three are zeros at the start.
        gamma: discount of a step.
    """

    arena: ArenaFile
    poses: NDArray[np.float32]
    ranges: NDArray[np.float32]
    fields_of_view: NDArray[np.float32]
    target: NDArray[np.float32]
    movers: NDArray[np.float32]
    commands: NDArray[np.float32]
    twists: NDArray[np.float32]
    terms: NDArray[np.float32]
    gamma: float

    def values(self) -> NDArray[np.float64]:
        """(n + 1,) the return that is still to come at each moment, discounted: what a critic should say there."""
        rewards = self.terms.sum(axis=1, dtype=np.float64)
        values = np.zeros(len(rewards))
        for moment in range(len(rewards) - 2, -1, -1):
            values[moment] = rewards[moment + 1] + self.gamma * values[moment + 1]
        return values


@dataclass(frozen=True, eq=False)
class Recording:
    """All S episodes of an evaluation, M moments in all.

    Attributes:
        evaluation: how they ended.
        arenas: the suite's.
        gamma: discount of a step, see `Track.values`.
        arena_indices: (S,) the arena of each episode.
        targets: (S, 2) float32.
        offsets: (S + 1,) where the moments of each episode begin, and the last one ends.
        poses: (M, 3) float32.
        ranges: (M, rays) float16: fine enough to draw.
        fields_of_view: (M,) float32.
        movers: (T, G, K, 3) float32 x, y, radius of what moves, from the first moment of all episodes to the last of the
            longest; a radius below zero is none.
        mover_indices: (S,) which of the G each episode met: one for each arena, or for each episode where people give way or
            robots are together.
        commands: (M, A) float32.
        twists: (M, 3) float32.
        terms: (M, terms) float32.
    """

    evaluation: EvaluationResult
    arenas: tuple[ArenaFile, ...]
    gamma: float
    arena_indices: NDArray[np.int32]
    targets: NDArray[np.float32]
    offsets: NDArray[np.int64]
    poses: NDArray[np.float32]
    ranges: NDArray[np.float16]
    fields_of_view: NDArray[np.float32]
    movers: NDArray[np.float32]
    mover_indices: NDArray[np.int64]
    commands: NDArray[np.float32]
    twists: NDArray[np.float32]
    terms: NDArray[np.float32]

    def track(self, episode: int) -> Track:
        """One of the episodes.

        Raises:
            IndexError: there are not as many.
        """
        if not 0 <= episode < len(self.arena_indices):
            raise IndexError(f"there are {len(self.arena_indices)} episodes: no {episode}")
        moments = slice(self.offsets[episode], self.offsets[episode + 1])
        discs = self.movers[: moments.stop - moments.start, self.mover_indices[episode]]
        return Track(
            arena=self.arenas[self.arena_indices[episode]],
            poses=self.poses[moments],
            ranges=self.ranges[moments].astype(np.float32),
            fields_of_view=self.fields_of_view[moments],
            target=self.targets[episode],
            movers=_with_who_is_gone(discs[:, discs[0, :, 2] > 0.0]),
            commands=self.commands[moments],
            twists=self.twists[moments],
            terms=self.terms[moments],
            gamma=self.gamma,
        )

    def save(self, path: Path) -> None:
        """Writes the file; whoever finds `path` finds it complete."""
        torn = path.with_name(f"{path.name}.part")
        with torn.open("wb") as file:
            np.savez_compressed(
                file,
                evaluation=np.frombuffer(self.evaluation.model_dump_json().encode(), np.uint8),
                arenas=np.frombuffer(_ARENAS.dump_json(self.arenas), np.uint8),
                gamma=np.float64(self.gamma),
                arena_indices=self.arena_indices,
                targets=self.targets,
                offsets=self.offsets,
                poses=self.poses,
                ranges=self.ranges,
                fields_of_view=self.fields_of_view,
                movers=self.movers,
                mover_indices=self.mover_indices,
                commands=self.commands,
                twists=self.twists,
                terms=self.terms,
            )
        torn.replace(path)

    @classmethod
    def load(cls, path: Path) -> Self:
        """What `save` wrote.

        Raises:
            OSError: it is not there.
            ValueError: it is not such a file, or a torn one.
        """
        try:
            # Opened here: of a damaged file the library would leave it open.
            with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
                arrays = dict(file)
            return cls(
                evaluation=EvaluationResult.model_validate_json(arrays.pop("evaluation").tobytes()),
                arenas=_ARENAS.validate_json(arrays.pop("arenas").tobytes()),
                gamma=float(arrays.pop("gamma")),
                **arrays,
            )
        except (zipfile.BadZipFile, zlib.error, EOFError, KeyError, TypeError) as error:
            raise ValueError(f"{path.name} is not a recording: {error}") from error


def _with_who_is_gone(discs: NDArray[np.float32]) -> NDArray[np.float32]:
    """Discs (n, movers, 3) of which each has a radius all the time: a robot that has ended its attempt leaves a point."""
    kept = discs.copy()
    kept[..., 2] = np.where(discs[..., 2] > 0.0, discs[..., 2], _GONE)
    return kept
