"""Reads what a worker sends over its link, up to the first item that can never be stored."""

from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic_core import from_json

from workers.protocol import Batch, Refusal, Seq

_MAX_REASON = 500
_SEQ = TypeAdapter(Seq)


def read_batch(text: str) -> tuple[Batch, Refusal | None]:
    """The batch, and None; or what stands before the first item that is none, and the word about that item.

    Raises:
        ValidationError: it is no message of the protocol, and no item with a number is to blame.
    """
    try:
        return Batch.model_validate_json(text), None
    except ValidationError as error:
        places = [problem["loc"] for problem in error.errors(include_url=False)]
        if any(place[:1] != ("items",) or len(place) < 2 for place in places):
            raise
        problem = min(error.errors(include_url=False), key=lambda problem: int(problem["loc"][1]))
    items: list[Any] = from_json(text)["items"]
    first = int(problem["loc"][1])
    seq = _SEQ.validate_python(items[first].get("seq") if isinstance(items[first], dict) else None)
    field = ".".join(str(part) for part in problem["loc"][3:]) or "the item"
    refusal = Refusal(seq=seq, reason=f"Item {seq} can't be stored: {field}: {problem['msg']}."[:_MAX_REASON])
    return Batch.model_validate({"items": items[:first]}), refusal


def in_turn(batch: Batch, last_seq: int) -> tuple[Batch, Refusal | None]:
    """The items that nobody has stored, `last_seq` being the last that was, up to one that has a gap before it."""
    fresh = [item for item in batch.items if item.seq > last_seq]
    for place, item in enumerate(fresh, start=1):
        if item.seq != last_seq + place:
            reason = f"Item {item.seq} came where {last_seq + place} should: what was between is lost."
            return Batch(items=tuple(fresh[: place - 1])), Refusal(seq=item.seq, reason=reason)
    return batch.model_copy(update={"items": tuple(fresh)}), None
