"""`simulate` and `bridge`: dives by the simulated vehicle, and the vehicle's side on a link."""

import json
import os
import shutil
import signal
import socket
import struct
import threading
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from fakes.ports import free_port
from fakes.processes import Running
from waiting import ended_once, until

from bridge import exit_codes
from bridge.clock import SystemClock
from bridge.links.link import memory_pair
from bridge.onboard.parameters import parameters_of
from bridge.sensors.waterlink import WaterlinkJsonParser
from bridge.simulator.dive import SimulatedVehicle
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import CONFIGS, load_vehicle
from bridge.vehicle.parameters import COMMIT, MODE
from bridge.wire.framing import Framer
from gcs_plugin.dives.folder import load_folder
from gcs_plugin.dives.recordings import began
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.session import Order
from identify.ingest.open import read_dive
from tui import cli

LEGS = """
name: a short one
legs:
  - {name: rest, phase: rest, duration_s: 1}
  - {name: ahead, phase: acceleration, duration_s: 3, surge_m_s: 0.3, transient_s: 3}
  - {name: ahead, phase: steady, duration_s: 2, surge_m_s: 0.3}
"""


@pytest.fixture
def mission(tmp_path):
    path = tmp_path / "short.yaml"
    path.write_text(LEGS, encoding="utf-8")
    return str(path)


def simulate(tmp_path, mission, *more):
    out = str(tmp_path / "dives")
    return cli.main(["simulate", "--vehicle", "ruvifist:hovering", "--mission", mission, "--out", out, *more])


def test_a_mission_of_ones_own_becomes_a_dive_folder(tmp_path, mission, capsys):
    assert simulate(tmp_path, mission, "--json", "-") == exit_codes.DONE
    output = json.loads(capsys.readouterr().out)
    assert Path(output["folder"]).name.endswith("Z-a-short-one-off")
    dive = read_dive(Path(output["folder"]))
    assert 6.0 < dive.duration_s < 7.5
    assert {"velocity", "gyro", "fog", "pwm", "nu_ref", "tau_cmd", "depth", "attitude"} <= (
        set(dive.signals()) | {"depth"}
    )
    assert dive.configuration_index() == 1
    assert load_folder(Path(output["folder"])).about().events == ()


def test_the_seed_decides_the_noise(tmp_path, mission, capsys):
    folders = []
    for seed in ("1", "1", "2"):
        assert simulate(tmp_path, mission, "--seed", seed, "--json", "-") == exit_codes.DONE
        folders.append(json.loads(capsys.readouterr().out)["folder"])
    first, again, other = (read_dive(Path(folder)).velocity.value.tolist() for folder in folders)
    assert first == again
    assert first != other


@pytest.mark.parametrize("mode", ["ff", "both"])
def test_feed_forward_without_parameters_is_refused_before_a_folder_is_made(tmp_path, mission, mode, capsys):
    assert simulate(tmp_path, mission, "--mode", mode) == exit_codes.BAD_INPUT
    said = capsys.readouterr().err
    assert f"--mode {mode}, and the simulated vehicle has no parameters to feed forward" in said
    assert not (tmp_path / "dives").exists()


def test_a_vehicle_that_stays_in_both_after_its_set_was_rolled_back_says_so_by_its_word(
    tmp_path, mission, capsys
):
    store = tmp_path / "memory.json"
    parameters_of(load_vehicle("ruvifist:hovering"), store).write(MODE, 3.0, armed=False)
    assert simulate(tmp_path, mission, "--parameters", str(store)) == exit_codes.BAD_INPUT
    said = " ".join(capsys.readouterr().err.split())
    assert f"{store}: is in mode both, and the simulated vehicle has no parameters to feed forward" in said
    assert "or give --mode off" in said


def test_what_is_uploaded_to_an_idle_vehicle_flies_in_the_dive_after(tmp_path, mission, monkeypatch, capsys):
    near, far = memory_pair()
    monkeypatch.setattr("bridge.links.open.open_link", lambda _: near)
    store = str(tmp_path / "memory.json")
    receipts = []

    def until_the_ground_is_done(work, *_):
        stop = threading.Event()
        vehicle = threading.Thread(target=work, args=(stop,))
        vehicle.start()
        receipts.append(upload_to(far, tmp_path))
        stop.set()
        vehicle.join()

    monkeypatch.setattr("bridge.command_line.until_stopped", until_the_ground_is_done)
    idle = ("--link", "any", "--speed", "20", "--parameters", store)
    assert simulate(tmp_path, "idle", *idle) == exit_codes.DONE
    assert [receipt.good for receipt in receipts] == [True]
    assert (
        simulate(tmp_path, mission, "--mode", "both", "--parameters", store, "--json", "-") == exit_codes.DONE
    )
    folder = json.loads(capsys.readouterr().out)["folder"]
    assert max(abs(read_dive(Path(folder)).tau_ff.value[:, 0])) > 10


