"""What a worker's slot and the process that its trainers are forked from say to one another, a packet for each message.

slot                              nursery
  | <-- Ready ---------------------- |   once: it has imported all that trainers need
  | --- Fork ----------------------> |   with three descriptors: orders to read, output and reports to write
  | <-- Forked or NotForked -------- |
  | --- Kill ----------------------> |   a trainer and whatever it has started
  | <-- Ended ---------------------- |   once for each trainer
"""

from typing import TypeAlias

import msgspec

MAX_PACKET_BYTES = 4_096
DESCRIPTORS = 3


class Fork(msgspec.Struct, frozen=True, tag="fork"):
    """Begin a trainer; the slot's number for it."""

    number: int


class Kill(msgspec.Struct, frozen=True, tag="kill"):
    """End a trainer at once; one that has ended already stays what it is."""

    number: int


class Ready(msgspec.Struct, frozen=True, tag="ready"):
    """Trainers can be had."""


class Forked(msgspec.Struct, frozen=True, tag="forked"):
    """The trainer runs, as a process of this id."""

    number: int
    pid: int


class NotForked(msgspec.Struct, frozen=True, tag="not forked"):
    """The machine could not begin it, and why."""

    number: int
    error: str


class Ended(msgspec.Struct, frozen=True, tag="ended"):
    """The trainer has ended, with a status as `subprocess` tells it: below 0 it was killed by that signal."""

    number: int
    status: int


Wish: TypeAlias = Fork | Kill
News: TypeAlias = Ready | Forked | NotForked | Ended
