"""Comparison of link names as users give them: whether two names mean the same link."""

import os
from collections.abc import Iterable
from typing import Final

from bridge.errors import LinkSpecError
from bridge.link.open import parse_link

EVERYWHERE: Final = "0.0.0.0"
NAMED_LOOPBACK: Final = {"localhost": "127.0.0.1"}
LISTENING: Final = ("udpin", "tcpin")


def among(spec: str, others: Iterable[str]) -> bool:
    """Whether `others` contains the link named by `spec`, under any spelling."""
    return any(same_link(spec, candidate) for candidate in others)


def same_link(one: str, other: str) -> bool:
    """Whether two names mean the same port of this computer, or the same peer.

    A listening port 0 equals no other: the system still has to choose it.
    """
    first, second = _place(one), _place(other)
    if first is None or second is None:
        return False
    kind, host, port = first
    if kind in LISTENING and (kind, port) == (second[0], second[2]):
        return port != 0 and (host == second[1] or EVERYWHERE in (host, second[1]))
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
