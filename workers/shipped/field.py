"""What shipped policies and baselines reach in families, in BARN, among people (pydantic only: the server reads it).

`python -m benchmarks.field --write` measures it.
"""

from functools import cache
from pathlib import Path
from typing import Literal

from sim.config import Frozen

FIELD = Path(__file__).parent / "field.json"

Part = Literal["families", "barn", "people"]


class FieldKey(Frozen):
    """Which driver drove which suite, with what it saw.

    Attributes:
        part: of the matrix.
        suite: a family, which stands for its maps of difficulty 1, or a frozen suite.
        driver: a baseline's name, or a policy's title.
        policy: of which shipped policy; None for a baseline.
        seed: of its training; None for a baseline.
        rays: of its scan.
        field_of_view: degrees of its scan.
    """

    part: Part
    suite: str
    driver: str
    policy: str | None
    seed: int | None
    rays: int
    field_of_view: float


class FieldRow(FieldKey):
    """How one driver did on one suite; rates are shares of the episodes, 0 to 1.

    Attributes:
        episodes: how many stand behind the rest.
        arrivals: of these.
        collisions: of these.
        spl: success weighted by path length.
        worst_tenth_spl: the same over the tenth of the episodes that did worst.
        seconds: mean over the arrivals; None where there were none.
        score: of the BARN challenge, 0 to 0.5; None elsewhere.
        at_fault: collisions that are the robot's own; None where nobody walks.
        intrusion: mean seconds near somebody; None where nobody walks.
        delay: mean seconds by which all people of a scenario are late; None where nobody walks.
        detour: mean metres more that they walk for a metre of their routes; None where nobody walks.
        worlds: where each is driven ten times, how many of them saw 0, 1, ... and 10 arrivals; None elsewhere.
    """

    episodes: int
    arrivals: int
    collisions: int
    spl: float
    worst_tenth_spl: float
    seconds: float | None
    score: float | None = None
    at_fault: int | None = None
    intrusion: float | None = None
    delay: float | None = None
    detour: float | None = None
    worlds: tuple[int, ...] | None = None

    @property
    def key(self) -> FieldKey:
        """Who drove what."""
        return FieldKey(**{name: getattr(self, name) for name in FieldKey.model_fields})

    @property
    def success(self) -> float:
        """Share of the episodes that arrived."""
        return self.arrivals / self.episodes


class Field(Frozen):
    """`field.json`.

    Attributes:
        command: what made it.
        date: of the last measurement, ISO 8601.
        rows: by part, suite and driver.
    """

    command: str
    date: str
    rows: tuple[FieldRow, ...]

    def in_place_of(self, older: "Field") -> "Field":
        """With the rows of an older measurement that this one does not measure anew."""
        anew = {row.key for row in self.rows}
        return self.model_copy(update={"rows": (*(row for row in older.rows if row.key not in anew), *self.rows)})


@cache
def field() -> Field:
    """The measured matrix that ships."""
    return Field.model_validate_json(FIELD.read_bytes())
