"""A vehicle that says what a recording says, on its own clock, and takes FF_MODE from whoever sets it."""

import math
import socket
import threading
from functools import partial

from fakes import ports
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SystemClock
from bridge.links.open import open_link
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.readings import Reading, encode
from bridge.wire.readings import decode as reading_of
from bridge.wire.tlog import TlogWriter, read_tlog
from gcs_plugin.dives.replay import play

LENGTH_S = 90
REAL32 = dialect.MAV_PARAM_TYPE_REAL32


def record(path, hz=10):
    """A vehicle that surges to and fro, armed, with its feed-forward on; so many readings a second of each kind."""
    encoder, writer = Encoder(1, 1), TlogWriter(path)
    for n in range(hz * LENGTH_S):
        now_s = n / hz
        surge = 0.3 * math.sin(now_s)
        readings = [
            ("imu", (0.0, 0.0, -9.81, 0.0, 0.0, 0.05, math.nan)),
            ("dvl", (surge, 0.0, 0.0, 0.01)),
            ("attitude", (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.05)),
            ("pressure", (130000.0, 12.0)),
            ("pwm", (1500 + 300 * surge,) * 8),
            ("nu_fb", (surge, 0.0, 0.0, 0.0, 0.0, 0.05)),
            ("nu_ref", (0.3, *(0.0,) * 13)),
        ]
        if n % hz == 0:
            readings += [
                ("alive", (1.0, float(dialect.MAV_TYPE_SUBMARINE), float(dialect.MAV_AUTOPILOT_GENERIC))),
                ("battery", (15.9, 12.0)),
                ("ff_mode", (3.0,)),
                ("veh_cfg", (1.0,)),
            ]
        for name, values in readings:
            raw = encoder.frame(*encode(Reading(name, now_s, values)))
            writer.write(round(1.79e15 + now_s * 1e6), raw)
    writer.close()
    return list(read_tlog(path))


class ReplayedVehicle:
    """Replays to a link on the recorded clock, and takes FF_MODE from whoever sets it; `deaf` hears nothing."""

    def __init__(self, records, spec):
        self.link, self.mode, self.deaf, self.asked = open_link(spec), 3.0, True, 0
        self._stop, self._framer, self._encoder = threading.Event(), Framer(), Encoder(1, 1)
        self._played = play(records, SystemClock(), self._wait)
        self._thread = threading.Thread(target=self._run)

    def start(self):
        self._thread.start()

    def stop(self):
        if not self._stop.is_set():
            self._stop.set()
            # A test may fail before it starts it.
            if self._thread.is_alive():
                self._thread.join()
            self.link.close()

    def _run(self):
        for _, frame in self._played:
            if self._stop.is_set():
                return
            reading = reading_of(frame)
            if reading is not None and reading.signal == "ff_mode":
                reading = Reading("ff_mode", reading.time_s, (self.mode,))
                self.link.write(self._encoder.frame(*encode(reading)))
            else:
                # By one encoder: two runs of sequence numbers would be two vehicles.
                self.link.write(self._encoder.frame(frame.message_id, frame.payload))

    def _wait(self, seconds):
        for frame in self._framer.feed(self.link.read(seconds)):
            self._hear(frame)

    def _hear(self, frame):
        message = decode(frame)
        if message is None or message.get_type() not in ("PARAM_SET", "PARAM_REQUEST_READ"):
            return
        self.asked += 1
        if self.deaf:
            return
        if message.get_type() == "PARAM_SET":
            self.mode = message.param_value
        value = dialect.MAVLink_param_value_message(b"FF_MODE", self.mode, REAL32, 1, 0)
        self.link.write(self._encoder.encode(value))


free_port = partial(ports.free_port, socket.SOCK_DGRAM)
