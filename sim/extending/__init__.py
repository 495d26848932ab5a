"""What an extension declares its parts with: the public, versioned half of Mapless that needs nothing but pydantic.

An extension is a Python package that adds parts to Mapless: reward terms, observation parts, arena families, baselines,
algorithms, networks. Each
part is a configuration, so that it stands in the form, the API's schema, the manifest and the comparison like those that
are built in. What a part does lies in another module, named by its `implementation`, which only those import who run it.

>>> from typing import Literal
>>> class StillTerm(RewardTerm):
...     '''Standing still.'''
...     name: Literal["my_lab.still"] = Field("my_lab.still", title="Standing still")
...     slow: float = Field(0.05, gt=0.0, title="Slow", description="Metres per second.")
...     formula = "speed < slow"
>>> extension = Extension(name="my_lab", version="1.0", api=1, parts=(StillTerm,))

What it may use: this module, `sim.extending.arenas`, `sim.extending.observing` (NumPy), `sim.extending.control` (the
simulator) and `workers.extending`, `workers.extending.learning` (torch). Everything else may change from one release to
the next; what these hold changes with `API_VERSION` only.
"""

from pydantic import Field

from sim.extending.base import ADVANCED, HIDDEN, Frozen, needs
from sim.extending.parts import (
    API_VERSION,
    ArenaFamily,
    Baseline,
    Extension,
    ObservationNumber,
    ObservationPart,
    Part,
    RewardTerm,
)

__all__ = [
    "ADVANCED",
    "API_VERSION",
    "HIDDEN",
    "ArenaFamily",
    "Baseline",
    "Extension",
    "Field",
    "Frozen",
    "ObservationNumber",
    "ObservationPart",
    "Part",
    "RewardTerm",
    "needs",
]
