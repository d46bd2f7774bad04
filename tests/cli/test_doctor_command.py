"""`doctor` on a simulated vehicle that is afloat, in simulated time."""

import json

import pytest
from fakes.terminal import nobody
from fakes.vehicle import FakeLink, QuietLink
from parameter_vehicle import put_at_any_link

from bridge import exit_codes
from bridge.clock import SimulatedClock
from bridge.errors import LogError
from bridge.links.link import memory_pair
from bridge.simulator.body import Start
from bridge.simulator.dive import SimulatedVehicle
from bridge.vehicle.config import load_vehicle
from bridge.wire.tlog import TlogWriter
from tui import cli


class Afloat(QuietLink):
    """A link to an idle vehicle; reading it lets simulated time pass."""

    name = "memory:afloat"

    def __init__(self):
        near, self._far = memory_pair()
        self.vehicle = SimulatedVehicle(load_vehicle("ruvifist"), "hovering", [near], Start(1, 0.2))
        self.clock = self.vehicle.clock

    def read(self, _):
        self.vehicle.rest()
        return self._far.read(0.0)

    def write(self, data):
        self._far.write(data)


@pytest.fixture
def doctor(monkeypatch, tmp_path, capsys):
    """Run the doctor on a link: its exit code, its findings by name, and what it said besides."""

    def run(link, *words):
        put_at_any_link(monkeypatch, link)
        code = cli.main(["doctor", "--link", "any", "--out", str(tmp_path), "--json", "-", *words])
        out, err = capsys.readouterr()
        return code, {finding["name"]: finding for finding in json.loads(out or "[]")}, err

    return run


@pytest.fixture
def wet(doctor):
    """Run the wet check on a link."""
    return lambda link: doctor(link, "--vehicle", "ruvifist:hovering", "--wet", "--confirm", "ruvifist")


@pytest.fixture
def link():
    return Afloat()


def test_a_healthy_vehicle_afloat_is_heard_with_all_its_sensors_and_no_warning(doctor):
    code, result, _ = doctor(Afloat(), "--vehicle", "ruvifist:hovering")
    assert code == exit_codes.DONE
    sensors = ("imu", "fog", "dvl", "attitude", "gravity")
    assert {"vehicle file", "link", "loss", "time", "disk", "parameters", *sensors} <= set(result)
    assert {name: finding["sentence"] for name, finding in result.items() if finding["level"] != "ok"} == {}


def test_the_wet_check_of_a_right_vehicle_finds_every_thruster_and_sensor_right(link, wet, tmp_path):
    _, result, _ = wet(link)
    names = [f"thruster {number}" for number in range(1, 9)] + ["dvl", "imu", "fog"]
    assert {name: result[name]["level"] for name in names} == dict.fromkeys(names, "ok")
    late_ms = {s: float(result[f"{s} latency"]["sentence"].split(": ")[1].split()[0]) for s in names[-3:]}
    assert abs(late_ms["dvl"]) < 25.0
    assert max(abs(late_ms["imu"]), abs(late_ms["fog"])) < 10.0
    assert not link.vehicle.bridge.armed
    (folder,) = tmp_path.glob("*-hovering-wet-check")
    assert (folder / "telemetry.tlog").stat().st_size > 100_000


def test_a_vehicle_that_goes_silent_in_the_wet_check_is_the_link_that_failed(link, wet, monkeypatch):
    listen = link.read

    def deaf_later(timeout_s):
        data = listen(timeout_s)
        return b"" if link.clock.boot_s() > 20 else data

    monkeypatch.setattr(link, "read", deaf_later)
    code, _, said = wet(link)
    assert code == exit_codes.LINK
    assert "no HEARTBEAT" in said
    assert "may still be armed" in said


def test_a_vehicle_whose_answer_to_the_arming_is_lost_is_disarmed(link, wet, monkeypatch):
    listen, armed_for = link.read, []

    def deaf_at_first(timeout_s):
        data = listen(timeout_s)
        armed_for.extend([0.05] * link.vehicle.bridge.armed)
        return b"" if armed_for and sum(armed_for) < 5.2 else data

    monkeypatch.setattr(link, "read", deaf_at_first)
    code, _, said = wet(link)
    assert code == exit_codes.LINK
    assert "an answer to the order to arm did not come within 5 s" in said
    assert not link.vehicle.bridge.armed


def test_a_wet_check_that_the_vehicle_refuses_leaves_no_dive_that_can_not_be_read(link, wet, tmp_path):
    link.vehicle.bridge.arm = lambda _armed, **_: False
    code, _, said = wet(link)
    assert code != exit_codes.DONE
    assert "arm" in said
    assert list(tmp_path.iterdir()) == []


