"""The audit log in JSON."""

from pydantic import Field

from server.schemas import Schema


class AuditEntry(Schema):
    """Somebody did something."""

    id: int
    at: float = Field(description="Seconds since the epoch, UTC.")
    actor: str = Field(description='A name; "owner" is who holds the token that the server printed at start.')
    address: str = Field(description="Of the client.")
    action: str = Field(description="What was done, as KIND.DEED.")
    target: str | None = Field(description="Id of what it was done to.")
    name: str | None = Field(description="Of what it was done to, as it was then.")
    project_id: str | None
    details: str | None
