"""What the app asks of a terminal: bytes a second while everything moves, and how soon a key is answered."""

import fcntl
import os
import pty
import select
import struct
import subprocess
import sys
import termios
import time

import numpy as np
import pytest
from figures import keep
from replayed_vehicle import ReplayedVehicle, free_port, record
from tmux import PATIENCE_S, alone

pytestmark = pytest.mark.slow
HZ = 200
"""Of 48 values: as many a second as 200 values at 50 Hz."""

MOST_BYTES_A_S = 20 * 1024
GOAL_S = 0.1
"""For 95 of 100 keys that bring another screen."""

FIRST_SCREEN_GOAL_S = 1.5
ROWS, COLUMNS = 24, 80
FIRST = b"NO LINK"
HELP, WATCH, IDENTIFY = b"Everywhere", b"THRUSTERS", b"a recording makes one"


class Terminal:
    """The app on a bare terminal, every byte of which is kept."""

    def __init__(self, command, environment):
        self._ours, theirs = pty.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, COLUMNS, 0, 0))
        self.app = subprocess.Popen(
            command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment, start_new_session=True
        )
        os.close(theirs)

    def read(self, seconds, words=None):
        """What comes within so long, or until `words` came."""
        came, until_s = b"", time.monotonic() + seconds
        while (left_s := until_s - time.monotonic()) > 0 and (words is None or words not in came):
            if select.select([self._ours], [], [], left_s)[0]:
                came += os.read(self._ours, 65536)
        return came

    def until(self, words):
        """Read until `words` came; how long that took."""
        began_s = time.monotonic()
        came = self.read(PATIENCE_S, words)
        assert words in came, f"{words!r} not seen within {PATIENCE_S:.0f} s: {came[-2000:]!r}"
        return time.monotonic() - began_s

    def answer_s(self, key, words):
        """How long after a key the words come that it brings to the screen."""
        os.write(self._ours, key)
        return self.until(words)

    def close(self):
        self.app.kill()
        self.app.wait()
        os.close(self._ours)


@pytest.fixture
def terminal(tmp_path):
    port = free_port()
    vehicle = ReplayedVehicle(record(tmp_path / "telemetry.tlog", HZ), f"udpout:127.0.0.1:{port}")
    command = [sys.executable, "-m", "tui", "tui", "--link", f"udpin:127.0.0.1:{port}", "--unrecorded"]
    terminal = Terminal(command, alone(tmp_path) | {"TERM": "xterm-256color"})
    try:
        terminal.first_screen_s = terminal.until(FIRST)
        vehicle.start()
        terminal.until(b"FF both")
        yield terminal
    finally:
        vehicle.stop()
        terminal.close()


def test_a_screen_on_which_everything_moves_takes_20_kib_a_second_at_most(terminal):
    sent = terminal.read(4.0)
    assert 0 < len(sent) <= 4.0 * MOST_BYTES_A_S


@pytest.mark.soak
def test_bytes_and_answers_of_a_minute(terminal):
    bytes_a_s = len(terminal.read(40.0)) / 40.0
    assert bytes_a_s <= MOST_BYTES_A_S
    answers_s, escapes_s = [], []
    for _ in range(20):
        answers_s.append(terminal.answer_s(b"?", HELP))
        escapes_s.append(terminal.answer_s(b"\x1b", WATCH))
        answers_s.append(terminal.answer_s(b"3", IDENTIFY))
        answers_s.append(terminal.answer_s(b"1", WATCH))
    half_ms, most_ms = (1000 * float(np.quantile(answers_s, share)) for share in (0.5, 0.95))
    escape_ms = 1000 * float(np.median(escapes_s))
    keep(
        "terminal_load",
        f"{bytes_a_s / 1024:.1f} KiB/s at 80 by 24; first screen {terminal.first_screen_s:.1f} s after the start "
        f"({'met' if terminal.first_screen_s <= FIRST_SCREEN_GOAL_S else 'missed'}); "
        f"{len(answers_s)} keys that bring another screen answered after {half_ms:.0f} ms (median), "
        f"95 % of them within {most_ms:.0f} ms ({'met' if most_ms <= 1000 * GOAL_S else 'missed'}), the last after "
        f"{1000 * max(answers_s):.0f} ms; escape, which is told from the begin of another key by 100 ms of waiting, "
        f"after {escape_ms:.0f} ms",
    )
