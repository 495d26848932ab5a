"""The route by which a page hears of changes, as server-sent events."""

from collections.abc import AsyncIterator

from fastapi import APIRouter
from fastapi.sse import EventSourceResponse, ServerSentEvent

from server.services import ServicesDep

router = APIRouter(tags=["events"])

# A page redraws at most five times a second, whatever the workers report.
_PAUSE_SECONDS = 0.2


@router.get("/api/events", response_class=EventSourceResponse)
async def stream_changes(services: ServicesDep) -> AsyncIterator[ServerSentEvent]:
    """Events `change`, each a `Change` as JSON; the REST API says what is true now.

    Changes that a page missed are not repeated: it reads anew whatever it shows when the stream opens.
    """
    with services.bus.subscribe() as subscription:
        # The first bytes tell the browser that the stream is open.
        yield ServerSentEvent(comment="open")
        async for batch in subscription.batches(_PAUSE_SECONDS):
            for change in batch:
                yield ServerSentEvent(event="change", data=change.model_dump())
