"""The rows of the paper's three tables, as the paper has them and as trainings of ours, and its figures (pydantic only)."""

from collections.abc import Mapping

from sim.config import ArenaConfig, Frozen, ObservationConfig, RewardConfig, RewardPreset, TaskConfig
from workers.config import (
    Algorithm,
    EvaluationConfig,
    MlpNetwork,
    ResBlockNetwork,
    TrainingConfig,
)
from workers.presets import paper_ddpg, paper_ppo
from workers.training.table import TableRow

STEPS = 600_000
"""Environment steps of every training: the paper does not give its own, so all methods get the same."""

EVALUATE_EVERY = 25_000
"""Environment steps between two looks at the frozen suite: how finely speed of learning is told."""

DRIVES = 10
"""Of each trained policy: one of 10,000 steps, as the paper's, holds about 90 attempts, ten are a fairer sample."""

LOGIT_PENALTY = 1e-3
"""Of DDPG the other way, as by default: PPO is run with what it is usually run with, and DDPG may have its own cure."""

# A checkpoint of DDPG holds its replay memory, so only every 200,000 steps keep one.
_EVALUATIONS_PER_CHECKPOINT = 8
# The least that a training and its evaluations may be scaled down to.
_LEAST_STEPS = 1_000


class Row(Frozen):
    """A method of a table.

    Attributes:
        id: stable name, also of its folder in a campaign.
        method: as the paper calls it.
        paper: the paper's figures.
        training: ours.
        seconds: of one such training on one core, about; where a campaign's time is estimated before it has begun.
        instead_of: id of the row whose place it takes where the claims are judged the other way; None for the paper's own.
    """

    id: str
    method: str
    paper: TableRow
    training: TrainingConfig
    seconds: float
    instead_of: str | None = None


_RESBLOCK = paper_ppo(ResBlockNetwork())
_VANILLA = paper_ppo(MlpNetwork(hidden_sizes=(64, 64)))
_DDPG = paper_ddpg()
_PENALISED_DDPG = _DDPG.model_copy(update={"logit_penalty": LOGIT_PENALTY})


def _training(arena: str, reward: RewardPreset, algorithm: Algorithm) -> TrainingConfig:
    return TrainingConfig(
        task=TaskConfig(
            arena=ArenaConfig.model_validate({"name": arena}),
            observation=ObservationConfig.preset("paper"),
            reward=RewardConfig.preset(reward),
        ),
        algorithm=algorithm,
        steps=STEPS,
        evaluation=EvaluationConfig(
            every_steps=EVALUATE_EVERY, evaluations_per_checkpoint=_EVALUATIONS_PER_CHECKPOINT, drives=DRIVES
        ),
    )


PAPER_ROWS: tuple[Row, ...] = (
    Row(
        id="simple-basic-resblock-ppo",
        method="ResBlock PPO",
        paper=TableRow(reward=17.49, episodes=90, success=1.0, steps=111.11),
        training=_training("simple", "basic", _RESBLOCK),
        seconds=70,
    ),
    Row(
        id="simple-basic-vanilla-ppo",
        method="Vanilla PPO",
        paper=TableRow(reward=3.34, episodes=23, success=0.3043, steps=419.69),
        training=_training("simple", "basic", _VANILLA),
        seconds=15,
    ),
    Row(
        id="simple-basic-ddpg",
        method="DDPG",
        paper=TableRow(reward=12.65, episodes=65, success=0.9846, steps=144.92),
        training=_training("simple", "basic", _DDPG),
        seconds=100,
    ),
    Row(
        id="complex-basic-ddpg",
        method="DDPG",
        paper=TableRow(reward=11.23, episodes=63, success=0.9365, steps=158.73),
        training=_training("complex", "basic", _DDPG),
        seconds=100,
    ),
    Row(
        id="complex-basic-resblock-ppo",
        method="ResBlock PPO",
        paper=TableRow(reward=9.07, episodes=87, success=0.6781, steps=114.94),
        training=_training("complex", "basic", _RESBLOCK),
        seconds=70,
    ),
    Row(
        id="complex-advanced-resblock-ppo",
        method="ResBlock PPO",
        paper=TableRow(reward=None, episodes=74, success=0.8513, steps=134.81),
        training=_training("complex", "clearance", _RESBLOCK),
        seconds=70,
    ),
)


