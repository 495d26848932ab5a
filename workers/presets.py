"""Named trainings to start from: what the launch form and the command line offer (pydantic only)."""

from pydantic import Field

from sim.config import ArenaConfig, Frozen, TaskConfig
from workers.config import EvaluationConfig, PpoConfig, ResBlockNetwork, TrainingConfig


class Preset(Frozen):
    """A complete training under a name."""

    id: str = Field(title="Identifier", description="Stable name, for the API and the command line.")
    title: str
    description: str
    training: TrainingConfig


DEFAULT = Preset(
    id="default",
    title="Default",
    description="PPO with a small network and the improved observation: the fastest way to a good policy.",
    training=TrainingConfig(),
)

PAPER = Preset(
    id="paper",
    title="Paper settings",
    description="ResBlock PPO on the observation and the basic reward as published, at the published learning rate.",
    training=TrainingConfig(
        task=TaskConfig(observation="paper"),
        algorithm=PpoConfig(
            network=ResBlockNetwork(),
            learning_rate=3e-4,
            learning_rate_schedule="constant",
        ),
        steps=600_000,
    ),
)

COMPLEX = Preset(
    id="complex",
    title="Complex arena",
    description="PPO for 17 obstacles: more robots, larger minibatches and a longer horizon (docs/recipes.md).",
    training=TrainingConfig(
        task=TaskConfig(arena=ArenaConfig(name="complex")),
        algorithm=PpoConfig(robots=256, minibatch_size=1024, gamma=0.995),
        steps=1_500_000,
        evaluation=EvaluationConfig(every_steps=100_000),
    ),
)

PRESETS: tuple[Preset, ...] = (DEFAULT, PAPER, COMPLEX)


def preset(identifier: str) -> Preset:
    """The preset of that name.

    Raises:
        KeyError: there is none; the message names those that exist.
    """
    for candidate in PRESETS:
        if candidate.id == identifier:
            return candidate
    raise KeyError(f"no preset {identifier!r}: choose one of {', '.join(p.id for p in PRESETS)}")
