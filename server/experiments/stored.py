"""An experiment's settings as another version may have stored them.

What this version does not know, or no longer allows, does not take the experiment away: it is shown with the default in its
place, and says so. It is not trained: what came of it would not be what was launched.
"""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from server.database import tables
from sim.extending.discovery import UsedExtension, missing, versions, wording
from workers.config import TrainingConfig


@dataclass(frozen=True, slots=True)
class StoredTraining:
    """Settings that were stored.

    Attributes:
        training: as far as they can be read, the defaults otherwise.
        unreadable: the others, dotted ("algorithm.gamma"), sorted.
    """

    training: TrainingConfig
    unreadable: tuple[str, ...]

    @property
    def lacking(self) -> tuple[UsedExtension, ...]:
        """The extensions for want of which settings can't be read."""
        return missing(self.training.extensions, versions()) if self.unreadable else ()

    @property
    def why_not(self) -> str:
        """Why it is not trained, and what to do; where it can be read, nothing."""
        if self.lacking:
            sources = "; ".join(one.source for one in self.lacking if one.source)
            how = f" ({sources})" if sources else ""
            return f"It needs {wording(self.lacking)}, which the service does not have: install it{how}."
        return f"This version can't read {', '.join(self.unreadable)}: launch the training anew." if self.unreadable else ""


def read_training(document: Mapping[str, Any]) -> StoredTraining:
    """What a stored document says."""
    try:
        return StoredTraining(TrainingConfig.model_validate(document), ())
    except ValidationError:
        return _read_in_part(document)


def _read_in_part(document: Mapping[str, Any]) -> StoredTraining:
    rest: dict[str, Any] = deepcopy(dict(document))
    unreadable: set[str] = set()
    while True:
        try:
            training = TrainingConfig.model_validate(rest)
        except ValidationError as error:
            for path in {_path(rest, problem["loc"]) for problem in error.errors()}:
                unreadable.add(".".join(path))
                _remove(rest, path)
        else:
            return StoredTraining(training, tuple(sorted(unreadable)))


def training_of(experiment: tables.Experiment) -> TrainingConfig:
    """What can be read of an experiment's settings."""
    return read_training(experiment.training).training


def _path(document: Mapping[str, Any], location: tuple[int | str, ...]) -> tuple[str, ...]:
    """Where in a document pydantic found a problem: the names of a union's members are not in it, nor what is missing."""
    path: list[str] = []
    here: Any = document
    for part in location:
        if isinstance(here, dict) and part in here:
            path.append(str(part))
            here = here[part]
    return tuple(path)


def _remove(document: dict[str, Any], path: tuple[str, ...]) -> None:
    """Takes out what is at a path, or all of it where the path is empty."""
    if not path:
        document.clear()
        return
    for part in path[:-1]:
        document = document.get(part, {})
    document.pop(path[-1], None)
