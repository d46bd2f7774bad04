"""The addresses of this computer on its networks, and the reason why a link can't listen at an address."""

import errno
import fcntl
import socket
import struct
from contextlib import suppress

from bridge.errors import LinkError

SIOCGIFADDR = 0x8915  # Linux: the IPv4 address of an interface
FIRST_FREE_PORT = 1024


def own_addresses() -> list[str]:
    """Return the IPv4 addresses of this computer, as far as its system reports them."""
    addresses = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for _, interface in socket.if_nameindex():
            with suppress(OSError):
                asked = struct.pack("256s", interface.encode()[:15])
                addresses.append(socket.inet_ntoa(fcntl.ioctl(probe.fileno(), SIOCGIFADDR, asked)[20:24]))
    return addresses or ["127.0.0.1"]


def no_listener(name: str, host: str, port: int, error: OSError) -> LinkError:
    """Return the error of a link that can't listen at `host` and `port`."""
    if isinstance(error, socket.gaierror):
        return LinkError(f"{name}: the host '{host}' is unknown ({error.strerror}); check the name")
    if error.errno == errno.EADDRNOTAVAIL:
        kind = name.partition(":")[0]
        other = {"udpin": "udpout", "tcpin": "tcp"}[kind]
        return LinkError(
            f"{name}: this computer has no address {host}; it has {', '.join(own_addresses())}: give one of these "
            f"(0.0.0.0 for all), or {other}:{host}:{port} where {host} is the other side"
        )
    if error.errno == errno.EACCES and port < FIRST_FREE_PORT:
        return LinkError(f"{name}: port {port} is kept for the system; give one from {FIRST_FREE_PORT} on")
    return LinkError(
        f"{name}: can't listen there ({error.strerror}); another program does: where that is a recording, give as "
        "--link the hub that it names at its start; else stop it, or give another port"
    )
