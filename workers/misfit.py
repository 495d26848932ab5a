"""Whether a training can begin with the policy of another one, and if not, in what they differ."""

from collections.abc import Iterator

from sim.actions import action_layout
from workers.config import TrainingConfig
from workers.networks.inputs import inputs_of


def misfit(theirs: TrainingConfig, ours: TrainingConfig) -> str | None:
    """In what keeps a policy of one training from being the beginning of another; None where nothing does.

    Observations have to be of the same parts, in the same order and of as many numbers, actions of the same components and
    ranges, and networks of the same kind and sizes. What 1 stands for in any of these numbers (a LiDAR's range, a robot's
    top speed) may differ, and so may everything else.

    Args:
        theirs: what made the policy.
        ours: what is to begin with it.
    """
    return "; ".join(_differences(theirs, ours)) or None


def _differences(theirs: TrainingConfig, ours: TrainingConfig) -> Iterator[str]:
    there, here = (one.task.observation for one in (theirs, ours))
    sizes = [inputs_of(one.task).size for one in (theirs, ours)]
    if there.parts != here.parts or sizes[0] != sizes[1]:
        yield (
            f"its observation is {there.in_short} of {sizes[0]} numbers, and this one's {here.in_short} of {sizes[1]}"
            if (there.in_short, sizes[0]) != (here.in_short, sizes[1])
            else f"its observation is made of the parts {_listed(theirs)}, and this one's of {_listed(ours)}"
        )
    actions = [action_layout(one.task.robot) for one in (theirs, ours)]
    ranges = [tuple(zip(one.names, one.lows, strict=True)) for one in actions]
    if ranges[0] != ranges[1]:
        named = [", ".join(f"{name} from {low:g} to 1" for name, low in some) for some in ranges]
        yield f"its actions are {named[0]}, and this one's {named[1]}"
    networks = [_network(one) for one in (theirs, ours)]
    if networks[0] != networks[1]:
        yield f"its network is {networks[0]}, and this one's {networks[1]}"


def _listed(training: TrainingConfig) -> str:
    return "; ".join(
        ", ".join(f"{key} {value}" if key != "name" else str(value) for key, value in part.model_dump(mode="json").items())
        for part in training.task.observation.parts
    )


def _network(training: TrainingConfig) -> str:
    """Kind and sizes: how far gradients go back through time changes no weight's place."""
    settings = training.algorithm.network.model_dump(mode="json", exclude={"sequence_length"})
    sizes = ", ".join(f"{key} {value}" for key, value in settings.items() if key != "name")
    return f"{settings['name']} ({sizes})" if sizes else str(settings["name"])