def _penalised(identifier: str) -> Row:
    row = next(row for row in PAPER_ROWS if row.id == identifier)
    training = row.training.model_copy(update={"algorithm": _PENALISED_DDPG})
    update = {
        "id": f"{identifier}-penalised",
        "method": "DDPG, logit penalty",
        "training": training,
        "instead_of": identifier,
    }
    return row.model_copy(update=update)


ROWS: tuple[Row, ...] = (*PAPER_ROWS, _penalised("simple-basic-ddpg"), _penalised("complex-basic-ddpg"))
"""What a campaign trains: the paper's rows, and DDPG's the other way, with a penalty that keeps it from saturating."""

ROW_BY_ID: Mapping[str, Row] = {row.id: row for row in ROWS}

OTHER_WAY: Mapping[str, str] = {row.instead_of: row.id for row in ROWS if row.instead_of is not None}
"""By row of the paper: the row that takes its place the other way."""


class Table(Frozen):
    """A table of the paper.

    Attributes:
        id: stable name.
        title: arena and reward.
        rows: their ids, in the paper's order.
        labels: of the rows, as this table tells them apart.
    """

    id: str
    title: str
    rows: tuple[str, ...]
    labels: tuple[str, ...]


TABLES: tuple[Table, ...] = (
    Table(
        id="simple-basic",
        title="Simple arena, basic reward",
        rows=("simple-basic-resblock-ppo", "simple-basic-vanilla-ppo", "simple-basic-ddpg"),
        labels=("ResBlock PPO", "Vanilla PPO", "DDPG"),
    ),
    Table(
        id="complex-basic",
        title="Complex arena, basic reward",
        rows=("complex-basic-ddpg", "complex-basic-resblock-ppo"),
        labels=("DDPG", "ResBlock PPO"),
    ),
    Table(
        id="complex-advanced",
        title="Complex arena, advanced reward",
        rows=("complex-basic-ddpg", "complex-advanced-resblock-ppo", "complex-basic-resblock-ppo"),
        labels=("DDPG, basic reward", "ResBlock PPO, advanced reward", "ResBlock PPO, basic reward"),
    ),
)
"""The third repeats both rows of the second."""


def title(row: Row) -> str:
    """What a person knows the row by: 'ResBlock PPO, simple arena, basic reward'."""
    setting = next(table.title for table in TABLES if (row.instead_of or row.id) in table.rows)
    return f"{row.method}, {setting[0].lower()}{setting[1:]}"


class Figure(Frozen):
    """Learning curves that the paper draws into one picture.

    Attributes:
        id: stable name, also of a file.
        title: what the paper calls it.
        rows: whose curves it shows.
    """

    id: str
    title: str
    rows: tuple[str, ...]


FIGURES: tuple[Figure, ...] = (
    Figure(
        id="simple-basic",
        title="Simple arena, basic reward",
        rows=(
            "simple-basic-resblock-ppo",
            "simple-basic-vanilla-ppo",
            "simple-basic-ddpg",
            OTHER_WAY["simple-basic-ddpg"],
        ),
    ),
    Figure(
        id="complex-basic",
        title="Complex arena, basic reward",
        rows=("complex-basic-resblock-ppo", "complex-basic-ddpg", OTHER_WAY["complex-basic-ddpg"]),
    ),
    Figure(id="complex-ddpg", title="DDPG, complex arena, basic reward", rows=("complex-basic-ddpg",)),
    Figure(
        id="complex-advanced",
        title="ResBlock PPO, complex arena, advanced reward",
        rows=("complex-advanced-resblock-ppo",),
    ),
)
"""In the paper's order, which puts the last two side by side; the other way of DDPG is drawn beside its own."""

CURVE = "train/return"
"""The metric of those curves: reward of a target attempt in training, summed; the paper calls it cumulative reward."""


def scaled(training: TrainingConfig, effort: float) -> TrainingConfig:
    """The training with a part of its steps and evaluated as often: a trial, whose figures say nothing of the paper's.

    Args:
        training: of a row.
        effort: above 0, at most 1.
    """
    if effort == 1.0:
        return training
    every = max(_LEAST_STEPS, round(training.evaluation.every_steps * effort))
    evaluation = training.evaluation.model_copy(update={"every_steps": every})
    return training.model_copy(update={"steps": max(_LEAST_STEPS, round(training.steps * effort)), "evaluation": evaluation})
