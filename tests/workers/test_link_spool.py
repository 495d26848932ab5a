"""What a training reports lies in a file first, numbered, until the server has it."""

from math import inf, nan
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workers.errors import SpoolDamagedError
from workers.protocol import EventItem, MetricItem
from workers.runtime.spool import Spool


def numbers(spool: Spool, limit: int = 100) -> list[int]:
    return [item.seq for item in spool.pending(limit)]


def test_items_are_numbered_from_what_the_server_has_and_wait_until_acknowledged(tmp_path: Path) -> None:
    spool = Spool(tmp_path / "spool", last_seq=40)
    assert [spool.metrics(step, 0.0, {"a": 1.0}) for step in (10, 20, 30)] == [41, 42, 43]
    assert numbers(spool) == [41, 42, 43]
    assert numbers(spool, limit=2) == [41, 42]
    spool.acknowledge(42)
    assert (numbers(spool), spool.acked, spool.last_seq) == ([43], 42, 43)
    spool.acknowledge(41)
    assert numbers(spool) == [43]


def test_metrics_and_events_keep_their_order_and_content(tmp_path: Path) -> None:
    spool = Spool(tmp_path / "spool", last_seq=0)
    spool.metrics(10, 5.0, {"a": 0.5, "b": nan, "c": inf})
    spool.event(10, "warning", "the robot\nis stuck é")
    first, second = spool.pending()
    assert first == MetricItem(seq=1, step=10, at=5.0, values={"a": 0.5, "b": None, "c": None})
    assert isinstance(second, EventItem)
    assert (second.seq, second.level, second.message) == (2, "warning", "the robot\nis stuck é")


def test_a_line_torn_by_a_crash_is_forgotten_and_its_number_given_again(tmp_path: Path) -> None:
    path = tmp_path / "spool"
    spool = Spool(path, last_seq=0)
    spool.metrics(10, 0.0, {"a": 1.0})
    spool.metrics(20, 0.0, {"a": 2.0})
    spool.close()
    whole = path.read_bytes()
    for cut in range(len(whole) // 2 + 1, len(whole)):
        path.write_bytes(whole[:cut])
        again = Spool(path, last_seq=0)
        assert numbers(again) == [1]
        assert again.metrics(30, 0.0, {"a": 3.0}) == 2
        assert [item.step for item in again.pending()] == [10, 30]
        again.close()


@given(st.lists(st.one_of(st.just("put"), st.integers(0, 3)), max_size=60), st.integers(1, 5))
def test_whatever_the_order_of_events_nothing_is_lost_doubled_or_swapped(
    tmp_path_factory: pytest.TempPathFactory, actions: list[str | int], limit: int
) -> None:
    spool = Spool(tmp_path_factory.mktemp("spool") / "spool", last_seq=0)
    put = received = 0
    for action in actions:
        if action == "put":
            put = spool.metrics(put, 0.0, {})
        else:
            # The server takes in what is pending, and its acknowledgement covers some of it.
            pending = numbers(spool, limit)
            assert pending == list(range(received + 1, min(put, received + limit) + 1))
            received += min(len(pending), int(action))
            spool.acknowledge(received)
    assert numbers(spool, 100) == list(range(received + 1, put + 1))
    spool.close()


def test_what_is_acknowledged_is_cut_off_and_numbers_go_on(tmp_path: Path) -> None:
    path = tmp_path / "spool"
    spool = Spool(path, last_seq=0)
    while path.stat().st_size <= 2**20:
        spool.event(0, "info", "x" * 10_000)
    last = spool.last_seq
    spool.acknowledge(last)
    assert path.stat().st_size == 0
    assert numbers(spool) == []
    assert spool.metrics(1, 0.0, {"a": 1.0}) == last + 1
    assert numbers(spool) == [last + 1]
    assert [item.seq for item in Spool(path, last_seq=last).pending()] == [last + 1]


def test_a_number_that_was_altered_on_disk_is_noticed_though_the_line_still_parses(tmp_path: Path) -> None:
    path = tmp_path / "spool"
    spool = Spool(path, last_seq=0)
    for step in (10, 20, 30):
        spool.metrics(step, 0.0, {"a": 1.0})
    path.write_bytes(path.read_bytes().replace(b'"step":20', b'"step":25'))
    assert numbers(spool) == [1]
    spool.acknowledge(1)
    with pytest.raises(SpoolDamagedError, match="after item 1 cannot be read back"):
        spool.pending()


@pytest.mark.parametrize("kept", [0, 1])
def test_a_spool_that_was_cut_short_is_noticed(tmp_path: Path, kept: int) -> None:
    path = tmp_path / "spool"
    spool = Spool(path, last_seq=0)
    spool.metrics(10, 0.0, {"a": 1.0})
    first = path.stat().st_size
    spool.metrics(20, 0.0, {"a": 1.0})
    with path.open("r+b") as file:
        file.truncate(kept * first + 5)
    # What is reported afterwards follows the stump, and cannot hide it.
    spool.metrics(30, 0.0, {"a": 1.0})
    assert numbers(spool) == [1] if kept else True
    spool.acknowledge(kept)
    with pytest.raises(SpoolDamagedError):
        spool.pending()


def test_a_whole_line_in_anothers_place_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "spool"
    spool = Spool(path, last_seq=0)
    for step in (10, 20, 30):
        spool.metrics(step, 0.0, {"a": 1.0})
    first, _, third = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(first + first + third)
    assert numbers(spool) == [1]


@given(st.data())
def test_whatever_byte_changes_only_what_was_reported_comes_back(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("spool") / "spool"
    spool = Spool(path, last_seq=0)
    for step in range(5):
        spool.metrics(step, 0.5, {"a": step / 7})
    whole, written = spool.pending(), bytearray(path.read_bytes())
    place = data.draw(st.integers(0, len(written) - 1))
    written[place] ^= data.draw(st.integers(1, 255))
    path.write_bytes(written)
    line = bytes(path.read_bytes()[:place]).count(b"\n")
    if line == 0:
        with pytest.raises(SpoolDamagedError):
            spool.pending()
    else:
        assert spool.pending() == whole[:line]
    spool.close()
