"""The adapter for MAVProxy: its licence, the dive that is taken where none is given, the vehicle that is meant."""

import os
import re
import struct
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import LogError
from bridge.wire.framing import Encoder, Framer
from gcs_plugin.bell import Bell
from gcs_plugin.dives.folder import list_folders, new_folder
from gcs_plugin.fleet import Fleet
from gcs_plugin.recording.state import Holding, write_holding
from gcs_plugin.watch.alarms import Settings, load_settings
from gcs_plugin.watch.picture import Alarm, Kind
from gcs_plugin.watch.watcher import Watcher

module = pytest.importorskip("gcs_plugin.mavproxy.module", reason="MAVProxy is not installed")
recordings = pytest.importorskip("gcs_plugin.mavproxy.recordings", reason="MAVProxy is not installed")

VEHICLE = Encoder(1, 1)
HUB = "tcpin:127.0.0.1:5777"


@pytest.fixture(autouse=True)
def at_home(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)


def dive(name, began_s):
    folder = Path("dives") / name
    folder.mkdir(parents=True)
    frame = VEHICLE.encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3))
    (folder / "telemetry.tlog").write_bytes(struct.pack(">Q", int(began_s * 1e6)) + frame)
    return folder


def of_another(present, say=lambda _: None):
    """MAVProxy at the hub of a process that records into `present`."""
    clock = SimulatedClock()
    began = "2026-11-20T09:12:03Z"
    write_holding(Holding(os.getpid(), HUB, (), str(present), began, 1, 1, 0, 7200.0, (), clock.unix_s()))
    return recordings.Recordings(clock, say, lambda: [HUB], lambda: None)


def test_the_dive_that_another_process_records_is_refused_and_the_one_before_it_taken():
    present = dive("b", 1.79e9 + 3600)
    with pytest.raises(LogError, match=f"no dive is over yet, {present} is being recorded"):
        of_another(present).newest()
    earlier = dive("a", 1.79e9)
    assert of_another(present).newest() == earlier


def test_mavproxys_own_recording_goes_on_in_a_next_dive_once_for_each_that_is_full(monkeypatch):
    monkeypatch.setattr("gcs_plugin.dives.recorded_dives.FULL_BYTES", 100)
    clock, said = SimulatedClock(), []
    recorder = recordings.Recordings(clock, said.append, list, lambda: None)
    recorder.command(["start"])
    for _ in range(10):
        (frame,) = Framer().feed(VEHICLE.encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3)))
        recorder.keep(frame, "a")
        clock.advance_to(clock.now_s + 1.0)
        recorder.tick()
    recorder.stop()
    dives = len(list_folders(Path("dives")))
    assert dives > 2
    assert said.count(recordings.FULL) == dives - 1


def test_a_second_link_on_which_a_vehicle_is_heard_later_makes_no_second_vehicle_of_it():
    clock, said = SimulatedClock(), []
    recorder = recordings.Recordings(clock, said.append, list, lambda: None)
    recorder.command(["start"])
    beat = dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3)
    frames = Framer().feed(b"".join(VEHICLE.encode(beat) for _ in range(1000)))
    for earlier, now in zip(frames, frames[60:], strict=False):
        recorder.keep(now, "tether")
        recorder.keep(earlier, "radio")
        clock.advance_to(clock.now_s + 0.01)
        recorder.tick()
    recorder.stop()
    assert said[-1].startswith("recorded 1880 frames")
    assert not [line for line in said if "two vehicles" in line]


def test_mavproxys_own_recording_is_refused_likewise_and_without_any_dive_it_says_how_one_is_made():
    recorder = recordings.Recordings(SimulatedClock(), lambda _: None, list, lambda: None)
    with pytest.raises(LogError, match="dives: no dive folder is there; give a DIVE"):
        recorder.newest()
    recorder.command(["start"])
    try:
        with pytest.raises(LogError, match="no dive is over yet"):
            recorder.newest()
        earlier = dive("a", 1.79e9)
        assert recorder.newest() == earlier
    finally:
        recorder.stop()


def test_a_dive_that_a_recorder_on_links_of_its_own_still_writes_is_not_taken_either():
    recorder = recordings.Recordings(SimulatedClock(), lambda _: None, list, lambda: None)
    present = new_folder(Path("dives"), 1.79e9 + 3600, "elsewhere")
    with present.open_telemetry(1) as telemetry:
        telemetry.write(1_790_003_600_000_000, VEHICLE.encode(dialect.MAVLink_system_time_message(0, 1)))
        with pytest.raises(
            LogError, match=f"no dive is over yet, {present.path} is being recorded by another"
        ):
            recorder.newest()
        earlier = dive("a", 1.79e9)
        assert recorder.newest() == earlier
    assert recorder.newest() == present.path


def test_an_order_for_the_next_dive_that_fails_unexpectedly_is_told_and_can_be_given_again(monkeypatch):
    said = []
    recorder = of_another(dive("b", 1.79e9), said.append)

    def fails(_):
        raise OSError("the disk has gone")

    monkeypatch.setattr("gcs_plugin.recording.orders.next_dive", fails)
    for _ in range(2):
        recorder.command(["next"])
        for thread in threading.enumerate():
            if thread.name == "next dive":
                thread.join()
        recorder.tick()
    assert said == ["seatrial: the next dive could not be ordered (the disk has gone); order it again"] * 2


def test_a_recording_goes_on_where_another_can_not_begin():
    recorder = recordings.Recordings(SimulatedClock(), lambda _: None, list, lambda: None)
    recorder.command(["start"])
    try:
        (runs,) = recorder.status()
        Path("notes.txt").write_text("no folder")
        with pytest.raises(LogError, match="no dive folder can be made there"):
            recorder.command(["start", "notes.txt"])
        assert recorder.status() == [runs]
    finally:
        recorder.stop()


