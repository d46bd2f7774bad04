"""The blocking driver of a parameter session, for a program that has a link to itself and can wait."""

import contextlib
from collections.abc import Callable
from threading import Event
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import LinkError, LinkLost, LinkTimeout
from bridge.links.link import Link
from bridge.wire.framing import Encoder, Framer
from gcs_plugin.params.receipt import Receipt
from gcs_plugin.params.session import News, Order, Progress, Session, Step, news_of
from gcs_plugin.params.transfer import Result
from gcs_plugin.peers import COMPANIONS_MAY_FOLLOW_S, GROUND_STATION, Peers, Source, ground_heartbeat

POLL_S: Final = 0.02
BEAT_S: Final = 1.0


class ParameterClient:
    """Reads and writes one vehicle's parameters over `link`.

    Every wait is a read of `link` with a timeout, so a link whose `read` steps a simulation keeps the simulation
    going. `progress` is called all along; `line` with the result of each parameter that changes, as soon as it is
    known. If two vehicles share the address, nothing is requested or written and LinkError is raised.
    """

    def __init__(
        self,
        link: Link,
        clock: Clock,
        progress: Callable[[Progress], None] = lambda _: None,
        line: Callable[[str, Result], None] = lambda *_: None,
    ) -> None:
        self._link, self._clock, self._progress, self._line = link, clock, progress, line
        self._framer, self._encoder = Framer(), Encoder(*GROUND_STATION)
        self._peers = Peers(link)
        self._session: Session | None = None

    def find_vehicle(self, timeout_s: float = 5.0, system: int | None = None) -> Source:
        """Find the component that holds the parameters: a companion before an autopilot.

        One that speaks is waited for until it beats: on a poor link its beats may be lost. Raises LinkTimeout if no
        HEARTBEAT arrives within `timeout_s`, LinkError if several systems send HEARTBEATs.
        """
        now_s = beat_s = self._clock.boot_s()
        end_s = now_s + timeout_s
        settled_s = float("inf")
        while now_s < end_s and (now_s < settled_s or self._peers.companion_follows(system)):
            if now_s >= beat_s:
                # A vehicle that listens on UDP learns the ground's address from this message.
                self._link.write(self._encoder.encode(ground_heartbeat()))
                beat_s = now_s + BEAT_S
            self._receive()
            now_s = self._clock.boot_s()
            if self._candidates(system) and settled_s == float("inf"):
                settled_s = self._clock.boot_s() + COMPANIONS_MAY_FOLLOW_S
        candidates = self._candidates(system)
        if not candidates:
            raise LinkTimeout(self._nobody(timeout_s, system))
        vehicle = self._peers.only_vehicle(candidates, "name one with --system")
        self._session = Session(self._peers, vehicle, self._clock)
        return vehicle

    @property
    def session(self) -> Session:
        """The session with the vehicle; calls `find_vehicle` first if no vehicle is known yet."""
        if self._session is None:
            self.find_vehicle()
        assert self._session is not None
        return self._session

    @property
    def vehicle(self) -> Source:
        """System and component of the vehicle."""
        return self.session.vehicle

    @property
    def autopilot(self) -> int:
        """MAV_AUTOPILOT of the component in use."""
        peer = self._peers.get(self.vehicle)
        return (
            dialect.MAV_AUTOPILOT_INVALID
            if peer is None or peer.heartbeat is None
            else peer.heartbeat.autopilot
        )

    @property
    def thrusters(self) -> Source:
        """The component that drives the vehicle's thrusters: its autopilot, otherwise the component in use."""
        autopilots = [
            peer.source
            for peer in self._peers
            if peer.source[0] == self.vehicle[0]
            and peer.heartbeat is not None
            and peer.heartbeat.is_autopilot
        ]
        return min(autopilots, default=self.vehicle)

    @property
    def armed(self) -> bool:
        """Whether any component of the vehicle reports that it is armed."""
        return self.session.armed

    def listen(self, stop: Event) -> None:
        """Read the link until `stop` is set, so that the vehicle's state stays current while a prompt is open."""
        with contextlib.suppress(LinkError):  # the next read raises it again
            while not stop.is_set():
                self._receive()

    def read_all(self) -> dict[str, float]:
        """Return all parameters. Raises LinkTimeout if none arrived, ParamUnverified if some are missing."""
        self.session.read()
        self._drive(self.session)
        return self.session.present

    def apply(self, order: Order) -> Receipt:
        """Carry out an order and return its receipt.

        Raises ParamRejected or ParamUnknown for a plan that can't be sent; ParamRejected while the vehicle is armed
        and if another program writes to the vehicle, or has written since `read_at`; LinkTimeout if the vehicle sends
        no HEARTBEAT any more. In each case nothing was written.
        """
        session = self.session
        session.write(order)
        try:
            self._drive(session)
        finally:
            session.close()
        assert session.receipt is not None
        return session.receipt

    def _drive(self, session: Session) -> None:
        """Do as the session says until it is idle or has ended; raise its failure."""
        reported: dict[str, Result] = {}
        while session.busy:
            try:
                for message in session.tick():
                    self._link.write(self._encoder.encode(message))
                if session.busy:
                    for news in self._receive():
                        if getattr(news.message, "target_system", 0) in (0, GROUND_STATION[0]):
                            session.on_news(news)
            except LinkLost as error:
                if session.step is not Step.WRITING:
                    raise
                session.give_up(str(error))
            self._progress(session.progress)
            for name, result in session.proven.items():
                if reported.get(name) != result:
                    reported[name] = result
                    self._line(name, result)
        if session.failure is not None:
            raise session.failure

    def _receive(self) -> list[News]:
        frames = self._framer.feed(self._link.read(POLL_S))
        now_s = self._clock.boot_s()
        heard = (news_of(frame, self._peers.on_frame(frame, self._link.name, now_s)) for frame in frames)
        return [news for news in heard if news is not None]

    def _candidates(self, system: int | None) -> list[Source]:
        vehicles = self._peers.vehicles(self._clock.boot_s())
        return [peer.source for peer in vehicles if system in (None, peer.source[0])]

    def _nobody(self, timeout_s: float, system: int | None) -> str:
        wanted = "" if system is None else f" of system {system}"
        beating = sorted(peer.source for peer in self._peers if peer.heartbeat is not None)
        others = ", ".join(f"{s}/{c}" for s, c in beating) or "nobody at all"
        to_do = (
            "give --system one that is heard, or switch that vehicle on"
            if self._candidates(None)
            else "check the cable, the address and that the bridge runs"
        )
        return f"{self._link.name}: no vehicle's HEARTBEAT{wanted} within {timeout_s:g} s (heard: {others}); {to_do}"
