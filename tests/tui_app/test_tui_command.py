"""`seatrial tui`: what is refused before the screen is taken, and the recording that is begun beside it."""

import os
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.clock import SimulatedClock, SystemClock
from bridge.errors import LinkError
from bridge.reports import ERROR, Report, line
from bridge.wire.framing import Encoder, frame_at
from gcs_plugin.recording import orders
from gcs_plugin.recording.state import HeardVehicle, Holding
from tui import cli
from tui.app import recorder
from tui.app.connecting import Choice, ways
from tui.app.connection import Connection
from tui.commands import tui

UNIX_S = 1_795_251_151.0
HOLDING = Holding(
    pid=os.getpid(),
    hub="tcp:127.0.0.1:5790",
    links=("udpin:127.0.0.1:14550",),
    folder="dives/2026-11-21T0852Z",
    began_utc="2026-11-21T08:40:00Z",
    frames=1000,
    bytes=50_000,
    lost=3,
    disk_left_s=3600.0,
    notices=(),
    written_unix_s=UNIX_S,
)


@pytest.fixture(autouse=True)
def _own_folders(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.delenv("TEXTUAL_DRIVER", raising=False)


def arguments(*words):
    return cli.verb_parser("tui").parse_args(words)


def test_a_pipe_is_no_terminal(capsys):
    assert cli.main(["tui", "--link", "udpin:127.0.0.1:0"]) == 2
    assert "needs a terminal; `seatrial watch` writes lines to a pipe" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--link", "udpin"], "'udpin' is not a link"),
        (["--web"], "give --link SPEC, or start `seatrial record`"),
        (["--unrecorded"], "--unrecorded looks at one link"),
        (["--keymap", "keys.yaml"], "unknown action 'watch.chart'; did you mean 'watch.charts'?"),
        (["--view-only", "--link", "udpin:127.0.0.1:0"], "--view-only begins none"),
        (["--fps", "0"], "--help"),
        (["--theme", "pink"], "--help"),
        (["--control"], "give --web too"),
        (["--host=0.0.0.0"], "give --web too"),
        (["--port=0"], "give --web too"),
        (["--web", "--unrecorded"], "leave --unrecorded and --view-only out"),
        (["--web", "--view-only"], "leave --unrecorded and --view-only out"),
        (["--web", "--port", "70000"], "'70000' is no port"),
    ],
    ids=" ".join,
)
def test_what_can_t_be_shown_is_refused_before_the_screen_is_taken(words, why, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tui, "_is_terminal", lambda: True)
    (tmp_path / "keys.yaml").write_text('watch.chart: "x"', encoding="utf-8")
    assert cli.main(["tui", *words]) == 2
    assert why in capsys.readouterr().err


@pytest.mark.parametrize(
    ("holding", "words", "begins"),
    [
        (HOLDING, (), False),
        (HOLDING, ("--link", HOLDING.links[0]), False),
        (None, (), False),
        (None, ("--link", HOLDING.links[0]), True),
        (None, ("--link", HOLDING.links[0], "--unrecorded"), False),
    ],
)
def test_a_recording_is_begun_only_of_links_that_are_named_and_that_none_holds(
    holding, words, begins, monkeypatch
):
    monkeypatch.setattr("gcs_plugin.recording.state.held", lambda _: holding)
    assert tui._begins(arguments(*words)) is begins


@pytest.mark.parametrize(
    ("holding", "words", "why"),
    [
        (replace(HOLDING, hub=""), (), "serves nobody; end it first"),
        (HOLDING, ("--link", "udpin:127.0.0.1:14999"), "does not hold udpin:127.0.0.1:14999"),
    ],
)
def test_a_recording_that_serves_nobody_or_has_not_the_link_is_refused(holding, words, why, monkeypatch):
    monkeypatch.setattr("gcs_plugin.recording.state.held", lambda _: holding)
    with pytest.raises((LinkError, tui.exit_codes.UsageError), match=why):
        tui._begins(arguments(*words))


class FakeProcess:
    """Ends with `code` after it was looked at a few times, and says `words` on its standard error."""

    code, words, looks = None, b"", 0

    def __init__(self):
        self.waited_for = threading.Event()

    def __call__(self, command, *, stderr, start_new_session, **_):
        self.command, self.detached = command, start_new_session
        stderr.write(self.words)
        stderr.flush()
        return self

    def poll(self):
        self.looks += 1
        return self.code if self.looks > 2 else None

    def wait(self):
        self.waited_for.set()


@pytest.fixture
def process(monkeypatch):
    monkeypatch.setattr(subprocess, "Popen", made := FakeProcess())
    return made


def begin(look):
    """Begin a recording that tells of itself at the first look after `look` gives it."""
    clock = SimulatedClock()

    def wait(seconds):
        clock.advance_to(clock.now_s + seconds)

    return recorder.begin(["--link", "x"], clock, wait, lambda _: look(clock.now_s))


