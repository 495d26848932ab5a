"""How large a training's checkpoint archives become: what does not fit is refused before it is launched, not midway."""

from math import prod

from sim.actions import action_layout
from sim.observations import observation_size
from workers.checkpoints import MAX_STATE_BYTES
from workers.config import OffPolicyConfig, TrainingConfig
from workers.errors import MemoryTooLargeError
from workers.networks.inputs import inputs_of
from workers.networks.layout import known_shapes
from workers.wording import counted

_NUMBER_BYTES = 4
# A reward, and whether something followed.
_OUTCOME_NUMBERS = 2
# Observations that no other row holds follow where an episode ended: of four steps at least, on average over a memory.
_STEPS_PER_EPISODE = 4
# An actor, two critics; of each the weights, a slow copy, two moments of Adam.
_NETWORK_COPIES = 12
# Manifest, episodes, random states; and poses, targets and obstacles of each robot.
_FIXED_BYTES = 2**20
_ROBOT_BYTES = 2**12


def replay_bytes(training: TrainingConfig) -> int:
    """Bytes that a full replay memory takes in an archive, at most; 0 where there is none."""
    algorithm = training.algorithm
    if not isinstance(algorithm, OffPolicyConfig):
        return 0
    slots = -(-algorithm.replay_size // algorithm.robots)
    return slots * algorithm.robots * _transition_bytes(training)


def archive_bytes(training: TrainingConfig) -> int:
    """Bytes of the training's largest archive, at most; without the weights of a network that only its module knows."""
    actions = action_layout(training.task.robot)
    shapes = known_shapes(training.algorithm.network, inputs_of(training.task).and_also(actions.size), actions)
    networks = _NETWORK_COPIES * _NUMBER_BYTES * sum(map(prod, (shapes or {}).values()))
    return replay_bytes(training) + networks + _FIXED_BYTES + _ROBOT_BYTES * training.algorithm.robots


def refuse_too_large(training: TrainingConfig, max_bytes: int = MAX_STATE_BYTES) -> None:
    """Before a training begins.

    Args:
        training: what is to be trained.
        max_bytes: of an archive that whoever keeps it takes; what this release reads is the most in any case.

    Raises:
        MemoryTooLargeError: its replay memory makes archives that nobody could take or read; the message says how much fits.
    """
    limit = min(max_bytes, MAX_STATE_BYTES)
    replay = replay_bytes(training)
    if replay == 0 or archive_bytes(training) <= limit:
        return
    fits = max(0, limit - (archive_bytes(training) - replay)) // _transition_bytes(training) // 1_000 * 1_000
    raise MemoryTooLargeError(
        f"checkpoints with this memory may have {counted(archive_bytes(training) / 2**20)} MiB, {counted(limit / 2**20)} "
        f"are taken: keep at most {counted(fits)} transitions, or make observations smaller (fewer batches of rays, "
        "fewer frames)"
    )


def _transition_bytes(training: TrainingConfig) -> int:
    observation = observation_size(training.task)
    row = _NUMBER_BYTES * (observation + action_layout(training.task.robot).size + _OUTCOME_NUMBERS) + 1
    return row + -(-_NUMBER_BYTES * observation // _STEPS_PER_EPISODE)
