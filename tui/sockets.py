"""What this process has open on networks, in a sentence each: address, for what, reachable from where."""

from collections.abc import Iterable

from bridge.errors import LinkSpecError
from bridge.link.open import parse_link

PROTOCOL = {"udpin": "UDP", "tcpin": "TCP", "udpout": "UDP", "tcp": "TCP"}
EVERY_ADDRESS = ("0.0.0.0", "::")


def whence(host: str) -> str:
    """From where an address of this computer can be reached."""
    from tui.web.visitors import is_loopback

    if is_loopback(host):
        return "this computer alone"
    return "every network of this computer" if host in EVERY_ADDRESS else f"the network of {host}"


def listening(protocol: str, host: str, port: int, what: str) -> str:
    """A socket that hears whoever reaches it."""
    number = f"port {port}" if port else "a free port"
    return f"open: {host} {number} ({protocol}): {what}, reachable from {whence(host)}"


def of_link(spec: str, what: str) -> list[str]:
    """The socket of a link by its name; none for a serial port."""
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
    """The sockets of several links."""
    return [sentence for spec in specs for sentence in of_link(spec, what)]


def of_served(hub: str) -> str:
    """The socket by which a recording serves others; `hub` is the link that they open. Raises LinkSpecError."""
    _, host, port = parse_link(hub)
    return listening("TCP", host, port, "what is recorded, for params, doctor, ff and others")
