"""The app for real: in tmux, against the frames of a recording that is replayed, driven by keys and read back."""

import os
import re
import signal
import sys
import time
from pathlib import Path

import pytest
from replayed_vehicle import ReplayedVehicle, free_port, record
from tmux import NEEDS_TMUX, PATIENCE_S, Tmux, alone
from waiting import until

from gcs_plugin.recording.state import held

BARE = frozenset({"", "0", "1", "2", "4", "7", "22", "24", "27", "39", "49"})
"""What sets and resets bold, dim, underline and inverse, and the terminal's own colours: all else of `CSI ... m` is a
colour, or another style."""

pytestmark = [pytest.mark.slow, NEEDS_TMUX]


@pytest.fixture
def port():
    return free_port()


@pytest.fixture
def app(tmp_path, port):
    terminal = Tmux(f"seatrial-{os.getpid()}-{port}", 80, 24, "sh", alone(tmp_path))
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
    app.until("1 Watch", "? ARMED STATE UNKNOWN", "NO LINK", "NOT REC", "Ctrl-X FF off")
    vehicle.start()
    app.until("■ ARMED", "LINK 0.", "sys 1/1", "FF both", "surge u", "ref   0.300", "DVL")

    app.keys("C-x")
    app.until("FF both; OFF", "times")
    assert vehicle.asked > 1
    app.keys("?")
    app.until("Everywhere", "sent until it is acknowledged", "FF both; OFF")
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


@pytest.mark.skipif(sys.platform != "linux", reason="reads the threads of a process in /proc")
def test_an_app_that_is_stopped_and_goes_on_has_no_more_threads_and_leaves_the_terminal_as_it_was(
    app, vehicle, tmp_path
):
    vehicle.start()
    # A shell that does not watch over what it runs, and so takes nothing back from one that is stopped.
    watched = f"stty -a > {tmp_path}/before; {app.line} --unrecorded; stty -a > {tmp_path}/after"
    app.keys(f"sh -c '{watched}'; echo ended with $?", "Enter")
    app.until("■ ARMED", "surge u", "FF both")
    of_child = "/proc/{0}/task/{0}/children"
    (shell,) = Path(of_child.format(app.process())).read_text().split()
    (pid,) = map(int, Path(of_child.format(shell)).read_text().split())
    threads = Path(f"/proc/{pid}/task")
    before = len(list(threads.iterdir()))
    sent = tmp_path / "bytes"
    sent.touch()
    app.keep(sent)
    for turn in range(1, 6):
        os.kill(pid, signal.SIGSTOP)
        os.kill(pid, signal.SIGCONT)
        # A key that comes while the threads are replaced may be lost: the screen is set up again after that.
        until(lambda turn=turn: sent.read_bytes().count(b"\x1b[?1049h") >= turn)
        app.keys("?")
        app.until("Everywhere")
        app.keys("Escape")
        app.until("surge u", "LINK 0.", without=("Everywhere",))
    until(lambda: len(list(threads.iterdir())) <= before)
    app.keys("C-q")
    app.until("ended with 0")
    assert (tmp_path / "after").read_text() == (tmp_path / "before").read_text()


def test_the_recording_that_the_app_began_outlives_it(app, vehicle, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    vehicle.start()
    app.keys(f"{app.line} --out {tmp_path}; echo ended with $?", "Enter")
    app.until("■ ARMED", "REC 00:00:", "FF both")
    app.keys("C-q")
    app.until("ended with 0")

    holding = held(time.time())
    try:
        (recorded,) = Path(holding.folder).glob("*.tlog")
        before = recorded.stat().st_size
        assert before > 0
        until(lambda: recorded.stat().st_size > before, PATIENCE_S)

        app.keys("clear", "Enter", f"{sys.executable} -m tui tui; echo ended again with $?", "Enter")
        app.until("■ ARMED", "REC 00:00:", "FF both")
        app.keys("C-q")
        app.until("ended again with 0")
    finally:
        os.kill(holding.pid, signal.SIGTERM)


def test_with_no_color_not_one_byte_of_colour_is_sent(tmp_path, port, vehicle):
    kept = tmp_path / "bytes"
    environment = alone(tmp_path) | {"NO_COLOR": "1"}
    terminal = Tmux(f"seatrial-bare-{os.getpid()}-{port}", 80, 24, "sh", environment)
    line = f"{sys.executable} -m tui tui --link udpin:127.0.0.1:{port}"
    try:
        terminal.keys("clear", "Enter")
        terminal.keep(kept)
        vehicle.start()
        terminal.keys(f"{line} --unrecorded --out {tmp_path}; echo ended with $?", "Enter")
        terminal.until("■ ARMED", "FF both", "surge u")
        for key, word in (("2", "DIVES"), *((key, "dive") for key in "3456"), ("?", "Everywhere")):
            terminal.keys(key)
            terminal.until(word)
        terminal.keys("Escape")
        terminal.until("6 Validate", without=("Everywhere",))
        terminal.keys("C-x", "t", "C-p")
        terminal.until("; OFF", "Search for commands")
        terminal.keys("C-c", "Escape")
        terminal.until("6 Validate", without=("Search for commands",))
        terminal.keys("1")
        terminal.until("; OFF", "surge u")
        terminal.keys("C-q", "C-q")  # once more, since nobody has confirmed OFF
        terminal.until("ended with 0")
    finally:
        terminal.close()
    sent = re.findall(rb"\x1b\[([0-9;:]*)m", kept.read_bytes())
    assert len(sent) > 100
    assert {number for code in sent for number in code.decode().split(";")} <= BARE
