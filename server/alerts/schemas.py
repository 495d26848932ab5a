"""Alerts in JSON."""

from typing import Annotated, Self

from pydantic import Field, StringConstraints, model_validator

from server.alerts.addresses import check_url
from server.database.tables import AlertChannel, AlertEvent, AlertFormat, AlertState
from server.schemas import Line, Page, Schema

MAX_RULES = 50
"""Of one person."""
Target = Annotated[Line, StringConstraints(max_length=2_000)]

# What a threshold may be, and what it counts.
_THRESHOLDS: dict[AlertEvent, tuple[float, float, str]] = {
    "success": (0.0, 1.0, "a success rate from 0 to 1"),
    "stuck": (1.0, 43_200.0, "minutes in the queue, from 1 to 43200"),
    "disk": (0.1, 1e6, "GiB that are left, from 0.1 on"),
}


class AlertRuleCreate(Schema):
    """What to tell of, and how."""

    event: AlertEvent = Field(
        description="`ended`: all runs of a training have; `failed`: a run has; `diagnosis`: one was found; `success`: a "
        "run's evaluation is above the threshold; `stuck`: a run waits for longer; `disk`: less is left."
    )
    project_id: str | None = Field(None, description="Null for every project that one may see.")
    threshold: float | None = Field(None, description="Success rate, minutes in the queue, or GiB left; null otherwise.")
    channel: AlertChannel
    target: Target | None = Field(None, description="URL of a webhook or a mail address; null for the browser.")
    format: AlertFormat = Field("json", description="Of what a webhook is sent.")

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        bounds = _THRESHOLDS.get(self.event)
        if bounds is None and self.threshold is not None:
            raise ValueError(f"{self.event} has no threshold")
        if bounds is not None and (self.threshold is None or not bounds[0] <= self.threshold <= bounds[1]):
            raise ValueError(f"{self.event} takes a threshold: {bounds[2]}")
        if self.event == "disk" and self.project_id is not None:
            raise ValueError("the disk is in no project")
        if self.channel == "browser" and self.target is not None:
            raise ValueError("the browser takes no target")
        if self.channel == "webhook":
            check_url(self.target or "")
        if self.channel == "mail" and not _is_address(self.target or ""):
            raise ValueError("a mail address looks like name@example.org")
        return self


class AlertRuleEdit(Schema):
    """What can be changed of a rule."""

    enabled: bool


class AlertRule(Schema):
    """A rule of one's own."""

    id: str
    event: AlertEvent
    project_id: str | None
    project: str | None = Field(description="Its name.")
    threshold: float | None
    channel: AlertChannel
    target: str | None
    format: AlertFormat
    enabled: bool
    created_at: float


class NewAlertRule(AlertRule):
    """A rule that was just made."""

    secret: str | None = Field(description="With which a webhook checks the signature; shown this once.")


class Alert(Schema):
    """Something that was, or is about to be, told."""

    id: int
    rule_id: str
    event: AlertEvent
    channel: AlertChannel
    target: str | None
    created_at: float
    title: str
    text: str
    experiment_id: str | None
    run_id: str | None
    state: AlertState = Field(
        description="`unclear`: the server ended while it was being sent, so it is not sent again; `withheld`: the rule had "
        "too much to say."
    )
    tries: int
    next_at: float | None = Field(description="When the next try is due; null where none is.")
    sent_at: float | None
    outcome: str | None = Field(description="What went wrong; null where nothing did.")


class AlertNews(Schema):
    """What the browser is to show."""

    items: list[Alert] = Field(description="The newest of them, the oldest first; twenty at most.")
    newest: int = Field(description="Ask for what came after it the next time.")


class AlertChannels(Schema):
    """How alerts can be sent from here."""

    mail: bool = Field(description="Whether a mail server is set.")
    own_address: str | None = Field(description="Where mail goes for who does not administrate; null where one may choose.")
    chooses_address: bool


class AlertRulePage(Page[AlertRule]):
    """Some of one's rules, the oldest first."""


class AlertPage(Page[Alert]):
    """Some of what one's rules have said, the newest first."""


def _is_address(text: str) -> bool:
    name, at, host = text.rpartition("@")
    return bool(name and at and "." in host) and not any(sign in text for sign in " ,;<>\"'")
