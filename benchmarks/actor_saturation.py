"""Watches a DDPG actor run onto the flat ends of its sigmoid and tanh, and, with a logit penalty, come back.

    python -m benchmarks.actor_saturation --seed 0 [--penalty 1e-3]

The settings are those of the paper's campaign in the simple arena; the penalty alone is changed. Each
line looks at what the 64 robots see at that step: the actor's mean logits and actions, the part of the
observations in which its critic asks for more speed, and the slope of the sigmoid by which that reaches the actor.
"""

import json
import tempfile
from pathlib import Path

import torch

from benchmarks.report import finish, parser
from benchmarks.training_rates import Silent
from workers.algorithms.ddpg import Ddpg
from workers.algorithms.gradients.actor_critic import action_value
from workers.live.viewing import Unwatched
from workers.networks.squashing import bound_actions
from workers.presets import paper_ddpg
from workers.reproduction.rows import ROW_BY_ID
from workers.training.trainer import REPORT_INTERVAL, Training

ROW = "simple-basic-ddpg"
EVERY = 2_000


def look(ddpg: Ddpg, observations: torch.Tensor) -> dict[str, float | list[float]]:
    """What the actor does in these observations, and what its critic would have it do."""
    with torch.no_grad():
        logits = ddpg.actor.network(observations)
    actions = bound_actions(logits).requires_grad_()
    (by_actions,) = torch.autograd.grad(action_value(ddpg.critics[0], observations, actions).sum(), actions)
    linear = actions.detach()[:, 0]
    return {
        "logits": [round(value, 1) for value in logits.mean(dim=0).tolist()],
        "actions": [round(value, 3) for value in actions.detach().mean(dim=0).tolist()],
        "faster_would_be_better": round(float((by_actions[:, 0] > 0).float().mean()), 2),
        "slope": float(f"{float((linear * (1.0 - linear)).mean()):.1e}"),
    }


def main() -> None:
    """Train, and look now and then."""
    options = parser(__doc__)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--penalty", type=float, default=0.0)
    options.add_argument("--steps", type=int, default=30_000)
    arguments = options.parse_args()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    algorithm = paper_ddpg().model_copy(update={"logit_penalty": arguments.penalty})
    config = ROW_BY_ID[ROW].training.model_copy(update={"algorithm": algorithm})
    looks: list[dict[str, float | list[float]]] = []
    with tempfile.TemporaryDirectory() as directory:
        training = Training(config, arguments.seed, Silent(), Path(directory), Unwatched(), REPORT_INTERVAL)
        ddpg = training.algorithm
        assert isinstance(ddpg, Ddpg)
        while training.step < arguments.steps:
            training.collect()
            training.update()
            if training.step >= EVERY * (len(looks) + 1):
                looks.append({"step": training.step, **look(ddpg, torch.from_numpy(training.observations.copy()))})
                print(json.dumps(looks[-1]), flush=True)
    finish("actor_saturation", {"seed": arguments.seed, "penalty": arguments.penalty, "last": looks[-1]})


if __name__ == "__main__":
    main()
