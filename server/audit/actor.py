"""In whose name the work of this moment is done, and from where."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from server.security.principal import OWNER, Principal


@dataclass(frozen=True, slots=True)
class Actor:
    """Who acts.

    Attributes:
        principal: in whose name.
        address: of the client; words where there is none.
    """

    principal: Principal
    address: str


# Outside of every request: whoever may run commands on the server's machine.
_SOMEBODY_HERE = Actor(OWNER, "command line")
_actor: ContextVar[Actor] = ContextVar("actor")


def current_actor() -> Actor:
    """Who acts in this request."""
    return _actor.get(_SOMEBODY_HERE)


@contextmanager
def acting(actor: Actor) -> Iterator[None]:
    """All that is done within is done in that name."""
    token = _actor.set(actor)
    try:
        yield
    finally:
        _actor.reset(token)
