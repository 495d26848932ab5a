"""Diagnoses in JSON."""

from pydantic import Field

from server.schemas import Schema
from workers.diagnoses import Diagnosis


class Diagnoses(Schema):
    """What a run's curves say about it."""

    run_id: str
    step: int = Field(description="Environment step of the newest curve point; 0 before the first.")
    diagnoses: tuple[Diagnosis, ...] = Field(description="Causes before symptoms; empty for a healthy run.")
