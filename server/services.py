"""What every request and background task shares; `app.state.services` holds the one of an application."""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

from server.arenas.store import ArenaStore
from server.background import Wake
from server.comparison.compared import KEPT, Compared
from server.database.engine import Database
from server.dispatch import Doorbell, Links, NoDoorbell, NoLinks
from server.events.bus import EventBus
from server.files import FileStore
from server.jobs.board import Board
from server.jobs.results import ResultStore
from server.lanes import Lanes
from server.live.drivers import PolicyDrivers
from server.live.hub import LiveHub
from server.live.views import open_view
from server.metrics.cache import AnswerCache
from server.metrics.grown import GrownRuns
from server.metrics.kept import KeptSeries
from server.monitoring.instruments import Instruments
from server.people.gate import Gate
from server.people.oidc.provider import Provider
from server.playground.registry import Playgrounds
from server.projects.repository import ProjectRepository
from server.recent import Recent
from server.security.limits import GuessLimiter
from server.security.secrets import Secrets
from server.settings import Settings
from server.system.pulse import Pulse
from server.worker_api.leases import Leases


@dataclass
class Services:
    """The parts of a running service. `doorbell` and `links` are exchanged for real ones where workers are to be reached."""

    settings: Settings
    secrets: Secrets
    database: Database
    files: FileStore
    arenas: ArenaStore
    results: ResultStore
    bus: EventBus = field(init=False)
    doorbell: Doorbell = field(default_factory=NoDoorbell)
    links: Links = field(default_factory=NoLinks)
    live: LiveHub = field(default_factory=lambda: LiveHub(open_view))
    drivers: PolicyDrivers = field(init=False)
    playgrounds: Playgrounds = field(default_factory=Playgrounds)
    leases: Leases = field(init=False)
    job_leases: Leases = field(init=False)
    board: Board = field(default_factory=Board)
    instruments: Instruments = field(default_factory=Instruments)
    curves: AnswerCache = field(default_factory=AnswerCache)
    series: KeptSeries = field(default_factory=KeptSeries)
    # Of which enough rows may wait to be compacted.
    grown: GrownRuns = field(default_factory=GrownRuns)
    compared: Recent[Compared] = field(default_factory=lambda: Recent(KEPT))
    lanes: Lanes = field(default_factory=Lanes)
    pulse: Pulse = field(default_factory=Pulse)
    # Of the sweep that removes what rules have taken.
    storage_wake: Wake = field(default_factory=Wake)
    # Of the sweep that thins curves.
    curves_wake: Wake = field(default_factory=Wake)
    login_limiter: GuessLimiter = field(init=False)
    gate: Gate = field(init=False)
    provider: Provider | None = field(init=False)

    def __post_init__(self) -> None:
        self.login_limiter = GuessLimiter(on_guess=self.instruments.wrong_secrets.inc)
        self.bus = EventBus(find_projects=self._projects_of)
        self.gate = Gate(self.database, self.lanes.accounts)
        oidc = self.settings.oidc
        self.provider = Provider(oidc) if oidc is not None else None
        self.drivers = PolicyDrivers(self.live)
        self.leases = Leases(self.settings.lease_seconds)
        self.job_leases = Leases(self.settings.lease_seconds)

    def _projects_of(self, experiment_ids: Collection[str]) -> dict[str, str]:
        with self.database.read() as session:
            found = ProjectRepository(session).of_experiments(experiment_ids)
        return {experiment_id: project_id for experiment_id, (project_id,) in found.items()}


# A coroutine, as every dependency that only hands over what is there: plain functions run on a thread each.
async def _services(connection: HTTPConnection) -> Services:
    services: Services = connection.app.state.services
    return services


ServicesDep = Annotated[Services, Depends(_services)]
