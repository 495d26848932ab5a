"""Where a webhook may go: nobody makes the server speak to what only the server can reach."""

import ipaddress
import socket
from urllib.parse import SplitResult, urlsplit

from sim.errors import MaplessError

_PORTS = {"http": 80, "https": 443}
# Through these networks an IPv6 address leads to the IPv4 address in its last 32 bits.
_NAT64 = ipaddress.ip_network("64:ff9b::/96")

Address = ipaddress.IPv4Address | ipaddress.IPv6Address


class RefusedAddressError(MaplessError, ValueError):
    """A webhook must not go there."""


def check_url(url: str) -> SplitResult:
    """The URL in its parts.

    Raises:
        RefusedAddressError: it is no HTTP URL, or holds a password.
    """
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        raise RefusedAddressError("this is no URL") from None
    if parts.scheme not in _PORTS or not parts.hostname or port == 0 or any(sign.isspace() for sign in url):
        raise RefusedAddressError("a webhook's URL begins with https:// or http://")
    if parts.username is not None or parts.password is not None:
        raise RefusedAddressError("a webhook's URL holds no user and no password")
    return parts


def literal(host: str) -> Address | None:
    """The address that a host is written as; None for a name."""
    try:
        return ipaddress.ip_address(host)
    except ValueError:
        return None


def is_public(address: Address) -> bool:
    """Whether everybody on the internet means the same machine by it."""
    if isinstance(address, ipaddress.IPv6Address):
        within = address.ipv4_mapped or address.sixtofour or (address.teredo or (None, None))[1]
        if address in _NAT64:
            within = ipaddress.IPv4Address(int(address) & 0xFFFFFFFF)
        if within is not None:
            return is_public(within)
    return address.is_global and not address.is_multicast


def look_up(parts: SplitResult, *, private: bool) -> str:
    """The address to connect to; blocks while the name is looked up.

    It is that address which is connected to, not the name: who answers for a name could answer otherwise the next time.

    Args:
        parts: of `check_url`.
        private: whether it may be one of a private network, or of this machine.

    Raises:
        RefusedAddressError: one of the name's addresses is not public, and may not be private.
        OSError: the name is not known.
    """
    assert parts.hostname is not None
    found = socket.getaddrinfo(parts.hostname, port_of(parts), type=socket.SOCK_STREAM)
    addresses = [ipaddress.ip_address(str(each[4][0]).partition("%")[0]) for each in found]
    if not private and not all(map(is_public, addresses)):
        raise RefusedAddressError(
            f"{parts.hostname} is in a private network: MAPLESS_ALERTS_PRIVATE_ADDRESSES=true would allow it."
        )
    return str(addresses[0])


def port_of(parts: SplitResult) -> int:
    """The port that a URL leads to."""
    return parts.port or _PORTS[parts.scheme]
