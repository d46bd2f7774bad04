"""The parameter client: thin I/O over a link around the pure state machines of listing and upload.

The client sends nothing to a component before that component's HEARTBEAT arrived on this link: an autopilot that does
not know the companion yet takes a write to the companion for its own (measured with ArduSub 4.5.7).

An upload to an armed vehicle needs a stronger confirmation, but is possible: a vehicle that holds its position in a
current is safer armed than disarmed. Only the model that acts on the thrusters must not change under way: the vehicle
refuses a commit while its feed-forward acts, and so does the ground station.
"""

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import LinkError, LinkLost, LinkTimeout, ParamRejected, ParamUnverified
from bridge.framing import Encoder, Frame, Framer, decode
from bridge.link.base import Link
from bridge.parameters import APPLYING_MODES, MODE, set_crc
from bridge.vehicle.feedforward import Mode
from gcs_plugin.off_orders import OffOrders
from gcs_plugin.params.deadline import Timing
from gcs_plugin.params.listing import Listing, ReadIndex, ReadList
from gcs_plugin.params.plan import Plan
from gcs_plugin.params.receipt import Newest, Receipt, Turn, begin, finish
from gcs_plugin.params.sidecar import Sidecar
from gcs_plugin.params.transfer import ReadValue, Result, SetValue, Source
from gcs_plugin.params.upload import Ending, Stage, Upload
from gcs_plugin.peers import COMPANIONS_MAY_FOLLOW_S, GROUND_STATION, Peers, parameter_holder


def obstacle(present: Mapping[str, float]) -> str:
    """Why an armed vehicle with the values `present` must not be given parameters, "" if it may."""
    if present.get(MODE) in APPLYING_MODES:
        return "is armed and its feed-forward acts on the thrusters: force the feed-forward off first"
    return ""


def not_raised(targets: Mapping[str, float], present: Mapping[str, float]) -> dict[str, float]:
    """`targets` without FF_MODE if that would raise the feed-forward's mode: a roll back is no order to act."""
    mode = present.get(MODE)
    return {
        name: value
        for name, value in targets.items()
        if name != MODE or mode is None or _is_no_rise(value, mode)
    }


def _is_no_rise(value: float, mode: float) -> bool:
    """Whether mode `value` gives the feed-forward no more authority than `mode`; the numbers are in another order."""
    if value not in set(Mode) or mode not in set(Mode):
        return value == mode
    if Mode(int(value)).applies_feedforward or Mode(int(mode)).applies_feedforward:
        return not Mode(int(value)).raises(Mode(int(mode)))
    return value <= mode


POLL_S: Final = 0.02
HEARTBEAT_LIMIT_S: Final = 6.0
GONE_S: Final = 12.0  # without any frame of the vehicle: at 30 % loss of 1 Hz heartbeats, once in a million
TELL_SILENCE_S: Final = 2.0
NO_INDEX: Final = -1

_HEARTBEAT: Final[int] = dialect.MAVLINK_MSG_ID_HEARTBEAT


def message_of(send: ReadList | ReadIndex | ReadValue | SetValue, target: Source) -> Any:
    """The MAVLink message, addressed to `target`, for a request of the listing or upload machine."""
    if isinstance(send, ReadList):
        return dialect.MAVLink_param_request_list_message(*target)
    if isinstance(send, ReadIndex):
        return dialect.MAVLink_param_request_read_message(*target, b"", send.index)
    name = send.name.encode()
    if isinstance(send, ReadValue):
        return dialect.MAVLink_param_request_read_message(*target, name, NO_INDEX)
    return dialect.MAVLink_param_set_message(*target, name, send.value, dialect.MAV_PARAM_TYPE_REAL32)


def _unheard(name: str, result: Result) -> None:
    """Default `line` callback: ignores the result of a parameter."""
    del name, result


def _unseen(words: str, done: int, total: int, stage: Stage | None) -> None:
    """Default `progress` callback: ignores the progress."""
    del words, done, total, stage


