"""A parameter session with one vehicle: read every parameter, then carry out a plan and prove it.

    IDLE -> READING -> IDLE (`present` is set) -> WAITING (for a fresh HEARTBEAT) -> WRITING -> ENDED

The session does no I/O on a link: `tick` returns the messages to send, `on_news` takes the messages that arrived. Two
drivers share it: `client.ParameterClient`, which blocks on a link of its own, and the module in MAVProxy, which calls
`tick` in every idle moment.

Nothing is sent to a component before its HEARTBEAT arrived: an autopilot that does not know the companion yet takes a
write to the companion for its own (measured with ArduSub 4.5.7). An armed vehicle may be written to, with a stronger
confirmation: a vehicle that holds its position in a current is safer armed than disarmed. Only the model that acts on
the thrusters must not change under way.

An OFF that another program orders after the reading began wins over a mode that the plan would raise: the plan was made
of values from before that order.
"""

from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import LinkError, LinkTimeout, ParamRejected, ParamUnverified, SeatrialError
from bridge.wire.framing import Frame, decode
from gcs_plugin.feedforward.off_orders import OffOrders
from gcs_plugin.params.listing import Listing, ReadIndex, ReadList
from gcs_plugin.params.plan import Plan, obstacle
from gcs_plugin.params.receipt import Newest, Receipt, Turn, begin, finish
from gcs_plugin.params.sidecar import Sidecar
from gcs_plugin.params.transfer import ReadValue, RestartScripts, Result, Send
from gcs_plugin.params.upload import Ending, Stage, Upload
from gcs_plugin.peers import Peer, Peers, Source

READ_WITHIN_S: Final = 30.0
HEARTBEAT_LIMIT_S: Final = 6.0  # at 30 % loss of 1 Hz heartbeats, once in a thousand
GONE_S: Final = 12.0  # without any frame of the vehicle: at the same loss, once in a million
SHOW_SILENCE_S: Final = 2.0
NO_INDEX: Final = -1

_USED: Final = frozenset(
    (
        dialect.MAVLINK_MSG_ID_SYSTEM_TIME,
        dialect.MAVLINK_MSG_ID_PARAM_VALUE,
        dialect.MAVLINK_MSG_ID_PARAM_ERROR,
    )
)


@dataclass(frozen=True, slots=True)
class News:
    """A message for a session; `rebooted`: it shows that its sender has rebooted."""

    source: Source
    message: Any
    rebooted: bool = False


def news_of(frame: Frame, peer: Peer | None) -> News | None:
    """The message in a frame that `peer` sent; None for a frame that no session uses."""
    message = decode(frame) if peer is not None and frame.message_id in _USED else None
    return None if peer is None or message is None else News(peer.source, message, peer.rebooted)


