"""Listen to a link for a while, and measure how a vehicle answers TIMESYNC."""

from dataclasses import dataclass, field
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.firmware.description import Firmware
from bridge.links.link import Link
from bridge.wire.framing import Encoder, Frame, Framer, decode
from bridge.wire.readings import Reading
from bridge.wire.readings import decode as decode_reading
from gcs_plugin.peers import GROUND_STATION, Peers, Reception, heartbeat_read
from gcs_plugin.watch.channels import heard

POLL_S: Final = 0.05
ASK_TIME_EVERY_S: Final = 0.5
FROM_AUTOPILOT: Final = {
    dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: "pwm",
    dialect.MAVLINK_MSG_ID_VISION_POSITION_DELTA: "dvl",
}
"""Signals of the contract that an autopilot sends in messages of its own."""


@dataclass(frozen=True, slots=True)
class Arrival:
    """A reading, when it arrived, by the ground's clock, and the component that sent it."""

    time_s: float
    reading: Reading
    component: int


@dataclass(frozen=True, slots=True)
class TimeAnswer:
    """A TIMESYNC exchange: the vehicle's clock, and the duration of the round trip."""

    vehicle_s: float
    round_trip_s: float


@dataclass
class Observed:
    """The traffic heard on a link. `arrivals` by signal; `unix_s` is the ground's Unix time when the listening ended.

    `left_out` counts frames of senders that found no place among `receptions`. `systems` are those of the vehicles that
    beat; `twins` says that two vehicles share an address, "" if none do.
    """

    link: str
    arrivals: dict[str, list[Arrival]] = field(default_factory=dict)
    time_answers: list[TimeAnswer] = field(default_factory=list)
    frames: int = 0
    receptions: tuple[Reception, ...] = ()
    left_out: int = 0
    systems: tuple[int, ...] = ()
    twins: str = ""
    listened_s: float = 0.0
    ended_s: float = 0.0
    unix_s: float = 0.0

    @property
    def firmware(self) -> Firmware | None:
        """The firmware of the autopilot that was heard, None without one that is supported."""
        beats = (heartbeat_read(each.reading.values, each.time_s) for each in self.arrivals.get("alive", []))
        return next((beat.firmware for beat in beats if beat.firmware is not None), None)

    def take(self, frame: Frame, now_s: float) -> None:
        self.frames += 1
        reading = decode_reading(frame)
        if reading is None and frame.known and (wanted := FROM_AUTOPILOT.get(frame.message_id)) is not None:
            values = next((value for signal, _, value in heard(frame, None) if signal == wanted), None)
            reading = None if values is None else Reading(wanted, now_s, values)
        if reading is not None and frame.system != GROUND_STATION[0]:
            self.arrivals.setdefault(reading.signal, []).append(Arrival(now_s, reading, frame.component))
        if frame.message_id == dialect.MAVLINK_MSG_ID_TIMESYNC:
            message = decode(frame)
            if message is not None and message.tc1 != 0 and frame.system != GROUND_STATION[0]:
                sent_s = message.ts1 / 1e9
                # A reply to another ground station, or to a request from before this listening, does not count.
                if 0.0 <= now_s - sent_s <= 10.0:
                    self.time_answers.append(TimeAnswer(message.tc1 / 1e9, now_s - sent_s))


def observe(link: Link, clock: Clock, duration_s: float) -> Observed:
    """Listen for `duration_s`, sending a TIMESYNC request every half second."""
    observed, framer, peers = Observed(link.name), Framer(), Peers(link)
    encoder = Encoder(*GROUND_STATION)
    start_s = ask_s = clock.boot_s()
    while (now_s := clock.boot_s()) - start_s < duration_s:
        if now_s >= ask_s:
            ask_s = now_s + ASK_TIME_EVERY_S
            # A zero could be taken for an empty reply.
            link.write(encoder.encode(dialect.MAVLink_timesync_message(0, max(1, round(now_s * 1e9)))))
        for frame in framer.feed(link.read(POLL_S)):
            arrived_s = clock.boot_s()
            peers.on_frame(frame, link.name, arrived_s)
            observed.take(frame, arrived_s)
    observed.ended_s, observed.unix_s = clock.boot_s(), clock.unix_s()
    observed.listened_s = observed.ended_s - start_s
    observed.receptions = tuple(peers.receptions(link.name, observed.ended_s))
    observed.left_out = peers.left_out[link.name]
    observed.systems = tuple(sorted({peer.source[0] for peer in peers.vehicles(observed.ended_s)}))
    observed.twins = peers.fault()
    return observed
