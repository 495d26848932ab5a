"""What the service is told from outside: environment variables with the prefix MAPLESS_."""

import ipaddress
import re
from pathlib import Path
from typing import Literal, Self
from urllib.parse import urlsplit

from pydantic import Field, SecretStr, field_validator, model_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from server.curve_thinning.rule import CurveRule
from server.people.oidc.settings import OidcSettings, check_right, is_safe_url
from server.runs.limits import Limits
from server.storage.rule import KeepRule
from workers.logs import LogFormat
from workers.runtime.settings import EXTENSIONS_SETTING

PROJECT_ROOT = Path(__file__).resolve().parent.parent

# A token that an attacker on the network may guess at needs at least this many characters.
_MIN_NETWORK_TOKEN = 16

# What the pages may be below; a first name that is the server's own would hide it from programs that leave the prefix out.
_PREFIX = re.compile(r"(/[\w.~-]*[\w~-][\w.~-]*)*", re.ASCII)
_OWN_PATHS = frozenset({"api", "live", "replays", "assets", "healthz", "readyz", "metrics"})


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a server bound to `host`."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class Settings(BaseSettings):
    """Where the service keeps its data and how it is reached.

    The defaults are the embedded mode: SQLite, a broker in a file, checkpoints in a directory, reachable from this machine
    only.

    Raises:
        pydantic.ValidationError: a value is out of range, or the server would be reachable from the network without a token.
    """

    model_config = SettingsConfigDict(
        env_prefix="MAPLESS_", frozen=True, extra="ignore", env_ignore_empty=True, validate_default=True
    )

    data_dir: Path = Field(
        Path("data"), description="Everything that the service keeps, where the URLs below don't say otherwise."
    )
    database_url: str | None = Field(None, description="SQLAlchemy URL; SQLite in the data directory if not given.")
    database_wait_seconds: float = Field(
        30.0, ge=0.0, le=3_600.0, description="How long a database server that is not up yet is waited for at start."
    )
    broker_url: str | None = Field(None, description="Celery broker URL; a SQLite file in the data directory if not given.")
    queue_prefix: str = Field(
        "mapless.", description="Of the queues' names: installations that share a broker need different ones."
    )
    files_url: str | None = Field(
        None,
        description="Directory or fsspec URL of the checkpoints, as s3://bucket/folder; in the data directory if not given.",
    )

    host: str = Field("127.0.0.1", description="Address to bind.")
    port: int = Field(8400, ge=0, le=65_535, description="Port to bind; 0 takes a free one.")
    server_url: str | None = Field(None, description="How workers reach the server, if not at its own host and port.")
    allowed_hosts: tuple[str, ...] = Field(
        (), description="More names under which browsers may reach the server (JSON list)."
    )
    trusted_proxies: tuple[str, ...] = Field(
        (),
        description="Addresses or networks of proxies in front of the server (JSON list): what they say of a client's "
        "address and of HTTPS is believed.",
    )

    token: SecretStr | None = Field(None, description="Login token; generated and kept in the data directory if not given.")
    worker_token: SecretStr | None = Field(None, description="The workers' token; generated likewise.")
    metrics_token: SecretStr | None = Field(
        None,
        min_length=16,
        description="Opens /metrics and nothing else, for Prometheus (16 characters or more); the login token does too.",
    )

    oidc_issuer: str | None = Field(
        None, description="URL of a provider of identities (OpenID Connect) that people sign in with, as its tokens have it."
    )
    oidc_client_id: str | None = Field(None, description="What the provider calls this installation.")
    oidc_client_secret: SecretStr | None = Field(
        None, description="What the provider knows this installation by; a public client has none."
    )
    oidc_title: str | None = Field(None, description="What the pages call the provider; its host if not given.")
    oidc_scopes: str = Field(
        "openid profile email", pattern=r"^openid( |$)", description="Asked of the provider, separated by spaces."
    )
    oidc_name_claim: str = Field("preferred_username", description="Claim that new accounts are called after.")
    oidc_email_claim: str = Field("email", description="Claim with the e-mail address, kept if `email_verified` says so.")
    oidc_groups_claim: str = Field("groups", description="Claim with a person's groups.")
    oidc_domains: tuple[str, ...] = Field(
        (), description="Domains of verified e-mail addresses that are let in (JSON list); all if not given."
    )
    oidc_groups: tuple[str, ...] = Field((), description="Groups that are let in (JSON list); all if not given.")
    oidc_rights: dict[str, tuple[str, ...]] = Field(
        default_factory=dict,
        description='What a group may do (JSON): `{"nav": ["editor in Halls"], "ops": ["administrator"]}`. Roles in '
        "projects named here are the groups' at every sign-in.",
    )
    oidc_strangers: bool = Field(False, description="Whether who is let in and was not invited gets an account.")

    workers: int | None = Field(
        None, ge=0, le=256, description="Local worker processes of `mapless up`; one a core if not given."
    )
    jobs: int | None = Field(
        None,
        ge=0,
        le=64,
        description="Replays, exports and evaluations side by side in the workers of `mapless up`; 2 if not given.",
    )
    public_url: str | None = Field(
        None,
        description="How people reach the pages, for links in alerts and invitations; the server's own URL if not given. "
        "With a path (https://lab.example/mapless) the pages are below it.",
    )
    alerts_private_addresses: bool = Field(
        False, description="Whether webhooks may go to addresses of this machine and of private networks."
    )
    smtp_host: str | None = Field(None, description="Mail server of alerts; without one there is no mail.")
    smtp_port: int = Field(587, ge=1, le=65_535, description="Its port.")
    smtp_security: Literal["starttls", "tls", "none"] = Field(
        "starttls", description="`starttls`, `tls` from the first byte (port 465), or `none`."
    )
    smtp_user: str | None = Field(None, description="Who logs in there; nobody if not given.")
    smtp_password: SecretStr | None = Field(None, description="And with what.")
    smtp_from: str | None = Field(None, description="Sender of the mail; `mapless@` the mail server's name if not given.")

    lease_seconds: float = Field(15.0, gt=0.0, le=600.0, description="How long a silent worker keeps its run or job.")
    max_runs_per_person: int | None = Field(
        None,
        ge=1,
        description="Runs of one person that may be under way at a time; any number if not given. What was launched with "
        "MAPLESS_TOKEN counts as one person's.",
    )
    max_runs_per_experiment: int | None = Field(
        None, ge=1, description="Likewise of an experiment that has no limit of its own; any number if not given."
    )
    extensions: str = Field("", description=EXTENSIONS_SETTING)
    log_format: LogFormat = Field("text", description="Of the log on standard error: `text`, or `json`, an object a line.")
    web_dist: Path = Field(PROJECT_ROOT / "web" / "dist", description="The built pages.")
    max_checkpoint_bytes: int = Field(512 * 2**20, gt=0, description="Largest checkpoint accepted from a worker.")
    trash_days: float = Field(7.0, ge=0.0, le=3_650.0, description="How long what was deleted can be taken back.")
    keep_checkpoints: KeepRule | None = Field(
        None,
        description='Which checkpoints of each run stay, where an experiment has no rule of its own, as JSON: `{"last": 3, '
        '"every": 10, "best": true}` keeps the newest 3, one in 10 and the best; all if not given.',
    )
    thin_curves: CurveRule | None = Field(
        None,
        description="How fine curves of runs stay that ended long ago, where an experiment has no rule of its own, as JSON: "
        '`{"points": 1000, "after_days": 30}` leaves 1000 points of each metric, each with the smallest, mean and largest '
        "value of those that it stands for; all if not given.",
    )
    min_free_disk_bytes: int = Field(
        2**30, ge=0, description="Free on each disk: with less, `mapless doctor` and the page *Storage* say so."
    )
    max_replay_bytes: int = Field(
        256 * 2**20, ge=0, description="Of all replays and bundles that are kept; older ones are made again."
    )
    request_seconds: float = Field(
        20.0, gt=0.0, le=600.0, description="How long a client may take for headers, and for the next part of a body."
    )
    max_body_bytes: int = Field(4 * 2**20, gt=0, description="Largest body of any other request.")

    @property
    def limits(self) -> Limits:
        """How many runs may be under way at a time."""
        return Limits(self.max_runs_per_person, self.max_runs_per_experiment)

    @field_validator("data_dir")
    @classmethod
    def _absolute(cls, path: Path) -> Path:
        """The processes that share it may have other working directories."""
        return path.resolve()

    @field_validator("trusted_proxies")
    @classmethod
    def _addresses(cls, proxies: tuple[str, ...]) -> tuple[str, ...]:
        """A name would have to be looked up for every request, and somebody else may answer for it."""
        for proxy in proxies:
            try:
                ipaddress.ip_network(proxy)
            except ValueError as error:
                raise ValueError(f"{proxy!r} is neither an address nor a network (10.0.0.5, 172.16.0.0/12)") from error
        return proxies

    @field_validator("public_url")
    @classmethod
    def _leads_to_pages(cls, url: str | None) -> str | None:
        if url is None:
            return None
        parts = urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.netloc or parts.query or parts.fragment:
            raise ValueError(f"{url!r} is no address of pages, as https://lab.example or https://lab.example/mapless")
        path = parts.path.rstrip("/")
        if not _PREFIX.fullmatch(path):
            raise ValueError(f"{path!r} is no path for pages: letters, digits, '-', '_', '.' and '~' between single slashes")
        if path.partition("/")[2].partition("/")[0] in _OWN_PATHS:
            raise ValueError(f"pages can't be below {path!r}: {', '.join(sorted(_OWN_PATHS))} are the server's own")
        return url

    @field_validator("oidc_rights")
    @classmethod
    def _are_rights(cls, rights: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
        for right in (right for theirs in rights.values() for right in theirs):
            check_right(right)
        return rights

    @model_validator(mode="after")
    def _whole_provider(self) -> Self:
        if self.oidc_issuer is None:
            return self
        if self.oidc_client_id is None:
            raise ValueError("MAPLESS_OIDC_ISSUER needs MAPLESS_OIDC_CLIENT_ID: what the provider calls this installation")
        if not is_safe_url(self.oidc_issuer):
            raise ValueError("MAPLESS_OIDC_ISSUER must begin with https://: the provider is sent secrets")
        return self

    @model_validator(mode="after")
    def _closed_on_a_network(self) -> Self:
        if is_loopback(self.host):
            return self
        if self.token is None:
            raise ValueError(
                f"refusing to listen on {self.host} without a login token: set MAPLESS_TOKEN (for example to the output of "
                "`openssl rand -hex 24`), or bind 127.0.0.1"
            )
        if len(self.token.get_secret_value()) < _MIN_NETWORK_TOKEN:
            raise ValueError(f"MAPLESS_TOKEN must have at least {_MIN_NETWORK_TOKEN} characters to listen on {self.host}")
        return self

    @property
    def oidc(self) -> OidcSettings | None:
        """The provider of identities; None where there is none."""
        if self.oidc_issuer is None or self.oidc_client_id is None:
            return None
        return OidcSettings(
            issuer=self.oidc_issuer,
            client_id=self.oidc_client_id,
            client_secret=self.oidc_client_secret.get_secret_value() if self.oidc_client_secret else None,
            scopes=self.oidc_scopes,
            title=self.oidc_title or urlsplit(self.oidc_issuer).hostname or self.oidc_issuer,
            name_claim=self.oidc_name_claim,
            email_claim=self.oidc_email_claim,
            groups_claim=self.oidc_groups_claim,
            domains=frozenset(domain.lower() for domain in self.oidc_domains),
            groups=frozenset(self.oidc_groups),
            rights=self.oidc_rights,
            strangers=self.oidc_strangers,
        )

    @property
    def resolved_database_url(self) -> str:
        """SQLAlchemy URL of the database."""
        return self.database_url or f"sqlite:///{self.data_dir / 'mapless.db'}"

    @property
    def resolved_broker_url(self) -> str:
        """Celery URL of the broker."""
        return self.broker_url or f"sqla+sqlite:///{self.data_dir / 'broker.db'}"

    @property
    def resolved_files_url(self) -> str:
        """Directory or fsspec URL of the checkpoints."""
        return self.files_url or str(self.data_dir / "checkpoints")

    @property
    def arenas_dir(self) -> Path:
        """Directory of the imported arenas."""
        return self.data_dir.resolve() / "arenas"

    @property
    def replays_dir(self) -> Path:
        """Directory of the evaluations that were driven again: a cache."""
        return self.data_dir.resolve() / "replays"

    @property
    def resolved_server_url(self) -> str:
        """Base URL for workers, without a trailing slash."""
        if self.server_url:
            return self.server_url.rstrip("/")
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}:{self.port}"

    @property
    def resolved_public_url(self) -> str:
        """Base URL of the pages, without a trailing slash."""
        return self.public_url.rstrip("/") if self.public_url else self.resolved_server_url

    @property
    def path_prefix(self) -> str:
        """What stands before every path in a browser's address, as /mapless; empty where that is nothing."""
        return urlsplit(self.public_url).path.rstrip("/") if self.public_url else ""
