"""What happened since the last report, gathered step by step and told as the project's standard metrics."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from sim.actions import DEFAULT_ACTIONS, ActionLayout
from workers.training.behavior import BehaviorMetrics

if TYPE_CHECKING:
    from sim.envs.vector import NavigationVectorEnv

Phase = Literal["simulation", "inference", "update", "reporting", "evaluation"]
_PHASES: tuple[Phase, ...] = ("simulation", "inference", "update", "reporting", "evaluation")
_OUTCOME_RATES = ("train/success_rate", "train/collision_rate", "train/timeout_rate")


class TrainingMetrics:
    """A window of a training: filled by the loop, emptied by each report."""

    def __init__(self, robots: int, steps: int = 0, actions: ActionLayout = DEFAULT_ACTIONS) -> None:
        """Starts after so many steps of each robot, whose actions are these."""
        self._robots = robots
        self._behavior = BehaviorMetrics(steps, actions)
        self._clear()

    def _clear(self) -> None:
        self._started = time.perf_counter()
        self._phases = dict.fromkeys(_PHASES, 0.0)
        self._outcomes = np.zeros(4, np.int64)
        self._attempt_rewards = self._attempt_steps = self._rewards = 0.0
        self._reward_terms: dict[str, float] = {}
        self._steps = self._updates = 0
        self._diagnostics: dict[str, list[float]] = {}

    @property
    def seconds(self) -> float:
        """Wall time since the last report."""
        return time.perf_counter() - self._started

    @property
    def empty(self) -> bool:
        """Whether nothing was learned since the last report."""
        return not self._updates

    @contextmanager
    def phase(self, name: Phase) -> Iterator[None]:
        """Counts the time inside as one kind of work."""
        started = time.perf_counter()
        try:
            yield
        finally:
            self.spend(name, time.perf_counter() - started)

    def spend(self, name: Phase, seconds: float) -> None:
        """Counts seconds as one kind of work."""
        self._phases[name] += seconds

    def step(
        self,
        env: "NavigationVectorEnv",
        observations: NDArray[np.float32],
        actions: NDArray[np.float32],
        rewards: NDArray[np.float32],
    ) -> int:
        """Takes in one step of all robots: what they see now, and what they did before. Returns how many episodes ended."""
        self._behavior.step(observations, actions)
        self._steps += 1
        self._rewards += float(rewards.sum())
        for name, total in zip(env.reward_term_names, env.reward_terms.sum(axis=0).tolist(), strict=True):
            self._reward_terms[name] = self._reward_terms.get(name, 0.0) + total
        outcomes = env.outcomes
        if not outcomes.any():
            return 0
        ended = outcomes > 0
        self._outcomes += np.bincount(outcomes, minlength=4)
        self._attempt_rewards += float(env.attempt_rewards[ended].sum())
        self._attempt_steps += float(env.attempt_steps[ended].sum())
        return int(ended.sum())

    def update(self, diagnostics: Mapping[str, float]) -> None:
        """Takes in the diagnostics of one update; a report tells their mean."""
        self._updates += 1
        for name, value in diagnostics.items():
            self._diagnostics.setdefault(name, []).append(value)

    def flush(self) -> dict[str, float]:
        """The window's metrics; the next window starts now."""
        seconds = self.seconds
        steps = self._steps * self._robots
        metrics = {name: sum(values) / len(values) for name, values in self._diagnostics.items()}
        if steps:
            metrics["train/reward"] = self._rewards / steps
            metrics.update({f"reward/{name}": total / steps for name, total in self._reward_terms.items()})
        if attempts := int(self._outcomes[1:].sum()):
            for name, count in zip(_OUTCOME_RATES, self._outcomes[1:].tolist(), strict=True):
                metrics[name] = count / attempts
            metrics["train/return"] = self._attempt_rewards / attempts
            metrics["train/episode_length"] = self._attempt_steps / attempts
        metrics.update(self._behavior.flush())
        metrics["time/steps_per_second"] = steps / seconds
        metrics.update({f"time/{name}": spent / seconds for name, spent in self._phases.items()})
        self._clear()
        return metrics