def test_a_vehicle_is_compared_with_its_model_by_its_own_parameters_whichever_mavproxy_targets():
    made = module.SeatrialModule.__new__(module.SeatrialModule)
    read = {(1, 1): {"FF1_M_U": 100.0}, (2, 1): {"FF1_M_U": 200.0}, (2, 191): {"FF1_D_U": 40.0}}
    made.mpstate = SimpleNamespace(mav_param=read[1, 1], mav_param_by_sysid=read)
    made._file, made._fleet, made._settings = "", SimpleNamespace(chosen=2), load_settings()
    assert made._new_watcher()._accepted(2) == {"FF1_M_U": 200.0, "FF1_D_U": 40.0}


def test_once_another_vehicle_is_meant_no_alarm_of_the_one_before_is_told_or_hides_its_own():
    made = module.SeatrialModule.__new__(module.SeatrialModule)
    alarm, said = Alarm(Kind.BATTERY, "", "battery 13.8 V, below 14 V"), []
    made.say_line, made._clock, made._file = said.append, SimulatedClock(), ""
    made._fleet = SimpleNamespace(chosen=2, choose=lambda *_: None, systems=lambda _: (1, 2))
    made._settings, made.mpstate = Settings(bell=False), SimpleNamespace(mav_param_by_sysid={})
    made._bell, made._picture = Bell(made._settings, print), SimpleNamespace(alarms=(alarm,))
    assert made._bell.hear((alarm,), 1.0) == (alarm,)
    made._vehicle("2")
    assert made._picture is None
    assert made._bell.hear((alarm,), 2.0) == (alarm,)


def test_two_vehicles_with_the_same_address_on_two_links_are_told_of_once_each_time_they_are_found():
    made = module.SeatrialModule.__new__(module.SeatrialModule)
    clock, said, watcher = SimulatedClock(), [], Watcher(None, None, settings=Settings(bell=False))
    made.say_line, made._clock, made._taps, made._look_s = said.append, clock, [], 0.0
    made.mpstate, made._bell = SimpleNamespace(mav_master=[]), Bell(Settings(bell=False), print)
    idle = SimpleNamespace(tick=list)
    made._recordings = made._switching = made._parameters = made._work = idle
    made._watcher, made._picture, encoders = watcher, None, {"a": Encoder(1, 1), "b": Encoder(1, 1)}
    for second in range(1, 60):
        clock.advance_to(float(second))
        for link, boot_ms in ("a", 1000 * second), ("b", 500_000 + 1000 * second):
            beat = dialect.MAVLink_heartbeat_message(12, 3, 0, 0, 4, 3)
            for message in beat, dialect.MAVLink_system_time_message(0, boot_ms):
                (frame,) = Framer().feed(encoders[link].encode(message))
                watcher.feed(frame, clock.now_s, link)
        made.idle_task()
    twins = [line for line in said if "two vehicles beat as system 1, component 1" in line]
    assert len(twins) == 1


def test_who_takes_the_module_out_is_told_that_off_is_sent_no_more_and_not_confirmed():
    made = module.SeatrialModule.__new__(module.SeatrialModule)
    said, clock, fleet = [], SimulatedClock(), Fleet()
    (beat,) = Framer().feed(VEHICLE.encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3)))
    fleet.on_frame(beat, "link", clock.boot_s())
    made._switching = module.Switching(fleet, clock, said.append)
    made._switching.command(["off"])
    assert made._switching.tick()
    quiet = SimpleNamespace(kill=lambda: None, stop=lambda: None)
    made._parameters = module.Parameters(fleet, clock, said.append)
    made._work, made._recordings, made._taps, made.remove_command = quiet, quiet, [], lambda _: None
    made.unload()
    assert said[-1].startswith("ff: stopped by the user, vehicle 1: sent once")
    assert said[-1].endswith("not confirmed")
    assert made._switching.tick() == []


def test_off_for_a_vehicle_that_is_long_silent_goes_on_its_link_and_complains_of_none():
    made = module.SeatrialModule.__new__(module.SeatrialModule)
    sent, said, clock, fleet = [], [], SimulatedClock(), Fleet()
    (beat,) = Framer().feed(VEHICLE.encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3)))
    fleet.on_frame(beat, "radio", clock.boot_s())
    fleet.chosen = 1
    clock.advance_to(3000.0)
    made._fleet, made.say_line = fleet, said.append
    link = SimpleNamespace(mav=SimpleNamespace(send=lambda message: sent.append(message.target_component)))
    made._taps = [SimpleNamespace(name="radio", connection=link)]
    switching = module.Switching(fleet, clock, lambda _: None)
    switching.command(["off"])
    made._switch(switching.tick())
    assert ({*sent}, said) == ({1, 191}, [])


def test_nothing_else_imports_the_adapter_and_each_of_its_files_says_its_licence():
    root = Path(__file__).resolve().parents[2]
    adapter = root / "gcs_plugin" / "mavproxy"
    sources = [
        path for room in ("bridge", "gcs_plugin", "identify", "tui") for path in (root / room).rglob("*.py")
    ]
    assert len(sources) > 20
    for path in sources:
        text = path.read_text(encoding="utf-8")
        if adapter in path.parents:
            assert text.startswith("# SPDX-License-Identifier: GPL-3.0-or-later"), path
        else:
            assert not re.search(r"(import|from) (MAVProxy|gcs_plugin\.mavproxy)", text), path
