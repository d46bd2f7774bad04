"""Find the way to a link: through the hub of a running recording that holds it, or directly if nobody does."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Final

import bridge.links.open
from bridge import clock as clocks
from bridge.clock import Clock
from bridge.errors import LinkError, LinkLost
from bridge.exit_codes import UsageError
from bridge.links.addresses import among, of_link
from bridge.links.link import Link
from bridge.links.reconnecting import Aside, Reconnecting, ignore_loss
from bridge.text import typed
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.peers import KnownVehicle
from gcs_plugin.recording import state
from gcs_plugin.recording.hub import PLACES, farewell
from gcs_plugin.recording.state import FRESH_S, Holding, hangs, how_to_end
from tui import show

SILENT_S: Final = 3.0
"""Patience with a recording that has not passed anything on yet; a search for a vehicle gives up after 5 s."""
LOOK_AGAIN_S: Final = 1.0


class ByWay(Link):
    """A link to a recording's hub, named after the recorded links: the hub's port says nothing to the user.

    A recording that hangs, and one that has no place left, is reported as such.
    """

    def __init__(self, hub: Link, links: Iterable[str]) -> None:
        self._hub, self._clock = hub, clocks.SystemClock()
        self._last = b""
        self._silent_s, self._look_s = SILENT_S, self._clock.boot_s() + SILENT_S
        self.name = ", ".join(links)
        self._ended = (
            f"the recording of {self.name} has ended, or let go of this program, which took in too slowly or sent too "
            "much; ask again, or begin another"
        )

    def read(self, timeout_s: float) -> bytes:
        try:
            data = self._hub.read(timeout_s)
        except LinkLost:
            raise LinkLost(self._ended) from None
        self._watch(bool(data))
        self._last = (self._last + data)[-len(farewell()) :]
        if self._last == farewell():
            raise LinkLost(
                f"{PLACES} programs are connected to the recording of {self.name} already; end one of them, "
                "and ask again"
            )
        return data

    def write(self, data: bytes) -> None:
        try:
            self._hub.write(data)
        except LinkLost:
            # The reason for dropping this program may still wait to be read.
            while self.read(0.0):
                pass
            raise LinkLost(self._ended) from None

    def close(self) -> None:
        self._hub.close()

    def _watch(self, came: bool) -> None:
        """Raise LinkLost if nothing comes because the recording hangs."""
        now_s = self._clock.boot_s()
        if came:
            self._silent_s, self._look_s = FRESH_S, now_s + FRESH_S
        elif now_s >= self._look_s:
            self._look_s = now_s + LOOK_AGAIN_S
            holding = state.hung(self._clock.unix_s(), self._silent_s)
            if holding is not None and holding.hub == self._hub.name:
                raise LinkLost(hangs(holding) if self._silent_s == FRESH_S else _may_hang(holding))


def _may_hang(holding: Holding) -> str:
    return (
        f"{words_of(holding)} tells nothing and passes nothing on, so that it may hang: ask again in "
        f"{FRESH_S:.0f} s, or {how_to_end(holding.pid)}"
    )


def holding_now() -> Holding | None:
    return state.held(_now())


def recordings_now() -> list[Holding]:
    """All running recordings, first the default one that other programs go through."""
    first = holding_now()
    return [*([first] if first is not None else []), *state.held_second(_now())]


def recorded_by(holding: Holding | None) -> list[Path]:
    """The recordings of the dive that a recording holds so far; none without one."""
    return [] if holding is None else DiveFolder(Path(holding.folder)).heard()


def holder_of(spec: str) -> Holding | None:
    """The running recording that holds this link."""
    return next((holding for holding in recordings_now() if holds(holding, spec)), None)


def holding_of(spec: str | None) -> Holding | None:
    """The running recording that holds this link; if none is named, the one that other programs go through."""
    return holding_now() if spec is None else holder_of(spec)


def _is_first(holding: Holding) -> bool:
    """Whether it is the recording that other programs go through if they name no link."""
    first = holding_now()
    return first is not None and first.pid == holding.pid


def usable_now() -> Holding | None:
    """The running recording, if any, for a program that needs it. Raises LinkError if a recording hangs."""
    holding = holding_now()
    if holding is None and (stuck := _hung_now()) is not None:
        raise LinkError(hangs(stuck))
    return holding


def _hung_now() -> Holding | None:
    return state.hung(_now())


def _now() -> float:
    return clocks.SystemClock().unix_s()


def link_for(spec: str | None, open_by_name: Callable[[str], Link] | None = None) -> Link:
    """The link to the vehicle: through the running recording if `spec` is None, or if a recording holds that link.

    Any other link is opened by `open_by_name`, None for `open_link`. A link through a recording is not signed here: the
    recording signs. Raises UsageError if nothing is named and nothing runs, LinkError if the link can't be opened,
    for example because a recording that hangs holds it.
    """
    holding = usable_now() if spec is None else holder_of(spec)
    if holding is None and spec is None:
        raise UsageError(
            "no link is named and no recording runs; give --link SPEC, or start `seatrial record`"
        )
    if holding is None:
        return _opened(str(spec), open_by_name or bridge.links.open.open_link)
    if not holding.hub:
        prefix = f"{spec}: " if spec else ""
        raise LinkError(f"{prefix}{words_of(holding)} holds the link and serves nobody; end it first")
    hub = bridge.links.open.open_link(holding.hub)
    show.say(show.words(), f"by way of {words_of(holding)}")
    show.say(show.words(), *of_link(holding.hub, "what it serves"))
    return ByWay(hub, holding.links)


def _opened(spec: str, open_by_name: Callable[[str], Link]) -> Link:
    """Open the link of that name. It may open although a recording that hangs holds it, for example to a far port."""
    try:
        return open_by_name(spec)
    except LinkError:
        stuck = _hung_now()
        if stuck is None or not holds(stuck, spec):
            raise
        raise LinkError(f"{spec}: {hangs(stuck)}") from None


def coming_back(
    link: Link,
    spec: str | None,
    clock: Clock,
    open_by_name: Callable[[str], Link] | None = None,
    lost: Callable[[str], None] = ignore_loss,
) -> Reconnecting:
    """`link`, as `link_for(spec, open_by_name)` returned it, replaced under the same name whenever it is lost.

    `lost` gets the reason for each loss, each sentence once. A link through a recording comes back only through a
    recording: a program that took the vehicle's port meanwhile would keep the next recording from it.
    """
    holding = None if spec is None else holder_of(spec)
    second = spec if holding is not None and not _is_first(holding) else None

    def again() -> Link:
        if second is not None:  # the first recording may be of another vehicle
            return of_recording(holder_of(second))
        if spec is not None and holding is None:
            return (open_by_name or bridge.links.open.open_link)(spec)
        return of_recording(usable_now())

    later = Aside(again, link.name)
    first = [link]
    return Reconnecting(lambda: first.pop() if first else later(), clock, link.name, lost)


def of_recording(holding: Holding | None) -> ByWay:
    """The link that a recording serves. Raises LinkError if there is no recording, or it serves nobody."""
    if holding is None or not holding.hub:
        raise LinkError("no recording runs that could be listened to; start `seatrial record`")
    return ByWay(bridge.links.open.open_link(holding.hub), holding.links)


def known_now(clock: Clock, spec: str | None = None) -> tuple[KnownVehicle, ...]:
    """Vehicles that the running recording has heard, timed by `clock`: those that an OFF sent through it is for.
    Empty for any other link."""
    now_unix_s, boot_s = clock.unix_s(), clock.boot_s()
    first = state.held(now_unix_s)
    running = [*([first] if first is not None else []), *state.held_second(now_unix_s)]
    holding = first if spec is None else next((each for each in running if holds(each, spec)), None)
    if holding is None:
        return ()
    written_s = boot_s - holding.age_s(now_unix_s)
    heard = (
        KnownVehicle(
            (vehicle.system, vehicle.component),
            vehicle.holds,
            written_s - max(0.0, holding.written_unix_s - vehicle.heard_unix_s),
            vehicle.behind,
        )
        for vehicle in holding.vehicles
    )
    return tuple(vehicle for vehicle in heard if vehicle.is_known(boot_s))


def refuse_second(specs: Iterable[str]) -> None:
    """Raise LinkError if a recording that runs or hangs holds one of these links."""
    stuck = _hung_now()
    for spec in specs:
        if stuck is not None and holds(stuck, spec):
            raise LinkError(f"{spec}: {hangs(stuck)}")
        if (holding := holder_of(spec)) is not None:
            by_name = "" if _is_first(holding) else f" with {typed('--link', spec)}"
            raise LinkError(
                f"{spec}: {words_of(holding)} holds it; end that one first, or leave it to it: "
                f"params, doctor, ff and note go by way of it{by_name}"
            )


def words_of(holding: Holding) -> str:
    """Describe a recording so that a person can find it."""
    return f"the recording of process {holding.pid} into {holding.folder}"


def holds(holding: Holding, spec: str) -> bool:
    """Whether a recording holds the link of that name, in any spelling."""
    return among(spec, holding.links)