def test_a_dive_by_feed_forward_alone_lies_in_a_folder_of_the_modes_own_word(tmp_path, mission, capsys):
    store = tmp_path / "memory.json"
    parameters = parameters_of(load_vehicle("ruvifist:hovering"), store)
    for name, value in (("FF1_M_U", 111.6), ("FF1_D_U", 56.0)):
        parameters.write(name, value, armed=False)
    parameters.write(COMMIT, parameters.staged_crc, armed=False)
    assert simulate(tmp_path, mission, "--mode", "ff", "--parameters", str(store), "--json", "-") == 0
    assert json.loads(capsys.readouterr().out)["folder"].endswith("Z-a-short-one-ff")


def test_a_thruster_of_an_idle_vehicle_may_weaken_for_a_flight_to_show_it(tmp_path, monkeypatch):
    near, _ = memory_pair()
    monkeypatch.setattr("bridge.links.open.open_link", lambda _: near)
    monkeypatch.setattr("bridge.command_line.until_stopped", lambda *_: None)
    starts = []

    class Spied(SimulatedVehicle):
        def __init__(self, file, configuration, links, start, parameters):
            starts.append(start)
            super().__init__(file, configuration, links, start, parameters)

    monkeypatch.setattr("tui.commands.simulate.SimulatedVehicle", Spied)
    weak = ("--link", "any", "--onset", "5", "T2_gain=0.5")
    assert simulate(tmp_path, "idle", *weak) == exit_codes.DONE
    assert (starts[0].truth.onset_s, starts[0].truth.onset) == (5.0, {"T2_gain": 0.5})


def upload_to(link, tmp_path):
    client = ParameterClient(link, SystemClock())
    client.find_vehicle()
    plan = make_plan({"FF1_M_U": 111.6, "FF1_D_U": 56.24}, client.read_all())
    return client.apply(Order(plan, tmp_path / "before.param"))


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--vehicle", "ruvifist", "--mission", "validation"), "name one: --vehicle FILE:CONFIGURATION"),
        (("--vehicle", "ruvifist:survey", "--mission", "hovering"), "moves sideways"),
        (("--vehicle", "ruvifist:survey", "--mission", "nowhere"), "no mission 'nowhere'"),
        (
            ("--vehicle", "ruvifist:survey", "--mission", "survey", "--speed", "0"),
            "'0' is not a number above 0, and not max",
        ),
        (("--vehicle", "ruvifist:survey", "--mission", "idle"), "--link"),
        (
            ("--vehicle", "ruvifist:survey", "--mission", "survey", "--seconds", "5"),
            "--seconds: a dive lasts as long as its mission",
        ),
        (("--vehicle", "own.yaml:survey", "--mission", "survey"), "truth"),
        (
            ("--vehicle", "bluerov2_heavy", "--mission", "survey"),
            "names no sensors, so a dive would record no",
        ),
    ],
)
def test_a_dive_that_can_not_be_says_why(tmp_path, monkeypatch, words, sentence, refused):
    monkeypatch.chdir(tmp_path)
    shutil.copy(CONFIGS / "vehicles" / "ruvifist.yaml", "own.yaml")
    assert sentence in refused("simulate", *words)
    assert not (tmp_path / "dives").exists()


@pytest.fixture
def _signals_of_a_terminal():
    """Whoever starts the tests may ignore some: a shell's job in the background has no Ctrl-C, one of nohup no end."""
    usual = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}
    before = {
        number: signal.signal(number, to) for number, to in (usual | {signal.SIGHUP: signal.SIG_DFL}).items()
    }
    yield
    for number, to in before.items():
        signal.signal(number, to)