def test_a_recording_is_begun_in_a_session_of_its_own_and_waited_for(process):
    assert begin(lambda now_s: HOLDING if now_s > 2.0 else None) == HOLDING
    assert process.detached
    assert process.command[1:] == ["-m", "tui", "record", "--link", "x"]
    assert process.waited_for.wait(60.0), "one that is killed stays among the processes"


def test_a_recording_that_does_not_start_says_why_and_one_that_says_nothing_is_not_waited_for_for_ever(
    process,
):
    with pytest.raises(LinkError, match="has not reported for 15 s"):
        begin(lambda _: None)
    why = "udpin:127.0.0.1:14550: in use; choose another port"
    process.code, process.words = 3, f"looking\n{line(Report(ERROR, 1.0, why))}".encode()
    with pytest.raises(LinkError, match=f"did not start: {why}"):
        begin(lambda _: None)


@pytest.mark.usefixtures("process")
def test_a_recording_whose_folder_of_state_can_not_be_made_does_not_end_the_app(tmp_path, monkeypatch):
    (tmp_path / "state").write_text("no folder")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    with pytest.raises(
        LinkError, match=r"did not start: .*state/seatrial: Not a directory; check the rights"
    ):
        begin(lambda _: HOLDING)


@pytest.fixture
def begun(monkeypatch):
    """What recordings were begun with."""
    options = []
    monkeypatch.setattr(recorder, "begin", lambda given, *_: options.append(given))
    return options


@pytest.fixture
def running(monkeypatch):
    """Let a recording run, or none."""

    def run(holding):
        for name in ("gcs_plugin.recording.state.held", "tui.app.recorder.held"):
            monkeypatch.setattr(name, lambda _: holding)

    return run


def connection(*links, looked_at="", clock=None):
    return Connection(
        clock or SystemClock(), links, looked_at, "here", ("ruvifist", None), "", None, None, silent=False
    )


def test_a_recording_that_has_ended_is_begun_again_with_its_own_links_and_never_twice(begun, running):
    goes_by = connection()
    running(HOLDING)
    goes_by.recording(UNIX_S)
    goes_by.record()
    assert begun == []
    running(None)
    goes_by.record()
    assert begun == [["--link", HOLDING.links[0], "--out", "here", "--vehicle", "ruvifist"]]


def test_without_a_link_nothing_is_begun_until_one_is_chosen(begun, running):
    running(None)
    goes_by = connection()
    with pytest.raises(LinkError, match="no link is known yet"):
        goes_by.record()
    goes_by.connect(Choice("tcp:sub:5777", records=True))
    assert begun == [["--link", "tcp:sub:5777", "--out", "here", "--vehicle", "ruvifist"]]


def test_a_link_that_is_only_looked_at_begins_nothing_and_shows_no_recording_of_another(begun, running):
    running(HOLDING)
    station = FakeStation()
    goes_by = connection("tcp:sub:5777")
    goes_by.station = station
    goes_by.connect(Choice("tcp:sub:5777", records=False))
    assert (begun, len(station.changed)) == ([], 1)
    assert goes_by.recording(UNIX_S) is None
    assert goes_by.link() == "tcp:sub:5777"
    assert connection(looked_at=HOLDING.links[0]).recording(UNIX_S) == HOLDING


def test_a_link_that_is_looked_at_is_looked_at_again_where_its_recording_can_not_begin(monkeypatch, running):
    """OFF goes by it."""

    def fails(*_):
        raise LinkError("the recording did not start: the disk is full")

    running(None)
    monkeypatch.setattr(recorder, "begin", fails)
    goes_by = connection("tcp:sub:5777", looked_at="tcp:sub:5777")
    goes_by.station = station = FakeStation()
    with pytest.raises(LinkError, match="the disk is full"):
        goes_by.record()
    assert goes_by.link() == "tcp:sub:5777"
    assert len(station.changed) == 2


def test_off_of_a_vehicle_that_is_looked_at_does_not_turn_to_the_one_that_is_recorded(begun, running):
    """The key for OFF begins a recording, where the vehicle on screen has none."""
    running(HOLDING)
    goes_by = connection("tcp:sub:5777")
    goes_by.station = station = FakeStation()
    goes_by.connect(Choice("tcp:sub:5777", records=False))
    with pytest.raises(LinkError, match="is recorded already, and the app goes by one recording"):
        goes_by.record()
    assert (begun, len(station.changed), goes_by.link()) == ([], 1, "tcp:sub:5777")


@pytest.mark.parametrize("named", [(), ("udpin:127.0.0.1:14550",)])
def test_off_by_a_link_that_is_looked_at_waits_for_no_vehicle_of_a_recording_of_others(named, running):
    clock = SystemClock()
    heard = HeardVehicle(7, 191, holds=True, heard_unix_s=clock.unix_s())
    running(replace(HOLDING, written_unix_s=clock.unix_s(), vehicles=(heard,)))
    goes_by = connection(*named, clock=clock)
    goes_by.station = FakeStation()
    assert goes_by.switch(()).waits_for == (7,)
    goes_by.connect(Choice("tcp:sub:5777", records=False))
    assert goes_by.switch(()).waits_for == ()


