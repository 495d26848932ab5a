"""Printed lines reach the server in order and once, also over a server that is away, and never pile up."""

import threading
from collections.abc import Callable

import pytest

from workers.errors import RunRefusedError, ServerUnavailableError
from workers.protocol import LogBatch
from workers.runtime import output
from workers.runtime.client import ServerClient
from workers.runtime.output import Output


class Receiver(ServerClient):
    """A server's end of the log, which answers as a test says."""

    def __init__(self, answer: Callable[[], None] = lambda: None) -> None:
        self.batches: list[LogBatch] = []
        self._answer = answer

    def log(self, run_id: str, attempt: int, batch: LogBatch) -> None:
        self._answer()
        self.batches.append(batch)

    @property
    def lines(self) -> list[tuple[int, str]]:
        return [(number, line.text) for batch in self.batches for number, line in enumerate(batch.lines, start=batch.first)]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output, "_PAUSE_SECONDS", 0.01)
    monkeypatch.setattr(output, "_LAST_PAUSE_SECONDS", 0.01)


def test_all_lines_arrive_in_batches() -> None:
    receiver = Receiver()
    printed = Output(receiver, "run", 1)
    for number in range(1, 1_201):
        printed.line(f"line {number}")
    printed.close()

    assert receiver.lines == [(number, f"line {number}") for number in range(1, 1_201)]
    assert len(receiver.batches) < 100
    assert max(len(batch.lines) for batch in receiver.batches) <= 500


def test_a_server_that_is_away_gets_them_afterwards_and_the_oldest_may_be_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output, "_WAITING_LINES", 10)
    away, tried = threading.Event(), threading.Event()
    away.set()

    def answer() -> None:
        tried.set()
        if away.is_set():
            raise ServerUnavailableError("away")

    receiver = Receiver(answer)
    printed = Output(receiver, "run", 1)
    for number in range(1, 31):
        printed.line(str(number))
    assert tried.wait(5.0)
    away.clear()
    printed.close()

    assert receiver.lines == [(number, str(number)) for number in range(21, 31)]


def test_a_refusal_ends_it() -> None:
    tries = []

    def answer() -> None:
        tries.append(1)
        raise RunRefusedError("over")

    printed = Output(Receiver(answer), "run", 1)
    printed.line("a")
    printed.close()
    printed.line("b")

    assert len(tries) == 1


def test_a_long_line_is_cut() -> None:
    receiver = Receiver()
    printed = Output(receiver, "run", 1)
    printed.line("x" * 5_000)
    printed.close()

    assert [len(text) for _, text in receiver.lines] == [2_000]
