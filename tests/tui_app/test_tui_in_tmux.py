"""The app for real: in tmux, against the frames of a recording that is replayed, driven by keys and read back."""

import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SystemClock
from bridge.framing import Encoder, Framer, decode
from bridge.link.open import open_link
from bridge.messages.readings import Reading, encode
from bridge.messages.readings import decode as reading_of
from bridge.tlog import TlogWriter, read_tlog
from gcs_plugin.holder import held
from gcs_plugin.replay import Player

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 60.0
LENGTH_S = 90
REAL32 = dialect.MAV_PARAM_TYPE_REAL32

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed"),
]


def record(path):
    """A vehicle that surges to and fro, armed, with its feed-forward on; ten readings a second."""
    encoder, writer = Encoder(1, 1), TlogWriter(path)
    for n in range(10 * LENGTH_S):
        now_s = n / 10
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
        if n % 10 == 0:
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
        self._player = Player(records, SystemClock(), self._wait)
        self._thread = threading.Thread(target=self._run)

    def start(self):
        self._thread.start()

    def stop(self):
        if not self._stop.is_set():
            self._stop.set()
            self._thread.join()
            self.link.close()

    def _run(self):
        for _, frame in self._player:
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


class Tmux:
    """One terminal of its own server."""

    def __init__(self, name, columns, rows, command, environment):
        self._base = ["tmux", "-L", name]
        size = ["-x", str(columns), "-y", str(rows)]
        subprocess.run(
            [*self._base, "-f", "/dev/null", "new-session", "-d", *size, command], env=environment, check=True
        )

    def keys(self, *keys):
        subprocess.run([*self._base, "send-keys", *keys], check=True)

    def screen(self):
        done = subprocess.run([*self._base, "capture-pane", "-p"], capture_output=True, text=True, check=True)
        return done.stdout

    def until(self, *words, without=()):
        """The screen once all `words` are on it; fails with the screen that is there instead."""
        until_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < until_s:
            screen = self.screen()
            if all(word in screen for word in words) and not any(word in screen for word in without):
                return screen
        pytest.fail(f"{words} not seen within {PATIENCE_S:.0f} s:\n{screen}")

    def resize(self, columns, rows):
        subprocess.run([*self._base, "resize-window", "-x", str(columns), "-y", str(rows)], check=True)

    def close(self):
        subprocess.run([*self._base, "kill-server"], check=False, capture_output=True)


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def port():
    return free_port()


@pytest.fixture
def app(tmp_path, port):
    environment = {
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "XDG_STATE_HOME": str(tmp_path),
        "XDG_CONFIG_HOME": str(tmp_path),
        "LANG": "C.UTF-8",
    }
    environment.pop("NO_COLOR", None)
    terminal = Tmux(f"seatrial-{os.getpid()}-{port}", 80, 24, "sh", environment)
    terminal.line = f"{sys.executable} -m tui tui --link udpin:127.0.0.1:{port}"
    yield terminal
    terminal.close()


@pytest.fixture
def vehicle(tmp_path, port):
    replayed = ReplayedVehicle(record(tmp_path / "telemetry.tlog"), f"udpout:127.0.0.1:{port}")
    yield replayed
    replayed.stop()


def test_the_app_lives_in_tmux_from_the_first_frame_to_the_last_key(app, vehicle):
    app.keys(f"{app.line} --unrecorded; echo ended with $?", "Enter")
    app.until("1 Watch", "? ARMED STATE UNKNOWN", "NO LINK", "NOT REC", "^x FF off")
    vehicle.start()
    app.until("■ ARMED", "LINK 0.", "sys 1/1", "FF both", "surge u", "ref   0.300", "DVL")

    app.keys("C-x")
    app.until("FF OFF", "times", without=("FF both",))
    assert vehicle.asked > 1
    app.keys("?")
    app.until("Everywhere", "sent until it is acknowledged", "FF OFF")
    vehicle.deaf = False
    app.keys("Escape")
    app.until("surge u", "FF OFF,")
    assert vehicle.mode == 0.0

    app.keys("C-p")
    app.until("Search for commands")
    app.keys("sunlight")
    app.until("Theme: sunlight")
    app.keys("Enter")
    app.until("surge u")
    app.keys("c")
    app.until("pitch q", without=("surge u",))
    app.resize(160, 50)
    app.until("VELOCITIES", "STATE", "surge u", "pitch q")
    app.resize(80, 24)
    app.until("pitch q", without=("VELOCITIES",))

    vehicle.stop()
    app.until("LINK LOST", "? was ARMED", "--")
    app.keys("C-q")
    app.until("ended with 0")


def test_the_recording_that_the_app_began_outlives_it(app, vehicle, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    vehicle.start()
    app.keys(f"{app.line} --out {tmp_path}; echo ended with $?", "Enter")
    app.until("■ ARMED", "REC 00:00:", "FF both")
    app.keys("C-q")
    app.until("ended with 0")

    holding = held(time.time())
    assert holding is not None
    try:
        (recorded,) = Path(holding.folder).glob("*.tlog")
        before = recorded.stat().st_size
        until_s = time.monotonic() + PATIENCE_S
        while recorded.stat().st_size == before and time.monotonic() < until_s:
            pass
        assert recorded.stat().st_size > before > 0

        app.keys("clear", "Enter", f"{sys.executable} -m tui tui; echo ended again with $?", "Enter")
        app.until("■ ARMED", "REC 00:00:", "FF both")
        app.keys("C-q")
        app.until("ended again with 0")
    finally:
        os.kill(holding.pid, signal.SIGTERM)
