"""Changes as they happen: written once for all, no more than a page shows, nothing lost that is not said to be."""

import asyncio
import json
import threading
from collections.abc import AsyncIterator, Collection, Coroutine
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import given
from hypothesis import strategies as st

from server import outage
from server.errors import BusyError, DatabaseAwayError
from server.events import bus as module
from server.events.bus import EventBus, Subscription
from server.events.changes import Change, Shown

PAUSE = 0.02
EVERYTHING = None


def change(run_id: str | None = "r", kind: str = "metrics", experiment_id: str | None = "e") -> Change:
    return Change.model_validate({"experiment_id": experiment_id, "run_id": run_id, "kind": kind})


def shown(*runs: str, experiments: tuple[str, ...] = (), reports: bool = False) -> Shown:
    return Shown(frozenset(experiments), frozenset(runs), reports)


Event = tuple[str, str, list[Change]]
"""Its id, its name, and what it tells."""


def read(block: bytes) -> Event:
    lines = dict(line.split(": ", 1) for line in block.decode().strip().split("\n"))
    told = json.loads(lines["data"])
    return lines["id"], lines["event"], [Change.model_validate(one) for one in told] if isinstance(told, list) else []


async def events(subscription: Subscription) -> AsyncIterator[Event]:
    async for block in subscription.events():
        yield read(block)


async def told(subscription: Subscription) -> list[list[Change]]:
    """What is told until the bus closes."""
    return [changes async for _, name, changes in events(subscription) if name == "changes"]


def run(scenario: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(scenario, 30))


def test_changes_of_one_pause_are_one_event_and_equal_ones_are_one_change() -> None:
    async def scenario() -> None:
        bus = EventBus(PAUSE)
        with bus.subscribe() as subscription:
            for _ in range(100):
                bus.publish(change())
            bus.publish(change(kind="run"))
            await asyncio.sleep(3 * PAUSE)
            bus.close()
            assert await told(subscription) == [[change(), change(kind="run")]]

    run(scenario())


def test_an_event_is_written_once_for_all_who_show_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[list[Change]] = []
    write = module._json

    def count(changes: list[Change]) -> str:
        written.append(changes)
        return write(changes)

    monkeypatch.setattr(module, "_json", count)

    async def scenario() -> None:
        bus = EventBus(PAUSE)
        listeners = [bus.subscribe(shown("r0") if n % 2 else EVERYTHING) for n in range(200)]
        subscriptions = [listener.__enter__() for listener in listeners]
        for n in range(50):
            bus.publish(change(f"r{n}"))
        await asyncio.sleep(3 * PAUSE)
        bus.close()
        heard = [await told(subscription) for subscription in subscriptions]
        assert heard[0] == [[change(f"r{n}") for n in range(50)]]
        assert heard[1] == [[change("r0")]]
        assert all(one == heard[n % 2] for n, one in enumerate(heard))
        # The very same bytes for a hundred, and nothing per run and listener.
        assert len(written) == 2
        for listener in listeners:
            listener.__exit__(None, None, None)
        assert bus.listeners == 0

    run(scenario())


def test_a_page_hears_of_what_it_shows() -> None:
    batch = [change("r1"), change("r2"), change("r2", "run"), change("r3", "checkpoint"), change(None, "deleted", "other")]
    elsewhere = [change(None, kind, None) for kind in ("metrics", "run", "checkpoint")]

    assert shown("r2").of(batch) == [change("r2"), change("r2", "run"), elsewhere[2], batch[4]]
    assert shown().of([change("r1"), change("r2")]) == []
    assert shown(reports=True).of([change("r1"), change("r2")]) == [elsewhere[0]]
    assert shown(experiments=("e",)).of(batch) == batch
    assert shown(reports=True).of(batch) == [*elsewhere, batch[4]]


@given(st.lists(st.tuples(st.sampled_from("abc"), st.sampled_from(["metrics", "run", "deleted"])), max_size=30))
def test_nothing_that_a_page_shows_is_kept_from_it(batch: list[tuple[str, str]]) -> None:
    changes = [change(run_id, kind) for run_id, kind in batch]
    heard = shown("a").of(changes)

    assert [one for one in heard if one.run_id == "a"] == list(dict.fromkeys(one for one in changes if one.run_id == "a"))
    assert len(heard) <= 3 + 3


def test_changes_come_from_any_thread() -> None:
    async def scenario() -> None:
        bus = EventBus(PAUSE)
        with bus.subscribe() as subscription:
            threads = [threading.Thread(target=bus.publish, args=(change(f"r{n}"),)) for n in range(20)]
            for thread in threads:
                thread.start()
            await asyncio.sleep(0.3)
            bus.close()
            assert {one.run_id for batch in await told(subscription) for one in batch} == {f"r{n}" for n in range(20)}

    run(scenario())


def test_who_reads_too_slowly_is_told_to_read_anew_and_costs_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scenario() -> None:
        bus = EventBus(0.0)
        with bus.subscribe() as slow:
            for n in range(200):
                bus.publish(change(f"r{n}"))
                await asyncio.sleep(0.001)
                assert len(slow._pending) <= 16
            bus.close()
            names = [name async for _, name, _ in events(slow)]
        assert names[0] == "resync"
        assert len(names) <= 16

    run(scenario())


def test_who_comes_back_hears_what_was_missed_and_nothing_twice() -> None:
    async def scenario() -> None:
        bus = EventBus(PAUSE)
        with bus.subscribe() as first:
            bus.publish(change("before"))
            stream = events(first)
            assert (await anext(stream))[1] == "opened"
            position, _, batch = await anext(stream)
            assert batch == [change("before")]
        for n in range(3):
            bus.publish(change(f"missed{n}"))
        await asyncio.sleep(3 * PAUSE)
        with bus.subscribe(since=position) as back:
            bus.publish(change("after"))
            await asyncio.sleep(3 * PAUSE)
            bus.close()
            assert await told(back) == [[change(f"missed{n}") for n in range(3)], [change("after")]]

    run(scenario())


