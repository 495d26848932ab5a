"""Runs the application on its port until it is told to stop."""

import contextlib
import errno
import socket
from collections.abc import Callable

import uvicorn

from server.app import create_app
from server.errors import ServiceError
from server.services import Services
from server.settings import Settings

# Streams end by themselves when the bus closes; this is for a client that takes its time to read the last bytes.
_GRACE_SECONDS = 3


class PortTakenError(ServiceError):
    """Somebody else listens on the port."""

    def __init__(self, host: str, port: int) -> None:
        super().__init__(f"Port {port} on {host} is taken: stop what runs there, or choose another with MAPLESS_PORT.")


class UnusableAddressError(ServiceError):
    """This machine has no such address, or may not use the port."""

    def __init__(self, host: str, port: int, reason: str) -> None:
        super().__init__(f"Can't listen on {host} port {port}: {reason}. Set MAPLESS_HOST and MAPLESS_PORT to what is free.")


class _Server(uvicorn.Server):
    """Ends event streams before it waits for open requests: they would not end by themselves."""

    def __init__(self, config: uvicorn.Config, services: Services, on_ready: Callable[[], None]) -> None:
        super().__init__(config)
        self._services = services
        self._on_ready = on_ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._on_ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self._services.bus.close()
        await super().shutdown(sockets)


def listen(settings: Settings) -> socket.socket:
    """A socket bound to the settings' address; the port is real even where the settings say 0.

    Raises:
        PortTakenError: somebody else listens there.
        UnusableAddressError: the address is not this machine's, or the port needs rights that this process lacks.
    """
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    # A port that was in use until a moment ago may be taken again at once.
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((settings.host, settings.port))
        # Some systems notice only now that the port is taken.
        listener.listen(socket.SOMAXCONN)
    except OSError as error:
        listener.close()
        if error.errno == errno.EADDRINUSE:
            raise PortTakenError(settings.host, settings.port) from error
        raise UnusableAddressError(settings.host, settings.port, error.strerror or str(error)) from error
    return listener


def serve(settings: Settings, on_ready: Callable[[str], None]) -> None:
    """Serve until SIGINT or SIGTERM, then end open streams and links and return.

    Args:
        settings: where to listen and what to serve.
        on_ready: called once with the login URL when requests are answered.

    Raises:
        PortTakenError, UnusableAddressError: see `listen`.
        OSError: the data directory can't be written.
    """
    listener = listen(settings)
    with contextlib.closing(listener):
        settings = settings.model_copy(update={"port": listener.getsockname()[1]})
        app = create_app(settings)
        services: Services = app.state.services
        config = uvicorn.Config(
            app,
            log_level="warning",
            access_log=False,
            server_header=False,
            # Frames are small and many: compressing each would cost more than it saves.
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=_GRACE_SECONDS,
        )
        server = _Server(config, services, lambda: on_ready(login_url(settings, services.secrets.token)))
        # uvicorn raises SIGINT once more when it has shut down; nothing is left to be interrupted.
        with contextlib.suppress(KeyboardInterrupt):
            server.run(sockets=[listener])


def login_url(settings: Settings, token: str) -> str:
    """What a person opens: the address as a browser on this machine reaches it, with the token."""
    host = "127.0.0.1" if settings.host in ("0.0.0.0", "::") else settings.host  # noqa: S104 - compared, not bound
    name = f"[{host}]" if ":" in host else host
    return f"http://{name}:{settings.port}/?token={token}"
