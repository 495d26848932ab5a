"""A campaign in JSON: the paper's tables and claims, and what our trainings say of them."""

from pydantic import Field

from server.database.tables import RunState
from server.experiments.schemas import ExperimentState
from server.schemas import Schema
from workers.reproduction.results import RowSpread
from workers.reproduction.verdict import Verdict
from workers.training.table import TableRow


class CampaignCreate(Schema):
    """A campaign to launch."""

    seeds: int = Field(5, ge=1, le=20, description="Of each row; claims need five.")
    effort: float = Field(1.0, ge=1e-4, le=1.0, description="Part of the rows' training steps; below 1 it is a trial.")


class CampaignRun(Schema):
    """A row trained with one seed."""

    id: str
    seed: int
    state: RunState
    progress: float = Field(description="Part of its steps that is done, 0 to 1.")
    error: str | None = Field(description="Why it failed; null unless it did.")
    measured: TableRow | None = Field(description="By the drives at its end; null before.")


class CampaignRow(Schema):
    """A row of the paper's tables: its figures, and ours."""

    id: str
    method: str
    instead_of: str | None = Field(
        description="Id of the paper's row that it trains another way; claims are judged with it a second time."
    )
    paper: TableRow
    ours: RowSpread | None = Field(description="Over the seeds that are done; null before the first.")
    experiment_id: str | None = Field(description="Null where nothing was launched, or it was deleted.")
    runs: list[CampaignRun] = Field(description="By seed.")


class PaperTable(Schema):
    """A table of the paper: ids of rows, as labelled there."""

    id: str
    title: str
    rows: list[str]
    labels: list[str]


class PaperFigure(Schema):
    """Learning curves that the paper draws into one picture: ids of rows."""

    id: str
    title: str
    rows: list[str]


class Campaign(Schema):
    """A campaign as it stands."""

    id: str
    created_at: float
    state: ExperimentState
    seeds: int
    effort: float = Field(description="Part of the rows' training steps; below 1 it is a trial.")
    progress: float = Field(description="Part of the work that is done, 0 to 1.")
    seconds_left: float | None = Field(description="Null unless workers are at it.")


class CampaignSummary(Schema):
    """A campaign in the list of all."""

    id: str
    created_at: float


class Reproduction(Schema):
    """The paper's tables, figures and claims, and what a campaign says of them."""

    campaign: Campaign | None = Field(description="Null before the first.")
    campaigns: list[CampaignSummary] = Field(description="All of them, the newest first.")
    workers: int = Field(description="That are here.")
    seconds: float = Field(description="That a full campaign takes with them, or with one where there are none, about.")
    curve: str = Field(description="Name of the metric of the learning curves.")
    tables: list[PaperTable]
    figures: list[PaperFigure]
    rows: list[CampaignRow]
    claims: list[Verdict]
    wanted: dict[str, int] = Field(
        description="How many seeds rows should have, by id, whose intervals are wider than their margins; at most forty."
    )
