"""`seatrial fetch`: by --link, and by way of the recording that runs."""

import json
import threading

import pytest
from diving_vehicle import Dive
from fakes.recordings import raws
from fakes.telling import telling
from fakes.vehicle import FakeVehicle
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge import exit_codes
from bridge.clock import SystemClock
from bridge.onboard.ring import RingSize
from bridge.signing.key import SigningKey, write_key
from bridge.signing.link import Gate, SignedLink, Times
from bridge.wire.segments import segments_in
from bridge.wire.tlog import read_tlog
from bridge.wire.whole_recording import WHOLE
from gcs_plugin.dives.folder import new_folder
from gcs_plugin.fetch.into_dive import boots_in
from gcs_plugin.fetch.merging import write_records
from gcs_plugin.fetch.mirror import Mirror
from gcs_plugin.recording.hub import Hub
from gcs_plugin.recording.recorder import Recorder
from gcs_plugin.recording.state import write_holding
from tui import cli
from tui.commands.fetch import MIRROR

pytestmark = pytest.mark.usefixtures("switched_off")

KEY = SigningKey(bytes(range(32)))


@pytest.fixture
def dive(tmp_path):
    return Dive(tmp_path / "ring")


@pytest.fixture
def folder(dive, tmp_path):
    """A dive with a hole in it."""
    return dived(dive, tmp_path, unheard_s=5.0)


def dived(dive, tmp_path, unheard_s):
    for cut, seconds in ((False, 5.0), (True, unheard_s), (False, 5.0)):
        dive.cut(cut)
        dive.dive(seconds)
    made = new_folder(tmp_path / "dives", 1_790_000_000.0, "lake")
    write_records(made.path / "telemetry.tlog", dive.heard)
    return made


@pytest.fixture
def fetch(dive, tmp_path, monkeypatch):
    """Fetch over a link: the exit code, and the JSON."""
    monkeypatch.setattr("tui.links.link_for", lambda *_: dive)
    came = tmp_path / "came.json"
    out = ("--out", tmp_path / "dives", "--link", "udpin:127.0.0.1:14550", "--json", came)

    def run(*words):
        code = cli.main(["fetch", *map(str, (*words, *out))])
        return code, json.loads(came.read_text()) if came.exists() else None

    return run


def test_the_newest_dive_is_made_whole_by_one_command(dive, folder, fetch, capsys):
    code, answer = fetch()
    assert code == exit_codes.DONE
    assert answer["recording"] == str(folder.path / WHOLE)
    assert answer["missing"] == answer["frames"] - len(dive.heard) > 50
    assert "had not been heard; the dive is whole in" in capsys.readouterr().out


@pytest.mark.parametrize("autopilot", [dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, dialect.MAV_AUTOPILOT_PX4])
def test_an_autopilot_without_a_bridge_has_no_recording_and_is_asked_for_none(
    monkeypatch, tmp_path, capsys, autopilot
):
    vehicle = FakeVehicle(autopilot=autopilot)
    monkeypatch.setattr("tui.links.link_for", lambda *_: vehicle)
    monkeypatch.setattr("bridge.clock.SystemClock", lambda: vehicle.clock)
    words = ("fetch", "--new", "--out", str(tmp_path), "--link", "udpin:127.0.0.1:14550")
    assert cli.main(words) == exit_codes.LINK
    assert "an autopilot alone keeps no recording to fetch: start seatrial bridge" in capsys.readouterr().err
    assert "FILE_TRANSFER_PROTOCOL" not in vehicle.heard


