"""Opens links by the names that people give them."""

from collections.abc import Callable

from bridge.errors import LinkError
from bridge.links.addresses import parse_link
from bridge.links.descriptor import open_serial, open_tcp, open_tcpin
from bridge.links.link import Link
from bridge.links.udp import open_udpin, open_udpout

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
    try:
        return open_serial(place, number) if kind == "serial" else _NETWORK[kind](place, number)
    except OSError as error:
        reason = f"can't be opened ({error.strerror}); end other programs on this computer, and try again"
        raise LinkError(reason, spec) from None
