"""A recording that hangs, ends, or drops a client: every verb that uses its hub says which."""

import os
import signal
import socket
import subprocess
import sys

import pytest
from fakes.telling import HUB, LINK, telling
from fakes.vehicle import QuietLink

from bridge import exit_codes
from bridge.clock import SimulatedClock, SystemClock
from bridge.errors import LinkError, LinkLost
from gcs_plugin.recording.state import held, hung, write_holding
from tui import cli
from tui.links import ByWay, link_for

FAR = "udpout:127.0.0.1:14559"
HANGS = f"the recording into /dives/a hangs and keeps its links: end it with `kill -9 {os.getpid()}`"


def holding(unix_s, **changed):
    return telling(written_unix_s=unix_s, **{"links": (LINK, FAR)} | changed)


@pytest.fixture
def stopped():
    """A recording whose state is 13 s old, though its process, this one, is there."""
    write_holding(holding(SystemClock().unix_s() - 13.0))


@pytest.mark.usefixtures("stopped")
@pytest.mark.parametrize(
    "line",
    [
        "ff off --seconds 1", "ff both --yes", "params show", "note caught", "conditions", "watch --once", "fetch",
        "fetch --new", "doctor", "record --next", "record --end", f"record --link {LINK} --seconds 1",
        f"record --link {FAR} --seconds 1",
    ],
)  # fmt: skip
def test_every_verb_names_the_process_that_hangs_and_how_to_end_it(line, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(line.split()) == exit_codes.LINK
    output = " ".join(capsys.readouterr().err.split())
    assert f"{HANGS} (what it wrote is kept), then begin another" in output
    assert "no recording runs" not in output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("stopped")
@pytest.mark.parametrize("words", [[], ["--view-only"]])
def test_the_app_names_it_where_no_link_is_given(words):
    from tui.commands import tui

    with pytest.raises(LinkError, match="hangs and keeps its links"):
        tui._begins(cli.verb_parser("tui").parse_args(words))


def test_off_by_a_port_that_one_which_hangs_keeps_names_it(capsys):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as kept:
        kept.bind(("127.0.0.1", 0))
        link = f"udpin:127.0.0.1:{kept.getsockname()[1]}"
        write_holding(holding(SystemClock().unix_s() - 13.0, links=(link,)))
        assert cli.main(["ff", "off", "--link", link, "--seconds", "1"]) == exit_codes.LINK
    assert f"{link}: {HANGS}" in " ".join(capsys.readouterr().err.split())


@pytest.mark.usefixtures("stopped")
@pytest.mark.parametrize("spec", [FAR, "udpin:127.0.0.1:0"])
def test_a_link_that_opens_beside_one_that_hangs_is_taken(spec):
    link = link_for(spec)
    assert link.name.startswith(spec.rpartition(":")[0])
    link.close()


class Course(QuietLink):
    """The hub of a recording as a client has it, by a clock that stands till somebody waits for something."""

    name = HUB

    def __init__(self, monkeypatch):
        self.clock = SimulatedClock()
        monkeypatch.setattr("bridge.clock.SystemClock", lambda: self.clock)
        self.data, self.lost = b"", False
        self.tell()
        self.link = ByWay(self, [LINK])

    def tell(self):
        """Write the state, as a recording does each second."""
        write_holding(holding(self.clock.unix_s()))

    def read(self, timeout_s):
        if self.lost:
            raise LinkLost(f"{HUB}: the other side has gone; plug it in or start it again")
        self.clock.advance_to(self.clock.boot_s() + timeout_s)
        return self.data

    def write(self, _):
        self.read(0.0)


@pytest.fixture
def course(monkeypatch):
    return Course(monkeypatch)


def reads(course, seconds, each=lambda: None):
    for _ in range(round(seconds / 0.5)):
        each()
        course.link.read(0.5)


def test_one_that_passed_nothing_on_and_tells_nothing_may_hang_before_a_cable_is_blamed(course):
    with pytest.raises(LinkLost, match=rf"process {os.getpid()} into /dives/a .* it may hang: .*kill -9"):
        reads(course, 4.0)


def test_a_recording_that_tells_on_is_never_said_to_hang_for_the_silence_of_a_vehicle(course):
    reads(course, 30.0, course.tell)
    assert course.clock.boot_s() == 30.0


def test_one_that_stops_after_it_was_heard_hangs_once_it_was_silent_for_ten_seconds(course):
    course.data = b"\xfd"
    reads(course, 5.0, course.tell)
    course.data = b""
    reads(course, 9.5)
    with pytest.raises(LinkLost, match="hangs and keeps its links"):
        reads(course, 2.0)


def test_one_that_passes_frames_on_does_not_hang_whatever_it_tells(course):
    course.data = b"\xfd"
    reads(course, 30.0)
    assert hung(course.clock.unix_s()) is not None


@pytest.mark.parametrize("ask", [lambda link: link.read(0.1), lambda link: link.write(b"x")])
def test_one_that_was_killed_or_let_this_program_go_says_so(course, ask):
    course.lost = True
    with pytest.raises(
        LinkLost, match=r"the recording of .*14550 has ended, or let go of this program.*ask again"
    ):
        ask(course.link)


@pytest.mark.skipif(sys.platform != "linux", reason="the system does not tell that a process has ended")
def test_one_that_was_killed_is_gone_before_its_parent_asks_for_its_end():
    ours = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        write_holding(holding(1_790_000_000.0, pid=ours.pid))
        assert held(1_790_000_000.0) is not None
        os.kill(ours.pid, signal.SIGKILL)
        # Waits for its end, and leaves it to be asked for.
        os.waitid(os.P_PID, ours.pid, os.WEXITED | os.WNOWAIT)
        os.kill(ours.pid, 0)
        assert held(1_790_000_000.0) is None
        assert hung(1_790_000_020.0) is None
    finally:
        ours.communicate()
