"""Counts what leads to each step of a training: curves are drawn over it as they are over steps."""

import time

from workers.manifest import Effort

WALL, CPU, EPISODES = "time/wall_seconds", "time/cpu_seconds", "train/episodes"
"""Under which a report tells it."""


class EffortMeter:
    """Counts on from what led to where this attempt begins; None is not known, and stays so."""

    def __init__(self, before: Effort | None) -> None:
        self._before = before
        self._wall, self._cpu, self._episodes = time.perf_counter(), time.process_time(), 0

    def resume(self, before: Effort | None) -> None:
        """Count on from a checkpoint, with what this attempt has taken until it was read."""
        self._before = before

    def ended(self, episodes: int) -> None:
        """So many more episodes have ended."""
        self._episodes += episodes

    def read(self) -> Effort | None:
        """What led to now."""
        if self._before is None:
            return None
        return Effort(
            wall_seconds=self._before.wall_seconds + time.perf_counter() - self._wall,
            cpu_seconds=self._before.cpu_seconds + time.process_time() - self._cpu,
            episodes=self._before.episodes + self._episodes,
        )

    def metrics(self) -> dict[str, float]:
        """As a report tells it; nothing where it is not known."""
        effort = self.read()
        if effort is None:
            return {}
        return {WALL: effort.wall_seconds, CPU: effort.cpu_seconds, EPISODES: float(effort.episodes)}