def test_an_order_to_the_recording_of_a_second_vehicle_does_not_go_to_that_of_the_first(running, monkeypatch):
    second = replace(HOLDING, pid=HOLDING.pid + 1, links=("tcp:sub:5777",))
    running(HOLDING)
    monkeypatch.setattr("gcs_plugin.recording.state.held_second", lambda _: [second])
    ordered = []
    for name in ("next_dive", "end"):
        monkeypatch.setattr(orders, name, lambda *_, name=name: ordered.append(name) or (HOLDING, HOLDING))
    of_second, of_first = connection(looked_at="tcp:sub:5777"), connection()
    for order in (of_second.next_dive, of_second.end):
        with pytest.raises(LinkError, match=f"process {second.pid} .* takes no order from here"):
            order()
    of_first.next_dive()
    of_first.end()
    assert ordered == ["next_dive", "end"]


def test_the_app_goes_by_no_link_beside_a_recording_of_another(begun, running):
    running(HOLDING)
    with pytest.raises(
        LinkError, match=r"udpin:.* is recorded already, and the app goes by one recording: end it first"
    ):
        connection().connect(Choice("tcp:sub:5777", records=True))
    assert begun == []


def test_words_are_dated_by_the_clock_on_the_top_line_whatever_the_vehicle_believes(running):
    running(None)
    clock = SimulatedClock(unix_at_boot_s=UNIX_S)
    watcher = connection("tcp:sub:5777", clock=clock).watcher()
    vehicle = Encoder(1, 1)
    for message in (
        mav.MAVLink_heartbeat_message(mav.MAV_TYPE_SUBMARINE, mav.MAV_AUTOPILOT_GENERIC, 0, 0, 4, 3),
        mav.MAVLink_system_time_message(1_500_000_000_000_000, 60_000),
        mav.MAVLink_statustext_message(2, b"Leak Detected"),
    ):
        watcher.feed(frame_at(raw := vehicle.encode(message), 0, len(raw)), 5.0, "tcp:sub:5777")
    (said,) = watcher.picture(5.0).said
    assert (said.text, said.utc_s) == ("Leak Detected", UNIX_S + 5.0)


class FakeStation:
    def __init__(self):
        self.changed = []

    def change(self, *to):
        self.changed.append(to)


def test_every_recorder_that_lives_on_is_named_on_leaving(running, monkeypatch, capsys):
    second = replace(HOLDING, pid=1, folder="dives/other", links=("serial:/dev/ttyUSB0",))
    running(HOLDING)
    monkeypatch.setattr("gcs_plugin.recording.state.held_second", lambda _: [second])
    tui.list_recorders()
    first, other = capsys.readouterr().err.splitlines()
    assert (
        "into dives/2026-11-21T0852Z goes on, of udpin:127.0.0.1:14550; `seatrial record --end` ends it"
        in first
    )
    assert (
        "process 1 into dives/other goes on, of serial:/dev/ttyUSB0; Ctrl-C in its terminal ends it" in other
    )


def test_the_recording_that_was_listed_before_the_app_is_said_to_have_ended(running, capsys):
    running(replace(HOLDING, pid=HOLDING.pid + 1))
    tui.list_recorders(HOLDING)
    ended, _ = capsys.readouterr().err.splitlines()
    assert ended == f"the recording of process {HOLDING.pid} into dives/2026-11-21T0852Z has ended since"
    running(HOLDING)
    tui.list_recorders(HOLDING)
    assert "ended since" not in capsys.readouterr().err


def test_the_dives_of_the_present_folder_are_shown_where_there_is_no_folder_of_dives(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert tui.folder_of_dives("dives") == Path("dives")
    (tmp_path / "2026-11-21T0852Z-hovering").mkdir()
    (tmp_path / "2026-11-21T0852Z-hovering" / "telemetry.tlog").write_bytes(b"")
    assert tui.folder_of_dives("dives") == Path()
    assert tui.folder_of_dives("elsewhere") == Path("elsewhere")
    (tmp_path / "dives").mkdir()
    assert tui.folder_of_dives("dives") == Path("dives")


def test_the_ways_are_recordings_then_ports_then_addresses_and_what_is_recorded_stands_once():
    second = replace(HOLDING, links=("serial:/dev/ttyUSB0:57600",))
    offered = ways(
        [HOLDING, second], [("/dev/ttyUSB0", "DVL"), ("/dev/ttyACM0", "")], ["127.0.0.1", "192.168.2.1"]
    )
    assert [(way.link, way.recorded, way.others) for way in offered] == [
        ("udpin:127.0.0.1:14550", True, False),
        ("serial:/dev/ttyUSB0:57600", True, True),
        ("serial:/dev/ttyACM0:115200", False, False),
        ("udpin:192.168.2.1:14550", False, False),
    ]


def test_the_first_screen_waits_for_no_library_that_only_the_mathematics_need():
    """Each of them takes longer to load than the app may take to show its first screen."""
    heavy = "{'scipy', 'numba', 'torch', 'matplotlib', 'aiohttp', 'pandas'}"
    line = f"import sys, tui.commands.tui; print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
