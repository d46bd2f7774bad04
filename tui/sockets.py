"""The network sockets of this process, in a sentence each: address, purpose, reachable from which networks."""

from collections.abc import Iterable

from bridge.errors import LinkSpecError
from bridge.link.open import parse_link

PROTOCOL = {"udpin": "UDP", "tcpin": "TCP", "udpout": "UDP", "tcp": "TCP"}
EVERY_ADDRESS = ("0.0.0.0", "::")


def whence(host: str) -> str:
    """The networks that reach an address of this computer."""
    from tui.web.visitors import is_loopback

    if is_loopback(host):
        return "this computer alone"
    return "every network of this computer" if host in EVERY_ADDRESS else f"the network of {host}"


def listening(protocol: str, host: str, port: int, what: str) -> str:
    """Sentence about a socket that accepts anyone who reaches it."""
    number = f"port {port}" if port else "a free port"
    return f"open: {host} {number} ({protocol}): {what}, reachable from {whence(host)}"


def of_link(spec: str, what: str) -> list[str]:
    """Sentence about the socket of a link; none for a serial port."""
    try:
        kind, host, port = parse_link(spec)
    except LinkSpecError:
        return []
    if kind == "serial":
        return []
    protocol = PROTOCOL[kind]
    if kind in ("udpin", "tcpin"):
        return [listening(protocol, host, port, what)]
    return [f"open: a port of its own ({protocol}): {what}, with {host} port {port} and nobody else"]


def of_links(specs: Iterable[str], what: str) -> list[str]:
    """The sentences about the sockets of several links."""
    return [sentence for spec in specs for sentence in of_link(spec, what)]


def of_served(hub: str) -> str:
    """Sentence about the socket on which a recording serves the link `hub` to others. Raises LinkSpecError."""
    _, host, port = parse_link(hub)
    return listening("TCP", host, port, "what is recorded, for params, doctor, ff and others")
