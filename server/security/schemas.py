"""The login in JSON."""

from pydantic import Field

from server.schemas import Schema


class Login(Schema):
    """The token, as printed at start."""

    token: str = Field(min_length=1, max_length=512)
