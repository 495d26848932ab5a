"""Changes as they happen: coalesced, at a bounded pace, over server-sent events that end when the server does."""

import asyncio
import threading

from server.events.bus import Change, EventBus, Subscription


def change(run_id: str = "r", kind: str = "metrics") -> Change:
    return Change.model_validate({"experiment_id": "e", "run_id": run_id, "kind": kind})


async def batches(subscription: Subscription) -> list[list[Change]]:
    """What is told until the bus closes."""
    return [batch async for batch in subscription.batches(pause=0.0)]


def test_equal_changes_that_wait_are_told_once() -> None:
    async def listen() -> list[list[Change]]:
        bus = EventBus()
        with bus.subscribe() as subscription:
            for _ in range(100):
                bus.publish(change())
            bus.publish(change(kind="run"))
            bus.close()
            return await batches(subscription)

    assert asyncio.run(listen()) == [[change(), change(kind="run")]]


def test_changes_come_from_any_thread_and_to_everybody() -> None:
    async def listen() -> list[list[list[Change]]]:
        bus = EventBus()

        def work() -> None:
            bus.publish(change())
            bus.close()

        with bus.subscribe() as first, bus.subscribe() as second:
            threading.Thread(target=work).start()
            return [await batches(first), await batches(second)]

    assert asyncio.run(listen()) == [[[change()]], [[change()]]]


def test_who_left_is_told_no_more_and_who_comes_late_finds_it_closed() -> None:
    async def come_and_go() -> list[list[list[Change]]]:
        bus = EventBus()
        with bus.subscribe() as left:
            pass
        bus.publish(change())
        bus.close()
        left.close()
        with bus.subscribe() as late:
            return [await batches(left), await batches(late)]

    assert asyncio.run(come_and_go()) == [[], []]
