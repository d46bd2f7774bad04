"""The names of links, the addresses in them, and which networks reach a socket of this program."""

import errno
import fcntl
import ipaddress
import os
import socket
import struct
from collections.abc import Iterable
from contextlib import suppress
from typing import Final

from bridge.errors import LinkError, LinkSpecError

DEFAULT_BAUD: Final = 115200
LOOPBACK: Final = "127.0.0.1"
FORMS: Final = (
    "serial:/dev/ttyUSB0:115200, udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or tcpin:HOST:PORT"
)
PROTOCOL: Final = {"udpin": "UDP", "tcpin": "TCP", "udpout": "UDP", "tcp": "TCP"}
EVERY_ADDRESS: Final = ("0.0.0.0", "::")
SIOCGIFADDR = 0x8915  # Linux: the IPv4 address of an interface
FIRST_FREE_PORT = 1024


def parse_link(spec: str) -> tuple[str, str, int]:
    """Return kind, serial port or host, and baud rate or port number of a link's name. Raises LinkSpecError."""
    kind, _, address = spec.partition(":")
    if kind == "serial" and address:
        return kind, *_port_and_baud(address)
    if kind in PROTOCOL and address:
        return kind, *_host_and_port(spec, address)
    raise LinkSpecError(f"'{spec}' is not a link; give {FORMS}")


def _port_and_baud(spec: str) -> tuple[str, int]:
    # Names under /dev/serial/by-path hold colons themselves.
    port, _, baud = spec.rpartition(":")
    return (port, int(baud)) if port and baud.isdecimal() else (spec, DEFAULT_BAUD)


def _host_and_port(spec: str, tail: str) -> tuple[str, int]:
    host, _, port = tail.rpartition(":")
    if not port.isdecimal() or not 0 <= int(port) <= 65535:
        raise LinkSpecError(f"'{spec}': '{port}' is not a port number from 0 to 65535; give {FORMS}")
    try:
        host.encode("idna")
    except UnicodeError:
        raise LinkSpecError(f"'{spec}': '{host}' can't be a host's name or address; mend it") from None
    return host or LOOPBACK, int(port)


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
        return LinkError(f"the host '{host}' is unknown ({error.strerror}); check the name", name)
    if error.errno == errno.EADDRNOTAVAIL:
        kind = name.partition(":")[0]
        other = {"udpin": "udpout", "tcpin": "tcp"}[kind]
        return LinkError(
            f"this computer has no address {host}; it has {', '.join(own_addresses())}: give one of these "
            f"(0.0.0.0 for all), or {other}:{host}:{port} where {host} is the other side",
            name,
        )
    if error.errno == errno.EACCES and port < FIRST_FREE_PORT:
        return LinkError(f"port {port} is kept for the system; give one from {FIRST_FREE_PORT} on", name)
    return LinkError(
        f"can't listen there ({error.strerror}); another program does: where that is a recording, give as "
        "--link the hub that it names at its start; else stop it, or give another port",
        name,
    )


def is_loopback(host: str) -> bool:
    """Whether only this computer reaches the address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def whence(host: str) -> str:
    """The networks that reach an address of this computer."""
    if is_loopback(host):
        return "this computer alone"
    return "every network of this computer" if host in EVERY_ADDRESS else f"the network of {host}"


def listening(protocol: str, host: str, port: int, purpose: str) -> str:
    """Sentence about a socket that accepts anyone who reaches it."""
    number = f"port {port}" if port else "a free port"
    return f"open: {host} {number} ({protocol}): {purpose}, reachable from {whence(host)}"


def of_link(spec: str, purpose: str) -> list[str]:
    """Sentence about the socket of a link; none for a serial port."""
    try:
        kind, host, port = parse_link(spec)
    except LinkSpecError:
        return []
    if kind == "serial":
        return []
    protocol = PROTOCOL[kind]
    if kind in ("udpin", "tcpin"):
        return [listening(protocol, host, port, purpose)]
    return [f"open: a port of its own ({protocol}): {purpose}, with {host} port {port} and nobody else"]


def of_links(specs: Iterable[str], purpose: str) -> list[str]:
    """The sentences about the sockets of several links."""
    return [sentence for spec in specs for sentence in of_link(spec, purpose)]


def of_served(hub: str) -> str:
    """Sentence about the socket on which a recording serves the link `hub` to others. Raises LinkSpecError."""
    _, host, port = parse_link(hub)
    return listening("TCP", host, port, "what is recorded, for params, doctor, ff and others")


NAMED_LOOPBACK: Final = {"localhost": "127.0.0.1"}
LISTENING: Final = ("udpin", "tcpin")


def among(spec: str, others: Iterable[str]) -> bool:
    """Whether `others` contains the link named by `spec`, under any spelling."""
    return any(same_link(spec, candidate) for candidate in others)


def same_link(spec: str, other: str) -> bool:
    """Whether two names mean the same port of this computer, or the same peer.

    A listening port 0 equals no other: the system still has to choose it.
    """
    first, second = _place(spec), _place(other)
    if first is None or second is None:
        return False
    kind, host, port = first
    if kind in LISTENING and (kind, port) == (second[0], second[2]):
        return port != 0 and (host == second[1] or EVERY_ADDRESS[0] in (host, second[1]))
    return first == second


def _place(spec: str) -> tuple[str, str, int] | None:
    """Kind, host and port that a name means; None if it is no link.

    A serial port is the same at any baud rate and by any of its names.
    """
    try:
        kind, place, number = parse_link(spec)
    except LinkSpecError:
        return None
    if kind == "serial":
        return kind, os.path.realpath(place), 0
    return kind, NAMED_LOOPBACK.get(place, place), number
