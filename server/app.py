"""The application: routes, what runs beside them, and who may come in."""

import functools
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from typing import Any

from fastapi import APIRouter, FastAPI
from starlette.routing import BaseRoute

from server.alerts import endpoints as alerts
from server.alerts.sending import keep_alerting
from server.arenas import endpoints as gallery
from server.arenas.store import ArenaStore
from server.audit import endpoints as audit
from server.bags import endpoints as bags
from server.checkpoints import endpoints as checkpoints
from server.checkpoints.archives import keep_swept
from server.comparison import endpoints as comparison
from server.curve_thinning import endpoints as curve_thinning
from server.curve_thinning.sweep import keep_curves_thinned
from server.data_export import endpoints as data_export
from server.database.engine import Database
from server.database.migrate import upgrade
from server.diagnoses import endpoints as diagnoses
from server.evaluations import endpoints as evaluations
from server.events import endpoints as events
from server.events.position import PositionMiddleware
from server.examples import with_examples
from server.experiments import endpoints as experiments
from server.exports import endpoints as exports
from server.field import endpoints as field
from server.files import FileStore
from server.http import pages
from server.http.abandoned import AbandonedRequestsMiddleware
from server.http.compression import CompressionMiddleware
from server.http.prefix import PathPrefixMiddleware
from server.http.problems import install_error_handlers
from server.http.refusals import with_refusals
from server.http.slow_clients import SlowClientMiddleware
from server.http.switchboard import Switchboard
from server.jobs import endpoints as jobs
from server.jobs.results import ResultStore
from server.leaderboards import endpoints as leaderboards
from server.lineage import endpoints as lineage
from server.live import endpoints as live
from server.metrics import endpoints as metrics
from server.metrics.compaction import keep_compacted
from server.monitoring import endpoints as monitoring
from server.monitoring.run_logs import RunLogsMiddleware
from server.monitoring.state import StateCollector
from server.monitoring.timing import RequestTimesMiddleware
from server.outage import Outage
from server.people import endpoints as people
from server.people.oidc import endpoints as oidc
from server.playground import endpoints as playground
from server.policies import endpoints as policies
from server.printing import endpoints as printing
from server.project_archives import endpoints as project_archives
from server.projects import endpoints as projects
from server.queueing import endpoints as queueing
from server.replays import endpoints as replays
from server.reproduction import endpoints as reproduction
from server.run_log import endpoints as run_log
from server.runs import endpoints as runs
from server.security import endpoints as login
from server.security.access import AccessMiddleware
from server.security.cookies import may_be_signed_in
from server.security.declared import check_permissions
from server.security.headers import SecurityHeadersMiddleware
from server.security.proxies import ClientAddressMiddleware
from server.security.secrets import load_secrets
from server.services import Services
from server.settings import Settings
from server.storage import endpoints as storage
from server.storage.sweep import keep_thinned
from server.studies import endpoints as studies
from server.studies.advance import keep_studying
from server.suites import endpoints as suites
from server.sweeper import dispatch
from server.system import endpoints as system
from server.system.readiness import ReadinessProbe
from server.uploads import endpoints as uploads
from server.version import version
from server.workbench import endpoints as workbench
from server.workbench.indexing import keep_indexed
from server.workbench.trash import keep_emptied
from server.worker_api import endpoints as worker_api
from server.worker_api import jobs as worker_jobs

# A new domain's routes go here.
ROUTERS: tuple[APIRouter, ...] = (
    system.router,
    login.router,
    people.router,
    oidc.router,
    audit.router,
    alerts.router,
    projects.router,
    project_archives.router,
    queueing.router,
    experiments.router,
    lineage.router,
    workbench.router,
    gallery.router,
    runs.router,
    run_log.router,
    metrics.router,
    diagnoses.router,
    checkpoints.router,
    exports.router,
    replays.router,
    policies.router,
    comparison.router,
    printing.router,
    data_export.router,
    reproduction.router,
    studies.router,
    events.router,
    live.router,
    playground.router,
    worker_api.router,
    worker_jobs.router,
    jobs.router,
    evaluations.router,
    leaderboards.router,
    field.router,
    suites.router,
    uploads.router,
    bags.router,
    storage.router,
    curve_thinning.router,
    monitoring.router,
)