def test_a_wet_check_that_is_interrupted_as_it_arms_ends_disarmed_though_orders_are_lost(
    link, wet, monkeypatch
):
    listen, order, lost = link.read, link.write, []

    def interrupted(timeout_s):
        if link.vehicle.bridge.armed and not lost:
            lost.append(b"")
            raise KeyboardInterrupt
        return listen(timeout_s)

    def lossy(data):
        # The answer to the arming comes, while the first orders to disarm do not arrive.
        if 0 < len(lost) < 3:
            lost.append(data)
        else:
            order(data)

    monkeypatch.setattr(link, "read", interrupted)
    monkeypatch.setattr(link, "write", lossy)
    code, _, said = wet(link)
    assert code == exit_codes.INTERRUPTED
    assert len(lost) == 3
    assert not link.vehicle.bridge.armed
    assert "may still be armed" not in said


def test_a_recording_that_fails_in_the_wet_check_leaves_the_vehicle_disarmed(link, wet, monkeypatch):
    write = TlogWriter.write

    def fails_later(writer, unix_us, raw):
        if link.clock.boot_s() > 20:
            raise LogError(f"{writer.path}: can't be written; free disk space")
        write(writer, unix_us, raw)

    monkeypatch.setattr(TlogWriter, "write", fails_later)
    code, _, said = wet(link)
    assert code == exit_codes.BAD_INPUT
    assert "can't be written" in said
    assert not link.vehicle.bridge.armed


def test_an_armed_vehicle_is_not_checked_and_stays_as_it_is(link, wet):
    link.vehicle.bridge.arm(True)
    code, _, said = wet(link)
    assert code == exit_codes.BAD_INPUT
    assert "is armed already" in said
    assert link.vehicle.bridge.armed


@pytest.mark.parametrize("words", [(), ("--confirm", "bluerov2")])
def test_no_thruster_turns_without_the_vehicles_name(link, doctor, monkeypatch, words):
    nobody(monkeypatch)
    code, _, said = doctor(link, "--vehicle", "ruvifist:hovering", "--wet", *words)
    assert code == exit_codes.BAD_INPUT
    assert "--confirm ruvifist" in said
    assert link.clock.boot_s() == 0.0
    assert not link.vehicle.bridge.armed


@pytest.mark.parametrize(
    ("vehicle", "name", "why"),
    [("ruvifist:survey", "ruvifist", "configuration"), ("ardusub_vectored", "ardusub_vectored", "thrusters")],
)
def test_no_thruster_turns_by_the_file_of_another_vehicle_or_shape(link, doctor, vehicle, name, why):
    code, result, _ = doctor(link, "--vehicle", vehicle, "--wet", "--confirm", name)
    assert code == exit_codes.NO
    assert result[why]["level"] == "failed"
    assert f"'{why}'" in result["wet check"]["sentence"]
    assert not [name for name in result if name.startswith("thruster ")]
    assert not link.vehicle.bridge.armed


def test_a_silent_link_is_a_failed_check(doctor):
    code, result, _ = doctor(FakeLink("memory:silent", clock=SimulatedClock()))
    assert code == exit_codes.NO
    assert result["link"]["level"] == "failed"
    assert "nothing arrived" in result["link"]["sentence"]
    assert result["disk"]["level"] == "ok"


HULL = """
configurations:
  only:
    dry_mass_kg: 10
    inertia_kgm2: [1, 1, 1]
    thrusters:
      - {direction: [1, 0, 0], position_m: [0, 0, 0]}
"""


@pytest.mark.parametrize(
    ("lines", "failed", "why"),
    [
        (
            "thrust_curve: {kind: table, file: gone.csv}",
            "vehicle file",
            "gone.csv: can't read this thrust table",
        ),
        (
            "sensors: {imu: {kind: mti300, port: PORT}, dvl: {kind: wayfinder, port: /dev/ttyGone}}",
            "dvl",
            "no port /dev/ttyGone",
        ),
        ('sensors: {depth: {kind: bar30, port: "i2c:250:0x76"}}', "depth", "no port /dev/i2c-250"),
    ],
)
def test_without_a_link_thrust_table_and_ports_of_the_devices_are_looked_for(
    capsys, tmp_path, lines, failed, why
):
    (tmp_path / "ttyHere").touch()
    vehicle = tmp_path / "mine.yaml"
    lines = lines.replace("PORT", str(tmp_path / "ttyHere"))
    vehicle.write_text(f"name: mine\n{lines}{HULL}", encoding="utf-8")
    assert cli.main(["doctor", "--vehicle", str(vehicle), "--json", "-"]) == exit_codes.NO
    output = {finding["name"]: finding for finding in json.loads(capsys.readouterr().out)}
    assert [name for name, finding in output.items() if finding["level"] != "ok"] == [failed]
    assert why in output[failed]["sentence"]


def test_nothing_to_check_is_wrong_usage(refused):
    assert "--vehicle FILE, --link SPEC" in refused("doctor")
