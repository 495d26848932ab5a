"""What several ask for at once is made once."""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest

from server.metrics.cache import AnswerCache
from server.recent import Recent

ASKING = 5


class Making:
    """Something whose making ends once everybody has asked."""

    def __init__(self, outcomes: list[bytes | Exception]) -> None:
        self._outcomes = outcomes
        self.times = 0
        self.may_end = threading.Event()

    def __call__(self) -> bytes:
        outcome = self._outcomes[self.times]
        self.times += 1
        assert self.may_end.wait(10.0)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome


def ask(get: Callable[[str, Callable[[], bytes]], bytes], making: Making) -> list[bytes | BaseException]:
    """What each of several threads hears that ask for one thing while it is made."""
    begun = threading.Barrier(ASKING + 1)

    def one() -> bytes:
        begun.wait(10.0)
        return get("key", making)

    with ThreadPoolExecutor(ASKING) as pool:
        asked = [pool.submit(one) for _ in range(ASKING)]
        begun.wait(10.0)
        making.may_end.set()
        return [each.exception() or each.result() for each in asked]


@pytest.fixture(params=[lambda: Recent[bytes](3).get, lambda: AnswerCache().get], ids=["recent", "answers"])
def get(request: pytest.FixtureRequest) -> Callable[[str, Callable[[], bytes]], bytes]:
    made: Callable[[str, Callable[[], bytes]], bytes] = request.param()
    return made


def test_what_several_ask_for_at_once_is_made_once(get: Callable[[str, Callable[[], bytes]], bytes]) -> None:
    making = Making([b"made"] * ASKING)

    assert ask(get, making) == [b"made"] * ASKING
    assert making.times == 1


def test_where_one_fails_the_next_tries_itself(get: Callable[[str, Callable[[], bytes]], bytes]) -> None:
    failure = ValueError("left")
    making = Making([failure, *[b"made"] * ASKING])

    heard = ask(get, making)

    assert heard.count(b"made") == ASKING - 1
    assert failure in heard
    assert making.times == 2
