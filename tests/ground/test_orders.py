"""Who holds the links says so in a file, and takes orders for the next dive and the end."""

import math
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from fakes.telling import telling

from bridge.clock import SimulatedClock, utc_text
from bridge.errors import LinkError
from gcs_plugin.recording import orders
from gcs_plugin.recording.orders import Order
from gcs_plugin.recording.state import held, hung, release, state_file, was_killed, write_holding

LONG_S = 600.0


class Recording:
    """A recording that looks at its orders whenever it is waited for; `obeys` says which it does."""

    def __init__(self, began_s=0.0, obeys=tuple(Order)):
        self.clock = SimulatedClock()
        self.clock.advance_to(LONG_S)
        self.obeys, self.heard = obeys, []
        began_utc = utc_text(self.clock.unix_s() - LONG_S + began_s)
        self.told = telling(began_utc=began_utc)
        self.tell()

    def tell(self):
        write_holding(replace(self.told, written_unix_s=self.clock.unix_s()))

    def wait(self, seconds):
        self.clock.advance_to(self.clock.boot_s() + seconds)
        order = orders.ordered() if self.obeys is not None else None
        if order is not None:
            self.heard.append(order)
        if order in (self.obeys or ()):
            self.told = replace(self.told, folder="/dives/b")
        self.tell()
        if order is Order.END and order in self.obeys:
            release()


def test_the_next_dive_is_asked_for_once_and_both_folders_are_told():
    recording = Recording()
    assert orders.next_dive(recording.clock, recording.wait) == (Path("/dives/a"), Path("/dives/b"))
    assert recording.heard == [Order.NEXT]
    assert orders.ordered() is None
    assert [path.name for path in state_file().parent.iterdir()] == ["recording.json"]


def test_a_flight_that_was_refused_at_once_is_followed_by_a_dive_of_its_own_as_soon_as_may_be():
    recording = Recording(began_s=LONG_S - 3.0)
    assert orders.next_dive(recording.clock, recording.wait, soon=True) == (
        Path("/dives/a"),
        Path("/dives/b"),
    )
    assert recording.clock.boot_s() == pytest.approx(LONG_S + 2.0, abs=0.2)


def test_an_end_is_waited_for_and_the_folder_told():
    recording = Recording()
    assert orders.end(recording.clock, recording.wait) == Path("/dives/a")
    assert recording.heard == [Order.END]
    assert held(recording.clock.unix_s()) is None


@pytest.mark.parametrize("ask", [orders.next_dive, orders.end])
def test_where_none_runs_it_is_said_what_to_do(ask):
    with pytest.raises(LinkError, match="no recording runs; start `seatrial record`"):
        ask(SimulatedClock(), lambda _: None)


@pytest.mark.parametrize("set_by_s", [-86_400.0, 86_400.0])
def test_a_clock_that_is_set_in_a_dive_makes_it_neither_younger_nor_older(set_by_s):
    long, short = Recording(), Recording(began_s=LONG_S - 3.0)
    for recording in (long, short):
        recording.clock.unix_at_boot_s += set_by_s
        recording.told = replace(recording.told, set_by_s=set_by_s)
        recording.tell()
    with pytest.raises(LinkError, match="this dive has only just begun"):
        orders.next_dive(short.clock, short.wait)
    long.tell()
    assert orders.next_dive(long.clock, long.wait) == (Path("/dives/a"), Path("/dives/b"))


def test_one_that_does_not_go_on_elsewhere_is_told_with_its_last_word():
    recording = Recording(obeys=())
    recording.told = replace(recording.told, notices=("error: no next dive: dives: the disk is full",))
    with pytest.raises(
        LinkError, match="goes on recording into /dives/a; its last word: error: no next dive"
    ):
        orders.next_dive(recording.clock, recording.wait)
    assert recording.clock.boot_s() == pytest.approx(LONG_S + 15.0, abs=0.2)


