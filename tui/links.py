"""Who holds a link: a recording that runs, whose hub then is the way to the vehicle, or nobody yet."""

import time
from collections.abc import Callable, Iterable
from typing import Final

from bridge.clock import Clock
from bridge.errors import LinkError, LinkLost
from bridge.link.base import Link
from bridge.link.reconnecting import Aside, Reconnecting, unheard
from gcs_plugin.holder import FRESH_S, Holding, hangs, held, held_beside, how_to_end, hung
from gcs_plugin.known_vehicles import KnownVehicle, still_known
from gcs_plugin.link_names import among
from tui.exit_codes import UsageError

LOOK_EVERY_S: Final = 0.1
LOOKS: Final = 25
"""A recording tells of itself once a second, so that one that goes on has told anew by then."""
SILENT_S: Final = 3.0
"""Of a recording that has passed nothing on yet, either; who looks for a vehicle gives up after 5 s."""
LOOK_AGAIN_S: Final = 1.0


class ByWay:
    """A link to the hub of a recording, called by the links that it records: the hub's port says nobody anything.

    Its loss is told as what it is: the recording has ended, hangs, or has let this program go. `wait` lets time pass.
    """

    def __init__(self, hub: Link, links: Iterable[str], wait: Callable[[float], None] = time.sleep) -> None:
        from bridge.clock import SystemClock

        self._hub, self._wait, self._clock = hub, wait, SystemClock()
        self._last = b""
        self._silent_s, self._look_s = SILENT_S, self._clock.boot_s() + SILENT_S
        self.name = ", ".join(links)

    def read(self, timeout_s: float) -> bytes:
        from gcs_plugin.guests import PLACES, farewell

        try:
            data = self._hub.read(timeout_s)
        except LinkLost:
            raise self._its_end() from None
        self._watch(bool(data))
        self._last = (self._last + data)[-len(farewell()) :]
        if self._last == farewell():
            raise LinkLost(
                f"{PLACES} programs are connected to the recording of {self.name} already; end one of them, "
                "and ask again (to listen and to force the feed-forward off goes all the same)"
            )
        return data

    def write(self, data: bytes) -> None:
        try:
            self._hub.write(data)
        except LinkLost:
            # Why it was let go may still wait to be read.
            while self.read(0.0):
                pass
            raise self._its_end() from None

    def close(self) -> None:
        self._hub.close()

    def _watch(self, came: bool) -> None:
        """Raise LinkLost where nothing comes since the recording hangs."""
        now_s = self._clock.boot_s()
        if came:
            self._silent_s, self._look_s = FRESH_S, now_s + FRESH_S
        elif now_s >= self._look_s:
            self._look_s = now_s + LOOK_AGAIN_S
            holding = hung(self._clock.unix_s(), self._silent_s)
            if holding is not None and holding.hub == self._hub.name:
                raise LinkLost(hangs(holding) if self._silent_s == FRESH_S else _may_hang(holding))

    def _its_end(self) -> LinkLost:
        """Why the connection ended: one that was killed is there for a moment yet, so that it must tell anew."""
        before = _serving(self._hub.name)
        for _ in range(LOOKS):
            now = _serving(self._hub.name)
            if before is None or now is None or now.pid != before.pid:
                break
            if now.written_unix_s != before.written_unix_s:
                return LinkLost(
                    f"the recording of {self.name} goes on, but let this program go, which took in too slowly or sent "
                    "too much; ask again"
                )
            self._wait(LOOK_EVERY_S)
        return LinkLost(f"the recording of {self.name} has ended; begin another, and ask again")


def _may_hang(holding: Holding) -> str:
    return (
        f"{words_of(holding)} tells nothing and passes nothing on, so that it may hang: ask again in "
        f"{FRESH_S:.0f} s, or {how_to_end(holding.pid)}"
    )


def holding_now() -> Holding | None:
    """The recording that runs, if one does."""
    from bridge.clock import SystemClock

    return held(SystemClock().unix_s())


def recordings_now() -> list[Holding]:
    """All recordings that run, first the one by which others go."""
    from bridge.clock import SystemClock

    first = holding_now()
    return [*([first] if first is not None else []), *held_beside(SystemClock().unix_s())]


def holder_of(spec: str) -> Holding | None:
    """The recording that runs and holds this link."""
    return next((one for one in recordings_now() if holds(one, spec)), None)


def _is_first(holding: Holding) -> bool:
    """Whether it is the one by which others go that name no link."""
    first = holding_now()
    return first is not None and first.pid == holding.pid


def _serving(hub: str) -> Holding | None:
    """The recording that runs and serves there."""
    return next((one for one in recordings_now() if one.hub == hub), None)


def usable_now() -> Holding | None:
    """The recording that runs, if one does, for who needs it. Raises LinkError where one hangs."""
    holding = holding_now()
    if holding is None and (stuck := _hung_now()) is not None:
        raise LinkError(hangs(stuck))
    return holding


