"""Named trainings to start from: what the launch form and the command line offer (pydantic only)."""

from pydantic import Field

from sim.config import ArenaConfig, Frozen, GeneratedArenaConfig, LidarConfig, ObservationConfig, TaskConfig
from workers.config import (
    DdpgConfig,
    EvaluationConfig,
    MlpNetwork,
    Network,
    PpoConfig,
    ResBlockNetwork,
    TrainingConfig,
)


class Preset(Frozen):
    """A complete training under a name."""

    id: str = Field(title="Identifier", description="Stable name, for the API and the command line.")
    title: str
    description: str
    training: TrainingConfig


def paper_ppo(network: Network) -> PpoConfig:
    """PPO at the published learning rate; what the paper leaves open is what PPO is usually run with."""
    return PpoConfig(
        network=network,
        robots=128,
        minibatch_size=512,
        learning_rate=3e-4,
        learning_rate_schedule="constant",
        gamma=0.99,
        entropy_coefficient=0.0,
    )


def paper_ddpg() -> DdpgConfig:
    """DDPG as in our reproduction's tables: the paper gives none of its settings, so nothing here follows the defaults."""
    return DdpgConfig(
        network=MlpNetwork(hidden_sizes=(128, 128)),
        robots=64,
        updates_per_step=4,
        batch_size=256,
        replay_size=200_000,
        warmup_steps=10_000,
        actor_learning_rate=3e-4,
        critic_learning_rate=1e-3,
        learning_rate_schedule="constant",
        gamma=0.99,
        tau=0.01,
        reward_scale=0.01,
        exploration_noise=0.5,
        final_exploration_noise=0.05,
        logit_penalty=0.0,
    )


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
        task=TaskConfig(observation=ObservationConfig.preset("paper")),
        algorithm=paper_ppo(ResBlockNetwork()),
        steps=600_000,
    ),
)

COMPLEX = Preset(
    id="complex",
    title="Complex arena",
    description="PPO for 17 obstacles: the default training, five times as long.",
    training=TrainingConfig(
        task=TaskConfig(arena=ArenaConfig(name="complex")),
        steps=1_500_000,
        evaluation=EvaluationConfig(every_steps=100_000),
    ),
)

NEW_PLACES = Preset(
    id="new-places",
    title="New places",
    description="For clutter that it has never met, by a noisy LiDAR and with commands that come late: PPO on 256 maps.",
    training=TrainingConfig(
        task=TaskConfig(
            arena=GeneratedArenaConfig(name="clutter", difficulty=0.5, maps=256),
            lidar=LidarConfig(noise=0.01, dropout=0.01),
            command_delay=1,
        ),
        steps=1_000_000,
        evaluation=EvaluationConfig(every_steps=250_000),
    ),
)

PRESETS: tuple[Preset, ...] = (DEFAULT, PAPER, COMPLEX, NEW_PLACES)


def preset(identifier: str) -> Preset:
    """The preset of that name.

    Raises:
        KeyError: there is none; the message names those that exist.
    """
    for candidate in PRESETS:
        if candidate.id == identifier:
            return candidate
    raise KeyError(f"no preset {identifier!r}: choose one of {', '.join(p.id for p in PRESETS)}")
