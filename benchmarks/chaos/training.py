"""The training that is disturbed: small, with many checkpoints, and the same bit for bit however often it is resumed."""

from typing import Any

# A checkpoint a second or so.
_STEPS_PER_CHECKPOINT = 8_192


def small_training(steps: int) -> dict[str, Any]:
    """What the launch form would send for a training of so many environment steps."""
    return {
        "steps": steps,
        "algorithm": {
            "name": "ppo",
            "network": {"name": "mlp", "hidden_sizes": [16]},
            "robots": 32,
            "rollout_steps": 32,
            "minibatch_size": 512,
        },
        "evaluation": {"every_steps": _STEPS_PER_CHECKPOINT},
    }
