"""A project in JSON."""

from typing import Annotated

from pydantic import Field, StringConstraints

from server.database.tables import Role
from server.schemas import Line, Schema

ProjectName = Annotated[Line, StringConstraints(max_length=80)]


class ProjectEdit(Schema):
    """What a project is called; no two have the same name."""

    name: ProjectName


class Project(Schema):
    """Experiments that belong together."""

    id: str
    name: str
    created_at: float
    experiments: int = Field(description="How many are in it.")
    role: Role = Field(description="What who asks may do in it.")
