"""A flight session on a recorded link: every frame of the flight is in the dive folder, orders included.

Beside an autopilot the session is with the companion; the autopilot's own messages that a dive needs, and the
parameters that tell how late they are, are asked for here, since it sends each link what was asked for on it.

The ground's heartbeat comes from the loop that watches the flight: where that hangs, the vehicle goes back by itself.
"""

import math
from collections.abc import Callable, Sequence
from typing import Final, Protocol

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import LinkError, LinkTimeout
from bridge.firmware.description import AUTOPILOT
from bridge.firmware.questions import Questions
from bridge.firmware.rates import Rates
from bridge.firmware.table import not_supported
from bridge.links.link import Link
from bridge.wire.framing import Encoder, Frame, Framer
from bridge.wire.framing import decode as decode_message
from bridge.wire.readings import decode
from gcs_plugin.flying.session import FlightSession
from gcs_plugin.peers import COMPANIONS, GROUND_STATION, Peers, Source, ground_heartbeat, heartbeat_of
from gcs_plugin.recording.recorder import HEARTBEAT_EVERY_S, Recorder
from gcs_plugin.watch.channels import StatusTexts

FIND_S: Final = 5.0
STEP_S: Final = 0.05
BEATS_WITHIN_S: Final = 2.5
"""An autopilot that is there was heard this lately: it beats once a second."""
_HEARTBEAT: Final[int] = dialect.MAVLINK_MSG_ID_HEARTBEAT
_ACK: Final[int] = dialect.MAVLINK_MSG_ID_COMMAND_ACK
_VALUE: Final[int] = dialect.MAVLINK_MSG_ID_PARAM_VALUE


class Ear(Protocol):
    """Hears the vehicle and speaks to it, and records both."""

    def hear(self) -> Sequence[Frame]:
        """Frames that have arrived; waits up to STEP_S for the first. Raises LinkLost once none can come any more."""
        ...

    def send(self, raw: bytes) -> None:
        """Send a frame, now or with the next `hear`."""
        ...


class Outbox:
    """Frames for a recorder to send."""

    def __init__(self) -> None:
        self._frames: list[bytes] = []

    def broadcast(self, raw: bytes) -> None:
        """Nobody else listens."""

    def taken(self) -> list[bytes]:
        frames, self._frames = self._frames, []
        return frames

    def put(self, raw: bytes) -> None:
        """Send a frame with the recorder's next step."""
        self._frames.append(raw)


class Recording:
    """A recording made here, by a recorder that beats as the ground and has this outbox."""

    def __init__(self, recorder: Recorder, outbox: Outbox) -> None:
        self._recorder, self.send = recorder, outbox.put

    def hear(self) -> Sequence[Frame]:
        return [item.frame for item in self._recorder.step(STEP_S)]


class Hub:
    """The hub of a recording that runs in another process; the heartbeat is this one's."""

    def __init__(self, link: Link, clock: Clock) -> None:
        self._link, self._clock, self._framer = link, clock, Framer()
        self._encoder, self._next_beat_s = Encoder(*GROUND_STATION), clock.boot_s()

    def hear(self) -> Sequence[Frame]:
        now_s = self._clock.boot_s()
        if now_s >= self._next_beat_s:
            self._next_beat_s = now_s + HEARTBEAT_EVERY_S
            self.send(self._encoder.encode(ground_heartbeat()))
        return self._framer.hear(self._link.read(STEP_S), self._clock.boot_s())

    def send(self, raw: bytes) -> None:
        self._link.write(raw)


