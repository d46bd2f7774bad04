"""Who runs a recording needs no --link for anything else: all goes by way of its hub."""

import json
import os
import threading
from pathlib import Path

import pytest
import yaml
from fakes.telling import HUB, LINK, telling
from fakes.vehicle import QuietLink
from pymavlink.dialects.v20 import ardupilotmega as dialect
from waiting import until

from bridge import exit_codes
from bridge.errors import LinkError
from bridge.exit_codes import UsageError
from bridge.links.addresses import same_link
from bridge.links.link import memory_pair
from bridge.links.open import open_link
from bridge.onboard.parameters import parameters_of
from bridge.vehicle.config import load_vehicle
from bridge.wire.framing import Encoder, decode
from bridge.wire.tlog import read_tlog
from gcs_plugin.dives.folder import About, new_folder
from gcs_plugin.recording.hub import Hub
from gcs_plugin.recording.recorder import Recorder
from gcs_plugin.recording.state import held, state_file, write_holding
from gcs_plugin.simulated import afloat
from identify.ingest.open import read_dive
from tui import cli
from tui.links import link_for

LINKS = (LINK, "serial:/dev/ttyUSB0:57600")


@pytest.fixture
def opened(monkeypatch):
    """The names of the links that were opened."""
    names = []
    monkeypatch.setattr("bridge.links.open.open_link", names.append)
    return names


@pytest.fixture
def running():
    """A recording that runs, so far as it tells."""
    return lambda **changed: write_holding(telling(**{"links": LINKS} | changed))


@pytest.mark.parametrize(
    ("link", "other"),
    [
        (LINK, LINK),
        (LINK, "udpin::14550"),
        (LINK, "udpin:localhost:14550"),
        (LINK, "udpin:0.0.0.0:14550"),
        ("tcpin:0.0.0.0:5760", "tcpin:192.168.2.1:5760"),
        ("serial:/dev/ttyUSB0", "serial:/dev/ttyUSB0:57600"),
        ("udpout:192.168.2.2:14550", "udpout:192.168.2.2:14550"),
    ],
)
def test_one_link_is_known_by_any_of_its_names(link, other):
    assert same_link(link, other)
    assert same_link(other, link)


@pytest.mark.parametrize(
    ("link", "other"),
    [
        *(
            (LINK, other)
            for other in ("udpin:127.0.0.1:14551", "udpin:192.168.2.1:14550", "tcpin:127.0.0.1:14550",
                          "udpout:127.0.0.1:14550", "any", "")
        ),
        ("udpin:127.0.0.1:0", "udpin:127.0.0.1:0"),
    ],
)  # fmt: skip
def test_another_link_is_another_and_a_port_still_to_be_chosen_is_nobodys(link, other):
    assert not same_link(link, other)
    assert not same_link(other, link)


def test_a_serial_port_is_one_by_either_of_its_names(tmp_path):
    (tmp_path / "ttyUSB7").touch()
    (tmp_path / "by-id").symlink_to(tmp_path / "ttyUSB7")
    assert same_link(f"serial:{tmp_path}/by-id", f"serial:{tmp_path}/ttyUSB7:57600")


def test_a_link_is_opened_where_no_recording_runs(opened):
    link_for(LINK)
    assert opened == [LINK]


@pytest.mark.parametrize("spec", [None, LINK, "udpin:0.0.0.0:14550", "serial:/dev/ttyUSB0"])
def test_the_links_of_a_recording_are_reached_by_way_of_it_and_that_is_said(opened, running, spec, capsys):
    running()
    link_for(spec)
    assert opened == [HUB]
    assert f"by way of the recording of process {os.getpid()} into /dives/a" in capsys.readouterr().err


@pytest.mark.parametrize("spec", [HUB, "udpin:127.0.0.1:14551"])
def test_a_link_that_it_does_not_hold_is_opened_beside_it(opened, running, spec, capsys):
    running()
    link_for(spec)
    assert opened == [spec]
    assert capsys.readouterr().err == ""


def test_without_a_link_and_without_a_recording_it_is_said_what_to_do(opened):
    with pytest.raises(UsageError, match="give --link SPEC, or start `seatrial record`"):
        link_for(None)
    assert opened == []


@pytest.mark.parametrize("spec", [None, LINK])
def test_a_recording_that_serves_nobody_is_named(opened, running, spec):
    running(hub="")
    with pytest.raises(
        LinkError, match=f"process {os.getpid()} into /dives/a holds the link and serves nobody"
    ):
        link_for(spec)
    assert opened == []


@pytest.mark.usefixtures("opened")
def test_a_second_recording_of_one_link_is_refused_with_who_records_it(running, tmp_path, capsys):
    running()
    line = ["record", "--link", "udpin:0.0.0.0:14550", "--out", str(tmp_path)]
    assert cli.main(line) == exit_codes.LINK
    output = capsys.readouterr().err
    assert f"process {os.getpid()} into /dives/a holds it" in output
    assert list(tmp_path.iterdir()) == []


