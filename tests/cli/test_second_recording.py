"""A second recording, of another vehicle: found by its links and its dive, and never stopped in place of the first."""

import os

import pytest
from diving_vehicle import Dive
from fakes.telling import HUB, LINK, telling
from fakes.vehicle import FakeLink

from bridge.clock import SystemClock
from bridge.errors import LinkError
from gcs_plugin.dives.folder import new_folder
from gcs_plugin.fetch.merging import write_records
from gcs_plugin.recording.state import held, held_second, release, state_file, write_holding
from tui import links
from tui.links import coming_back, link_for, recordings_now, refuse_second

pytestmark = pytest.mark.usefixtures("switched_off")

FIRST, SECOND = LINK, "udpin:127.0.0.1:14621"
OTHER_HUB = "tcp:127.0.0.1:4712"


def of_recording(**changed):
    return telling(**{"pid": os.getppid(), "folder": "/dives/first"} | changed)


@pytest.fixture
def two():
    """Two recordings that run, so far as they tell."""
    second = of_recording(pid=os.getpid(), hub=OTHER_HUB, links=(SECOND,), folder="/dives/second")
    write_holding(of_recording())
    write_holding(second, second=True)
    yield second
    release()


def dead(name):
    """A link that is lost at once."""
    return FakeLink(name, reads_fail=True, writes_fail=True)


@pytest.fixture
def opened(monkeypatch):
    """The names of the links that were opened."""
    names = []

    def open_dead(name):
        names.append(name)
        return dead(name)

    monkeypatch.setattr("bridge.links.open.open_link", open_dead)
    return names


def test_both_are_told_the_first_first_and_the_second_takes_its_place(two):
    now_s = SystemClock().unix_s()
    assert [item.folder for item in recordings_now()] == ["/dives/first", "/dives/second"]
    assert held(now_s).folder == "/dives/first"
    assert [item.folder for item in held_second(now_s)] == ["/dives/second"]
    write_holding(two)
    assert [item.folder for item in recordings_now()] == ["/dives/second"]
    assert [path.name for path in state_file().parent.glob("recording.*")] == ["recording.json"]


@pytest.mark.usefixtures("two")
def test_what_a_killed_one_told_is_taken_away_by_the_next():
    write_holding(of_recording(pid=2**22 + 1, links=("udpin:127.0.0.1:9",)), second=True)
    assert len(recordings_now()) == 2
    release()
    assert list(state_file().parent.glob("recording.*.beside")) == []


@pytest.mark.usefixtures("two")
@pytest.mark.parametrize(("spec", "hub"), [(None, HUB), (FIRST, HUB), (SECOND, OTHER_HUB)])
def test_each_link_is_reached_by_way_of_the_recording_that_holds_it(opened, spec, hub, capsys):
    link = coming_back(link_for(spec), spec, SystemClock())
    assert opened == [hub]
    assert ("into /dives/second" in capsys.readouterr().err) == (hub == OTHER_HUB)
    link.close()


@pytest.mark.usefixtures("two")
def test_a_link_by_way_of_the_second_never_comes_back_by_way_of_the_first(monkeypatch):
    results = []
    monkeypatch.setattr(links, "Aside", lambda again, _: results.append(again))
    coming_back(dead(SECOND), SECOND, SystemClock())
    release()
    with pytest.raises(LinkError, match="no recording runs that could be listened to"):
        results[0]()


@pytest.mark.usefixtures("two")
@pytest.mark.parametrize(
    ("spec", "folder"), [(None, "/dives/first"), (SECOND, "/dives/second"), ("udpin:127.0.0.1:9", None)]
)
def test_watch_shows_the_recording_of_its_own_link_and_of_no_other(spec, folder):
    holding = links.holding_of(spec)
    assert (holding and holding.folder) == folder


@pytest.mark.usefixtures("two")
def test_its_link_is_refused_to_a_third_recording_with_the_way_to_it():
    with pytest.raises(LinkError, match=f"into /dives/second holds it.* by way of it with --link {SECOND}"):
        refuse_second([SECOND])


def test_a_dive_that_another_vehicles_ring_knows_nothing_of_says_whom_it_asked(
    tmp_path, monkeypatch, refused
):
    dive = Dive(tmp_path / "ring")
    dive.dive(5.0)
    made = new_folder(tmp_path / "dives", 1_790_000_000.0, "boat")
    write_records(made.path / "telemetry.tlog", dive.heard)
    write_holding(of_recording())
    other = Dive(tmp_path / "other")
    for _ in range(3):
        other.switch_on()
    other.dive(5.0)
    monkeypatch.setattr("tui.links.link_for", lambda *_: other)
    assert "holds nothing of this dive any more; the ground's is all there is (asked by way of" in refused(
        "fetch", made.path
    )


def test_a_fetch_by_the_link_of_the_second_means_its_dive_and_never_ends_that_of_the_first(
    two, tmp_path, monkeypatch, refused
):
    made = new_folder(tmp_path / "dives", 1_790_000_000.0, "boat")
    write_records(made.path / "telemetry.tlog", [])
    write_holding(of_recording(**vars(two) | {"folder": str(made.path)}), second=True)
    monkeypatch.setattr("tui.links.link_for", lambda *_: dead(SECOND))
    assert f"{made.path}: is still recorded, by process {os.getpid()}, beside what" in refused(
        "fetch", "--link", SECOND
    )
    assert list(state_file().parent.glob("*.asked")) == []