def test_a_dive_of_which_the_vehicle_lost_a_part_too_has_another_exit_code(dive, fetch, tmp_path, capsys):
    made = dived(dive, tmp_path, unheard_s=30.0)
    segments = [segment for segment, _ in segments_in(dive.folder)]
    for segment in segments[len(segments) // 3 : 2 * len(segments) // 3]:
        (dive.folder / segment.name).unlink()
    code, answer = fetch(made.path)
    assert code == exit_codes.NO
    (hole,) = answer["holes"]
    assert 8.0 < hole["length_s"] < 20.0
    assert (
        "nobody has, the vehicle neither: its ring was full or let its oldest go" in capsys.readouterr().out
    )


def test_two_fetches_at_once_are_refused_and_the_second_sends_nothing(dive, folder, fetch, tmp_path, capsys):
    before = dive.world.now_s
    with Mirror(tmp_path / "dives" / MIRROR).locked():
        assert fetch()[0] == exit_codes.BAD_INPUT
    assert "another fetch is at work there; wait for its end" in capsys.readouterr().err
    assert dive.world.now_s == before
    assert not (folder.path / WHOLE).exists()
    assert fetch()[0] == exit_codes.DONE
    assert (folder.path / WHOLE).exists()


class SignedDive(Dive):
    """A dive whose vehicle signs, and hears nobody without the key."""

    def on_board(self, link):
        gate = Gate(self.name, KEY, Times(self.world), self.world, lambda _: None)
        return SignedLink(link, gate, self.world)


def test_over_a_signed_link_it_takes_the_key_and_the_dive_that_it_makes_is_not_signed(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    signed = SignedDive(tmp_path / "ring", bounds=RingSize(10_000_000, 4000))
    signed.dive(5.0)
    monkeypatch.setattr("bridge.links.open.open_link", lambda _: signed)
    monkeypatch.setattr("bridge.clock.SystemClock", lambda: signed.world)
    write_key(tmp_path / "lake.key", KEY)
    words = ["fetch", "--new", "--link", "udpin:127.0.0.1:14550", "--json", "came.json"]
    assert cli.main([*words, "--sign-key", "lake.key"]) == exit_codes.DONE
    data = json.loads((tmp_path / "came.json").read_text())
    made = raws(tmp_path / data["recording"])
    assert made == signed.kept()[: len(made)]
    assert len(made) == data["frames"] > 50
    capsys.readouterr()
    other = SigningKey(bytes(32))
    write_key(tmp_path / "other.key", other)
    assert cli.main([*words, "--sign-key", "other.key"]) != exit_codes.DONE
    assert "another key" in capsys.readouterr().err


def test_what_can_not_be_meant_is_refused(tmp_path, refused):
    out = ["--out", str(tmp_path), "--link", "udpin:127.0.0.1:14550"]
    assert "holds no dive to make whole" in refused("fetch", *out)
    assert "--new makes a folder of its own" in refused("fetch", tmp_path, "--new", *out)
    assert "--minutes is for --new" in refused("fetch", "--minutes", "3", *out)


def test_a_recording_that_tells_no_boot_is_refused_and_goes_on_in_its_folder(
    dive, tmp_path, monkeypatch, refused
):
    asked = []
    monkeypatch.setattr("gcs_plugin.recording.orders.next_dive", lambda *_: asked.append(1))
    dive.dive(5.0)
    made = new_folder(tmp_path / "dives", 1_790_000_000.0, "lake")
    write_records(made.path / "heard.tlog", dive.heard)
    untold = [(us, frame.raw) for us, frame in read_tlog(made.path / "heard.tlog") if not boots_in([frame])]
    write_records(made.path / "telemetry.tlog", untold)
    (made.path / "heard.tlog").unlink()
    write_holding(telling(links=("serial:/dev/x:9600",), folder=str(made.path)))
    assert "nothing in it tells which recording of the vehicle's is of this dive" in refused("fetch")
    assert asked == []


def test_by_way_of_the_recording_that_runs_no_link_is_named(dive, folder, tmp_path):
    clock, stop = SystemClock(), threading.Event()
    hub = Hub(clock)
    after = new_folder(tmp_path / "dives", 1_790_000_900.0, "after")
    read = dive.read

    def slowly(timeout_s):
        stop.wait(0.005)
        return read(timeout_s)

    dive.read = slowly
    recorder = Recorder([dive], after.open_telemetry, clock, lambda: 10**12, lambda _: None, outlet=hub)
    recording = threading.Thread(target=recorder.run, args=(stop,))
    recording.start()
    try:
        write_holding(telling(hub=hub.address, links=("serial:/dev/x:9600",), folder=str(after.path)))
        assert cli.main(["fetch", str(folder.path)]) == exit_codes.DONE
    finally:
        stop.set()
        recording.join()
        hub.close()
    assert hub.dropped == 0
    whole = raws(folder.path / WHOLE)
    sent = dive.kept()
    first = sent.index(whole[0])
    assert whole == sent[first : first + len(whole)]
    assert len(whole) > len(dive.heard)
