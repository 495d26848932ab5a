"""Disk use and rules in JSON."""

from pydantic import Field

from server.curve_thinning.rule import CURVES_STAY, CurveRule
from server.schemas import Page, Schema
from server.storage.rule import KeepRule

MOST_SPARED = 50


class StoredExperiment(Schema):
    """What an experiment takes."""

    id: str
    name: str
    in_trash: bool = Field(description="It goes as a whole, some days after it was deleted.")
    checkpoints: int
    checkpoint_bytes: int = Field(description="Of the archives of its checkpoints.")
    curve_bytes: int = Field(description="Of its compacted curves in the database.")
    going: int = Field(description="Checkpoints that go, and can be kept until then.")
    going_bytes: int
    rule: KeepRule = Field(description="That it goes by.")
    own_rule: bool = Field(description="The rule is its own, not the installation's.")
    curve_rule: CurveRule = Field(CURVES_STAY, description="That its curves go by.")
    own_curve_rule: bool = Field(False, description="That rule is its own, not the installation's.")


class Storage(Page[StoredExperiment]):
    """The experiments that may be seen, those with the most bytes of checkpoints first."""

    checkpoint_bytes: int = Field(description="Of all of them together.")
    going_bytes: int
    free_bytes: int = Field(description="Left on the disk of the data directory.")
    min_free_bytes: int = Field(description="That should be left (MAPLESS_MIN_FREE_DISK_BYTES).")
    keep_days: float = Field(description="From when a rule takes a checkpoint until it is gone.")


class SparedCheckpoint(Schema):
    """A checkpoint that a rule would take, and that stays."""

    id: str
    seed: int
    step: int
    reason: str


class Thinning(Schema):
    """What a rule takes of an experiment, and leaves."""

    rule: KeepRule
    going: int = Field(description="Checkpoints that go, with their evaluations' episodes.")
    going_bytes: int
    staying: int
    spared: list[SparedCheckpoint] = Field(description=f"Some of those that the rule leaves alone; {MOST_SPARED} at most.")
    spared_total: int


class RuleChange(Schema):
    """Another rule for an experiment."""

    rule: KeepRule | None = Field(description="Null for the installation's.")
