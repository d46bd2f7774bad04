"""The app for real: in tmux, against the frames of a recording that is replayed, driven by keys and read back."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from replayed_vehicle import ReplayedVehicle, free_port, record

from gcs_plugin.holder import held

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 60.0

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed"),
]


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
