"""Whether two names of links, as people give them, mean one."""

import os
from collections.abc import Iterable
from typing import Final

from bridge.errors import LinkSpecError
from bridge.link.open import parse_link

EVERYWHERE: Final = "0.0.0.0"
NAMED_LOOPBACK: Final = {"localhost": "127.0.0.1"}
LISTENING: Final = ("udpin", "tcpin")


def among(spec: str, others: Iterable[str]) -> bool:
    """Whether one of `others` is the link of that name, however it is spelt."""
    return any(same_link(spec, one) for one in others)


def same_link(one: str, other: str) -> bool:
    """Whether two names mean one port of this computer, or one peer; port 0 is still to be chosen, and nobody's."""
    mine, theirs = _place(one), _place(other)
    if mine is None or theirs is None:
        return False
    kind, host, port = mine
    if kind in LISTENING and (kind, port) == (theirs[0], theirs[2]):
        return port != 0 and (host == theirs[1] or EVERYWHERE in (host, theirs[1]))
    return mine == theirs


def _place(spec: str) -> tuple[str, str, int] | None:
    """What a name means; a serial port is one at any baud rate and by any of its names. None for what is no link."""
    try:
        kind, place, number = parse_link(spec)
    except LinkSpecError:
        return None
    if kind == "serial":
        return kind, os.path.realpath(place), 0
    return kind, NAMED_LOOPBACK.get(place, place), number
