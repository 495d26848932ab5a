"""What metrics are called, on the pages and in print.

`python -m server.written.metric_words web/src/charts/metricWords.json` writes the pages' copy; a test compares the two.
"""

from collections.abc import Mapping
from typing import NamedTuple

from server.estimates import is_rate

# Stands for the rest of a name, spelled out, in its key and in its title.
REST = "*"


class MetricWords(NamedTuple):
    """A metric in words.

    Attributes:
        title: of its chart.
        axis: what its values are, with their unit; shares are written in per cent, and the ticks say so.
        note: what tells it from others of the same title.
        share: whether it is of 0 to 1, and written in per cent.
    """

    title: str
    axis: str
    note: str = ""
    share: bool = False


_EPISODES, _TIME, _COMMANDS = "Share of episodes", "Share of the time", "Share of the limit"
_DEVIATION, _PER_STEP = "Standard deviation", "Reward per step"

METRIC_WORDS: Mapping[str, MetricWords] = {
    "eval/success_rate": MetricWords("Success rate", _EPISODES, "evaluation", share=True),
    "eval/collision_rate": MetricWords("Collision rate", _EPISODES, "evaluation", share=True),
    "eval/timeout_rate": MetricWords("Time-out rate", _EPISODES, "evaluation", share=True),
    "eval/return": MetricWords("Return", "Return per episode", "per episode, evaluation"),
    "eval/reward": MetricWords("Reward", _PER_STEP, "per step, evaluation"),
    "eval/steps": MetricWords("Steps to the target", "Steps", "evaluation"),
    "eval/path_efficiency": MetricWords("Path efficiency", "Shortest path over path driven", "evaluation", share=True),
    "train/success_rate": MetricWords("Success rate", _EPISODES, "training", share=True),
    "train/collision_rate": MetricWords("Collision rate", _EPISODES, "training", share=True),
    "train/timeout_rate": MetricWords("Time-out rate", _EPISODES, "training", share=True),
    "train/return": MetricWords("Return", "Return per episode", "per episode, training"),
    "train/reward": MetricWords("Reward", _PER_STEP, "per step, training"),
    "train/episode_length": MetricWords("Episode length", "Steps per episode", "training"),
    "train/episodes": MetricWords("Episodes", "Episodes", "that have ended"),
    f"reward/{REST}": MetricWords(f"Reward: {REST}", _PER_STEP),
    "train/linear_speed": MetricWords("Commands: linear", _COMMANDS, share=True),
    "train/lateral_speed": MetricWords("Commands: lateral", _COMMANDS, share=True),
    "train/angular_speed": MetricWords("Commands: angular", _COMMANDS, share=True),
    "train/steering": MetricWords("Commands: steering", _COMMANDS, share=True),
    "train/spin": MetricWords("Commands: turning one way", _COMMANDS, share=True),
    "policy/saturation": MetricWords("Turning at its limit", "Share of the commands", share=True),
    "observation/constant": MetricWords("Constant observations", "Share of their numbers", share=True),
    "loss/policy": MetricWords("Policy loss", "Loss"),
    "loss/value": MetricWords("Value loss", "Loss"),
    "policy/kl": MetricWords("KL divergence", "KL divergence, nats", "old to new policy"),
    "policy/entropy": MetricWords("Entropy", "Entropy, nats"),
    "policy/temperature": MetricWords("Temperature", "Temperature", "weight of the entropy"),
    "policy/std_linear": MetricWords("Exploration: linear", _DEVIATION),
    "policy/std_lateral": MetricWords("Exploration: lateral", _DEVIATION),
    "policy/std_angular": MetricWords("Exploration: angular", _DEVIATION),
    "policy/std_steering": MetricWords("Exploration: steering", _DEVIATION),
    "policy/clip_fraction": MetricWords("Clipped samples", "Share of the samples", share=True),
    "value/explained_variance": MetricWords(
        "Explained variance", "Fraction of the variance", "of the returns, by the critic"
    ),
    "value/mean": MetricWords("Value", "Return to come", "mean of the critic's targets"),
    "optim/learning_rate": MetricWords("Learning rate", "Learning rate"),
    "time/steps_per_second": MetricWords("Steps per second", "Steps per second", "all robots"),
    "time/wall_seconds": MetricWords("Time under way", "Seconds"),
    "time/cpu_seconds": MetricWords("CPU time of the trainer", "Seconds"),
    "time/simulation": MetricWords("Where the time goes: simulation", _TIME, share=True),
    "time/inference": MetricWords("Where the time goes: inference", _TIME, share=True),
    "time/update": MetricWords("Where the time goes: update", _TIME, share=True),
    "time/evaluation": MetricWords("Where the time goes: evaluation", _TIME, share=True),
    "time/reporting": MetricWords("Where the time goes: reporting", _TIME, share=True),
}


def words_of(name: str) -> MetricWords:
    """Of a metric; one that has none is called by its name, and a rate is a share."""
    group, _, rest = name.partition("/")
    found = METRIC_WORDS.get(name) or (METRIC_WORDS.get(f"{group}/{REST}") if rest else None)
    if found is None:
        return MetricWords(name, name, share=is_rate(name))
    return found._replace(title=found.title.replace(REST, rest.replace("_", " ").lower()))