class Seat(QuietLink):
    """A client of the hub that lets the whole of it live on, vehicle and recorder, whenever it reads."""

    def __init__(self, recorder, hub):
        self._recorder, self._inner = recorder, open_link(hub.address)
        self.name = self._inner.name

    def read(self, timeout_s):
        self._recorder.step(timeout_s)
        return self._inner.read(0.0)

    def write(self, data):
        self._inner.write(data)

    def close(self):
        self._inner.close()


@pytest.fixture
def at_sea(monkeypatch, tmp_path):
    """A simulated vehicle afloat with a recording that serves its link: its parameters, and the dive's folder."""
    file = load_vehicle("ruvifist")
    parameters = parameters_of(file, None)
    link, clock = afloat(file, "hovering", 1, parameters)
    hub = Hub(clock)
    folder = new_folder(tmp_path / "dives", clock.unix_s(), "hub")
    folder.describe(About())
    recorder = Recorder(
        [link], folder.open_telemetry, clock, lambda: 1 << 40, lambda _: None, outlet=hub,
        before_sync=lambda: None,
    )  # fmt: skip
    monkeypatch.setattr("bridge.clock.SystemClock", lambda: clock)
    monkeypatch.setattr("bridge.links.open.open_link", lambda _: Seat(recorder, hub))
    write_holding(telling(hub=hub.address, folder=str(folder.path), links=LINKS))
    yield parameters, folder, recorder
    recorder.close()
    hub.close()


def test_parameters_and_mode_go_by_way_of_the_recording_which_keeps_what_was_asked(at_sea, tmp_path, capsys):
    parameters, folder, recorder = at_sea
    new = tmp_path / "new.param"
    new.write_text("FF1_M_U,111.5\nFF1_D_U,56.25\n", encoding="utf-8")
    receipts = ["--receipts", str(tmp_path / "receipts")]
    assert cli.main(["params", "upload", str(new), "--yes", *receipts]) == exit_codes.DONE
    assert parameters.active(1)["M_u"] == 111.5
    write_holding(telling(hub=held_hub(), folder=str(folder.path)))
    assert cli.main(["ff", "both", "--yes"]) == exit_codes.DONE
    write_holding(telling(hub=held_hub(), folder=str(folder.path)))
    assert cli.main(["ff", "off"]) == exit_codes.DONE
    assert parameters.mode == 0
    assert capsys.readouterr().err.count("by way of the recording") == 3
    recorder.close()
    frames = [frame for _, frame in read_tlog(folder.path / "telemetry.tlog")]
    asked = [decode(frame) for frame in frames if frame.system == 255]
    sets = [message.param_value for message in asked if message.get_type() == "PARAM_SET"]
    assert {111.5, 56.25, 3.0, 0.0} <= set(sets)
    assert recorder.kept.frames == len(frames)
    dive = read_dive(folder.path)
    assert None not in (dive.velocity, dive.gyro, dive.attitude, dive.fog)
    assert {float(value) for value in dive.ff_mode.value[:, 0]} == {0.0, 3.0}


def held_hub():
    return json.loads(state_file().read_text(encoding="utf-8"))["hub"]


@pytest.mark.usefixtures("at_sea")
def test_the_doctor_sees_a_vehicle_by_way_of_the_recording(tmp_path, capsys):
    line = ["doctor", "--vehicle", "ruvifist:hovering", "--out", str(tmp_path), "--json", "-"]
    cli.main(line)
    output = {finding["name"]: finding["level"] for finding in json.loads(capsys.readouterr().out)}
    heard = ("link", "loss", "time", "dvl", "imu", "fog", "parameters")
    assert [output[name] for name in heard] == ["ok"] * len(heard)


def test_a_note_is_an_event_of_the_dive_that_is_recorded(at_sea, capsys):
    _, folder, _ = at_sea
    assert cli.main(["note", "tether\x1b[2J", "caught  on the ladder"]) == exit_codes.DONE
    assert f"noted in {folder.path}" in capsys.readouterr().out
    data = yaml.safe_load((folder.path / "dive.yaml").read_text(encoding="utf-8"))
    assert [event["text"] for event in data["events"]] == ["tether[2J caught  on the ladder"]


def test_a_note_of_another_dive_takes_the_place_of_its_notes(tmp_path, capsys):
    folder = tmp_path / "2026-11-20T0912Z"
    folder.mkdir()
    assert cli.main(["note", "new", "--dive", str(folder)]) == exit_codes.BAD_INPUT
    (folder / "telemetry.tlog").write_bytes(b"")
    assert cli.main(["note", "new propellers", "--dive", str(folder)]) == exit_codes.DONE
    assert f"noted of {folder}" in capsys.readouterr().out
    data = yaml.safe_load((folder / "dive.yaml").read_text(encoding="utf-8"))
    assert (data["notes"], data["events"]) == ("new propellers", [])