def _hung_now() -> Holding | None:
    from bridge.clock import SystemClock

    return hung(SystemClock().unix_s())


def serving_now() -> bool:
    """Whether a recording runs by which a vehicle can be reached. Raises LinkError where one hangs."""
    holding = usable_now()
    return holding is not None and bool(holding.hub)


def link_for(spec: str | None, open_one: Callable[[str], Link] | None = None) -> Link:
    """The link to the vehicle: by way of the recording that runs where `spec` is None, or one of its links.

    `open_one` opens one of its own, None as it is; one by way of a recording is not signed here: the recording signs.
    Raises UsageError where nothing is named and nothing runs, LinkError where the link can't be had, also since a
    recording that hangs keeps it.
    """
    from bridge.link.open import open_link
    from tui import show
    from tui.sockets import of_link

    holding = usable_now() if spec is None else holder_of(spec)
    if holding is None and spec is None:
        raise UsageError(
            "no link is named and no recording runs; give --link SPEC, or start `seatrial record`"
        )
    if holding is None:
        return _opened(str(spec), open_one or open_link)
    if not holding.hub:
        what = f"{spec}: " if spec else ""
        raise LinkError(f"{what}{words_of(holding)} holds the link and serves nobody; end it first")
    hub = open_link(holding.hub)
    show.say(show.words(), f"by way of {words_of(holding)}")
    for sentence in of_link(holding.hub, "what it serves"):
        show.say(show.words(), sentence)
    return ByWay(hub, holding.links)


def _opened(spec: str, open_one: Callable[[str], Link]) -> Link:
    """The link of that name. What a recording that hangs keeps may open all the same: one to a far port, say."""
    try:
        return open_one(spec)
    except LinkError:
        stuck = _hung_now()
        if stuck is None or not holds(stuck, spec):
            raise
        raise LinkError(f"{spec}: {hangs(stuck)}") from None


def coming_back(
    link: Link,
    spec: str | None,
    clock: Clock,
    open_one: Callable[[str], Link] | None = None,
    lost: Callable[[str], None] = unheard,
) -> Reconnecting:
    """`link`, which `link_for(spec, open_one)` gave; where it is lost, what then takes its place, under its name.

    `lost` hears why it was lost, each sentence once. One by way of a recording comes back by way of a recording alone:
    whoever took the vehicle's port meanwhile would keep the next recording from it.
    """
    from bridge.link.open import open_link

    holding = None if spec is None else holder_of(spec)
    second = spec if holding is not None and not _is_first(holding) else None

    def again() -> Link:
        if second is not None:  # the first may be of another vehicle
            return _of_recording(holder_of(second))
        if spec is not None and holding is None:
            return (open_one or open_link)(spec)
        return _of_recording(usable_now())

    later = Aside(again, link.name)
    first = [link]
    return Reconnecting(lambda: first.pop() if first else later(), clock, link.name, lost)


def _of_recording(holding: Holding | None) -> Link:
    """The link that a recording serves. Raises LinkError where there is none, or it serves nobody."""
    from bridge.link.open import open_link

    if holding is None or not holding.hub:
        raise LinkError("no recording runs that could be listened to; start `seatrial record`")
    return ByWay(open_link(holding.hub), holding.links)


def known_now(clock: Clock, spec: str | None = None) -> tuple[KnownVehicle, ...]:
    """Whom the recording that runs has heard, by `clock`: whom an OFF by way of it is for; by any other link nobody."""
    now_unix_s = clock.unix_s()
    first = held(now_unix_s)
    running = [*([first] if first is not None else []), *held_beside(now_unix_s)]
    holding = first if spec is None else next((one for one in running if holds(one, spec)), None)
    if holding is None:
        return ()
    boot_s = clock.boot_s()
    heard = (
        KnownVehicle((one.system, one.component), one.holds, boot_s - max(0.0, now_unix_s - one.heard_unix_s))
        for one in holding.vehicles
    )
    return tuple(one for one in heard if still_known(one, boot_s))


def refuse_second(specs: Iterable[str]) -> None:
    """Raise LinkError where a recording that runs, or that hangs, holds one of these links."""
    stuck = _hung_now()
    for spec in specs:
        if stuck is not None and holds(stuck, spec):
            raise LinkError(f"{spec}: {hangs(stuck)}")
        if (holding := holder_of(spec)) is not None:
            by_name = "" if _is_first(holding) else f" with --link {spec}"
            raise LinkError(
                f"{spec}: {words_of(holding)} holds it; end that one first, or leave it to it: "
                f"params, doctor, ff and note go by way of it{by_name}"
            )


def words_of(holding: Holding) -> str:
    """A recording as a person finds it."""
    return f"the recording of process {holding.pid} into {holding.folder}"


def holds(holding: Holding, spec: str) -> bool:
    """Whether a recording holds the link of that name, however it is spelt."""
    return among(spec, holding.links)
