"""The route that Prometheus scrapes."""

from fastapi import APIRouter, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest

from server.security.permissions import SCRAPE
from server.services import ServicesDep

router = APIRouter(tags=["monitoring"])


@router.get("/metrics", include_in_schema=False, dependencies=[SCRAPE])
async def scrape(services: ServicesDep) -> Response:
    """Counters and gauges in Prometheus' text format; for the metrics token or a login."""
    text = await services.lanes.metrics.run(generate_latest, services.instruments.registry)
    return Response(text, media_type=CONTENT_TYPE_LATEST)
