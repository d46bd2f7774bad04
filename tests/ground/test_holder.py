"""Who holds the links is told by a file that can't be taken for the truth when it is none."""

import math
import os
import subprocess
import sys
from dataclasses import replace

import pytest

from bridge.errors import LogError
from gcs_plugin.recording.state import Holding, held, hung, release, state_file, write_holding

NOW_S = 1_790_000_000.0


def holding(**changed):
    told = Holding(
        os.getpid(), "tcp:127.0.0.1:4711", ("udpin:127.0.0.1:14550", "serial:/dev/ttyUSB0"), "/dives/a",
        "2026-11-20T09:12:03Z", 12345, 678901, 2, 147600.0, ("warning: the disk has 1.0 MB left",), NOW_S,
    )  # fmt: skip
    return replace(told, **changed)


def test_what_is_told_is_learnt():
    write_holding(holding())
    assert held(NOW_S + 1.0) == holding()
    assert state_file().parts[-2:] == ("seatrial", "recording.json")
    assert [path.name for path in state_file().parent.iterdir()] == ["recording.json"]


def test_where_nothing_comes_the_disk_lasts_for_ever():
    write_holding(holding(disk_left_s=math.inf))
    assert held(NOW_S).disk_left_s == math.inf


def test_nobody_holds_anything_before_somebody_does():
    assert held(NOW_S) is None
    release()


@pytest.mark.parametrize("now_s", [NOW_S + 10.5, NOW_S - 10.5])
def test_one_that_has_told_nothing_for_ten_seconds_holds_nothing(now_s):
    write_holding(holding())
    assert held(NOW_S + 9.5) == holding()
    assert held(now_s) is None


@pytest.mark.parametrize(
    ("age_s", "hangs"), [(9.5, False), (10.5, True), (3599.0, True), (3601.0, False), (-10.5, True)]
)
def test_one_that_tells_nothing_and_whose_process_is_there_hangs_for_an_hour(age_s, hangs):
    write_holding(holding())
    assert hung(NOW_S + age_s) == (holding() if hangs else None)


def test_one_whose_process_has_gone_holds_nothing():
    with subprocess.Popen([sys.executable, "-c", ""]) as gone:
        gone.wait(20)
    write_holding(holding(pid=gone.pid))
    assert held(NOW_S) is None
    assert hung(NOW_S + 20.0) is None


@pytest.mark.parametrize("pid", [0, -1, 1 << 70])
def test_a_number_that_no_process_can_have_holds_nothing(pid):
    write_holding(holding(pid=pid))
    assert held(NOW_S) is None


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"pid": 1}', "\xff"])
def test_a_file_that_says_something_else_is_nobodys(text):
    state_file().parent.mkdir(parents=True, exist_ok=True)
    state_file().write_text(text, encoding="latin-1")
    assert held(NOW_S) is None
    release()


def test_only_who_told_it_takes_it_back():
    write_holding(holding(pid=os.getppid()))
    release()
    assert held(NOW_S) is not None
    write_holding(holding())
    release()
    assert held(NOW_S) is None
    assert not state_file().exists()


def test_a_place_that_can_not_be_written_is_said(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    with pytest.raises(LogError, match="nobody learns of the recording"):
        write_holding(holding())
    assert held(NOW_S) is None


def test_without_a_word_from_the_environment_it_lies_in_the_users_own_folder(monkeypatch, tmp_path):
    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert state_file() == tmp_path / ".local" / "state" / "seatrial" / "recording.json"
