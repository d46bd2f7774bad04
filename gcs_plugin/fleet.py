"""The choice of the vehicle that orders go to, among all that are heard on the links of the ground station.

Pure: takes frames with their arrival times, returns the vehicle to send orders to. If the choice is not clear, an error
is raised and nothing may be sent.
"""

from typing import Final

from bridge.errors import LinkError, LinkTimeout
from bridge.wire.framing import Frame
from gcs_plugin.params.session import News, news_of
from gcs_plugin.peers import COMPANIONS_MAY_FOLLOW_S, Peers, Reception, Source

SILENT_S: Final = 6.0
"""A vehicle without a HEARTBEAT for longer counts as absent: a false alarm once in a thousand, at 30 % loss of 1 Hz."""


class Fleet:
    """All `peers` heard on any link. `chosen` is the system that orders go to, None for the only vehicle."""

    def __init__(self) -> None:
        self.chosen: int | None = None
        self.peers = Peers()

    def on_frame(self, frame: Frame, link: str, time_s: float) -> News | None:
        """A frame arrived on the link of that name; return its message if the parameter code uses it, else None."""
        return news_of(frame, self.peers.on_frame(frame, link, time_s))

    def choose(self, system: int | None, now_s: float) -> Source | None:
        """Choose a system, or with None whichever vehicle is alone, and return its component as `meant` does.

        Raises LinkError for a system that sends no HEARTBEAT, and the errors of `meant`; the choice then stays.
        """
        if system is not None and system not in self.systems(now_s):
            there = ", ".join(map(str, self.systems(now_s))) or "none"
            raise LinkError(f"no vehicle beats as system {system}; these do: {there}")
        before, self.chosen = self.chosen, system
        try:
            return None if system is None else self.meant(now_s)
        except LinkError:
            self.chosen = before
            raise

    def systems(self, now_s: float) -> tuple[int, ...]:
        """Systems of the vehicles that send HEARTBEATs."""
        return tuple(sorted({peer.source[0] for peer in self.peers.vehicles(now_s, SILENT_S)}))

    def meant(self, now_s: float) -> Source:
        """The component with the parameters of the chosen vehicle: a companion before an autopilot.

        Raises LinkTimeout if no vehicle, or not the chosen vehicle, sends HEARTBEATs, or if it was first heard so
        recently that a companion may still follow; LinkError if several vehicles send HEARTBEATs and none is chosen, or
        if two vehicles share its address.
        """
        peers = self.peers.vehicles(now_s, SILENT_S)
        if self.chosen is not None:
            peers = [peer for peer in peers if peer.source[0] == self.chosen]
            if not peers:
                raise LinkTimeout(
                    f"vehicle {self.chosen} has not beaten for {SILENT_S:.0f} s; check its link, "
                    "or choose another: seatrial vehicle N"
                )
        if not peers:
            raise LinkTimeout("no vehicle beats on any link; check cable, address, and that the bridge runs")
        holder = self.peers.only_vehicle([peer.source for peer in peers], "choose one: seatrial vehicle N")
        of_system = (peer for peer in self.peers.vehicles(now_s) if peer.source[0] == holder[0])
        if now_s - min(peer.vehicle_s for peer in of_system) < COMPANIONS_MAY_FOLLOW_S:
            raise LinkTimeout(f"vehicle {holder[0]} was heard only just now; try again in two seconds")
        return holder

    def link_of(self, source: Source) -> str:
        """Name of the link of its last frame, of any of its system's if it was never heard itself; "" for none."""
        peer = self.peers.get(source)
        others = (other for other in self.peers if other.source[0] == source[0])
        peer = peer or max(others, key=lambda other: other.heard_s, default=None)
        return "" if peer is None else peer.link

    def sources(self, now_s: float) -> list[tuple[str, Reception]]:
        """Every component on every link that it was heard on, by system, component and link."""
        names = {name for peer in self.peers for name in peer.links}
        heard = [(name, reception) for name in names for reception in self.peers.receptions(name, now_s)]
        return sorted(heard, key=lambda entry: (entry[1].system, entry[1].component, entry[0]))
