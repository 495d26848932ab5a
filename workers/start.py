"""Where a training may begin instead of with fresh weights: at a policy that was trained before (pydantic only)."""

from typing import Literal

from pydantic import Field

from sim.config import Frozen


class StartFrom(Frozen):
    """A policy that was trained before.

    `source` and `name` find it at launch; `sha256` and `title` are then written down beside them, so that a manifest says by
    itself what a training began with.
    """

    source: Literal["checkpoint", "shipped", "file"] = Field(
        title="Kind", description="A checkpoint of a run, a policy that ships, or an archive on the command line."
    )
    name: str = Field(
        min_length=1,
        max_length=200,
        pattern=r"^[^\x00-\x1f\x7f]+$",
        title="Policy",
        description="Id of the checkpoint, or name of the policy or the file.",
    )
    sha256: str | None = Field(None, pattern="^[0-9a-f]{64}$", title="SHA-256", description="Of its archive.")
    title: str = Field(
        "", max_length=300, title="Title", description="For people: the training that made it, seed and step."
    )
