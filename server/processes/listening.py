"""The server's address: bound once, and as people and workers on this machine write it."""

import errno
import socket

from server.errors import ServiceError
from server.settings import Settings

_ACCEPTED_AT_ONCE = 16


class PortTakenError(ServiceError):
    """Somebody else listens on the port."""

    def __init__(self, host: str, port: int) -> None:
        super().__init__(f"Port {port} on {host} is taken: stop what runs there, or choose another with MAPLESS_PORT.")


class UnusableAddressError(ServiceError):
    """This machine has no such address, or may not use the port."""

    def __init__(self, host: str, port: int, reason: str) -> None:
        super().__init__(f"Can't listen on {host} port {port}: {reason}. Set MAPLESS_HOST and MAPLESS_PORT to what is free.")


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


def accepting(listener: socket.socket) -> list[socket.socket]:
    """The listener several times over: an event loop of uvloop's takes one connection of each in a turn.

    In a turn that takes a hundredth of a second, one would be too few where a hundred come in a second: they would wait, and
    nobody would see them waiting.
    """
    return [listener, *(listener.dup() for _ in range(_ACCEPTED_AT_ONCE - 1))]


def local_url(settings: Settings) -> str:
    """The server's base URL as programs on this machine reach it."""
    host = "127.0.0.1" if settings.host in ("0.0.0.0", "::") else settings.host  # noqa: S104 - compared, not bound
    name = f"[{host}]" if ":" in host else host
    return f"http://{name}:{settings.port}"


def login_url(settings: Settings, token: str) -> str:
    """What a person opens: the address as a browser on this machine reaches it, with the token."""
    return f"{local_url(settings)}/?token={token}"