@pytest.mark.parametrize("position", ["0-1", "", "nonsense", "é-1", "{epoch}-99999", "{epoch}-x"])
def test_who_was_somewhere_unknown_reads_anew(position: str) -> None:
    async def scenario() -> None:
        bus = EventBus(PAUSE)
        bus.publish(change())
        with bus.subscribe(since=position.format(epoch=bus._epoch)) as subscription:
            bus.close()
            assert [name async for _, name, _ in events(subscription)] == ["opened", "resync"]

    run(scenario())


def test_what_is_remembered_is_bounded_and_what_is_forgotten_is_said() -> None:
    async def scenario() -> None:
        bus = EventBus(PAUSE, remembered=10)
        with bus.subscribe() as first:
            position = (await anext(events(first)))[0]
            for n in range(1_000):
                bus.publish(change(f"r{n}"))
            assert len(bus._recent) == 10
            await asyncio.sleep(3 * PAUSE)
            with bus.subscribe(since=position) as second:
                bus.close()
                assert [name async for _, name, _ in events(second)] == ["opened", "resync"]
            assert [name async for _, name, _ in events(first)] == ["resync"]

    run(scenario())


def test_a_silent_stream_says_that_it_is_there() -> None:
    async def scenario() -> None:
        bus = EventBus(PAUSE)
        with bus.subscribe() as subscription:
            stream = subscription.events(silence=PAUSE)
            await anext(stream)
            assert await anext(stream) == b": still here\n\n"

    run(scenario())


def test_an_answer_says_from_when_it_is_so_that_nothing_is_missed_before_one_listens(client: TestClient) -> None:
    read_at = client.get("/api/experiments").headers["Mapless-Position"]
    experiment = client.post("/api/experiments", json={"name": "launched meanwhile"}).json()
    bus: EventBus = client.app.state.services.bus  # type: ignore[attr-defined]

    async def scenario() -> None:
        with bus.subscribe(shown(reports=True), since=read_at) as subscription:
            stream = events(subscription)
            assert (await anext(stream))[1] == "opened"
            assert (await anext(stream))[2] == [change(None, "experiment", experiment["id"])]

    assert client.portal is not None
    client.portal.call(scenario)
    assert client.get("/api/experiments").headers["Mapless-Position"] == bus.position != read_at


def test_there_are_only_so_many_streams(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_MAX_LISTENERS", 1)

    async def scenario() -> None:
        bus = EventBus(PAUSE)
        with bus.subscribe(), pytest.raises(BusyError, match="close some"), bus.subscribe():
            raise AssertionError("a second one")
        with bus.subscribe():
            assert bus.listeners == 1

    run(scenario())


def test_who_left_is_told_no_more_and_who_comes_late_finds_it_closed() -> None:
    async def scenario() -> None:
        bus = EventBus(PAUSE)
        with bus.subscribe() as left:
            pass
        bus.publish(change())
        bus.close()
        left.close()
        with bus.subscribe() as late:
            assert [await told(left), await told(late)] == [[], []]

    run(scenario())


def test_who_may_see_some_projects_hears_of_these_only() -> None:
    asked: list[set[str]] = []
    there = {"a": "mine", "b": "theirs", "c": "theirs"}

    def find(experiments: Collection[str]) -> dict[str, str]:
        asked.append(set(experiments))
        return {each: there[each] for each in experiments if each in there}

    async def scenario() -> None:
        bus = EventBus(PAUSE, find_projects=find)
        with bus.subscribe() as everything, bus.subscribe(projects=frozenset({"mine"})) as some:
            start = bus.position
            for experiment in ("a", "b", "gone"):
                bus.publish(change(experiment_id=experiment))
            await asyncio.sleep(3 * PAUSE)
            bus.belongs("b", "mine")
            bus.publish(change(experiment_id="b"))
            await asyncio.sleep(3 * PAUSE)
            with bus.subscribe(since=start, projects=frozenset({"theirs"})) as later:
                bus.belongs("gone", "theirs")
            with bus.subscribe(since=start, projects=frozenset({"theirs"})) as known:
                pass
            bus.close()
            for stream in (later, known):
                stream.close()
            assert await told(some) == [[change(experiment_id="a")], [change(experiment_id="b")]]
            assert [len(changes) for changes in await told(everything)] == [3, 1]
            # Where something belongs that nobody remembers, whoever comes back reads everything anew.
            assert [name async for _, name, _ in events(later)] == ["opened", "resync"]
            assert await told(known) == [[change(experiment_id="gone")]]
        # Each is looked up once.
        assert asked == [{"a", "b", "gone"}]

    run(scenario())


def test_what_belongs_where_is_asked_again_where_the_database_is_away(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outage, "RETRY_AFTER", PAUSE)
    asked = []

    def find(experiments: Collection[str]) -> dict[str, str]:
        asked.append(experiments)
        if len(asked) < 3:
            raise DatabaseAwayError("away")
        return {"e": "p"}

    async def scenario() -> None:
        bus = EventBus(PAUSE, find_projects=find)
        with bus.subscribe(projects=frozenset({"p"})) as subscription:
            bus.publish(change())
            async for _, name, changes in events(subscription):
                if name == "changes":
                    assert changes == [change()]
                    return

    run(scenario())
    assert len(asked) == 3
