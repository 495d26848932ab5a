"""Signing in with the provider, in JSON."""

from typing import Annotated

from pydantic import Field, StringConstraints

from server.schemas import Schema

PagePath = Annotated[str, StringConstraints(max_length=1_000, pattern=r"^/[\x21-\x7e]*$")]


class ProviderSignIn(Schema):
    """How somebody wants to sign in with the provider of the settings."""

    back: PagePath = Field("/", description="Path of the page that it leads to.")
    invitation: str | None = Field(
        None, min_length=1, max_length=100, description="What an invitation's link ends with, to accept it with the sign-in."
    )
    connect: bool = Field(False, description="From now on the identity signs in to the account that is signed in here.")


class ProviderAddress(Schema):
    """Where to send the browser."""

    url: str = Field(description="The provider's page, from where the browser comes back here.")