class Step(Enum):
    """State of a session."""

    IDLE = auto()
    READING = auto()
    WAITING = auto()
    WRITING = auto()
    ENDED = auto()


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a session is: `stage` of an upload, None while parameters are read; tasks done, in all (0: unknown)."""

    stage: Stage | None
    done: int
    total: int
    unanswered_s: float

    @property
    def words(self) -> str:
        """The stage, and the time without an answer if it is long."""
        silence = f", no answer for {self.unanswered_s:.0f} s" if self.unanswered_s >= SHOW_SILENCE_S else ""
        return f"{'reading' if self.stage is None else self.stage.value}{silence}"


@dataclass(frozen=True)
class Order:
    """A plan to carry out; `even_armed`: on an armed vehicle too, if its feed-forward does not act.

    The values before are saved in a new file, `preimage` or its next free number. `restores` is the pre-image that a
    roll back goes back to, "" for any other upload; `sidecar` is the provenance of the values; `read_at` is the newest
    receipt at the time the vehicle was read, None to skip the check that nobody has written since.
    """

    plan: Plan
    preimage: Path
    even_armed: bool = False
    restores: str = ""
    sidecar: Sidecar | None = None
    read_at: Newest | None = None


def message_of(send: ReadList | ReadIndex | Send, target: Source) -> Any:
    """The MAVLink message, addressed to `target`, for a request of the listing or upload machine."""
    if isinstance(send, ReadList):
        return dialect.MAVLink_param_request_list_message(*target)
    if isinstance(send, ReadIndex):
        return dialect.MAVLink_param_request_read_message(*target, b"", send.index)
    if isinstance(send, RestartScripts):
        restart = dialect.SCRIPTING_CMD_STOP_AND_RESTART
        return dialect.MAVLink_command_long_message(
            *target, dialect.MAV_CMD_SCRIPTING, 0, restart, 0, 0, 0, 0, 0, 0
        )
    name = send.name.encode()
    if isinstance(send, ReadValue):
        return dialect.MAVLink_param_request_read_message(*target, name, NO_INDEX)
    return dialect.MAVLink_param_set_message(*target, name, send.value, dialect.MAV_PARAM_TYPE_REAL32)


class Session:
    """Reads and writes the parameters of the component `vehicle`, which `peers` have heard.

    `present` holds the parameters read, `failure` why a reading or an upload did not come about (then nothing was
    written), `receipt` the result of an upload that was begun.
    """

    def __init__(self, peers: Peers, vehicle: Source, clock: Clock) -> None:
        self.vehicle = vehicle
        self.step = Step.IDLE
        self.present: dict[str, float] = {}
        self.read_s = clock.boot_s()
        self.failure: SeatrialError | None = None
        self.receipt: Receipt | None = None
        self._peers, self._clock = peers, clock
        self._orders = OffOrders()
        self._listing: Listing | None = None
        self._listed_s = 0.0
        self._order: Order | None = None
        self._turn: Turn | None = None
        self._upload: Upload | None = None
        self._since_s = 0.0

    @property
    def armed(self) -> bool:
        """Whether any component of the vehicle reports that it is armed."""
        return self._peers.armed(self.vehicle[0])

    @property
    def busy(self) -> bool:
        """Whether parameters are being read or written."""
        return self.step in (Step.READING, Step.WAITING, Step.WRITING)

    @property
    def progress(self) -> Progress:
        now_s = self._clock.boot_s()
        if self._upload is not None:
            return Progress(self._upload.stage, *self._upload.progress, self._upload.unanswered_s(now_s))
        if self._listing is None:
            return Progress(None, len(self.present), len(self.present), 0.0)
        return Progress(None, len(self._listing.values), self._listing.count or 0, now_s - self._listed_s)

    @property
    def proven(self) -> dict[str, Result]:
        """Newest result so far of each parameter that changes, by name."""
        return {} if self._upload is None else self._upload.proven

    def read(self) -> None:
        """Start to read every parameter."""
        now_s = self._clock.boot_s()
        self.step, self.failure, self._upload = Step.READING, None, None
        self._listed_s, self._orders = now_s, OffOrders()
        self._listing = Listing(self.vehicle, now_s, READ_WITHIN_S)

    def write(self, order: Order) -> None:
        """Start to carry out an order, once the next HEARTBEAT arrives.

        Raises ParamRejected or ParamUnknown for a plan that can't be sent.
        """
        order.plan.check()
        self._order, self._since_s = order, self._clock.boot_s()
        self.step, self.failure, self.receipt = Step.WAITING, None, None

    def check_armed(self, plan: Plan, even_armed: bool) -> None:
        """Raise ParamRejected if the vehicle is armed and must not be given this plan now."""
        if not self.armed or not Upload(plan, self.vehicle).needs_disarmed:
            return
        if against := obstacle(plan.present):
            raise ParamRejected(f"{self._named} {against}; nothing was sent")
        if plan.restarts_scripts:
            raise ParamRejected(
                f"{self._named} is armed, and its scripts are to start anew; nothing was sent: disarm it"
            )
        if not even_armed:
            raise ParamRejected(
                f"{self._named} is armed; nothing was sent: disarm it, or say that it may be armed (--armed)"
            )

    def stop(self, sentence: str) -> bool:
        """Stop and roll back the staged values; False from the commit on, when only the vehicle can still refuse."""
        if self._upload is None:
            self._fail(ParamRejected(sentence))
            return True
        self._upload.abort(sentence, self._clock.boot_s())
        return self._upload.stage not in (Stage.COMMIT, Stage.LIVE, Stage.WITHDRAW)

    def give_up(self, sentence: str) -> None:
        """End an upload at once and send nothing more, as when the link is lost."""
        if self._upload is not None:
            self._upload.give_up(sentence)
            self._finish()

    def close(self) -> None:
        """Release the vehicle for other uploads."""
        if self._turn is not None:
            self._turn.close()
            self._turn = None

    def tick(self) -> list[Any]:
        now_s = self._clock.boot_s()
        sends: list[ReadList | ReadIndex | Send] = []
        if self.step is Step.READING and self._listing is not None:
            sends += self._listing.tick(now_s)
            self._end_reading(self._listing, now_s)
        if self.step is Step.WAITING:
            self._begin(now_s)
        if self.step is Step.WRITING and self._upload is not None:
            sends += self._write_on(self._upload, now_s)
        return [message_of(send, self.vehicle) for send in sends] if self.busy else []

    def on_news(self, news: News) -> None:
        """A message arrived that is meant for this ground station."""
        now_s, message, kind = self._clock.boot_s(), news.message, news.message.get_type()
        rebooted = news.rebooted and news.source == self.vehicle
        if self.step is Step.READING and self._listing is not None:
            if rebooted:
                self._listing.on_reboot(now_s)
            elif kind == "PARAM_VALUE":
                index, count = message.param_index, message.param_count
                before = len(self._listing.values)
                self._listing.on_value(
                    message.param_id, message.param_value, index, count, news.source, now_s
                )
                self._listed_s = now_s if len(self._listing.values) != before else self._listed_s
        elif self.step is Step.WRITING and self._upload is not None:
            if rebooted:
                self._upload.on_reboot(now_s)
            elif kind == "PARAM_VALUE":
                self._upload.on_value(message.param_id, message.param_value, news.source, now_s)
            elif kind == "PARAM_ERROR":
                self._upload.on_error(message.param_id, message.error, news.source, now_s)

    @property
    def _named(self) -> str:
        peer = self._peers.get(self.vehicle)
        return f"vehicle {self.vehicle[0]}, component {self.vehicle[1]}{f' on {peer.link}' if peer else ''}"

    def _end_reading(self, listing: Listing, now_s: float) -> None:
        if fault := self._peers.fault(self.vehicle[0]):
            self._fail(LinkError(fault))
        elif listing.complete:
            self.present, self.read_s, self.step = dict(listing.values), now_s, Step.IDLE
        elif listing.done and listing.count is None:
            self._fail(
                LinkTimeout(
                    f"{self._named} sent no parameter within {READ_WITHIN_S:.0f} s; check that the bridge runs"
                )
            )
        elif listing.done:
            self._fail(
                ParamUnverified(
                    f"{len(listing.missing)} of {listing.count} parameters of {self._named} "
                    f"did not come within {listing.limit_s:.0f} s; better the link and try again"
                )
            )

    def _begin(self, now_s: float) -> None:
        """Begin the upload once a HEARTBEAT arrived: take the turn, check the vehicle, save the values before."""
        order = self._order
        assert order is not None
        peer = self._peers.get(self.vehicle)
        if peer is None or not peer.beats(now_s, now_s - self._since_s):
            if now_s >= self._since_s + HEARTBEAT_LIMIT_S:
                self._fail(
                    LinkTimeout(
                        f"{self._named}: no HEARTBEAT for {HEARTBEAT_LIMIT_S:.0f} s; nothing was sent, check the link"
                    )
                )
            return
        upload = Upload(order.plan, self.vehicle, now_s)
        try:
            if fault := self._peers.fault(self.vehicle[0]):
                raise LinkError(fault)
            self.check_armed(order.plan, order.even_armed)
            self._turn = Turn(order.preimage.parent, self.vehicle[0], order.read_at)
            self.receipt = begin(
                order.plan,
                self.vehicle,
                order.preimage,
                upload.crc,
                self._clock.unix_s(),
                order.restores,
                order.sidecar,
            )
        except SeatrialError as error:
            self._fail(error)
            return
        self._upload, self.step, self._since_s = upload, Step.WRITING, now_s

    def _write_on(self, upload: Upload, now_s: float) -> list[Send]:
        assert self._order is not None
        if self.armed and upload.needs_disarmed and not self._order.even_armed:
            upload.abort("the vehicle was armed during the upload", now_s)
        if self._orders.has_ordered_off(self.vehicle[0]):
            upload.overrule(now_s)
        sends = upload.tick(now_s)
        trouble = self._peers.fault(self.vehicle[0])
        peer = self._peers.get(self.vehicle)
        if peer is None or now_s - peer.heard_s >= GONE_S:
            trouble = trouble or f"{self._named} went silent, nothing came from it for {GONE_S:.0f} s"
        if trouble and upload.ending is None:
            # Send no further write: it would reach the second vehicle too, or nobody.
            upload.give_up(f"{trouble}; {upload.left_behind}")
            sends = []
        if upload.ending is not None:
            self._finish()
        return sends

    def _finish(self) -> None:
        assert self._upload is not None
        assert self._order is not None
        assert self.receipt is not None
        ending: Ending | None = self._upload.ending
        if ending is not None:
            took_s = self._clock.boot_s() - self._since_s
            self.receipt, self.step = finish(self.receipt, self._order.plan, ending, took_s), Step.ENDED
            self.close()

    def _fail(self, error: SeatrialError) -> None:
        self.failure, self.step = error, Step.ENDED
        self.close()