@pytest.mark.usefixtures("_signals_of_a_terminal")
@pytest.mark.parametrize(
    "how", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP], ids=["Ctrl-C", "kill", "closed"]
)
def test_a_dive_that_is_stopped_says_in_its_folder_that_it_was_cut(
    tmp_path, mission, monkeypatch, capsys, how
):
    def stop(share):
        if share > 0.5:
            os.kill(os.getpid(), how)

    monkeypatch.setattr("tui.show._lines", lambda *_, **__: lambda report: stop(report.share))
    assert simulate(tmp_path, mission) == exit_codes.INTERRUPTED
    assert "stopped before it was done" in capsys.readouterr().err
    (folder,) = (tmp_path / "dives").iterdir()
    (event,) = load_folder(folder).about().events
    assert event.text == "cut short: 5 s of 7 s were dived"


def bridge(tmp_path, monkeypatch, sensors, *more, seconds="1.5", link=None):
    monkeypatch.setattr("bridge.onboard.program.lasting", lambda *_: link or memory_pair()[0])
    vehicle = tmp_path / "some.yaml"
    vehicle.write_text(
        f"name: some\nsensors: {sensors}\nconfigurations:\n  only:\n    dry_mass_kg: 10\n    inertia_kgm2: [1, 1, 1]\n"
        "    thrusters:\n      - {direction: [1, 0, 0], position_m: [0, 0, 0]}\n",
        encoding="utf-8",
    )
    store = str(tmp_path / "memory.json")
    line = ["bridge", "--vehicle", str(vehicle), "--link", "any", "--parameters", store]
    return cli.main([*line, "--seconds", seconds, *more])


def test_a_bridge_without_any_port_tells_of_each_and_answers_with_the_code_of_a_link(
    tmp_path, monkeypatch, capsys
):
    sensors = "{imu: {kind: mti300, port: /dev/ttyNone}, dvl: {kind: wayfinder, port: /dev/ttyGone}}"
    assert bridge(tmp_path, monkeypatch, sensors) == exit_codes.LINK
    output = capsys.readouterr().err
    assert output.count("warning: imu: there is no port /dev/ttyNone") == 1
    assert output.count("warning: dvl: there is no port /dev/ttyGone") == 1
    assert "no device's port could be opened (dvl, imu)" in output


class IdleBridge:
    """A bridge of which nothing is to be told."""

    def __init__(self):
        self.link_faults, self.device_faults, self.unread_ports = {}, {}, frozenset()


class FaultyBridge(IdleBridge):
    """A bridge whose devices fail and come back as told."""

    def __init__(self, *_, **__):
        super().__init__()
        self.device_faults = {"imu": "imu: there is no port /dev/ttyNone"}
        self.unread_ports = frozenset({"imu"})


def test_a_device_that_comes_back_is_told_and_one_port_is_enough(tmp_path, monkeypatch, capsys):
    made = []

    def make(*arguments, **named):
        made.append(FaultyBridge(*arguments, **named))
        return made[0]

    def steps(work, clock, seconds, each):
        del work, clock, seconds
        each(0.0)
        each(0.5)
        made[0].device_faults = {"dvl": "dvl silent: check cable"}
        each(1.0)

    monkeypatch.setattr("bridge.onboard.service.Bridge", make)
    monkeypatch.setattr("bridge.command_line.until_stopped", steps)
    sensors = "{imu: {kind: mti300, port: /dev/ttyNone}, dvl: {kind: wayfinder, port: /dev/ttyGone}}"
    assert bridge(tmp_path, monkeypatch, sensors) == exit_codes.DONE
    assert capsys.readouterr().err.splitlines() == [
        "warning: imu: there is no port /dev/ttyNone",
        "warning: dvl silent: check cable",
        "imu is back",
    ]


def test_what_stands_against_recording_and_companion_is_on_their_own_terminal_and_so_is_its_end(
    tmp_path, monkeypatch, capsys
):
    full, unheard = "ring: not written, disk full", "no autopilot heard: look at --link"
    ring = SimpleNamespace(fault="", identity=1, start=lambda: None, close=lambda: None)
    troubles = iter([unheard, unheard, ""])

    def steps(work, clock, seconds, each):
        del work, clock, seconds
        for now_s, fault in enumerate(["", full, ""]):
            ring.fault = fault
            each(float(now_s))

    companion = SimpleNamespace(trouble=lambda _: next(troubles))
    monkeypatch.setattr("bridge.onboard.program.ring_for", lambda *_: ring)
    monkeypatch.setattr("bridge.ardusub.companion.Companion", lambda *_: companion)
    monkeypatch.setattr("bridge.onboard.service.Bridge", lambda *_, **__: IdleBridge())
    monkeypatch.setattr("bridge.command_line.until_stopped", steps)
    assert bridge(tmp_path, monkeypatch, "{}", "--ardusub") == exit_codes.DONE
    warned = [f"warning: {unheard}", f"warning: {full}"]
    over = [f"no longer so: {full}", f"no longer so: {unheard}"]
    said = capsys.readouterr().err.splitlines()
    assert said[:2] == warned
    assert sorted(said[2:]) == over[::-1]


