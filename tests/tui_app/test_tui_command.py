"""`seatrial tui`: what is refused before the screen is taken, and the recording that is begun beside it."""

import os
import subprocess
import threading
from dataclasses import replace

import pytest

from bridge.clock import SimulatedClock
from bridge.errors import LinkError
from bridge.reports import ERROR, Report, line
from gcs_plugin.recording.state import Holding
from tui import cli
from tui.app import recorder
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
        ([], "give --link SPEC, or start `seatrial record`"),
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


def test_where_a_recording_runs_its_hub_is_the_link(monkeypatch):
    monkeypatch.setattr("gcs_plugin.recording.state.held", lambda _: HOLDING)
    monkeypatch.setattr(recorder, "begin", None)
    assert tui._open(arguments())[0] == tui.OF_RECORDING
    assert tui._open(arguments("--link", HOLDING.links[0]))[0] == tui.OF_RECORDING


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
        tui._open(arguments(*words))


def test_where_none_runs_one_is_begun_with_the_links_that_are_given(monkeypatch):
    begun = []
    monkeypatch.setattr("gcs_plugin.recording.state.held", lambda _: None)
    monkeypatch.setattr(recorder, "begin", lambda options, *_: begun.append(options) or HOLDING)
    words = ["--link", HOLDING.links[0], "--out", "here", "--vehicle", "ruvifist"]
    assert tui._open(arguments(*words))[0] == tui.OF_RECORDING
    assert begun == [words]


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


def begin(found):
    """Begin a recording that tells of itself at the first look after `found` gives it."""
    clock = SimulatedClock()

    def wait(seconds):
        clock.advance_to(clock.now_s + seconds)

    return recorder.begin(["--link", "x"], clock, wait, lambda _: found(clock.now_s))


def test_a_recording_is_begun_in_a_session_of_its_own_and_waited_for(process):
    assert begin(lambda now_s: HOLDING if now_s > 2.0 else None) == HOLDING
    assert process.detached
    assert process.command[1:] == ["-m", "tui", "record", "--link", "x"]
    assert process.waited_for.wait(10.0), "one that is killed stays among the processes"


def test_a_recording_that_does_not_start_says_why_and_one_that_says_nothing_is_not_waited_for_for_ever(
    process,
):
    with pytest.raises(LinkError, match="has not reported for 15 s"):
        begin(lambda _: None)
    why = "udpin:127.0.0.1:14550: in use; choose another port"
    process.code, process.words = 3, f"looking\n{line(Report(ERROR, 1.0, why))}".encode()
    with pytest.raises(LinkError, match=f"did not start: {why}"):
        begin(lambda _: None)


def test_without_a_recording_there_is_no_hub():
    assert recorder.recording(UNIX_S) is None
    with pytest.raises(LinkError, match="no recording runs"):
        recorder.hub()


def test_a_recording_that_has_ended_is_begun_again_with_its_own_links_and_never_twice(monkeypatch):
    begun = []
    monkeypatch.setattr("tui.links.holding_now", lambda: HOLDING)
    monkeypatch.setattr(recorder, "begin", lambda options, *_: begun.append(options))
    again = tui._again(arguments("--vehicle", "ruvifist", "--out", "here"))
    monkeypatch.setattr(recorder, "held", lambda _: HOLDING)
    again()
    assert begun == []
    monkeypatch.setattr(recorder, "held", lambda _: None)
    again()
    assert begun == [["--link", HOLDING.links[0], "--out", "here", "--vehicle", "ruvifist"]]


@pytest.mark.parametrize("words", [["--unrecorded", "--link", "x"], ["--view-only"]])
def test_an_app_that_records_nothing_begins_nothing_again(words, monkeypatch):
    monkeypatch.setattr("tui.links.holding_now", lambda: HOLDING)
    assert tui._again(arguments(*words)) is None
