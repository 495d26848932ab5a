"""Uploaded policies in JSON."""

from pydantic import Field

from server.database.tables import DEFAULT_PROJECT
from server.schemas import Line, Page, Schema
from sim.config import TaskConfig

MAX_FILE_BYTES = 16 * 2**20
"""Of a policy's file."""
MAX_UPLOAD_BYTES = 24 * 2**20
"""Of an upload's JSON, with the file in base64."""


class PolicyUpload(Schema):
    """An ONNX file, or a bundle of this project, which brings its own task."""

    name: Line = Field(max_length=120)
    project_id: str = DEFAULT_PROJECT
    content: str = Field(
        max_length=MAX_UPLOAD_BYTES, description="The file's bytes in base64: `.onnx`, or a bundle's `.zip`."
    )
    task: TaskConfig | None = Field(
        None,
        description="Robot, LiDAR, observation and limits that an `.onnx` file is for; a bundle has them in its manifest.",
    )


class PolicyTask(Schema):
    """What a policy is for."""

    task: TaskConfig = Field(description="Its robot, LiDAR, observation and limits.")


class ObservedPart(Schema):
    """A part of an observation."""

    name: str
    numbers: int = Field(description="Of all its moments.")


class ActionRange(Schema):
    """A number of an action: a fraction of the robot's limit, in the limit's unit."""

    name: str
    low: float
    high: float
    unit: str


class PolicyShapes(Schema):
    """What a file has to take and give to be a task's policy."""

    observation: int = Field(description="Numbers of its input `observation`.")
    parts: list[ObservedPart] = Field(description="In the order of the newest moment.")
    actions: list[ActionRange] = Field(
        description="What the numbers of its output `action` command, from fraction to limit."
    )


class UploadedPolicy(Schema):
    """A policy that was uploaded."""

    id: str
    name: str
    project_id: str
    task: TaskConfig
    sha256: str
    size: int = Field(description="Bytes of its ONNX file.")
    created_at: float


class UploadedPolicyPage(Page[UploadedPolicy]):
    """Some of the uploaded policies, the newest first."""
