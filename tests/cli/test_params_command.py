"""`params` against the vehicle's real parameter server, in simulated time."""

import json
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.framing import Encoder, Framer, decode
from bridge.parameters import ParameterServer, vehicle_table
from bridge.vehicle.config import load_vehicle
from tui import cli, exit_codes

VEHICLE = str(Path(__file__).resolve().parents[1] / "data" / "vehicles" / "hovering.yaml")


class VehicleAtTheEnd:
    """A link whose far end is a parameter server; reading it lets simulated time pass."""

    name = "memory:vehicle"

    def __init__(self):
        self.clock = SimulatedClock()
        self.server = ParameterServer(None, vehicle_table(load_vehicle(VEHICLE).vehicle))
        self.armed = False
        self.mute = False
        self.stuck = set()
        self._framer, self._encoder = Framer(), Encoder(1, 1)
        self._out = []
        self._beat_s = 0.0

    def read(self, timeout_s):
        self.clock.advance_to(self.clock.now_s + max(timeout_s, 0.001))
        if self.mute:
            return b""
        if self.clock.now_s >= self._beat_s:
            self._beat_s += 1.0
            self._out.append(dialect.MAVLink_heartbeat_message(12, 0, 128 if self.armed else 0, 0, 4, 3))
        messages, self._out = self._out + self.server.step(20), []
        return b"".join(self._encoder.encode(message) for message in messages)

    def write(self, data):
        for frame in self._framer.feed(data):
            message = decode(frame)
            if message.get_type() == "PARAM_SET" and message.param_id in self.stuck:
                continue
            self._out += self.server.handle(message, self.armed)

    def close(self):
        pass


@pytest.fixture
def vehicle(monkeypatch, tmp_path):
    vehicle = VehicleAtTheEnd()
    monkeypatch.setattr("bridge.link.open.open_link", lambda _: vehicle)
    monkeypatch.setattr("bridge.clock.SystemClock", lambda: vehicle.clock)
    monkeypatch.chdir(tmp_path)
    return vehicle


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "new.param"
    path.write_text("FF1_M_U,111.5\nFF1_D_U,56.25\n", encoding="utf-8")
    return str(path)


def run(*line):
    return cli.main(["params", *line, "--link", "any"])


@pytest.mark.usefixtures("vehicle")
def test_show_lists_what_the_vehicle_holds(capsys):
    assert run("show", "ff1_m", "--json", "-") == exit_codes.DONE
    shown = json.loads(capsys.readouterr().out)
    assert sorted(shown) == ["FF1_M_U", "FF1_M_V", "FF1_M_W"]


@pytest.mark.usefixtures("vehicle")
def test_show_writes_a_file_that_diff_finds_to_be_the_same(tmp_path, capsys):
    kept = str(tmp_path / "kept.param")
    assert run("show", "--out", kept) == exit_codes.DONE
    assert run("diff", kept) == exit_codes.DONE
    assert "changed" not in capsys.readouterr().out


@pytest.mark.usefixtures("vehicle")
def test_show_of_a_name_that_the_vehicle_lacks_is_a_no():
    assert run("show", "SERVO") == exit_codes.NO


def test_diff_says_what_would_change_and_writes_nothing(vehicle, file, capsys):
    assert run("diff", file) == exit_codes.NO
    assert "2 changed" in capsys.readouterr().out
    assert vehicle.server.value("FF1_M_U") == 0.0


def test_upload_is_active_read_back_and_has_a_receipt(vehicle, file, tmp_path, capsys):
    assert run("upload", file, "--yes", "--json", "-") == exit_codes.DONE
    receipt = json.loads(capsys.readouterr().out)
    active = vehicle.server.active(1)
    assert {name: value for name, value in active.items() if value} == {"M_u": 111.5, "D_u": 56.25}
    assert [line["after"] for line in receipt["parameters"]] == [111.5, 56.25]
    assert len(list((tmp_path / "receipts").glob("*-receipt.json"))) == 1


def test_rollback_brings_the_values_before_back(vehicle, file, tmp_path):
    vehicle.server.write("FF1_M_U", 99.0, armed=False)
    vehicle.server.write("FF_COMMIT", vehicle.server.staged_crc, armed=False)
    assert run("upload", file, "--yes") == exit_codes.DONE
    (before,) = (tmp_path / "receipts").glob("*-before.param")
    assert run("rollback", str(before), "--yes") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 99.0


def test_upload_takes_the_json_of_an_identification(vehicle, tmp_path):
    estimate = {"name": "M_u", "value": 112.0, "identifiable": True}
    vague = {"name": "M_v", "value": 50.0, "identifiable": False}
    path = tmp_path / "found.json"
    path.write_text(
        json.dumps({"configuration": "hovering", "parameters": [estimate, vague]}), encoding="utf-8"
    )
    assert run("upload", str(path), "--vehicle", VEHICLE, "--yes") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 112.0
    assert "M_v" not in vehicle.server.active(1)


def test_only_sends_the_lines_named(vehicle, file):
    assert run("upload", file, "--yes", "--only", "FF1_D_U") == exit_codes.DONE
    assert vehicle.server.active(1)["D_u"] == 56.25
    assert "M_u" not in vehicle.server.active(1)


def test_an_armed_vehicle_gets_no_upload(vehicle, file, capsys):
    vehicle.armed = True
    assert run("upload", file, "--yes") == exit_codes.NO
    assert "is armed; nothing was sent" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0


def test_a_value_that_the_vehicle_never_takes_leaves_everything_as_it_was(vehicle, file, capsys):
    vehicle.stuck = {"FF1_D_U"}
    assert run("upload", file, "--yes") == exit_codes.NO
    assert vehicle.server.value("FF1_M_U") == 0.0
    assert vehicle.server.active_crc == 0
    assert "rolled back" in capsys.readouterr().out


def test_a_value_out_of_its_bounds_stops_the_whole_upload(vehicle, tmp_path, capsys):
    path = tmp_path / "wild.param"
    path.write_text("FF1_M_U,111.5\nFF1_D_U,-3\n", encoding="utf-8")
    assert run("upload", str(path), "--yes") == exit_codes.NO
    assert "FF1_D_U" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0


def test_without_a_terminal_nobody_is_asked(vehicle, file, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    assert run("upload", file) == exit_codes.BAD_INPUT
    assert "--yes" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0


@pytest.mark.parametrize(("typed", "code", "value"), [("yes\n", 0, 111.5), ("no\n", 4, 0.0), ("\n", 4, 0.0)])
def test_the_operator_is_asked_and_only_yes_means_yes(vehicle, file, monkeypatch, typed, code, value):
    class Terminal:
        def isatty(self):
            return True

        def readline(self):
            return typed

    monkeypatch.setattr("sys.stdin", Terminal())
    assert run("upload", file) == code
    assert vehicle.server.value("FF1_M_U") == value


def test_nobody_on_the_link(vehicle, capsys):
    vehicle.mute = True
    assert run("show", "--seconds", "2") == exit_codes.LINK
    assert "no vehicle's HEARTBEAT" in capsys.readouterr().err