# What runs as long as the service does, entered in order at start and left in reverse. Each may put its own parts into the
# services that it is given (`services.doorbell`, `services.links`).
Background = Callable[[Services], AbstractAsyncContextManager[None]]
BACKGROUND: tuple[Background, ...] = (
    dispatch,
    keep_swept,
    keep_compacted,
    keep_indexed,
    keep_emptied,
    keep_thinned,
    keep_curves_thinned,
    keep_studying,
    keep_alerting,
)


def create_services(settings: Settings) -> Services:
    """The parts of a service, its database brought up to date.

    Raises:
        OSError: the data directory can't be written.
        ServiceError: the database can't be reached or used.
    """
    settings.data_dir.mkdir(parents=True, exist_ok=True)
    secrets = load_secrets(settings)
    database = Database(settings.resolved_database_url)
    upgrade(database, settings.database_wait_seconds)
    url = settings.resolved_files_url
    files = FileStore(url, settings.max_checkpoint_bytes, Outage(f"The store {url}"))
    arenas = ArenaStore(settings.arenas_dir)
    results = ResultStore(settings.replays_dir, settings.max_replay_bytes)
    return Services(settings=settings, secrets=secrets, database=database, files=files, arenas=arenas, results=results)


def create_app(settings: Settings | None = None) -> FastAPI:
    """The application; its services are made here and let go of at the end of its lifespan.

    Raises:
        As `create_services`.
    """
    services = create_services(settings or Settings())

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        async with AsyncExitStack() as stack:
            stack.callback(services.database.dispose)
            stack.callback(services.bus.close)
            stack.callback(services.board.close)
            stack.push_async_callback(services.live.close)
            stack.push_async_callback(services.drivers.close)
            for background in BACKGROUND:
                await stack.enter_async_context(background(services))
            yield

    app = describe(lifespan, max_body_size=services.settings.max_body_bytes)
    app.state.services = services
    app.state.readiness = ReadinessProbe(services)
    services.instruments.registry.register(StateCollector(services))
    is_known = functools.partial(may_be_signed_in, settings=services.settings)
    pages.mount_pages(app, services.settings.web_dist, services.settings.path_prefix, is_known)
    app.router.middleware_stack = Switchboard(app.router)
    # The last one added meets a request first.
    app.add_middleware(AbandonedRequestsMiddleware)
    app.add_middleware(CompressionMiddleware)
    app.add_middleware(PositionMiddleware, bus=services.bus)
    app.add_middleware(
        AccessMiddleware,
        settings=services.settings,
        secrets=services.secrets,
        limiter=services.login_limiter,
        gate=services.gate,
    )
    app.add_middleware(SecurityHeadersMiddleware)
    app.add_middleware(RequestTimesMiddleware, instruments=services.instruments)
    app.add_middleware(SlowClientMiddleware, seconds=services.settings.request_seconds)
    app.add_middleware(ClientAddressMiddleware, trusted_proxies=services.settings.trusted_proxies)
    app.add_middleware(RunLogsMiddleware)
    if services.settings.path_prefix:
        app.add_middleware(PathPrefixMiddleware, public_url=services.settings.resolved_public_url)
    return app


class _Application(FastAPI):
    """Says of itself more than FastAPI finds out."""

    def openapi(self) -> dict[str, Any]:
        """The description, with examples and with what every request may be refused with."""
        return with_refusals(with_examples(super().openapi()))


def describe(
    lifespan: Callable[[FastAPI], AbstractAsyncContextManager[None]] | None = None, *, max_body_size: int | None = None
) -> FastAPI:
    """The application's routes without anything behind them: enough for its OpenAPI description.

    A route that takes more than `max_body_size` bytes, an upload, says so with a `max_body_size` of its own.
    """
    app = _Application(
        title="Mapless",
        version=version(),
        lifespan=lifespan,
        openapi_url="/api/openapi.json",
        # Swagger's pages load scripts from elsewhere, which the content security policy forbids.
        docs_url=None,
        redoc_url=None,
        max_body_size=max_body_size,
    )
    install_error_handlers(app)
    app.router.routes.extend(_routes(max_body_size))
    return app


@functools.cache
def _routes(max_body_size: int | None) -> list[BaseRoute]:
    """Every router's, ready to answer: they know no service, and building their models takes a fifth of a second."""
    builder = FastAPI(max_body_size=max_body_size, openapi_url=None)
    for router in ROUTERS:
        check_permissions(router)
        for route in router.routes:
            # Each by itself, so that a request is compared with those only that it may be for.
            builder.include_router(APIRouter(routes=[route]))
    return builder.routes
