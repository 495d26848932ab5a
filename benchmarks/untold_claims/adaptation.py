"""How soon each method, trained in the simple arena, does well once it finds itself in the complex one."""

from collections.abc import Iterator

import numpy as np

from benchmarks.untold_claims.trainings import Trainings
from benchmarks.untold_claims.words import mean, told
from workers.config import EvaluationConfig
from workers.reproduction.measures import SCALES
from workers.reproduction.rows import EVALUATE_EVERY, OTHER_WAY, ROW_BY_ID
from workers.statistics.differences import difference_of_means

RESBLOCK, VANILLA, DDPG = "resblock-ppo", "vanilla-ppo", OTHER_WAY["simple-basic-ddpg"].removeprefix("simple-basic-")
METHODS = {RESBLOCK: "ResBlock PPO", VANILLA: "Vanilla PPO", DDPG: "DDPG, logit penalty"}

# How far a training in the other arena is looked at, and how often.
AFTER_CHANGE = 200_000


def adaptation(trainings: Trainings) -> Iterator[str]:
    """How soon each method, trained in the simple arena, does well once it finds itself in the complex one."""
    yield "## ResBlock PPO adapts swiftly to changes of the environment"
    yield ""
    yield (
        "Each method learns the simple arena for 600,000 steps as in the paper's first table; then obstacles appear: the "
        "training goes on in the complex arena. *After*: mean success on that arena's frozen suite over the evaluations of "
        f"the next {AFTER_CHANGE:,} steps, one in {EVALUATE_EVERY:,}; *fresh* is the same from fresh weights. DDPG's memory "
        "of steps is empty after the change."
    )
    after, fresh = {}, {}
    for method in METHODS:
        there = _train(trainings, method)
        after[method], fresh[method] = (
            trainings.learned(name, AFTER_CHANGE, EVALUATE_EVERY) for name in (f"{there}-after-simple", there)
        )
    yield from (
        "",
        "| method | at the change % | after % | of each seed | fresh % | ResBlock PPO has after the change |",
        "|---|---|---|---|---|---|",
    )
    for method, title in METHODS.items():
        at_first = 100 * float(np.mean(trainings.at_first(f"complex-basic-{method}-after-simple")))
        difference = difference_of_means(after[RESBLOCK], after[method])
        why = "" if method == RESBLOCK else told(SCALES["success"], difference, trainings.seeds)
        seeds = ", ".join(f"{100 * rate:.1f}" for rate in after[method])
        yield f"| {title} | {at_first:.1f} | {mean(after[method], 100)} | {seeds} | {mean(fresh[method], 100)} | {why} |"


def _train(trainings: Trainings, method: str) -> str:
    """Trains a method before and after the change, and from fresh weights; the name of these last trainings."""
    before, there = ROW_BY_ID[f"simple-basic-{method}"], f"complex-basic-{method}"
    training = before.training.model_copy(
        update={
            "task": ROW_BY_ID["complex-basic-resblock-ppo"].training.task,
            "steps": AFTER_CHANGE,
            "evaluation": EvaluationConfig(every_steps=EVALUATE_EVERY, drives=1),
        }
    )
    trainings.trained(before.id, before.training)
    trainings.changed(f"{there}-after-simple", training, before.id)
    row = ROW_BY_ID.get(there)
    trainings.trained(there, row.training if row else training)
    return there
