"""How an address says whose episodes are replayed: `checkpoint:ID`, `evaluation:ID`, `policy:NAME:SUITE`, or several."""

from dataclasses import dataclass
from typing import Literal, cast, get_args

from server.errors import NotFoundError
from workers.film_protocol import MAX_TOGETHER

Kind = Literal["checkpoint", "evaluation", "policy"]


@dataclass(frozen=True)
class Reference:
    """Something whose episodes were measured.

    Attributes:
        kind: of it.
        id: of a checkpoint or an evaluation; the name of a shipped policy.
        suite: on which a shipped policy was measured; empty for the others, which have one each.
    """

    kind: Kind
    id: str
    suite: str = ""

    def __str__(self) -> str:
        return ":".join(part for part in (self.kind, self.id, self.suite) if part)


def references(text: str) -> tuple[Reference, ...]:
    """Those of an address, each once, in its order.

    Raises:
        NotFoundError: it names none, too many, or what nobody knows.
    """
    found = tuple(dict.fromkeys(_reference(each) for each in text.split(",")))
    if len(found) > MAX_TOGETHER:
        raise NotFoundError(f"At most {MAX_TOGETHER} policies are replayed together.")
    return found


def _reference(text: str) -> Reference:
    kind, _, rest = text.partition(":")
    name, _, suite = rest.partition(":")
    if kind not in get_args(Kind) or not name or (kind == "policy") != bool(suite):
        raise NotFoundError(
            "An address of replays names checkpoint:ID, evaluation:ID or policy:NAME:SUITE, or several of them by commas."
        )
    return Reference(cast("Kind", kind), name, suite)