def test_an_order_that_nobody_took_is_withdrawn():
    recording = Recording(obeys=None)
    with pytest.raises(LinkError, match="goes on recording"):
        orders.end(recording.clock, recording.wait)
    assert orders.ordered() is None


def test_a_recording_that_dies_meanwhile_has_no_next_dive():
    recording = Recording()

    def die(seconds):
        recording.clock.advance_to(recording.clock.boot_s() + seconds)
        release()

    with pytest.raises(LinkError, match="has ended, and the next dive is not recorded"):
        orders.next_dive(recording.clock, die)


@pytest.mark.parametrize("ask", [orders.next_dive, orders.end])
def test_one_that_hangs_meanwhile_has_not_ended(ask):
    recording = Recording()

    def hang(seconds):
        recording.clock.advance_to(recording.clock.boot_s() + seconds)

    with pytest.raises(LinkError, match=rf"/dives/a hangs .* `kill -9 {os.getpid()}`"):
        ask(recording.clock, hang)
    assert orders.ordered() is None


def test_an_order_to_another_process_is_not_ours():
    with subprocess.Popen(
        [sys.executable, "-c", "import sys; sys.stdin.read()"], stdin=subprocess.PIPE
    ) as other:
        recording = Recording()
        recording.told = replace(recording.told, pid=other.pid)
        recording.tell()
        with pytest.raises(LinkError):
            orders.end(recording.clock, recording.wait)
    assert recording.heard == []


@pytest.mark.parametrize("text", ["", "sink", "\xff"])
def test_what_is_no_order_is_cleared_away(text):
    file = state_file().with_name(f"recording.{os.getpid()}.asked")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="latin-1")
    assert orders.ordered() is None
    orders.forget()
    assert not file.exists()


NOW_S = 1_790_000_000.0


def holding(**changed):
    full = {
        "frames": 12345,
        "bytes": 678901,
        "lost": 2,
        "disk_left_s": 147600.0,
        "notices": ("warning: full",),
    }
    return telling(**full | {"written_unix_s": NOW_S} | changed)


@pytest.mark.parametrize("disk_left_s", [147600.0, math.inf])
def test_what_is_told_is_learnt(disk_left_s):
    write_holding(holding(disk_left_s=disk_left_s))
    assert held(NOW_S + 1.0) == holding(disk_left_s=disk_left_s)
    assert state_file().parts[-2:] == ("seatrial", "recording.json")
    assert [path.name for path in state_file().parent.iterdir()] == ["recording.json"]


@pytest.mark.parametrize(
    ("age_s", "holds", "hangs"),
    [(9.5, True, False), (10.5, False, True), (3599.0, False, True), (3601.0, False, False), (-10.5, False, True)],
)  # fmt: skip
def test_one_that_tells_nothing_for_ten_seconds_holds_nothing_and_hangs_for_an_hour(age_s, holds, hangs):
    write_holding(holding())
    assert held(NOW_S + age_s) == (holding() if holds else None)
    assert hung(NOW_S + age_s) == (holding() if hangs else None)


@pytest.mark.parametrize("set_by_s", [-86_400.0, -20.0, 0.0, 20.0, 86_400.0])
def test_one_that_hangs_does_so_though_the_clock_was_set_meanwhile(set_by_s):
    write_holding(holding(written_monotonic_s=time.monotonic() - 15.0))
    assert held(NOW_S + set_by_s) is None
    assert hung(NOW_S + set_by_s) is not None


def test_after_a_loss_of_power_no_process_that_got_its_number_is_taken_for_it():
    write_holding(holding(pid=os.getppid(), boot="of-the-run-before"))
    assert held(NOW_S) is None
    assert hung(NOW_S + 20.0) is None
    assert was_killed(os.getppid())


def test_one_whose_process_has_gone_holds_nothing():
    with subprocess.Popen([sys.executable, "-c", ""]) as gone:
        gone.wait(20)
    write_holding(holding(pid=gone.pid))
    assert held(NOW_S) is None
    assert hung(NOW_S + 20.0) is None


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
