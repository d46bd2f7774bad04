"""MAVProxy takes a replayed recording of ours for a vehicle and logs its frames.

Its own `--master=FILE.tlog` dies of its heartbeat, which it writes to the log, with every tlog: the way in is a
replay.
"""

import os
import queue
import shutil
import socket
import subprocess
import sys
import threading
from collections import Counter
from contextlib import contextmanager
from pathlib import Path
from time import monotonic

import pytest

from bridge import exit_codes
from bridge.errors import LogError
from bridge.simulator.dive import simulate_dive
from bridge.simulator.missions import Leg, Mission, rest
from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import Framer
from bridge.wire.tlog import TlogWriter, read_tlog
from tui import cli

MAVPROXY = shutil.which("mavproxy.py", path=str(Path(sys.executable).parent)) or shutil.which("mavproxy.py")
DEADLINE_S = 60.0
# UDP loses what comes while MAVProxy is not given the processor; without load it misses none.
MOST_MISSED = 0.05
SPEED = "4"

pytestmark = pytest.mark.skipif(
    MAVPROXY is None, reason="MAVProxy is not installed: pip install -e .[mavproxy]"
)


class Output:
    """The lines that a process prints, read as they come."""

    def __init__(self, process):
        self.heard = []
        self._lines = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, args=(process.stdout,), daemon=True)
        self._reader.start()

    def _read(self, stream):
        for line in stream:
            self._lines.put(line)
        self._lines.put(None)

    def take(self, seconds):
        """The next line; nothing where none came within `seconds`. Fails where the process has ended."""
        try:
            line = self._lines.get(timeout=max(seconds, 0.0))
        except queue.Empty:
            return ""
        assert line is not None, f"MAVProxy has ended: {self.heard}"
        self.heard.append(line)
        return line

    def close(self):
        """Read what is left of a process that has ended."""
        self._reader.join(10.0)

    def wait_for(self, text):
        deadline_s = monotonic() + DEADLINE_S
        while not any(text in line for line in self.heard):
            assert monotonic() < deadline_s, f"MAVProxy does not say '{text}', but {self.heard}"
            self.take(deadline_s - monotonic())


@contextmanager
def mavproxy(port, folder):
    """A MAVProxy that listens at `port` and keeps its files in `folder`; ended when the block is left."""
    process = subprocess.Popen(
        [
            MAVPROXY,
            f"--master=udpin:127.0.0.1:{port}",
            "--non-interactive",
            "--default-modules=link,param,log",
            f"--state-basedir={folder}",
        ],
        cwd=folder,
        env={**os.environ, "HOME": str(folder), "PYTHONUNBUFFERED": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    )
    with process:
        output = Output(process)
        try:
            yield output
        finally:
            process.terminate()
            try:
                process.wait(10.0)
            except subprocess.TimeoutExpired:
                process.kill()
            output.close()


@pytest.fixture
def recording(tmp_path):
    """A simulated dive of some seconds, recorded."""
    path = tmp_path / "dive.tlog"
    framer = Framer()
    legs = (*rest("still", 1.0), Leg("ahead", "steady", 3.0, surge_m_s=0.3, transient_s=2.0))
    with TlogWriter(path) as writer:

        def record(unix_s, data):
            for frame in framer.feed(data):
                writer.write(round(unix_s * 1e6), frame.raw)

        simulate_dive(load_vehicle("ruvifist"), "hovering", Mission("ahead", legs), seed=1, sink=record)
    return path


@pytest.fixture
def port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


def frames(path):
    """How often each frame stands in a recording; none while nothing has been written yet."""
    try:
        return Counter(frame.raw for _, frame in read_tlog(path))
    except LogError:
        return Counter()


def test_mavproxy_detects_the_vehicle_of_a_replayed_recording_and_logs_its_frames(tmp_path, recording, port):
    folder = tmp_path / "mavproxy"
    folder.mkdir()
    ours = frames(recording)
    assert ours.total() > 1000
    with mavproxy(port, folder) as output:
        output.wait_for("Waiting for heartbeat")
        line = ["replay", str(recording), "--link", f"udpout:127.0.0.1:{port}", "--speed", SPEED]
        assert cli.main(line) == exit_codes.DONE
        output.wait_for("Detected vehicle 1:1")
        deadline_s = monotonic() + DEADLINE_S
        while (missed := (ours - frames(folder / "mav.tlog")).total()) > MOST_MISSED * ours.total():
            assert monotonic() < deadline_s, f"{missed} of {ours.total()} frames are not in MAVProxy's log"
            output.take(0.2)