@pytest.mark.parametrize(("words", "why"), [(["a"], "no recording runs"), (["\x1b", " "], "without a word")])
def test_a_note_that_can_not_be_kept_is_said(words, why, refused):
    assert why in refused("note", *words)


class Recording:
    """`seatrial record` in a thread; `far` is the vehicle's end of its link."""

    def __init__(self, monkeypatch, out, *words):
        near, self.far = memory_pair()
        monkeypatch.setattr(
            "bridge.links.open.open_link", lambda spec: near if spec == LINK else open_link(spec)
        )
        line = ["record", "--link", LINK, "--out", str(out), "--name", "x", "--seconds", "60", *words]
        self.codes = []
        self.thread = threading.Thread(target=lambda: self.codes.append(cli.main(line)), daemon=True)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.thread.join(20)


def now():
    from bridge.clock import SystemClock

    return held(SystemClock().unix_s())


@pytest.fixture
def ends(monkeypatch):
    """Makes a recording's sixty seconds end when it is set."""
    end = threading.Event()

    def until_stopped(work, clock, seconds, each):
        stop = threading.Event()
        worker = threading.Thread(target=work, args=(stop,))
        worker.start()
        end.wait(20)
        each(0.0)
        stop.set()
        worker.join()
        assert clock.boot_s() < seconds

    monkeypatch.setattr("bridge.command_line.until_stopped", until_stopped)
    monkeypatch.setattr("gcs_plugin.recording.recorder.SYNC_EVERY_S", 0.01)
    yield end
    end.set()


def beat():
    return Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3))


def test_a_recording_tells_of_itself_while_it_runs_and_no_longer(monkeypatch, tmp_path, ends):
    with Recording(monkeypatch, tmp_path) as recording:
        assert until(now).links == (LINK,)
        recording.far.write(beat())
        holding = until(lambda: now() if now().frames else None)
        ends.set()
    assert recording.codes == [exit_codes.DONE]
    assert (holding.pid, holding.frames, holding.bytes, holding.lost) == (os.getpid(), 1, len(beat()), 0)
    assert Path(holding.folder).parent == tmp_path
    assert now() is None


def test_where_the_ground_alone_spoke_nothing_was_recorded(monkeypatch, tmp_path, ends, capsys):
    with Recording(monkeypatch, tmp_path) as recording:
        client = open_link(until(now).hub)
        client.write(beat())
        assert recording.far.read(5.0) == beat()
        client.close()
        ends.set()
    assert recording.codes == [exit_codes.LINK]
    assert "no dive folder is kept" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_note_outlives_a_recording_in_which_nothing_was_heard(monkeypatch, tmp_path, ends, capsys):
    with Recording(monkeypatch, tmp_path) as recording:
        until(now)
        assert cli.main(["note", "in the water"]) == exit_codes.DONE
        ends.set()
    assert recording.codes == [exit_codes.LINK]
    assert "keeps its notes alone" in capsys.readouterr().err
    (folder,) = tmp_path.iterdir()
    assert [path.name for path in folder.iterdir()] == ["dive.yaml"]


def test_beside_another_recording_the_first_stays_the_one_that_others_learn_of(
    monkeypatch, tmp_path, ends, running, capsys
):
    first = {"pid": os.getppid(), "links": ("udpin:127.0.0.1:9",), "folder": "/dives/first"}
    running(**first)
    with Recording(monkeypatch, tmp_path) as recording:
        recording.far.write(beat())
        until(lambda: [path for path in tmp_path.glob("*/telemetry.tlog") if path.stat().st_size])
        assert now().folder == "/dives/first"
        state_file().unlink()
        assert Path(until(now).folder).parent == tmp_path
        ends.set()
    output = capsys.readouterr().err
    assert "go by way of the recording of process" in output
    assert "/dives/first; the links of this one are at tcp:127.0.0.1:" in " ".join(output.split())


@pytest.mark.parametrize("port", ["-1", "65536", "any", ""])
def test_a_hub_on_a_port_that_is_none_is_wrong_usage(port, refused):
    assert "no port from 0 to 65535, and not none" in refused("record", "--link", LINK, f"--hub={port}")


def test_a_state_that_can_not_be_written_is_said_once_and_the_recording_goes_on(
    monkeypatch, tmp_path, ends, capsys
):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    with Recording(monkeypatch, tmp_path / "dives") as recording:
        recording.far.write(beat())
        until(lambda: [p for p in tmp_path.glob("dives/*/telemetry.tlog") if p.stat().st_size])
        ends.set()
    assert recording.codes == [exit_codes.DONE]
    assert capsys.readouterr().err.count("nobody learns of the recording") == 1
