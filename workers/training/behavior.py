"""How robots behave while they train: what tells a robot that learns to drive from one that spins or sees nothing."""

import numpy as np
from numpy.typing import NDArray

from sim.actions import DEFAULT_ACTIONS, ActionLayout

# Behaviour changes slowly: a sample in four costs a quarter and says the same.
_EVERY = 4

# Fewer observations than these may be alike by chance.
_MIN_OBSERVATIONS = 64

# An angular command this near to its limit is at its limit.
_AT_LIMIT = np.float32(0.99)

# Observations kept of a window: at most 512 rows.
_KEPT_ROBOTS = 32
_MAX_KEPT = 16

# A number is constant where 98 of 100 observations have the same, to a thousandth of its range of 1 or 2.
_ALIKE = 1e-3
_CONSTANT_SHARE = 0.98

Floats = NDArray[np.float32]


class BehaviorMetrics:
    """Samples of a window between two reports.

    | metric                 | meaning, all of it 0 to 1                                                       |
    |------------------------|---------------------------------------------------------------------------------|
    | `train/linear_speed`   | mean linear command                                                             |
    | `train/angular_speed`  | mean size of the angular command, or `train/steering` of the steering angle     |
    | `train/lateral_speed`  | mean size of the lateral command, where the drive is omnidirectional            |
    | `train/spin`           | size of each robot's mean angular command, over robots: 1 if all turn in circles |
    | `policy/saturation`    | share of angular commands at their limit                                        |
    | `observation/constant` | share of the observation's numbers that hardly vary over robots and samples     |
    """

    def __init__(self, steps: int = 0, actions: ActionLayout = DEFAULT_ACTIONS) -> None:
        """Starts after so many steps of each robot, so that a resumed training samples the same ones."""
        self._steps = steps
        self._names = actions.names
        self._low, self._high = np.array(actions.lows, np.float32), np.ones(actions.size, np.float32)
        self._clear()

    def _clear(self) -> None:
        self._samples = self._commands = self._saturated = 0
        self._speeds = np.zeros(len(self._names))
        self._turned: NDArray[np.floating] | None = None
        self._seen: list[Floats] = []

    def step(self, observations: Floats, actions: Floats) -> None:
        """Takes in one step of all robots.

        Args:
            observations: (robots, size), what the robots saw.
            actions: (robots, A), commands before they are cut at their limits.
        """
        self._steps += 1
        if self._steps % _EVERY:
            return
        commands = np.clip(actions, self._low, self._high)
        sizes = np.abs(commands)
        self._samples += 1
        self._commands += len(commands)
        self._speeds += sizes.sum(axis=0)
        self._saturated += int((sizes[:, -1] >= _AT_LIMIT).sum())
        self._turned = commands[:, -1] + (0.0 if self._turned is None else self._turned)
        if len(self._seen) < _MAX_KEPT:
            self._seen.append(observations[:_KEPT_ROBOTS].copy())

    def flush(self) -> dict[str, float]:
        """The window's metrics, none where nothing was sampled; the next window starts now."""
        if self._turned is None:
            return {}
        means = (self._speeds / self._commands).tolist()
        metrics = {
            **{_metric(name): mean for name, mean in zip(self._names, means, strict=True)},
            "train/spin": float(np.abs(self._turned).mean()) / self._samples,
            "policy/saturation": self._saturated / self._commands,
        }
        seen = np.concatenate(self._seen)
        if len(seen) >= _MIN_OBSERVATIONS:
            alike = np.abs(seen - np.median(seen, axis=0)) <= _ALIKE
            metrics["observation/constant"] = float((alike.mean(axis=0) >= _CONSTANT_SHARE).mean())
        self._clear()
        return metrics


def _metric(component: str) -> str:
    """The metric of a component's mean size."""
    return "train/steering" if component == "steering" else f"train/{component}_speed"
