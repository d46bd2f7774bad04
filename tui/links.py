"""Who holds a link: a recording that runs, whose hub then is the way to the vehicle, or nobody yet."""

import os
from collections.abc import Iterable

from bridge.errors import LinkError, LinkSpecError
from bridge.link.base import Link
from gcs_plugin.holder import Holding, held
from tui.exit_codes import UsageError

EVERYWHERE = "0.0.0.0"
NAMED_LOOPBACK = {"localhost": "127.0.0.1"}
LISTENING = ("udpin", "tcpin")


def holding_now() -> Holding | None:
    """The recording that runs, if one does."""
    from bridge.clock import SystemClock

    return held(SystemClock().unix_s())


def serving_now() -> bool:
    """Whether a recording runs by which a vehicle can be reached."""
    holding = holding_now()
    return holding is not None and bool(holding.hub)


def link_for(spec: str | None) -> Link:
    """The link to the vehicle: by way of the recording that runs where `spec` is None, or one of its links.

    Raises UsageError where nothing is named and nothing runs, LinkError where the link can't be had.
    """
    from bridge.link.open import open_link
    from tui import show

    holding = holding_now()
    if holding is None and spec is None:
        raise UsageError(
            "no link is named and no recording runs; give --link SPEC, or start `seatrial record`"
        )
    if holding is None or (spec is not None and not holds(holding, spec)):
        return open_link(str(spec))
    if not holding.hub:
        what = f"{spec}: " if spec else ""
        raise LinkError(f"{what}{words_of(holding)} holds the link and serves nobody; end it first")
    show.say(show.words(), f"by way of {words_of(holding)}")
    return open_link(holding.hub)


def refuse_second(specs: Iterable[str]) -> None:
    """Raise LinkError where a recording that runs holds one of these links."""
    holding = holding_now()
    for spec in specs:
        if holding is not None and holds(holding, spec):
            raise LinkError(
                f"{spec}: {words_of(holding)} holds it; end that one first, or leave it to it: "
                "params, doctor, ff and note go by way of it"
            )


def words_of(holding: Holding) -> str:
    """A recording as a person finds it."""
    return f"the recording of process {holding.pid} into {holding.folder}"


def holds(holding: Holding, spec: str) -> bool:
    """Whether a recording holds the link of that name, however it is spelt."""
    return any(same_link(spec, one) for one in holding.links)


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
    from bridge.link.open import parse_link

    try:
        kind, place, number = parse_link(spec)
    except LinkSpecError:
        return None
    if kind == "serial":
        return kind, os.path.realpath(place), 0
    return kind, NAMED_LOOPBACK.get(place, place), number
