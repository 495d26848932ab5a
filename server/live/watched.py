"""What a live view may be of: a run, or a policy that ships under 'policy-NAME'."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy.orm import Session

from server.arenas.references import with_geometry
from server.checkpoints.repository import CheckpointRepository
from server.checkpoints.service import CheckpointService
from server.experiments.stored import training_of
from server.policies.service import find
from server.runs.repository import RunRepository
from server.runs.states import FINISHED
from server.services import Services
from sim.arenas import with_maps_of
from sim.config import TaskConfig

# No run's id has a hyphen.
_POLICY = "policy-"


def policy_view(name: str) -> str:
    """Under which the live view of a shipped policy goes."""
    return f"{_POLICY}{name}"


@dataclass(frozen=True)
class Watched:
    """A run or a policy to look at.

    Attributes:
        id: of its live view.
        task: the place, and the geometry of robot and LiDAR.
        save: writes the archive of the policy that drives after the training; None while its worker sends the frames.
    """

    id: str
    task: TaskConfig
    save: Callable[[Path], None] | None


def watched(services: Services, identifier: str) -> Watched:
    """What the live view of that id shows.

    Raises:
        NotFoundError: there is nothing of that id.
    """
    if identifier.startswith(_POLICY):
        policy = find(identifier.removeprefix(_POLICY))
        task = with_maps_of(policy.card.training.task, policy.card.seed)
        return Watched(identifier, task, lambda path: _copy(policy.archive, path))
    with services.database.read() as session:
        run = RunRepository(session).get(identifier)
        training, seed = training_of(run.experiment), run.seed
        best = _best(session, identifier) if run.state in FINISHED else None
    task = with_maps_of(with_geometry(training, services.arenas).task, seed)
    if best is None:
        return Watched(identifier, task, None)
    return Watched(identifier, task, lambda path: CheckpointService(services).download(best).save(path))


def _best(session: Session, run_id: str) -> str | None:
    """The id of a run's best checkpoint; of its last where none was evaluated, None where there is none."""
    repository = CheckpointRepository(session)
    best = repository.best(run_id)
    last = best[0] if best else repository.last(run_id)
    return last.id if last else None


def _copy(source: Path, target: Path) -> None:
    target.write_bytes(source.read_bytes())
