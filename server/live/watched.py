"""What a live view may be of: a run, a policy under 'policy-NAME' or 'checkpoint-ID', or a playground under 'play-ID'."""

from collections.abc import Callable
from dataclasses import dataclass

from pydantic import BaseModel
from sqlalchemy.orm import Session

from server.arenas.references import with_geometry
from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.experiments.stored import training_of
from server.live.drivers import Driven
from server.playground.registry import PLAY_PREFIX
from server.policies.service import find, shipped_hash
from server.runs.repository import RunRepository
from server.runs.states import FINISHED
from server.services import Services
from sim.arenas import with_maps_of
from sim.config import TaskConfig
from workers.job_protocol import CheckpointPolicy, ShippedPolicyName, ViewJob
from workers.scene.stage import Stage

POLICY_PREFIX = "policy-"
"""Of what is no run: no run's id has a hyphen."""


CHECKPOINT_PREFIX = "checkpoint-"
"""Of one policy of a run."""


def checkpoint_view(checkpoint_id: str) -> str:
    """Under which the live view of a checkpoint goes."""
    return f"{CHECKPOINT_PREFIX}{checkpoint_id}"


def policy_view(name: str) -> str:
    """Under which the live view of a shipped policy goes."""
    return f"{POLICY_PREFIX}{name}"


@dataclass(frozen=True)
class Watched:
    """A run, a policy, a checkpoint or a playground to look at.

    Attributes:
        id: of its live view.
        task: the place, and the geometry of robot and LiDAR.
        driven: the policy that drives after the training; None while its worker sends the frames.
        stage: what a playground draws; None of everything else.
        moment: what there is to say of what a playground's picture shows; None likewise.
    """

    id: str
    task: TaskConfig
    driven: Driven | None
    stage: Stage | None = None
    moment: Callable[[], BaseModel] | None = None


def watched(services: Services, identifier: str) -> Watched:
    """What the live view of that id shows.

    Raises:
        NotFoundError: there is nothing of that id.
    """
    if identifier.startswith(PLAY_PREFIX):
        ground = services.playgrounds.get(identifier)
        return Watched(identifier, ground.empty_task, ground.driven, ground, ground.shown_moment)
    if identifier.startswith(POLICY_PREFIX):
        policy = find(identifier.removeprefix(POLICY_PREFIX))
        task = with_maps_of(policy.card.training.task, policy.card.seed)
        name = policy.card.name
        driven = Driven(ViewJob(policy=ShippedPolicyName(name=name)), shipped_hash(name), policy.card.title)
        return Watched(identifier, task, driven)
    with services.database.read() as session:
        if identifier.startswith(CHECKPOINT_PREFIX):
            chosen = CheckpointRepository(session).get(identifier.removeprefix(CHECKPOINT_PREFIX))
            run = RunRepository(session).get(chosen.run_id)
            best: tables.Checkpoint | None = chosen
        else:
            run = RunRepository(session).get(identifier)
            best = _best(session, identifier) if run.state in FINISHED else None
        training, seed = training_of(run.experiment), run.seed
        title = f"{run.experiment.name}, seed {seed}"
    task = with_maps_of(with_geometry(training, services.arenas).task, seed)
    if best is None:
        return Watched(identifier, task, None)
    return Watched(identifier, task, Driven(ViewJob(policy=CheckpointPolicy(id=best.id)), best.sha256, title))


def _best(session: Session, run_id: str) -> tables.Checkpoint | None:
    """A run's best checkpoint; of its last where none was evaluated, None where there is none."""
    repository = CheckpointRepository(session)
    best = repository.best(run_id)
    return best[0] if best else repository.last(run_id)