def test_the_bridge_beats_on_its_link_though_no_sensor_is_there(tmp_path, monkeypatch):
    near, far = memory_pair()
    framer = Framer()

    def beats():
        heard = framer.feed(far.read(0.0))
        return any(frame.message_id == 0 and frame.system == 1 for frame in heard)

    ended_once(monkeypatch, beats)
    assert bridge(tmp_path, monkeypatch, "{}", link=near) == exit_codes.DONE


def test_a_dive_is_dated_from_when_it_was_asked_for_and_so_after_the_upload_that_it_flies_with(
    tmp_path, mission, monkeypatch, capsys
):
    monkeypatch.setattr(SystemClock, "unix_s", lambda _: 1_790_000_000.0)
    assert simulate(tmp_path, mission, "--json", "-") == exit_codes.DONE
    folder = Path(json.loads(capsys.readouterr().out)["folder"])
    assert read_dive(folder).unix_at_boot_s == 1_790_000_000.0
    assert began(folder) == pytest.approx(1_790_000_000.0, abs=1.0)


def test_effects_set_in_during_a_dive_as_asked(tmp_path, mission, capsys):
    speeds = []
    for onset in ((), ("--onset", "3", "T1_gain=0.3", "X_uu=400")):
        assert simulate(tmp_path, mission, *onset, "--json", "-") == exit_codes.DONE
        velocity = read_dive(Path(json.loads(capsys.readouterr().out)["folder"])).velocity
        early = velocity.time_s < 2.9
        speeds.append((velocity.value[early].tolist(), float(velocity.value[-1, 0])))
    assert speeds[0][0] == speeds[1][0]
    assert speeds[1][1] < speeds[0][1] - 0.02


def test_a_dive_that_can_not_begin_leaves_no_folder(tmp_path, mission, monkeypatch, capsys):
    def impossible(*_):
        return replace(load_truth(load_vehicle("ruvifist"), "hovering"), effects={"T1_gain": 0.1})

    monkeypatch.setattr("tui.commands.simulate.load_truth", impossible)
    assert simulate(tmp_path, mission) == exit_codes.BAD_INPUT
    assert "T1_gain 0.1 out of bounds" in capsys.readouterr().err
    assert not list((tmp_path / "dives").iterdir())


def test_a_dive_that_would_overwrite_the_parameters_of_a_vehicle_afloat_does_not_begin(
    tmp_path, mission, capsys
):
    memory = str(tmp_path / "memory.json")
    afloat = Running(
        "simulate", "--vehicle", "ruvifist:hovering", "--mission", "idle",
        "--link", "udpout:127.0.0.1:9", "--parameters", memory,
    )  # fmt: skip
    try:
        afloat.until("Ctrl-C ends it")
        assert simulate(tmp_path, mission, "--parameters", memory) == exit_codes.BAD_INPUT
        said = " ".join(capsys.readouterr().err.split())
        assert (
            f"another vehicle (process {afloat.process.pid}) keeps its parameters there: end that one" in said
        )
        assert not (tmp_path / "dives").exists()
    finally:
        afloat.kill()
    assert simulate(tmp_path, mission, "--parameters", memory) == exit_codes.DONE, (
        "a killed one locks nobody out"
    )


def test_an_idle_vehicle_without_a_link_leaves_a_wrong_store_of_parameters_where_it_is(tmp_path, refused):
    letter = tmp_path / "letter.json"
    letter.write_text("hello", encoding="utf-8")
    line = ["simulate", "--vehicle", "ruvifist:survey", "--mission", "idle", "--parameters", str(letter)]
    assert "give --link SPEC" in refused(*line)
    assert list(tmp_path.iterdir()) == [letter]


