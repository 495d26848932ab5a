"""Runs the application on its port until it is told to stop."""

import contextlib
import signal
import socket
from collections.abc import Callable

import uvicorn

from server.http.slow_clients import timed_protocol
from server.processes.listening import accepting, listen, login_url
from server.processes.settling import settle_in_background, share_memory
from server.settings import Settings
from workers.logs import configure
from workers.runtime.supervised import end_with_supervisor

# Streams end by themselves when the bus closes; this is for a client that takes its time to read the last bytes.
_GRACE_SECONDS = 3
# Longer than a page waits between two looks, and than proxies keep a connection (nginx and cloud balancers 60 s): who closes
# first while the other one asks loses a request.
_KEPT_SECONDS = 75


class _Server(uvicorn.Server):
    """Ends event streams before it waits for open requests: they would not end by themselves."""

    def __init__(self, config: uvicorn.Config, on_ready: Callable[[], None], end_streams: Callable[[], None]) -> None:
        super().__init__(config)
        self._on_ready = on_ready
        self._end_streams = end_streams

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._on_ready()
            settle_in_background()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self._end_streams()
        await super().shutdown(sockets)


def serve(settings: Settings, on_ready: Callable[[str], None]) -> None:
    """Serve until SIGINT or SIGTERM, then end open streams and links and return.

    Args:
        settings: where to listen and what to serve.
        on_ready: called once with the login URL when requests are answered.

    Raises:
        PortTakenError, UnusableAddressError: see `listen`.
        OSError: the data directory can't be written.
    """
    share_memory()
    end_with_supervisor()
    configure(settings.log_format)
    listener = listen(settings)
    # Late, so that a port that is taken is answered at once.
    from server.app import create_app

    with contextlib.closing(listener):
        settings = settings.model_copy(update={"port": listener.getsockname()[1]})
        app = create_app(settings)
        services = app.state.services
        config = uvicorn.Config(
            app,
            # As the rest of us, and no line for each request.
            log_config=None,
            log_level="warning",
            access_log=False,
            server_header=False,
            # The application asks its own settings whom to believe.
            proxy_headers=False,
            http=timed_protocol(settings.request_seconds),
            # Frames are small and many: compressing each would cost more than it saves.
            ws="websockets-sansio",
            ws_per_message_deflate=False,
            timeout_keep_alive=_KEPT_SECONDS,
            timeout_graceful_shutdown=_GRACE_SECONDS,
        )

        def end_streams() -> None:
            services.bus.close()
            services.board.close()

        url = login_url(settings, services.secrets.token)
        server = _Server(config, on_ready=lambda: on_ready(url), end_streams=end_streams)
        # uvicorn raises the signal that ended it once more when it has shut down; nothing is left to be interrupted.
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        with contextlib.suppress(KeyboardInterrupt):
            server.run(sockets=accepting(listener))
