"""The shipped policies as files: what there is, and where (pydantic only: the server lists them)."""

from functools import cache
from pathlib import Path

from sim.config import Frozen
from workers.config import TrainingConfig
from workers.errors import UnknownPolicyError
from workers.reporting import EvaluationResult
from workers.shipped.figures import Figures
from workers.shipped.recipes import RECIPES

FOLDER = Path(__file__).parent / "policies"
BASELINES = Path(__file__).parent / "baselines.json"
ARCHIVE = "policy.zip"
CARD = "card.json"


class SuiteFigures(Frozen):
    """How a policy or a baseline did on a suite."""

    suite: str
    suite_hash: str
    figures: Figures


class Card(Frozen):
    """`card.json`: a shipped policy in short.

    Attributes:
        name, title, description, training, seed: of its recipe.
        command: what made it, typed in a checkout of the version that its manifest names.
        step: environment steps after which it was kept, the best of its training on the first of its suites.
        results: one for each suite.
    """

    name: str
    title: str
    description: str
    command: str
    training: TrainingConfig
    seed: int
    step: int
    results: tuple[SuiteFigures, ...]


class Baseline(Frozen):
    """A controller that needs no training, on every suite that anything here is measured on."""

    name: str
    results: tuple[SuiteFigures, ...]


class Baselines(Frozen):
    """`baselines.json`: what a policy has to beat."""

    command: str
    baselines: tuple[Baseline, ...]


class ShippedPolicy:
    """The files of one shipped policy.

    | file         | content |
    |--------------|---------|
    | policy.zip   | a checkpoint archive with the policy and its manifest, without the state to resume |
    | card.json    | `Card` |
    | SUITE.json   | `workers.reporting.EvaluationResult`: every episode behind the card's figures |
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.card = Card.model_validate_json((folder / CARD).read_bytes())

    @property
    def archive(self) -> Path:
        """The checkpoint archive."""
        return self._folder / ARCHIVE

    def evaluation(self, suite: str) -> EvaluationResult:
        """Every episode on a suite.

        Raises:
            UnknownPolicyError: it was not measured on it.
        """
        if suite not in (result.suite for result in self.card.results):
            raise UnknownPolicyError(f"the policy {self.card.name!r} was not measured on {suite!r}")
        return EvaluationResult.model_validate_json((self._folder / f"{suite}.json").read_bytes())


@cache
def shipped_policies() -> tuple[ShippedPolicy, ...]:
    """All that have been made, in the order of their recipes."""
    return tuple(ShippedPolicy(FOLDER / each.name) for each in RECIPES if (FOLDER / each.name / CARD).is_file())


def shipped_policy(name: str) -> ShippedPolicy:
    """The policy of that name.

    Raises:
        UnknownPolicyError: there is none; the message names those that exist.
    """
    for policy in shipped_policies():
        if policy.card.name == name:
            return policy
    names = ", ".join(policy.card.name for policy in shipped_policies())
    raise UnknownPolicyError(f"there is no shipped policy {name!r}: choose one of {names}")


@cache
def baselines() -> Baselines:
    """The controllers that need no training."""
    return Baselines.model_validate_json(BASELINES.read_bytes())
