"""The lock of the writers: first come, first served, one at a time, and nobody waits for ever."""

import threading
import time

import pytest

from server.database.fair_lock import FairLock
from server.errors import DatabaseBusyError


def started(thread: threading.Thread) -> threading.Thread:
    thread.start()
    return thread


def test_those_who_wait_are_served_in_the_order_in_which_they_came() -> None:
    lock = FairLock()
    served: list[int] = []

    def wait(number: int) -> None:
        with lock.held(timeout=10):
            served.append(number)

    with lock.held(timeout=1):
        threads = []
        for number in range(20):
            threads.append(started(threading.Thread(target=wait, args=(number,))))
            while len(lock._waiting) <= number:
                time.sleep(0.001)
    for thread in threads:
        thread.join()

    assert served == list(range(20))


def test_only_one_holds_it() -> None:
    lock = FairLock()
    inside = 0
    most = 0

    def count() -> None:
        nonlocal inside, most
        for _ in range(200):
            with lock.held(timeout=10):
                inside += 1
                most = max(most, inside)
                inside -= 1

    threads = [started(threading.Thread(target=count)) for _ in range(8)]
    for thread in threads:
        thread.join()

    assert most == 1


def test_who_waits_too_long_is_told_and_leaves_the_queue_to_the_others() -> None:
    lock = FairLock()
    served = threading.Event()

    def wait() -> None:
        with lock.held(timeout=10):
            served.set()

    with lock.held(timeout=1):
        impatient: list[DatabaseBusyError] = []

        def give_up() -> None:
            try:
                with lock.held(timeout=0.05):
                    pass
            except DatabaseBusyError as error:
                impatient.append(error)

        started(threading.Thread(target=give_up)).join()
        patient = started(threading.Thread(target=wait))
    patient.join()

    assert len(impatient) == 1
    assert served.is_set()


def test_a_writer_within_a_writer_is_an_error_of_the_program() -> None:
    lock = FairLock()
    with lock.held(timeout=1), pytest.raises(AssertionError, match="wait for itself"), lock.held(timeout=1):
        pass


def test_it_is_free_after_a_block_that_raised() -> None:
    lock = FairLock()
    with pytest.raises(KeyError), lock.held(timeout=1):
        raise KeyError
    with lock.held(timeout=1):
        pass
