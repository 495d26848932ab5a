"""Rules for curves in JSON."""

from pydantic import Field

from server.curve_thinning.rule import CurveRule
from server.schemas import Schema


class CurveThinning(Schema):
    """What a rule does to the curves of an experiment's runs. Evaluations and a curve's newest point stay in any case."""

    rule: CurveRule
    runs: int = Field(description="That ended long enough ago and have a metric of more points than the rule leaves.")
    points: int = Field(description="Of those metrics.")
    kept: int = Field(description="That are left of them at most.")
    frees: int = Field(description="Bytes of the database, about.")
    later: int = Field(description="Runs that have not ended so long ago, or at all.")
    marked: int = Field(description="Runs that are thinned by the rule that holds now, unless another one comes before.")
    thins_at: float | None = Field(description="When the first of them is; null where none is.")
    spared: str | None = Field(description="Why no run of it is thinned, whatever a rule says.")


class CurveRuleChange(Schema):
    """Another rule for an experiment."""

    rule: CurveRule | None = Field(description="Null for the installation's.")
