"""What the parts of the paper's observation are worth, each left out once."""

from collections.abc import Iterator, Sequence

from benchmarks.untold_claims.trainings import Trainings
from benchmarks.untold_claims.words import each, rate, rates, told
from workers.reproduction.measures import SCALES
from workers.reproduction.rows import ROW_BY_ID
from workers.statistics.differences import difference_of_rates

# Of a scan, the robot's speeds, the target and the robot's own direction: what the paper's observation is made of.
PARTS = {
    "ranges": "the ranges",
    "speeds": "the speeds",
    "distance": "the target's distance",
    "direction": "the target's direction",
    "heading": "its own heading",
    "deviation": "the heading's deviation from the target",
}


def observation(trainings: Trainings, without: Sequence[str] = tuple(PARTS)) -> Iterator[str]:
    """What the paper's observation is worth, part by part, in the complex arena.

    Args:
        trainings: where they are kept.
        without: names of the parts that are left out, each once.
    """
    row = ROW_BY_ID["complex-basic-resblock-ppo"]
    assert {part.name for part in row.training.task.observation.parts} == PARTS.keys()
    whole = trainings.trained(row.id, row.training)
    yield "## The comprehensive observation improves decisions"
    yield ""
    yield (
        "ResBlock PPO in the complex arena with the basic reward, as in the paper's second table, and once more without "
        "each part of its sixteen numbers."
    )
    yield from ("", "| without | success % | of each seed | the whole has |", "|---|---|---|---|")
    yield f"| nothing | {rate(whole)} | {each(whole)} | |"
    for part in without:
        task = row.training.task.model_copy(update={"observation": row.training.task.observation.without(part)})
        name = f"{row.id}-without-{part}"
        results = trainings.trained(name, row.training.model_copy(update={"task": task}))
        difference = difference_of_rates(rates(whole), rates(results))
        yield f"| {PARTS[part]} | {rate(results)} | {each(results)} | {told(SCALES['success'], difference, len(whole))} |"
    if missing := [PARTS[part] for part in PARTS if part not in without]:
        yield ""
        yield f"Not measured: {', '.join(missing)}."