class Crew:
    """Hears the vehicle of a link by `ear`, and steps the session once there is one; `tell` gets the vehicle's texts.

    `veh_cfg` is the configuration that the vehicle names, None before it has.
    """

    def __init__(self, ear: Ear, link: Link, clock: Clock, tell: Callable[[str], None]) -> None:
        self.clock = clock
        self._peers, self._link = Peers(link), link.name
        self._ear = ear
        self._encoder = Encoder(*GROUND_STATION)
        self._texts = StatusTexts(lambda _source, _severity, text: tell(f"vehicle: {text.words}"))
        self._session: FlightSession | None = None
        self._rates: Rates | None = None
        self._questions: Questions | None = None
        self._autopilot_s = -math.inf
        self.veh_cfg: float | None = None

    @property
    def session(self) -> FlightSession:
        """The session with the vehicle that `find` found."""
        assert self._session is not None
        return self._session

    def find(self, number: int, system: int | None = None) -> FlightSession:
        """Listen for the vehicle that flies manoeuvres by itself.

        Raises LinkTimeout if none is heard within FIND_S, LinkError if several are, or it can't, or shares its address.
        """
        end_s = self.clock.boot_s() + FIND_S
        flying: set[Source] = set()
        said_veh_cfg: dict[Source, float] = {}
        while self.clock.boot_s() < end_s:
            for frame in self._step():
                source = (frame.system, frame.component)
                if system in (None, source[0]):
                    reading = decode(frame)
                    if reading is not None and reading.signal == "flight":
                        flying.add(source)
                    elif reading is not None and reading.signal == "veh_cfg":
                        said_veh_cfg[source] = reading.values[0]
        if len(flying) > 1:
            raise LinkError(
                f"{len(flying)} vehicles fly manoeuvres by themselves here; name one with --system"
            )
        heard = self._peers.vehicles(self.clock.boot_s())
        if not flying and any(system in (None, peer.source[0]) for peer in heard):
            raise LinkError(
                self._not_supported(system)
                or "this vehicle flies no manoeuvres by itself: beside ArduSub start seatrial bridge --ardusub, give a "
                "control program of your own flights (docs/onboard.md), or fly the plan by hand, as its file says how"
            )
        if not flying:
            raise LinkTimeout(f"no vehicle within {FIND_S:g} s; check cable, address and that it is on")
        vehicle = flying.pop()
        if fault := self._peers.fault(vehicle[0]):
            raise LinkError(fault)
        self.veh_cfg = said_veh_cfg.get(vehicle)
        self._session = FlightSession(vehicle, number)
        return self._session

    def _not_supported(self, system: int | None) -> str:
        """A sentence on an autopilot beside which nothing flies a plan; "" where none such beats, or others too."""
        beats = [
            p.heartbeat for p in self._peers if p.heartbeat is not None and system in (None, p.source[0])
        ]
        sentences = {not_supported(beat.autopilot) for beat in beats if beat.is_autopilot}
        return sentences.pop() if len(sentences) == 1 else ""

    @property
    def fault(self) -> str:
        """Two vehicles share the address, and both would obey; "" for one alone."""
        return self._peers.fault(self.session.vehicle[0])

    @property
    def deserted(self) -> bool:
        """Whether the companion that flies is not heard any more, and the autopilot beside it is."""
        now_s = self.clock.boot_s()
        return self.session.silent(now_s) and now_s - self._autopilot_s <= BEATS_WITHIN_S

    def step(self) -> None:
        """Record, hear, and send all that is due."""
        self._step()
        now_s = self.clock.boot_s()
        rates = [] if self._rates is None else self._rates.step(now_s, has_stream=True)
        questions = [] if self._questions is None else self._questions.step(now_s)
        for message in (*rates, *questions, *self.session.tick(now_s)):
            self._ear.send(self._encoder.encode(message))

    def _step(self) -> Sequence[Frame]:
        frames = self._ear.hear()
        now_s = self.clock.boot_s()
        for frame in frames:
            self._peers.on_frame(frame, self._link, now_s)
            self._texts.hear(frame)
            if self._rates is not None:
                self._heed(self._rates, frame)
            if self._session is not None:
                self._meet(frame, self._session.vehicle)
                self._session.on_frame(frame, now_s)
        return frames

    def _meet(self, frame: Frame, vehicle: Source) -> None:
        """The autopilot beside a companion is known by its first heartbeat."""
        beats = frame.message_id == _HEARTBEAT and (frame.system, frame.component) == (vehicle[0], AUTOPILOT)
        if not beats or vehicle[1] not in COMPANIONS:
            return
        self._autopilot_s = self.clock.boot_s()
        if self._rates is not None:
            return
        if (firmware := heartbeat_of(frame, 0.0).firmware) is not None:
            self._rates = Rates(vehicle[0], firmware, GROUND_STATION)
            self._questions = Questions(vehicle[0], AUTOPILOT, tuple(firmware.corners.values()))

    def _heed(self, rates: Rates, frame: Frame) -> None:
        """The autopilot sends what was asked of it, acknowledges a rate, or states a parameter."""
        if (frame.system, frame.component) != (self.session.vehicle[0], AUTOPILOT):
            return
        rates.on_frame(frame.message_id)
        message = decode_message(frame) if frame.message_id in (_ACK, _VALUE) else None
        if message is None:
            return
        assert self._questions is not None
        if frame.message_id == _ACK:
            rates.on_ack(message, self.clock.boot_s())
        else:
            self._questions.on_value(message.param_id, message.param_value)
