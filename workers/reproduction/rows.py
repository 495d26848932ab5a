"""The rows of the paper's three tables, as the paper has them and as trainings of ours (pydantic only)."""

from sim.config import ArenaConfig, Frozen, RewardConfig, TaskConfig
from workers.config import (
    Algorithm,
    DdpgConfig,
    EvaluationConfig,
    MlpNetwork,
    PpoConfig,
    ResBlockNetwork,
    TrainingConfig,
)

EPISODES_STEPS = 10_000
"""A table's row is one drive of about this many steps: in it, episodes x steps per episode is about 10,000."""


class TableRow(Frozen):
    """What a table says of one method, over one drive of about `EPISODES_STEPS` steps.

    Attributes:
        reward: mean per step; None where the paper gives none.
        episodes: target attempts.
        success: part of them that arrived, 0 to 1.
        steps: steps per episode, however it ended.
    """

    reward: float | None
    episodes: float
    success: float
    steps: float


class Row(Frozen):
    """A method of a table.

    Attributes:
        id: stable name, also of its folder in a campaign.
        table: arena and reward, as the paper groups them.
        method: as the paper calls it.
        paper: the paper's figures.
        training: ours.
    """

    id: str
    table: str
    method: str
    paper: TableRow
    training: TrainingConfig


# The published learning rate; the other hyperparameters are not given, and are ours.
_RESBLOCK = PpoConfig(network=ResBlockNetwork(), learning_rate=3e-4, learning_rate_schedule="constant")
_VANILLA = PpoConfig(network=MlpNetwork(hidden_sizes=(64, 64)), learning_rate=3e-4, learning_rate_schedule="constant")
_DDPG = DdpgConfig()


def _training(arena: str, reward: str, algorithm: Algorithm, steps: int) -> TrainingConfig:
    return TrainingConfig(
        task=TaskConfig(
            arena=ArenaConfig.model_validate({"name": arena}),
            observation="paper",
            reward=RewardConfig.model_validate({"name": reward}),
        ),
        algorithm=algorithm,
        steps=steps,
        evaluation=EvaluationConfig(every_steps=100_000),
    )


ROWS: tuple[Row, ...] = (
    Row(
        id="simple-basic-resblock-ppo",
        table="Simple arena, basic reward",
        method="ResBlock PPO",
        paper=TableRow(reward=17.49, episodes=90, success=1.0, steps=111.11),
        training=_training("simple", "basic", _RESBLOCK, 500_000),
    ),
    Row(
        id="simple-basic-vanilla-ppo",
        table="Simple arena, basic reward",
        method="PPO",
        paper=TableRow(reward=3.34, episodes=23, success=0.3043, steps=419.69),
        training=_training("simple", "basic", _VANILLA, 500_000),
    ),
    Row(
        id="simple-basic-ddpg",
        table="Simple arena, basic reward",
        method="DDPG",
        paper=TableRow(reward=12.65, episodes=65, success=0.9846, steps=144.92),
        training=_training("simple", "basic", _DDPG, 100_000),
    ),
    Row(
        id="complex-basic-ddpg",
        table="Complex arena, basic reward",
        method="DDPG",
        paper=TableRow(reward=11.23, episodes=63, success=0.9365, steps=158.73),
        training=_training("complex", "basic", _DDPG, 200_000),
    ),
    Row(
        id="complex-basic-resblock-ppo",
        table="Complex arena, basic reward",
        method="ResBlock PPO",
        paper=TableRow(reward=9.07, episodes=87, success=0.6781, steps=114.94),
        training=_training("complex", "basic", _RESBLOCK, 600_000),
    ),
    Row(
        id="complex-advanced-resblock-ppo",
        table="Complex arena, advanced reward",
        method="ResBlock PPO",
        paper=TableRow(reward=None, episodes=74, success=0.8513, steps=134.81),
        training=_training("complex", "clearance", _RESBLOCK, 600_000),
    ),
)


class Claim(Frozen):
    """A comparison that the paper makes: the success of one row is above that of another."""

    statement: str
    better: str
    worse: str


CLAIMS: tuple[Claim, ...] = (
    Claim(
        statement="In the simple arena ResBlock PPO arrives more often than plain PPO.",
        better="simple-basic-resblock-ppo",
        worse="simple-basic-vanilla-ppo",
    ),
    Claim(
        statement="In the simple arena ResBlock PPO arrives more often than DDPG.",
        better="simple-basic-resblock-ppo",
        worse="simple-basic-ddpg",
    ),
    Claim(
        statement="In the complex arena with the basic reward DDPG arrives more often than ResBlock PPO.",
        better="complex-basic-ddpg",
        worse="complex-basic-resblock-ppo",
    ),
    Claim(
        statement="In the complex arena the advanced reward makes ResBlock PPO arrive more often.",
        better="complex-advanced-resblock-ppo",
        worse="complex-basic-resblock-ppo",
    ),
)
