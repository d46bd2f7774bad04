"""Opens links by the names that people give them."""

from collections.abc import Callable

from bridge.errors import LinkSpecError
from bridge.link.base import Link
from bridge.link.serial import DEFAULT_BAUD, open_serial
from bridge.link.tcp import open_tcp, open_tcpin
from bridge.link.udp import open_udpin, open_udpout

LOOPBACK = "127.0.0.1"
FORMS = "serial:/dev/ttyUSB0:115200, udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or tcpin:HOST:PORT"

_NETWORK: dict[str, Callable[[str, int], Link]] = {
    "udpin": open_udpin,
    "udpout": open_udpout,
    "tcp": open_tcp,
    "tcpin": open_tcpin,
}


def open_link(spec: str) -> Link:
    """Open the link that `spec` names. If a network host is left out, it is this computer only.

    Raises LinkSpecError if `spec` can't be parsed, LinkError if the link can't be opened.
    """
    kind, place, number = parse_link(spec)
    return open_serial(place, number) if kind == "serial" else _NETWORK[kind](place, number)


def parse_link(spec: str) -> tuple[str, str, int]:
    """Return kind, serial port or host, and baud rate or port number of a link's name. Raises LinkSpecError."""
    kind, _, address = spec.partition(":")
    if kind == "serial" and address:
        return kind, *_port_and_baud(address)
    if kind in _NETWORK and address:
        return kind, *_host_and_port(spec, address)
    raise LinkSpecError(f"'{spec}' is not a link; give {FORMS}")


def _port_and_baud(rest: str) -> tuple[str, int]:
    # Names under /dev/serial/by-path hold colons themselves.
    port, _, baud = rest.rpartition(":")
    return (port, int(baud)) if port and baud.isdecimal() else (rest, DEFAULT_BAUD)


def _host_and_port(spec: str, rest: str) -> tuple[str, int]:
    host, _, port = rest.rpartition(":")
    if not port.isdecimal() or not 0 <= int(port) <= 65535:
        raise LinkSpecError(f"'{spec}': '{port}' is not a port number from 0 to 65535; give {FORMS}")
    return host or LOOPBACK, int(port)
