"""The route by which a page hears of changes, as server-sent events."""

import asyncio
from typing import Annotated, Literal

from fastapi import APIRouter, Header, Query
from fastapi.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from server.events.bus import Subscription
from server.events.changes import Shown
from server.http.problems import Responses
from server.security.permissions import SIGNED_IN
from server.security.principal import Principal, PrincipalDep
from server.services import Services, ServicesDep

router = APIRouter(tags=["events"])

_EVENT = {
    "type": "object",
    "properties": {"id": {"type": "string"}, "event": {"type": "string"}, "data": {"type": "string"}},
    "required": ["data"],
}
_STREAM: Responses = {200: {"content": {"text/event-stream": {"schema": {"type": "string"}, "itemSchema": _EVENT}}}}
# A page shows this many experiments or runs at most.
_MAX_SHOWN = 100

Ids = Annotated[list[str], Query(max_length=_MAX_SHOWN)]


class _EventStream(StreamingResponse):
    """A subscription that lasts as long as its connection."""

    def __init__(self, services: Services, principal: Principal, shown: Shown | None, since: str | None) -> None:
        # A proxy that waits for more before it passes something on would defeat the purpose.
        headers = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}
        super().__init__(iter(()), media_type="text/event-stream", headers=headers)
        self._services = services
        self._principal = principal
        self._subscribed = services.bus.subscribe(shown, since, principal.visible)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send events until one side ends."""
        with self._subscribed as subscription:
            self.body_iterator = subscription.events()
            ended = asyncio.create_task(self._end_with_its_rights(subscription))
            try:
                await super().__call__(scope, receive, send)
            finally:
                ended.cancel()

    async def _end_with_its_rights(self, subscription: Subscription) -> None:
        """Whoever may see more or less than before listens anew, if at all."""
        await self._services.gate.until_changed(self._principal)
        subscription.close()


@router.get("/api/events", response_class=StreamingResponse, responses=_STREAM, dependencies=[SIGNED_IN])
async def stream_changes(
    services: ServicesDep,
    principal: PrincipalDep,
    experiment: Ids = [],  # noqa: B006 (FastAPI copies it)
    run: Ids = [],  # noqa: B006
    follow: Literal["everything", "shown"] = "everything",
    reports: bool = False,
    since: str | None = None,
    last_event_id: Annotated[str | None, Header()] = None,
) -> StreamingResponse:
    """Events `changes`, each a list of `Change` as JSON; the REST API says what is true now.

    With `follow=shown` only changes of the given experiments and runs are told in full, of everything else which kinds there
    were (and of metrics even that with `reports` only). `since`, or the header `Last-Event-ID`, is the id of the last event
    that was read: what has changed since then is told first. An event `resync` says that something was missed: whatever the
    page shows is to be read anew.
    """
    shown = Shown(frozenset(experiment), frozenset(run), reports) if follow == "shown" else None
    return _EventStream(services, principal, shown, last_event_id or since)
