"""What those who have processes forked and the nursery that forks them say to one another, a packet for each message.

Through the worker's *door*, a socket that all of its processes have, each comes with a connection of its own:

client                            nursery
  | --- Hello --------------------> |   through the door, with one descriptor: the other end of its connection
  | <-- Ready or Refused ---------- |   it has imported all that is needed; or it does not begin, and why
  | --- Fork ---------------------> |   with three descriptors: see `FORKED`
  | <-- Forked or NotForked ------- |
  | --- Kill ---------------------> |   a process and whatever it has started
  | <-- Ended --------------------- |   once for each process

Where a client closes its connection, all that was forked for it is killed.
"""

from typing import Literal, TypeAlias

import msgspec

MAX_PACKET_BYTES = 16_384
MAX_CAUSE_CHARACTERS = 4_000
DESCRIPTORS = 3

What: TypeAlias = Literal["trainer", "job"]
FORKED: dict[What, str] = {
    "trainer": "orders to read, output and reports to write",
    "job": "its end of a pipe, standard output, standard error",
}
"""What is forked, and what its three descriptors are."""


class Hello(msgspec.Struct, frozen=True, tag="hello"):
    """Somebody who will want processes."""


class Fork(msgspec.Struct, frozen=True, tag="fork"):
    """Begin a process; the client's number for it."""

    number: int
    what: What


class Kill(msgspec.Struct, frozen=True, tag="kill"):
    """End a process at once; one that has ended already stays what it is."""

    number: int


class Ready(msgspec.Struct, frozen=True, tag="ready"):
    """Processes can be had; the nursery's own id."""

    pid: int


class Refused(msgspec.Struct, frozen=True, tag="refused"):
    """The nursery does not begin, or ends again and again: how, for people."""

    cause: str


class Forked(msgspec.Struct, frozen=True, tag="forked"):
    """The process runs, and this is its id."""

    number: int
    pid: int


class NotForked(msgspec.Struct, frozen=True, tag="not forked"):
    """The machine could not begin it, and why."""

    number: int
    error: str


class Ended(msgspec.Struct, frozen=True, tag="ended"):
    """The process has ended, with a status as `subprocess` tells it: below 0 it was killed by that signal."""

    number: int
    status: int


Wish: TypeAlias = Fork | Kill
News: TypeAlias = Ready | Refused | Forked | NotForked | Ended
