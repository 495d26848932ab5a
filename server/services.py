"""What every request and background task shares; `app.state.services` holds the one of an application."""

from dataclasses import dataclass, field
from typing import Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

from server.arenas.store import ArenaStore
from server.database.engine import Database
from server.dispatch import Doorbell, Links, NoDoorbell, NoLinks
from server.events.bus import EventBus
from server.files import FileStore
from server.lanes import Lanes
from server.live.drivers import PolicyDrivers
from server.live.hub import LiveHub
from server.live.views import open_view
from server.metrics.cache import AnswerCache
from server.monitoring.instruments import Instruments
from server.replays.recordings import RecordingStore
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
    recordings: RecordingStore
    bus: EventBus = field(default_factory=EventBus)
    doorbell: Doorbell = field(default_factory=NoDoorbell)
    links: Links = field(default_factory=NoLinks)
    live: LiveHub = field(default_factory=lambda: LiveHub(open_view))
    drivers: PolicyDrivers = field(init=False)
    leases: Leases = field(init=False)
    instruments: Instruments = field(default_factory=Instruments)
    curves: AnswerCache = field(default_factory=AnswerCache)
    lanes: Lanes = field(default_factory=Lanes)
    pulse: Pulse = field(default_factory=Pulse)
    login_limiter: GuessLimiter = field(init=False)

    def __post_init__(self) -> None:
        self.login_limiter = GuessLimiter(on_guess=self.instruments.wrong_secrets.inc)
        self.drivers = PolicyDrivers(self.live)
        self.leases = Leases(self.settings.lease_seconds)


def _services(connection: HTTPConnection) -> Services:
    services: Services = connection.app.state.services
    return services


ServicesDep = Annotated[Services, Depends(_services)]
