"""Arenas in JSON."""

from typing import Literal

from pydantic import Field

from server.schemas import Schema
from sim.arenas.document import IMPORT_CLEARANCE
from sim.config import AnyArenaConfig, ArenaFile

MAX_FILES = 18
"""Of an upload: a world, its keyframes, and the sources of the plugins that move what is in it."""

MAX_UPLOAD_BYTES = 24 * 2**20
"""Of an upload's JSON: the largest image in base64, and its YAML."""

MAX_REVIEW_BYTES = 2**20
"""Of an arena that is being drawn: 2,000 obstacles take 200 kB."""


class ArenaUploadFile(Schema):
    """One file of an upload."""

    name: str = Field(min_length=1, max_length=255)
    content: str = Field(max_length=MAX_UPLOAD_BYTES, description="The file's bytes in base64.")


class ArenaUpload(Schema):
    """The file of an arena, the two of a ROS map, or a world and what says how things move in it."""

    files: list[ArenaUploadFile] = Field(min_length=1, max_length=MAX_FILES)
    keep: bool = Field(False, description="Import it; else it is only looked at.")


class ArenaSummary(Schema):
    """An arena in the gallery."""

    kind: Literal["fixed", "generated", "imported"]
    key: str = Field(description="Unique in the gallery: the arena's name, or the hash of an imported one.")
    title: str
    config: AnyArenaConfig = Field(description="What a task's `arena` must be to train on it; without geometry.")
    imported_at: float | None = Field(description="Epoch seconds; null where it was not imported.")


class ArenaView(Schema):
    """An arena, drawn."""

    title: str
    config: AnyArenaConfig
    geometry: ArenaFile
    obstacles: int
    free_area: float = Field(description="Square metres in one piece, for a robot that keeps 0.2 m from everything.")
    free_share: float = Field(description="The same over the floor's area, 0 to 1.")
    known: bool = Field(description="Built in, generated, or imported already; false for an upload that was only looked at.")
    trainings: int = Field(description="Experiments that use this imported arena; only one that none uses may be deleted.")


class ArenaReviewRequest(Schema):
    """An arena that is being drawn."""

    arena: ArenaFile
    clearance: float = Field(
        IMPORT_CLEARANCE,
        ge=0.05,
        le=2.0,
        description="Metres that the robot needs around its centre; what the Burger needs.",
    )


class ArenaRemark(Schema):
    """One thing to mend in an arena."""

    refused: bool = Field(description="Whether the arena can't be kept as it is.")
    text: str
    x: float = Field(description="Where, metres.")
    y: float


class ArenaReview(Schema):
    """What was found in an arena; nothing where it is as it should be."""

    free_area: float = Field(description="Square metres in one piece for the robot's centre.")
    free_share: float = Field(description="The same over the floor's area, 0 to 1.")
    remarks: list[ArenaRemark] = Field(description="What is refused first; the first twenty.")
