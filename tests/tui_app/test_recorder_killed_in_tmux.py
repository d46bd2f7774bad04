"""The app for real in tmux beside the simulated vehicle, while its recorder is killed as for want of memory."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from fakes.ports import free_port
from tmux import NEEDS_TMUX, Tmux, alone

from bridge.wire.tlog import read_tlog
from gcs_plugin.recording.state import held

pytestmark = [pytest.mark.slow, NEEDS_TMUX]
SEATRIAL = (sys.executable, "-P", "-m", "tui")


@pytest.fixture
def vehicle(tmp_path):
    """The link of the simulated vehicle, afloat."""
    port = free_port()
    words = ["simulate", "--vehicle", "ruvifist:hovering", "--mission", "idle"]
    with subprocess.Popen(
        [*SEATRIAL, *words, "--link", f"tcpin:127.0.0.1:{port}"],
        cwd=tmp_path,
        env=alone(tmp_path),
        stderr=subprocess.PIPE,
        text=True,
    ) as simulator:
        try:
            assert "afloat" in simulator.stderr.readline()
            yield f"tcp:127.0.0.1:{port}"
        finally:
            simulator.terminate()
            simulator.stderr.close()


@pytest.fixture
def app(tmp_path, vehicle):
    """The app, which has begun the recording itself; whatever records in the end is ended."""
    line = f"cd {tmp_path}; {' '.join(SEATRIAL)} tui --link {vehicle}; echo ended with $?"
    terminal = Tmux(f"seatrial-killed-{os.getpid()}", 80, 24, "sh", alone(tmp_path))
    try:
        terminal.keys(line, "Enter")
        yield terminal
    finally:
        terminal.close()
        if holding := held(time.time()):
            os.kill(holding.pid, signal.SIGTERM)


def recorder():
    """The process that records, and the folder that it records into."""
    holding = held(time.time())
    return holding.pid, Path(holding.folder)


def test_off_reaches_the_vehicle_though_the_recorder_was_killed_just_before_the_key(
    app, tmp_path, monkeypatch
):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    app.until("□ DISARMED", "LINK ", "REC 00:00:", "FF off")
    subprocess.run(
        [*SEATRIAL, "ff", "shadow", "--yes"], env=alone(tmp_path), check=True, capture_output=True, timeout=60
    )
    app.until("FF shadow")
    pid, first = recorder()
    os.kill(pid, signal.SIGKILL)
    app.keys("C-x")
    app.until("FF OFF, ", "□ DISARMED", "REC 00:00:", without=("LINK LOST", "no recording runs"))
    screen = app.until("FF off", "LINK ", without=("FF OFF, ",))
    assert screen.count("link 1/1") == 1, "the link of the recording that was killed has left its row behind"
    again, second = recorder()
    assert again != pid
    assert second != first
    assert all(list(read_tlog(folder / "telemetry.tlog")) for folder in (first, second))

    os.kill(again, signal.SIGSTOP)
    app.until("NOT RECORDING? silent ", "the recorder hangs since 1", f"kill -9 {again}")
    app.keys("C-g")
    app.until("nothing is recorded: ")
    os.kill(again, signal.SIGKILL)
    app.until("NOT RECORDING", "no recording runs that could be listened to")
    app.keys("C-e")
    app.until("speak to")
    app.keys("C-q")
    app.until("ended with 0")
