"""Who holds a link: a recording that runs, whose hub then is the way to the vehicle, or nobody yet."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from bridge.clock import Clock
from bridge.errors import LinkError, LinkLost
from bridge.link.base import Link
from bridge.link.reconnecting import Aside, Reconnecting
from gcs_plugin.holder import Holding, held
from gcs_plugin.link_names import among
from tui.exit_codes import UsageError


class ByWay:
    """A link to the hub of a recording, called by the links that it records: the hub's port says nobody anything."""

    def __init__(self, hub: Link, links: Iterable[str]) -> None:
        self._hub = hub
        self.name = ", ".join(links)

    def read(self, timeout_s: float) -> bytes:
        with self._its_end():
            return self._hub.read(timeout_s)

    def write(self, data: bytes) -> None:
        with self._its_end():
            self._hub.write(data)

    def close(self) -> None:
        self._hub.close()

    @contextmanager
    def _its_end(self) -> Iterator[None]:
        """A hub is lost with its recording alone, and what to do is not to plug it in."""
        try:
            yield
        except LinkLost:
            raise LinkLost(f"the recording of {self.name} has ended; begin another, and ask again") from None


def holding_now() -> Holding | None:
    """The recording that runs, if one does."""
    from bridge.clock import SystemClock

    return held(SystemClock().unix_s())


def serving_now() -> bool:
    """Whether a recording runs by which a vehicle can be reached."""
    holding = holding_now()
    return holding is not None and bool(holding.hub)


def link_for(spec: str | None, open_one: Callable[[str], Link] | None = None) -> Link:
    """The link to the vehicle: by way of the recording that runs where `spec` is None, or one of its links.

    `open_one` opens one of its own, None as it is; one by way of a recording is not signed here: the recording signs.
    Raises UsageError where nothing is named and nothing runs, LinkError where the link can't be had.
    """
    from bridge.link.open import open_link
    from tui import show
    from tui.sockets import of_link

    holding = holding_now()
    if holding is None and spec is None:
        raise UsageError(
            "no link is named and no recording runs; give --link SPEC, or start `seatrial record`"
        )
    if holding is None or (spec is not None and not holds(holding, spec)):
        return (open_one or open_link)(str(spec))
    if not holding.hub:
        what = f"{spec}: " if spec else ""
        raise LinkError(f"{what}{words_of(holding)} holds the link and serves nobody; end it first")
    hub = open_link(holding.hub)
    show.say(show.words(), f"by way of {words_of(holding)}")
    for sentence in of_link(holding.hub, "what it serves"):
        show.say(show.words(), sentence)
    return ByWay(hub, holding.links)


def coming_back(
    link: Link, spec: str | None, clock: Clock, open_one: Callable[[str], Link] | None = None
) -> Reconnecting:
    """`link`, which `link_for(spec, open_one)` gave; where it is lost, what then takes its place, under its name.

    One by way of a recording comes back by way of a recording alone: whoever took the vehicle's port meanwhile would
    keep the next recording from it.
    """
    from bridge.link.open import open_link

    holding = holding_now()
    by_way = spec is None or (holding is not None and holds(holding, spec))
    later = Aside(_of_recording if by_way else lambda: (open_one or open_link)(str(spec)), link.name)
    first = [link]
    return Reconnecting(lambda: first.pop() if first else later(), clock, link.name)


def _of_recording() -> Link:
    """The link that the recording that runs serves. Raises LinkError where none does."""
    from bridge.link.open import open_link

    holding = holding_now()
    if holding is None or not holding.hub:
        raise LinkError("no recording runs that could be listened to; start `seatrial record`")
    return ByWay(open_link(holding.hub), holding.links)


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
    return among(spec, holding.links)