@pytest.mark.parametrize(
    ("onset", "why"),
    [
        ("2", ""),
        ("soon X_uu=3", ""),
        ("2 X_uu", "X_uu has no value; give seconds and effects"),
        ("2 wind=3", ""),
        ("2 T9_gain=0.5", ""),
        ("7 X_uu=3", ""),
        ("-1 X_uu=3", ""),
        ("2 T1_gain=0.01", "T1_gain is 0.01, and can be from 0.3 to 2 here"),
        ("2 X_uu=1e9", ""),
    ],
)
def test_an_onset_that_says_no_effect_is_refused_before_a_folder_is_made(
    tmp_path, mission, onset, why, capsys
):
    assert simulate(tmp_path, mission, "--onset", *onset.split()) == exit_codes.BAD_INPUT
    assert f"--onset {onset}: {why}" in capsys.readouterr().err
    assert not (tmp_path / "dives").exists()


@pytest.mark.parametrize(
    "more",
    [["--link", "udpout:127.0.0.1:9"], ["--mode", "both"], ["--parameters", "p.json"], ["--speed", "2"]],
)
def test_under_ardusub_the_autopilot_keeps_link_parameters_mode_and_time(
    refused, tmp_path, monkeypatch, more
):
    monkeypatch.chdir(tmp_path)
    assert f"{more[0]}: ArduSub flies this vehicle" in refused(
        "simulate", "--vehicle", "bluerov2", "--mission", "ardusub", *more
    )


def test_the_body_under_ardusub_answers_at_its_port(capsys, monkeypatch):
    port = free_port(socket.SOCK_DGRAM)
    monkeypatch.setattr("tui.commands.simulate.PORT", port)

    def ask():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
            autopilot.settimeout(0.2)
            for number in range(100):
                packet = struct.pack("<HHI16H", 18458, 400, number, *(1500,) * 16)
                autopilot.sendto(packet, ("127.0.0.1", port))
                with suppress(OSError):
                    answers.append(json.loads(autopilot.recv(4096)))

    answers = []
    asking = threading.Thread(target=ask)
    asking.start()
    line = ["simulate", "--vehicle", "bluerov2", "--mission", "ardusub", "--seconds", "3"]
    code = cli.main([*line, "--onset", "0.1", "current_e=2"])
    asking.join()
    assert code == 0
    east = [answer["velocity"][1] for answer in answers]
    assert abs(east[20]) < 0.02 < 0.1 < east[-1] < 2.0
    assert f"waits for ArduSub at port {port}" in capsys.readouterr().err


def test_the_body_under_ardusub_has_a_dvl_at_its_port_of_the_vehicle_file(tmp_path, capsys, monkeypatch):
    port, dvl_port = free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_STREAM)
    monkeypatch.setattr("tui.commands.simulate.PORT", port)
    vehicle = tmp_path / "rov.yaml"
    bundled = load_vehicle("bluerov2").path.read_text(encoding="utf-8")
    sensors = (
        f"{{dvl: {{kind: a50, port: 'tcp:127.0.0.1:{dvl_port}'}}, gnss: {{kind: ublox, port: /dev/ttyGPS}}}}"
    )
    vehicle.write_text(f"{bundled}\nsensors: {sensors}\n", encoding="utf-8")
    samples, ahead = [], (1400, 1400, 1600, 1600, 1500, 1500)

    def connected():
        with suppress(ConnectionRefusedError):
            return socket.create_connection(("127.0.0.1", dvl_port), timeout=60.0)

    def dive():
        parser, link = WaterlinkJsonParser(), until(connected)
        with link, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
            autopilot.settimeout(0.2)
            for number in range(800):
                packet = struct.pack("<HHI16H", 18458, 400, number, *ahead, *(0,) * 10)
                autopilot.sendto(packet, ("127.0.0.1", port))
                with suppress(OSError):
                    autopilot.recv(4096)
            while len(samples) < 15:
                samples.extend(parser.feed(link.recv(4096), 0.0))

    diving = threading.Thread(target=dive)
    diving.start()
    ended_once(monkeypatch, lambda: not diving.is_alive())
    assert cli.main(["simulate", "--vehicle", str(vehicle), "--mission", "ardusub"]) == exit_codes.DONE
    said = capsys.readouterr().err
    assert f"open: 127.0.0.1 port {dvl_port} (TCP): the simulated dvl" in said
    assert "the gnss is not simulated: only one whose port is tcp:127.0.0.1:PORT is" in said
    assert 0.0 < samples[0].velocity[0] < 0.1
    assert samples[-1].velocity[0] > 0.2