class ParameterClient:
    """Reads and writes one vehicle's parameters over `link`.

    Every wait is a read of `link` with a timeout, so a link whose `read` steps a simulation keeps the simulation
    going. `progress` is called with words for the crew (the stage, and the time without an answer), the number done,
    the total, and the stage of an upload, None while parameters are read; `line` with the result of each parameter
    that changes, as soon as it is known. If two vehicles share the address, nothing is requested or written and
    LinkError is raised.
    """

    def __init__(
        self,
        link: Link,
        clock: Clock,
        timing: Timing | None = None,
        progress: Callable[[str, int, int, Stage | None], None] = _unseen,
        line: Callable[[str, Result], None] = _unheard,
    ) -> None:
        self._link, self._clock = link, clock
        self._timing = timing or Timing()
        self._progress, self._line = progress, line
        self._framer, self._encoder = Framer(), Encoder(*GROUND_STATION)
        self._peers = Peers(link)
        self._vehicle: Source | None = None

    def find_vehicle(
        self, timeout_s: float = 5.0, system: int | None = None, component: int | None = None
    ) -> Source:
        """Find the component that holds the parameters: the named component, otherwise a companion before an autopilot.

        Raises LinkTimeout if no HEARTBEAT arrives within `timeout_s`, LinkError if several systems send HEARTBEATs.
        """
        end_s = self._clock.boot_s() + timeout_s
        settled_s: float | None = None
        while self._clock.boot_s() < end_s:
            for frame in self._receive():
                self._note(frame)
            candidates = self._candidates(system, component)
            now_s = self._clock.boot_s()
            if candidates and settled_s is None:
                settled_s = now_s + COMPANIONS_MAY_FOLLOW_S
            named = component is not None and system is not None
            if candidates and settled_s is not None and (named or now_s >= settled_s):
                break
        candidates = self._candidates(system, component)
        if not candidates:
            raise LinkTimeout(self._nobody(timeout_s, system, component))
        systems = sorted({source[0] for source in candidates})
        if len(systems) > 1:
            numbers = ", ".join(map(str, systems))
            raise LinkError(
                f"{self._link.name}: several vehicles beat (systems {numbers}); name one with --system"
            )
        self._vehicle = parameter_holder(candidates)
        self._refuse_twins()
        return self._vehicle

    @property
    def thrusters(self) -> Source:
        """The component that drives the vehicle's thrusters: its autopilot, otherwise the component in use."""
        vehicle = self._known_vehicle()
        autopilots = [
            source
            for source in self._candidates(vehicle[0], None)
            if (peer := self._peers.get(source)) is not None
            and peer.heartbeat is not None
            and peer.heartbeat.is_autopilot
        ]
        return min(autopilots, default=vehicle)

    @property
    def vehicle(self) -> Source:
        """System and component of the vehicle; calls `find_vehicle` first if no vehicle is known yet."""
        return self._known_vehicle()

    @property
    def armed(self) -> bool:
        """Whether any component of the vehicle reports that it is armed."""
        return self._peers.armed(self._known_vehicle()[0])

    def listen(self, stop: Event) -> None:
        """Read the link until `stop` is set, so that the vehicle's state stays current while a prompt is open."""
        with contextlib.suppress(LinkError):  # the next read raises it again
            while not stop.is_set():
                for frame in self._receive():
                    self._note(frame)

    def read_all(self, timeout_s: float = 30.0) -> dict[str, float]:
        """Return all parameters. Raises LinkTimeout if none arrived, ParamUnverified if some are missing."""
        timing = replace(self._timing, deadline_s=timeout_s)
        listing = Listing(self._known_vehicle(), self._clock.boot_s(), timing)
        heard_s = self._clock.boot_s()
        while not listing.done:
            for send in listing.tick(self._clock.boot_s()):
                self._send(send)
            before = len(listing.values)
            for frame in self._receive():
                self._feed_listing(listing, frame)
            self._refuse_twins()
            now_s = self._clock.boot_s()
            heard_s = now_s if len(listing.values) != before else heard_s
            self._tell(None, len(listing.values), listing.count or 0, now_s - heard_s)
        if listing.count is None:
            raise LinkTimeout(
                f"{self._vehicle_text()} sent no parameter within {timeout_s:.0f} s; "
                "check that the bridge runs"
            )
        if not listing.complete:
            raise ParamUnverified(
                f"{len(listing.missing)} of {listing.count} parameters of {self._vehicle_text()} "
                f"did not come within {timeout_s:.0f} s; better the link and try again"
            )
        return dict(listing.values)

    def apply(
        self,
        plan: Plan,
        preimage: Path,
        *,
        even_armed: bool = False,
        restores: str = "",
        sidecar: Sidecar | None = None,
        read_at: Newest | None = None,
    ) -> Receipt:
        """Carry out a plan and return its receipt.

        Before the first write, the values on the vehicle are saved in a new file, `preimage` or its next free number,
        together with a receipt that says what was begun; at the end the receipt says how the upload ended. `restores`
        is the pre-image that a roll back goes back to, "" for any other upload; `sidecar` is the provenance of the
        values; `read_at` is the newest receipt at the time the vehicle was read.

        Raises ParamRejected or ParamUnknown for a plan that can't be sent; ParamRejected while the vehicle is armed
        (unless `even_armed` and its feed-forward does not act) and if another program writes to the vehicle, or has
        written since `read_at`; LinkTimeout if the vehicle sends no HEARTBEAT any more. In each case nothing was
        written.
        """
        plan.check()
        orders = OffOrders()
        self._await_heartbeat()
        system, component = self._known_vehicle()
        upload = Upload(plan, (system, component), self._clock.boot_s(), self._timing, set_crc)
        if self.armed and upload.needs_disarmed:
            if against := obstacle(plan.present):
                raise ParamRejected(f"{self._vehicle_text()} {against}; nothing was sent")
            if not even_armed:
                raise ParamRejected(
                    f"{self._vehicle_text()} is armed; nothing was sent, disarm it, or upload with --armed"
                )
        crc = upload.crc if upload.commits else None
        vehicle, unix_s = (system, component), self._clock.unix_s()
        with Turn(preimage.parent, system, read_at):
            begun = begin(plan, vehicle, preimage, crc, unix_s, restores, sidecar)
            start_s = self._clock.boot_s()
            ending = self._drive(upload, even_armed, orders)
            return finish(begun, plan, ending, self._clock.boot_s() - start_s)

    def _drive(self, upload: Upload, even_armed: bool, orders: OffOrders) -> Ending:
        reported: dict[str, Result] = {}
        while upload.ending is None:
            try:
                if orders.given(self._known_vehicle()[0]):
                    upload.overrule(self._clock.boot_s())
                for send in upload.tick(self._clock.boot_s()):
                    self._send(send)
                for frame in self._receive():
                    self._feed_upload(upload, frame, even_armed)
            except LinkLost as error:
                upload.give_up(str(error))
            now_s = self._clock.boot_s()
            trouble = self._peers.fault(self._known_vehicle()[0]) or self._gone(now_s)
            if trouble and upload.ending is None:
                # Send no further write: it would reach the second vehicle too, or nobody.
                upload.give_up(f"{trouble}; {upload.left_behind}")
            self._tell(upload.stage, *upload.progress, upload.unanswered_s(now_s))
            for name, result in upload.proven.items():
                if reported.get(name) != result:
                    reported[name] = result
                    self._line(name, result)
        return upload.ending

    def _gone(self, now_s: float) -> str:
        """Why the upload is given up (the vehicle is silent), "" while frames arrive from it."""
        peer = self._peers.get(self._known_vehicle())
        if peer is not None and now_s - peer.heard_s < GONE_S:
            return ""
        return f"{self._vehicle_text()} went silent, nothing came from it for {GONE_S:.0f} s"

    def _refuse_twins(self) -> None:
        fault = self._peers.fault(self._known_vehicle()[0])
        if fault:
            raise LinkError(fault)

    def _tell(self, stage: Stage | None, done: int, total: int, unanswered_s: float) -> None:
        silent = f", no answer for {unanswered_s:.0f} s" if unanswered_s >= TELL_SILENCE_S else ""
        self._progress(f"{'reading' if stage is None else stage.value}{silent}", done, total, stage)

    def _await_heartbeat(self) -> None:
        """Wait for the next HEARTBEAT of the vehicle's component; raise LinkTimeout after HEARTBEAT_LIMIT_S."""
        vehicle = self._known_vehicle()
        start_s = self._clock.boot_s()
        while self._beat_s(vehicle) < start_s and self._clock.boot_s() < start_s + HEARTBEAT_LIMIT_S:
            for frame in self._receive():
                self._note(frame)
        if self._beat_s(vehicle) < start_s:
            raise LinkTimeout(
                f"{self._vehicle_text()}: no HEARTBEAT for {HEARTBEAT_LIMIT_S} s; nothing was sent, "
                "check the link"
            )
        self._refuse_twins()

    def _feed_listing(self, listing: Listing, frame: Frame) -> None:
        now_s, source = self._clock.boot_s(), (frame.system, frame.component)
        message = self._note(frame)
        if message is not None and self._is_rebooted(source):
            listing.on_reboot(now_s)
        elif frame.message_id == dialect.MAVLINK_MSG_ID_PARAM_VALUE and message is not None:
            listing.on_value(
                message.param_id, message.param_value, message.param_index, message.param_count, source, now_s
            )

    def _feed_upload(self, upload: Upload, frame: Frame, even_armed: bool) -> None:
        source, now_s = (frame.system, frame.component), self._clock.boot_s()
        message = self._note(frame)
        if message is None:
            return
        if frame.message_id == dialect.MAVLINK_MSG_ID_PARAM_VALUE:
            upload.on_value(message.param_id, message.param_value, source, now_s)
        elif frame.message_id == dialect.MAVLINK_MSG_ID_PARAM_ERROR:
            if message.target_system in (0, GROUND_STATION[0]):
                upload.on_error(message.param_id, message.error, source, now_s)
        elif self._is_rebooted(source):
            upload.on_reboot(now_s)
        elif frame.message_id == _HEARTBEAT and self.armed and upload.needs_disarmed and not even_armed:
            upload.abort("the vehicle was armed during the upload", now_s)

    def _is_rebooted(self, source: Source) -> bool:
        """Whether the last frame of this component shows that the vehicle in use has rebooted."""
        peer = self._peers.get(source)
        return source == self._vehicle and peer is not None and peer.rebooted

    def _beat_s(self, source: Source) -> float:
        """When the component last sent a HEARTBEAT; -inf if never."""
        peer = self._peers.get(source)
        return float("-inf") if peer is None or peer.heartbeat is None else peer.heartbeat.time_s

    def _note(self, frame: Frame) -> Any | None:
        """Enter a frame in the table of senders; return its message, None if it is not used here or damaged."""
        self._peers.on_frame(frame, self._link.name, self._clock.boot_s())
        return decode(frame) if frame.message_id in _USED else None

    def _receive(self) -> list[Frame]:
        return self._framer.feed(self._link.read(POLL_S))

    def _send(self, send: ReadList | ReadIndex | ReadValue | SetValue) -> None:
        self._link.write(self._encoder.encode(message_of(send, self._known_vehicle())))

    def _candidates(self, system: int | None, component: int | None) -> list[Source]:
        return [
            peer.source
            for peer in self._peers.vehicles(self._clock.boot_s())
            if system in (None, peer.source[0]) and component in (None, peer.source[1])
        ]

    def _nobody(self, timeout_s: float, system: int | None, component: int | None) -> str:
        wanted = f" of system {system}" if system is not None else ""
        wanted += f" component {component}" if component is not None else ""
        beating = sorted(peer.source for peer in self._peers if peer.heartbeat is not None)
        others = ", ".join(f"{s}/{c}" for s, c in beating) or "nobody at all"
        return (
            f"{self._link.name}: no vehicle's HEARTBEAT{wanted} within {timeout_s:g} s (heard: {others}); "
            "check the cable, the address and that the bridge runs"
        )

    def _known_vehicle(self) -> Source:
        if self._vehicle is None:
            self.find_vehicle()
        assert self._vehicle is not None
        return self._vehicle

    def _vehicle_text(self) -> str:
        system, component = self._known_vehicle()
        return f"vehicle {system}, component {component} on {self._link.name}"


_USED: Final = frozenset(
    (
        dialect.MAVLINK_MSG_ID_HEARTBEAT,
        dialect.MAVLINK_MSG_ID_SYSTEM_TIME,
        dialect.MAVLINK_MSG_ID_PARAM_VALUE,
        dialect.MAVLINK_MSG_ID_PARAM_ERROR,
    )
)
