"""What the parts of the paper's observation are worth, each left out once."""

from collections.abc import Iterator

from benchmarks.untold_claims.trainings import Trainings
from benchmarks.untold_claims.words import each, rate, rates, told
from workers.reproduction.measures import SCALES
from workers.reproduction.rows import ROW_BY_ID
from workers.statistics.differences import difference_of_rates

# Of a scan, the robot's speeds, the target and the robot's own direction: what the paper's observation is made of.
_PARTS_BY_TITLE = {
    "the ranges": ("ranges",),
    "the speeds": ("speeds",),
    "the target's distance": ("distance",),
    "the target's direction": ("direction",),
    "its own heading": ("heading",),
    "the heading's deviation from the target": ("deviation",),
}
_PARTS = {name for names in _PARTS_BY_TITLE.values() for name in names}


def observation(trainings: Trainings) -> Iterator[str]:
    """What the paper's observation is worth, group by group, in the complex arena."""
    row = ROW_BY_ID["complex-basic-resblock-ppo"]
    assert {part.name for part in row.training.task.observation.parts} == _PARTS
    whole = trainings.trained(row.id, row.training)
    yield "## The comprehensive observation improves decisions"
    yield ""
    yield (
        "ResBlock PPO in the complex arena with the basic reward, as in the paper's second table, and once more without "
        "each part of its sixteen numbers."
    )
    yield from ("", "| without | success % | of each seed | the whole has |", "|---|---|---|---|")
    yield f"| nothing | {rate(whole)} | {each(whole)} | |"
    for left_out, parts in _PARTS_BY_TITLE.items():
        task = row.training.task.model_copy(update={"observation": row.training.task.observation.without(*parts)})
        name = f"{row.id}-without-{'-'.join(parts)}"
        results = trainings.trained(name, row.training.model_copy(update={"task": task}))
        difference = difference_of_rates(rates(whole), rates(results))
        yield f"| {left_out} | {rate(results)} | {each(results)} | {told(SCALES['success'], difference, len(whole))} |"
