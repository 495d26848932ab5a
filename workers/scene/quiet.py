"""viser servers that keep to themselves: for the bridge on 127.0.0.1 alone, silent, closed to wishes for a public tunnel."""

import contextlib
import threading
from collections.abc import Iterator
from types import SimpleNamespace

import rich
import viser
import websockets.datastructures
import websockets.exceptions
from viser import _messages
from viser.infra import _infra

from workers.scene.gate import GatedServe

# viser lets nobody decide who may connect; what its module knows as `websockets` does it instead.
_infra.websockets = SimpleNamespace(  # type: ignore[assignment, attr-defined]
    asyncio=SimpleNamespace(server=SimpleNamespace(serve=GatedServe)),
    datastructures=websockets.datastructures,
    exceptions=websockets.exceptions,
)

_console = threading.Lock()


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Keeps viser from announcing on the console that a server comes or goes, which it does whatever it is told."""
    console = rich.get_console()
    with _console:
        console.quiet, quiet = True, console.quiet
        try:
            yield
        finally:
            console.quiet = quiet


def start_viser() -> viser.ViserServer:
    """A server on a free port of 127.0.0.1 that `gate.KEY` opens."""
    with _silence():
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        # With these, any browser could open a public tunnel to this port.
        server._websock_server.unregister_handler(message)  # noqa: SLF001
    return server


def stop_viser(server: viser.ViserServer) -> None:
    """Closes the port; blocks until it is gone."""
    with _silence():
        server.stop()
