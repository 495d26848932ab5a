"""Sends what rules have to say: each alert by one server, once, and again after a while where it was not taken.

Who sends one writes so down first. Where that server ends before it could write what came of it, nobody knows whether the
message has arrived: it counts as unclear, and is not sent a second time.
"""

import asyncio
import contextlib
import logging
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from server.alerts.channels import SECONDS, UndeliveredError, Webhooks, send_mail
from server.alerts.messages import Letter
from server.alerts.repository import AlertRepository
from server.alerts.watcher import AlertWatcher
from server.database import tables
from server.database.tables import AlertState
from server.errors import PartAwayError
from server.outage import RETRY_AFTER, patiently
from server.services import Services

logger = logging.getLogger(__name__)

_WATCH_SECONDS = 5.0
_SEND_SECONDS = 1.0
# Side by side: one receiver that dawdles keeps no other waiting.
_AT_ONCE = 16
# How long a sender has: more than any delivery takes.
_LEASE_SECONDS = 4 * SECONDS
# Between the tries.
BACK_OFF = (10.0, 60.0, 300.0, 1_800.0, 7_200.0)
# At shutdown, for what is on its way.
_CLOSE_SECONDS = 3.0
_UNCLEAR = "The server ended while it was being sent. It is not sent again: it may have arrived."


class AlertSender:
    """Delivers alerts that are due. Used on the event loop.

    Args:
        services: of the server.
        clock: seconds since the epoch.
    """

    def __init__(self, services: Services, clock: Callable[[], float] = time.time) -> None:
        self._services = services
        self._lane = services.lanes.alerts
        self._clock = clock
        self._webhooks = Webhooks(services.settings, services.lanes.alerts)
        self._under_way: set[asyncio.Task[None]] = set()

    async def send_due(self) -> None:
        """Begin to deliver what is due, as far as there are places."""
        for alert_id in await self._lane.run(self._due, _AT_ONCE - len(self._under_way)):
            task = asyncio.create_task(self._send(alert_id))
            self._under_way.add(task)
            task.add_done_callback(self._under_way.discard)

    async def settled(self) -> None:
        """Wait until nothing is under way."""
        await asyncio.gather(*self._under_way, return_exceptions=True)

    async def close(self) -> None:
        """Let what is under way arrive, for a moment."""
        if self._under_way:
            _, late = await asyncio.wait(self._under_way, timeout=_CLOSE_SECONDS)
            for task in late:
                task.cancel()
        await self._webhooks.close()

    def _due(self, places: int) -> list[int]:
        now = self._clock()
        with self._services.database.read() as session:
            repository = AlertRepository(session)
            unclear, due = repository.has_unclear(now), list(repository.due(now, places)) if places > 0 else []
        if unclear:
            with self._services.database.write() as session:
                AlertRepository(session).give_up_unclear(now, _UNCLEAR)
        return due

    async def _send(self, alert_id: int) -> None:
        try:
            taken = await self._lane.run(self._take, alert_id)
            if taken is None:
                return
            state, outcome, at = await self._deliver(*taken)
            await patiently(lambda: self._lane.run(self._settle, alert_id, state, outcome, at))
        except PartAwayError:
            # It was not taken: it is due when the database is back.
            return
        except Exception:
            logger.exception("alert %d: what came of it could not be written down", alert_id)

    def _take(self, alert_id: int) -> tuple[tables.Alert, tables.AlertRule] | None:
        now = self._clock()
        with self._services.database.write() as session:
            return AlertRepository(session).take(alert_id, now, now + _LEASE_SECONDS)

    def _settle(self, alert_id: int, state: AlertState, outcome: str | None, at: float | None) -> None:
        with self._services.database.write() as session:
            AlertRepository(session).settle(alert_id, state, outcome, at)

    async def _deliver(self, alert: tables.Alert, rule: tables.AlertRule) -> tuple[AlertState, str | None, float | None]:
        """What came of a try: the state, what went wrong, and when it was sent or is due again."""
        letter = self._letter(alert, rule)
        try:
            if rule.channel == "mail":
                await self._lane.run(send_mail, letter, rule.target or "", self._services.settings)
            else:
                await self._webhooks.post(letter, rule.target or "", rule.format, rule.secret or "")
        except UndeliveredError as error:
            if error.final or alert.tries > len(BACK_OFF):
                return "failed", error.why, None
            return "waiting", error.why, self._clock() + max(BACK_OFF[alert.tries - 1], error.after)
        except Exception as error:
            logger.exception("alert %d could not be sent", alert.id)
            return "failed", f"It could not be sent: {type(error).__name__}.", None
        return "sent", None, self._clock()

    def _letter(self, alert: tables.Alert, rule: tables.AlertRule) -> Letter:
        path = "alerts"
        if alert.run_id is not None:
            path = f"runs/{alert.run_id}"
        elif alert.experiment_id is not None:
            path = f"experiments/{alert.experiment_id}"
        return Letter(
            id=alert.id,
            event=rule.event,
            at=alert.created_at,
            title=alert.title,
            text=alert.text,
            url=f"{self._services.settings.resolved_public_url}/{path}",
            project_id=alert.project_id,
            experiment_id=alert.experiment_id,
            run_id=alert.run_id,
        )


@asynccontextmanager
async def keep_alerting(services: Services) -> AsyncIterator[None]:
    """Notice and send, for as long as the block lasts."""
    sender = AlertSender(services)
    watcher = AlertWatcher(services)

    async def look() -> None:
        await services.lanes.alerts.run(watcher.look)

    tasks = [
        asyncio.create_task(_regularly(look, _WATCH_SECONDS)),
        asyncio.create_task(_regularly(sender.send_due, _SEND_SECONDS)),
    ]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        for task in tasks:
            with contextlib.suppress(asyncio.CancelledError):
                await task
        await sender.close()


async def _regularly(do: Callable[[], Awaitable[None]], pause: float) -> None:
    while True:
        try:
            await do()
        except PartAwayError:
            await asyncio.sleep(RETRY_AFTER)
        except Exception:
            logger.exception("alerts: the next look tries again")
        await asyncio.sleep(pause)
