"""Recordings of the bridge, of ArduSub and of DataFlash logs: every signal arrives in SI units, on one clock."""

import gzip
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from autopilot_log import FORMATS, dataflash
from built_recordings import (
    BOOT_UNIX_S,
    NAN,
    Stamped,
    array,
    attitude,
    contract_dive,
    heartbeat,
    imu,
    odometry,
    outputs,
    recording,
    servos,
    write,
)
from fakes.shared import shared
from pymavlink.DFReader import DFReader_binary
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.vehicle.config import Device, Mounting, Sensors, load_vehicle
from identify.dive import Dive, Kind, Signal
from identify.ingest.commands import samples_of_a_loop
from identify.ingest.open import read_dive


def test_every_signal_of_the_contract_arrives_in_si_units(tmp_path: Path) -> None:
    dive = read_dive(write(tmp_path / "a.tlog", recording(contract_dive())))
    assert dive.velocity.time_s == pytest.approx(5.0 + np.arange(100) / 10)
    assert dive.velocity.value[50] == pytest.approx([1.0, 0.2, -0.1])
    expected = {
        "gyro": [0.1, 0.2, 0.3], "fog": [0.35], "specific_force": [0, 0, -9.81], "attitude": [1, 0, 0, 0],
        "pressure": [110050.0], "pwm": [1500, 1600], "rpm": [0, -700], "voltage": [16.3],
        "tau_cmd": [1, 2, 3, 4, 5, 6], "nu_ref": list(range(14)), "veh_cfg": [1], "armed": [1],
    }  # fmt: skip
    for name, value in expected.items():
        assert dive.signals()[name].value[0] == pytest.approx(value), name
    assert dive.configuration_index() == 1
    assert dive.unix_at_boot_s == pytest.approx(BOOT_UNIX_S)
    assert dive.recorded_at_boot_s == pytest.approx(BOOT_UNIX_S, abs=0.1)
    assert not dive.velocity_is_filtered


def test_the_configuration_is_that_of_most_of_the_dive_and_none_if_no_number_was_told() -> None:
    time_s = np.arange(4.0)
    configurations = Signal(time_s, np.array([[np.nan], [2.0], [1.0], [1.0]]))
    dive = Dive("a", Path("a.tlog"), "0" * 64, veh_cfg=configurations)
    assert dive.configuration_index() == 1
    silent = Signal(time_s, np.full((4, 1), np.nan))
    assert replace(dive, veh_cfg=silent).configuration_index() is None


def test_a_dvl_without_bottom_lock_stays_unknown(tmp_path: Path) -> None:
    dive = read_dive(write(tmp_path / "a.tlog", recording(contract_dive())))
    assert np.isnan(dive.velocity.value[3]).all()
    assert np.isfinite(dive.velocity.value[4]).all()


def test_fog_and_imu_are_told_apart_and_fields_that_are_not_new_are_left_out(tmp_path: Path) -> None:
    stale = (5.55, 1, 1, imu(5.55, 0, 0b000111, (9.0, 9.0, 9.0)))
    stamped = sorted([*contract_dive(), stale], key=lambda m: m[0])
    dive = read_dive(write(tmp_path / "a.tlog", recording(stamped)))
    assert 9.0 not in dive.gyro.value
    assert 5.55 in dive.specific_force.time_s


def test_a_second_imu_with_all_its_axes_is_no_fibre_optic_gyro(tmp_path: Path) -> None:
    stamped = [m for m in contract_dive() if getattr(m[3], "id", 0) != 1]
    stamped += [(t, 1, 1, imu(t, 1, 0b111111, (0.1, 0.2, 0.3))) for t in np.arange(5.0, 6.0, 0.05)]
    dive = read_dive(write(tmp_path / "a.tlog", recording(sorted(stamped, key=lambda m: m[0]))))
    assert dive.fog is None
    assert dive.gyro is not None


def test_an_array_of_another_contract_version_is_not_read(tmp_path: Path) -> None:
    stamped = [m for m in contract_dive() if getattr(m[3], "msgname", "") != "DEBUG_FLOAT_ARRAY"]
    stamped += [(5.0, 1, 1, array(5.0, "TAU_CMD", (1.0,), version=2))]
    assert read_dive(write(tmp_path / "a.tlog", recording(stamped))).tau_cmd is None


def test_a_recording_is_known_by_its_unfolded_bytes_and_a_cut_one_by_its_beginning(tmp_path: Path) -> None:
    data = recording(contract_dive()) * (1 + 65536 // len(recording(contract_dive())))
    dive = read_dive(write(tmp_path / "a.tlog", data))
    folded = read_dive(write(tmp_path / "b.tlog.gz", gzip.compress(data)))
    cut = read_dive(write(tmp_path / "c.tlog", data[:65536]))
    assert (folded.sha256, folded.opening) == (dive.sha256, dive.opening)
    assert cut.sha256 != dive.sha256
    assert cut.opening == dive.opening != ""
    assert read_dive(write(tmp_path / "d.tlog", data[:65535])).opening == ""


def test_a_dive_folder_joins_its_recordings(tmp_path: Path) -> None:
    data = recording(contract_dive())
    first = recording(contract_dive(4))
    folder = tmp_path / "2026-11-20T0912Z-hovering"
    folder.mkdir()
    write(folder / "telemetry.tlog", first)
    write(folder / "telemetry.2.tlog", data[len(first) :])
    dive = read_dive(folder)
    assert len(dive.velocity) == 100
    assert dive.name == "2026-11-20T0912Z-hovering"


def test_of_two_sounders_that_look_down_the_first_tells_the_altitude(tmp_path: Path) -> None:
    stamped: list[Stamped] = list(contract_dive())
    for k in range(20):
        for number in (0, 1):
            cm = 400 + 100 * number
            sounder = mav.MAVLink_distance_sensor_message(
                100 * k + 10 * number, 20, 5000, cm, 1, number, 25, 255
            )
            stamped.append((0.1 * k + 0.01 * number, 1, 1, sounder))
    stamped.sort(key=lambda each: each[0])
    dive = read_dive(write(tmp_path / "a.tlog", recording(stamped)))
    assert dive.altitude.value[:, 0].tolist() == [4.0] * 20


def test_a_distance_whose_signal_is_no_good_is_unknown(tmp_path: Path) -> None:
    """MAVLink's signal_quality: 0 is not told, 1 is invalid, 100 is best."""
    stamped: list[Stamped] = list(contract_dive())
    for k, quality in enumerate((0, 1, 2, 100)):
        sounder = mav.MAVLink_distance_sensor_message(
            5000 + 100 * k, 20, 5000, 400, 1, 0, 25, 255, 0, 0, [0] * 4, quality
        )
        stamped.append((5.0 + 0.1 * k, 1, 1, sounder))
    stamped.sort(key=lambda each: each[0])
    dive = read_dive(write(tmp_path / "a.tlog", recording(stamped)))
    assert dive.altitude.value[:, 0] == pytest.approx([4.0, np.nan, 4.0, 4.0], nan_ok=True)


def test_a_dive_made_elsewhere_is_read_whole() -> None:
    dive = read_dive(shared("sealed", "open_1", "dive.tlog.gz"))
    assert dive.counts["records"] == 102337
    assert set(dive.signals()) >= {
        "velocity",
        "gyro",
        "fog",
        "pwm",
        "tau_cmd",
        "nu_fb",
        "nu_ref",
        "veh_cfg",
        "rpm",
    }
    assert dive.velocity.rate_hz == pytest.approx(10.0)
    assert np.abs(dive.fog.value[:, 0] - dive.gyro.value[:, 2]).mean() < 0.01
    assert dive.specific_force.value[:, 2].mean() == pytest.approx(-9.81, abs=0.02)


@pytest.mark.parametrize("name", ["2023-04-18.tlog", "small.tlog"])
def test_real_dives_with_slow_commands_are_read_and_judged(name: str) -> None:
    dive = read_dive(shared("data", "ardusub_dives", name))
    assert dive.pwm.rate_hz == pytest.approx(2.0, abs=0.1)
    assert any("too slow" in note for note in dive.notes)
    assert np.linalg.norm(dive.specific_force.value, axis=1).mean() == pytest.approx(9.8, abs=0.3)


def ned_velocity(boot_s: float, velocity: tuple[float, float, float]) -> Any:
    return mav.MAVLink_local_position_ned_message(int(boot_s * 1e3), 0, 0, 0, *velocity)


def ardusub_dive(boot_s: float = 0.0) -> list[Stamped]:
    """Ten seconds of an ArduSub that moves north at 1 m/s while it heads east."""
    stamped: list[Stamped] = []
    for k in range(100):
        t = boot_s + k / 10
        messages = [
            attitude(t, np.pi / 2),
            ned_velocity(t, (1.0, 0.0, 0.2)),
            servos(round(t * 1e6), [1500, 1600, 0, 1400]),
            servos(round(t * 1e6), [1111] * 4, port=1),
            mav.MAVLink_scaled_imu2_message(int(t * 1e3), 0, 0, -1000, 0, 0, 250, 0, 0, 0),
            mav.MAVLink_global_position_int_message(int(t * 1e3), 0, 0, 0, -2500, 0, 0, 0, 0),
        ]
        stamped += [(t, 1, 1, message) for message in messages]
        if k % 10 == 0:
            stamped.append((t, 1, 1, heartbeat(autopilot=3, armed=k >= 50)))
            stamped.append((t, 255, 190, heartbeat(mav.MAV_TYPE_GCS, 8, False)))
    return stamped


def test_ardusub_velocity_is_turned_from_north_east_down_into_body_axes(tmp_path: Path) -> None:
    dive = read_dive(write(tmp_path / "a.tlog", recording(ardusub_dive())))
    assert dive.velocity.value[40] == pytest.approx([0.0, -1.0, 0.2], abs=1e-6)
    assert dive.velocity_is_filtered
    assert dive.depth.value[0] == pytest.approx([2.5])
    # The rates of ATTITUDE, by which the autopilot steers, and not those of an IMU told as often.
    assert dive.gyro.value[0] == pytest.approx([0, 0, 0.1])
    assert dive.armed.value[:, 0].tolist() == [0.0] * 5 + [1.0] * 5


def test_servo_outputs_end_at_the_first_that_is_never_driven(tmp_path: Path) -> None:
    dive = read_dive(write(tmp_path / "a.tlog", recording(ardusub_dive())))
    assert dive.pwm.value[0] == pytest.approx([1500, 1600])


def of_outputs(path: Path, pwm: list[float]) -> Any:
    stamped = [(k / 10, 1, 1, outputs(k / 10, pwm)) for k in range(100)]
    return read_dive(write(path, recording([*stamped, (10.0, 1, 1, imu(10.0, 0, 56, (0.1, 0.2, 0.3)))]))).pwm


def test_an_output_that_is_never_a_number_counts_as_driven(tmp_path: Path) -> None:
    value = of_outputs(tmp_path / "a.tlog", [NAN, 1500.0, 1600.0]).value
    assert value.shape == (100, 3)
    assert np.isnan(value[:, 0]).all()
    assert value[0, 1:] == pytest.approx([1500.0, 1600.0])


def test_the_32_bit_microseconds_of_servo_outputs_are_unwrapped(tmp_path: Path) -> None:
    boot_s = 2 * 4294.967296 - 5.0
    dive = read_dive(write(tmp_path / "a.tlog", recording(ardusub_dive(boot_s))))
    assert dive.pwm.time_s == pytest.approx(boot_s + np.arange(100) / 10, abs=1e-4)


def test_position_deltas_of_a_dvl_driver_come_before_the_filtered_velocity(tmp_path: Path) -> None:
    stamped = ardusub_dive()
    for k in range(100):
        t = k / 10
        delta = mav.MAVLink_vision_position_delta_message(
            int(t * 1e6), 100_000, [0] * 3, [0.05, 0.0, 0.01], 100
        )
        stamped.append((t, 255, 0, delta))
    stamped.sort(key=lambda m: m[0])
    dive = read_dive(write(tmp_path / "a.tlog", recording(stamped)))
    assert dive.velocity.value[10] == pytest.approx([0.5, 0.0, 0.1], abs=1e-6)
    assert dive.velocity.time_s[10] == pytest.approx(0.95, abs=1e-3)
    assert not dive.velocity_is_filtered


def test_the_stamps_of_an_ardupilot_are_trusted_less(tmp_path: Path) -> None:
    dives = [
        read_dive(write(tmp_path / "a.tlog", recording(stamped)))
        for stamped in (ardusub_dive(), contract_dive())
    ]
    assert [dive.stamped_s for dive in dives] == [2.5e-3, 5e-4]


def dive_with_deltas(*, has_arrays: bool) -> list[Stamped]:
    """An ArduSub that hears VISION_POSITION_DELTA of component 191, our companion where it sends the contract's arrays
    too."""
    stamped = ardusub_dive()
    for k in range(100):
        t = k / 10
        delta = mav.MAVLink_vision_position_delta_message(
            int(t * 1e6), 100_000, [0, 0, 0.1], [0.05, 0, 0], 100
        )
        stamped.append((t, 1, 191, delta))
        stamped += [(t, 1, 191, array(t, "TAU_CMD", (1.0,)))] * has_arrays
    return sorted(stamped, key=lambda m: m[0])


@pytest.mark.parametrize(("has_arrays", "late_s"), [(True, 0.0), (False, 0.05)])
def test_our_companions_deltas_are_of_their_end_and_anothers_of_their_middle(tmp_path, has_arrays, late_s):
    stamped = dive_with_deltas(has_arrays=has_arrays)
    velocity = read_dive(write(tmp_path / "a.tlog", recording(stamped))).velocity
    assert velocity.time_s[10] == pytest.approx(1.0 - late_s, abs=1e-3)
    assert bool(velocity.value[10, 1] == 0.0) is has_arrays, "turned back to the axes of the middle"


@pytest.mark.parametrize("has_arrays", [True, False])
def test_our_companions_deltas_are_of_the_bodys_origin_and_anothers_of_the_dvl(tmp_path, has_arrays):
    rov, place = load_vehicle("bluerov2"), (0.1, 0.05, 0.12)
    sensors = Sensors(dvl=Device("a50", mounting=Mounting(position_m=place)))
    file = replace(rov, vehicle=replace(rov.vehicle, sensors=sensors))
    path = write(tmp_path / "a.tlog", recording(dive_with_deltas(has_arrays=has_arrays)))
    told, dive = read_dive(path), read_dive(path, vehicle=file)
    by_turning = np.cross(dive.gyro.at(dive.velocity.time_s), place)
    assert np.abs(by_turning).max() > 0.01
    expected = told.velocity.value + by_turning * has_arrays
    assert dive.velocity.value == pytest.approx(expected, abs=1e-9)
    assert (told.velocity_at_origin, dive.velocity_at_origin) == (has_arrays, False)


@pytest.mark.parametrize(
    ("component", "asks", "at_origin"), [(191, 4, True), (191, 1, False), (240, 4, False)]
)
def test_the_steps_in_the_log_of_an_autopilot_that_our_companion_asks_again_and_again_are_of_the_bodys_origin(
    tmp_path, component, asks, at_origin
):
    steps = {"VISO": ("Qffff", "TimeUS,dt,PosDX,PosDY,PosDZ"), "MAVC": ("QBHf", "TimeUS,SC,Cmd,P1")}
    records = [("MAVC", 0, component, 512, 148.0)] * asks
    for k in range(1, 2800):
        records.append(("ATT", 50_000 * k, 0, 0, 0))
        records.append(("IMU", 50_000 * k, 0, 0.0, 0.0, 0.1, 0.0, 0.0, -9.81))
        records.append(("VISO", 50_000 * k + 1, 0.05, 0.01, 0.0, 0.0))
    path = tmp_path / "a.bin"
    path.write_bytes(dataflash(FORMATS | steps, records))
    dive = read_dive(path)
    assert dive.velocity.value[5] == pytest.approx([0.2, 0.0, 0.0], abs=1e-3)
    assert (dive.velocity_is_filtered, dive.velocity_at_origin) == (False, at_origin)


@pytest.mark.parametrize(("component", "late_s"), [(1, 0.085), (191, 0.0)])
def test_the_pressure_that_an_ardusub_holds_is_dated_before_that_and_not_that_of_a_bridge(
    tmp_path, component, late_s
):
    stamped = ardusub_dive()
    for k in range(100):
        stamped.append((k / 10, 1, component, mav.MAVLink_scaled_pressure2_message(100 * k, 1100.0, 0, 2000)))
    stamped.sort(key=lambda m: m[0])
    pressure = read_dive(write(tmp_path / "a.tlog", recording(stamped))).pressure
    assert pressure.time_s[50] == pytest.approx(5.0 - late_s, abs=2e-3)


@pytest.mark.parametrize("begins", [0, 15])
@pytest.mark.parametrize(("pa_m", "is_water"), [(0.0, False), (200.0, False), (10_050.0, True)])
def test_a_pressure_that_stays_while_an_ardusub_sinks_is_of_its_hull_and_the_depth_the_autopilots(
    tmp_path: Path, pa_m: float, is_water: bool, begins: int
) -> None:
    """The autopilot's filter begins after so many samples: until then it has the depth of where it started."""
    stamped = dive_with_deltas(has_arrays=False)
    for k in range(100):
        deep_m = 23.0 + 0.5 * np.sin(0.2 * k)
        pressure = mav.MAVLink_scaled_pressure2_message(100 * k, 1013.0 + 0.01 * pa_m * deep_m, 0, 2000)
        told_mm = 0 if k < begins else round(-1e3 * deep_m)
        sunk = mav.MAVLink_global_position_int_message(100 * k + 1, 0, 0, 0, told_mm, 0, 0, 0, 0)
        stamped += [(k / 10, 1, 1, message) for message in (pressure, sunk)]
    stamped = [item for item in stamped if getattr(item[3], "relative_alt", 0) != -2500]
    stamped.sort(key=lambda item: item[0])
    dive = read_dive(write(tmp_path / "a.tlog", recording(stamped)))
    assert (dive.pressure is not None, dive.depth is None) == (is_water, is_water)
    assert any("air in its hull" in note for note in dive.notes) is not is_water


@pytest.mark.parametrize("later_s", [60.0, 2 * 3600.0])
def test_a_bridge_beside_an_autopilot_is_put_on_one_clock(tmp_path: Path, later_s: float) -> None:
    """The bridge booted later than the autopilot, whose pulses tell 32 bits of microseconds; both say what happens at
    the same instant."""
    stamped: list[Stamped] = []
    for k in range(100):
        t = 5.0 + k / 10
        stamped.append((t, 1, 191, odometry(t, (t, 0.0, 0.0))))
        stamped += [(t, 1, 191, imu(t, 0, 0b111111, (0.0, 0.0, 0.1)))]
        autopilot_s = t + later_s
        stamped.append((t, 1, 1, servos(round(autopilot_s * 1e6), [1500, 1600])))
        stamped.append(
            (t, 1, 1, mav.MAVLink_scaled_pressure2_message(int(autopilot_s * 1e3), 1100.0, 0, 2000))
        )
    dive = read_dive(write(tmp_path / "a.tlog", recording(stamped)))
    assert dive.pwm.time_s == pytest.approx(dive.velocity.time_s, abs=1e-3)


@pytest.mark.parametrize(("rate_hz", "earlier_s"), [(200.0, 0.00125), (50.0, 0.00875), (20.0, 0.0)])
def test_samples_of_a_loop_are_dated_when_their_changes_came_on_average(
    rate_hz: float, earlier_s: float
) -> None:
    """Every 2.5 ms a new pulse; samples that hold until the next are right at the time they are given. Slow samples
    may be those of a slow loop."""
    at_s = np.arange(0.0, 10.0, 1 / rate_hz)
    pulses = samples_of_a_loop(Signal(at_s, np.floor(at_s / 2.5e-3 + 1e-9)[:, None]), 2.5e-3)
    assert pulses.time_s == pytest.approx(at_s - earlier_s)
    if earlier_s:
        time_s = 1.0 + (np.arange(32_000) + 0.5) * 2.5e-4
        off = pulses.held_at(time_s)[:, 0] - np.floor(time_s / 2.5e-3)
        assert np.mean(off) == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize(
    ("autopilot", "rate_hz", "loop_hz", "hold"),
    [(3, 20.0, 400.0, False), (3, 20.0, None, None), (3, 30.0, 50.0, None), (3, 10.0, None, False),
     (3, 50.0, 400.0, None), (3, 2.0, 400.0, None), (12, 10.0, 400.0, None)],
    ids=["a stated loop", "no stated loop", "nearly the loop's own", "slower than any loop", "dated", "seldom",
         "another firmware's"],
)  # fmt: skip
def test_an_autopilots_pulses_are_samples_of_its_loop_where_that_is_faster_for_certain(
    tmp_path: Path, autopilot: int, rate_hz: float, loop_hz: float | None, hold: bool | None
) -> None:
    stamped: list[Stamped] = [(0.0, 1, 1, heartbeat(autopilot=autopilot))]
    if loop_hz:
        stamped.append((0.0, 1, 1, mav.MAVLink_param_value_message(b"SCHED_LOOP_RATE", loop_hz, 9, 1356, 7)))
    for k in range(60):
        t = 1.0 + k / rate_hz
        stamped += [(t, 1, 1, servos(round(t * 1e6), [1500 + k % 7, 1600])), (t, 1, 1, attitude(t, 0.0))]
    assert read_dive(write(tmp_path / "a.tlog", recording(stamped))).commands_hold is hold


def test_what_a_companion_stamps_alike_is_of_one_time_also_where_its_clock_drifts(tmp_path: Path) -> None:
    """A controller's tick: of NU_FB a moment after TAU_PID the check of a closed loop would take the tick before."""
    stamped: list[Stamped] = []
    for k in range(600):
        t, bridge_s = k / 20, k / 20 * (1 + 1e-4)
        stamped.append((t, 1, 1, servos(round((t + 60) * 1e6), [1500, 1600])))
        stamped.append((t, 1, 1, mav.MAVLink_scaled_pressure2_message(int((t + 60) * 1e3), 1100.0, 0, 2000)))
        stamped.append((t, 1, 191, odometry(bridge_s, (t, 0.0, 0.0))))
        stamped += [(t, 1, 191, array(bridge_s, name, (1.0,))) for name in ("TAU_PID", "NU_FB")]
    dive = read_dive(write(tmp_path / "a.tlog", recording(stamped)))
    assert (dive.nu_fb.time_s == dive.tau_pid.time_s).all()
    assert dive.nu_fb.time_s == pytest.approx(dive.pwm.time_s, abs=2e-3)


@pytest.mark.parametrize("pause_s", [0.0, 8.0])
def test_what_a_companion_sends_after_a_restart_is_of_that_time_and_not_of_the_beginning(
    tmp_path: Path, pause_s: float
) -> None:
    """Twice its clock begins anew, while the autopilot's goes on."""
    stamped: list[Stamped] = []
    for k in range(1800):
        t = 100.0 + k / 20
        stamped.append((t, 1, 1, attitude(t, 0.1)))
        began_s = 95.0 + 30.0 * (k // 600)
        if t >= began_s + 5.0 + pause_s:
            stamped.append((t, 1, 191, odometry(t - began_s, (0.01 * t, 0.0, 0.0))))
            stamped.append((t, 1, 191, array(t - began_s, "NU_FB", (0.01 * t,))))
    dive = read_dive(write(tmp_path / "a.tlog", recording(stamped)))
    assert len(dive.velocity) == 3 * (600 - 20 * pause_s)
    for signal in (dive.velocity, dive.nu_fb):
        assert signal.time_s == pytest.approx(100.0 * signal.value[:, 0], abs=2e-3)


SOUNDER = ("QBfBB", "TimeUS,Instance,Dist,Stat,Orient")


def logged(folder: Path, name: str = "", form: tuple[str, str] = ("", ""), rows: Iterable[Any] = ()) -> Path:
    """A tenth of a second a step: heading 90 degrees, roll rising by 0.05 degrees a step; rows of `name` come at the
    end, 50 ms apart."""
    records: list[tuple[Any, ...]] = []
    for k in range(40):
        us = 2_000_000 + 100_000 * k
        records += [("ATT", us, 5 * k, 0, 9000), ("RCOU", us, 1500 + k, 1400, 0)]
        records += [("IMU", us, instance, instance, 0, 0.25, 0, 0, -9.8) for instance in (0, 1)]
        records += [("ARM", us, 1)] if k == 20 else []
    records += [(name, 2_000_000 + 50_000 * k, *row) for k, row in enumerate(rows)]
    formats = FORMATS | {"RCOU": ("QHHH", "TimeUS,C1,C2,C3"), "ARM": ("QB", "TimeUS,ArmState")}
    formats |= {name: form} if name else {}
    (folder / "dive.BIN").write_bytes(dataflash(formats, records))
    return folder / "dive.BIN"


def test_units_instances_and_unused_outputs_come_out_right(tmp_path: Path) -> None:
    dive = read_dive(logged(tmp_path))
    half_roll = np.deg2rad(0.05 * 10) / 2
    c, s = np.cos(np.pi / 4), np.sin(np.pi / 4)
    expected = [c * np.cos(half_roll), c * np.sin(half_roll), s * np.sin(half_roll), s * np.cos(half_roll)]
    assert dive.attitude.value[10] == pytest.approx(expected, abs=1e-9)
    assert dive.attitude.time_s[10] == pytest.approx(3.0)
    assert dive.pwm.value[3] == pytest.approx([1503, 1400])
    assert dive.gyro.value.tolist() == [[0.0, 0.0, 0.25]] * 40
    assert dive.armed.held_at(np.array([2.5, 4.5]))[:, 0].tolist() == [0.0, 1.0]


def test_a_log_of_several_dives_says_of_each_when_it_was_armed(tmp_path: Path) -> None:
    """Armed at 30 s and 900 s, disarmed at 600 s and 1900 s: none of these is near another."""
    records: list[tuple[Any, ...]] = [("IMU", 5_000_000 * k, 0, 0, 0, 0, 0, 0, -9.8) for k in range(400)]
    records += [("ARM", 1_000_000 * s, state) for s, state in ((30, 1), (600, 0), (900, 1), (1900, 0))]
    records += [("ARM", 90_000_000_000, 1)]
    (tmp_path / "dive.BIN").write_bytes(dataflash(FORMATS | {"ARM": ("QB", "TimeUS,ArmState")}, records))
    armed = read_dive(tmp_path / "dive.BIN").armed
    assert armed.held_at(np.array([20.0, 40.0, 700.0, 1000.0, 1950.0]))[:, 0].tolist() == [0, 1, 0, 1, 0]


@pytest.mark.parametrize("stated", [True, False])
def test_an_echo_sounder_without_an_echo_tells_no_distance(tmp_path: Path, stated: bool) -> None:
    """The autopilot goes on to log the last distance, or 0, with a state that is not that of a good one."""
    readings = [(3.0, 4), (0.0, 1), (3.0, 1), (9.0, 3), (2.5, 4)]
    form = SOUNDER if stated else ("QfB", "TimeUS,Dist,Orient")
    rows = [(0, distance, state, 25) if stated else (distance, 25) for distance, state in readings]
    expected = [3.0, NAN, NAN, NAN, 2.5] if stated else [3.0, 0.0, 3.0, 9.0, 2.5]
    dive = read_dive(logged(tmp_path, "RFND", form, rows))
    assert dive.altitude.value[:, 0] == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize("instance", ["Instance", "Inst"])
def test_the_voltage_is_that_of_the_first_battery_of_several(tmp_path: Path, instance: str) -> None:
    """Older releases of ArduPilot call the number of a battery Instance, newer ones Inst."""
    form = ("QBf", f"TimeUS,{instance},Volt")
    dive = read_dive(logged(tmp_path, "BAT", form, [(0, 15.5), (1, 12.0)] * 20))
    assert dive.voltage.value[:, 0].tolist() == [15.5] * 20


def test_the_altitude_is_that_of_the_first_sounder_that_looks_down(tmp_path: Path) -> None:
    """The first sounder looks ahead, and two look down: one from the bow, one from the stern."""
    rows = [(number, 3.0 + number, 4, 0 if number == 0 else 25) for _ in range(20) for number in range(3)]
    assert read_dive(logged(tmp_path, "RFND", SOUNDER, rows)).altitude.value[:, 0].tolist() == [4.0] * 20


@pytest.mark.parametrize(("first", "expected"), [(3, 47.1), (0, 47.2)])
def test_fixes_are_those_of_the_first_receiver_that_has_any(
    tmp_path: Path, first: int, expected: float
) -> None:
    rows = [
        (number, status, 471_000_000 + 1_000_000 * number, 80_000_000, 0.5, 90.0)
        for _ in range(20)
        for number, status in ((0, first), (1, 3))
    ]
    form = ("QBBLLff", "TimeUS,I,Status,Lat,Lng,Spd,GCrs")
    assert read_dive(logged(tmp_path, "GPS", form, rows)).gnss.value[:, 0] == pytest.approx([expected] * 20)


def test_a_damaged_stretch_is_skipped_and_counted(tmp_path: Path) -> None:
    path = logged(tmp_path)
    data = bytearray(path.read_bytes())
    data[1500:1540] = bytes(40)
    path.write_bytes(data)
    dive = read_dive(path)
    assert 37 <= len(dive.pwm) <= 39
    assert any("damaged" in note for note in dive.notes)


def test_a_log_cut_anywhere_still_opens(tmp_path: Path) -> None:
    path = logged(tmp_path)
    whole = path.read_bytes()
    for end in range(700, len(whole), 97):
        path.write_bytes(whole[:end])
        assert read_dive(path).pwm is not None


def test_a_real_log_agrees_with_pymavlink(capfd: pytest.CaptureFixture[str]) -> None:
    path = shared("data", "ardusub_dives", "small.BIN")
    dive = read_dive(path)
    reader = DFReader_binary(str(path))
    theirs: dict[str, list[tuple[float, ...]]] = {"RCOU": [], "XKF1": [], "CTUN": []}
    while (message := reader.recv_match(type=list(theirs))) is not None:
        fields = {"RCOU": ("C1", "C6"), "XKF1": ("VN", "VE", "VD"), "CTUN": ("Alt",)}[message.get_type()]
        theirs[message.get_type()].append((message.TimeUS * 1e-6, *(getattr(message, f) for f in fields)))
    reader.filehandle.close()
    capfd.readouterr()
    outputs, depth, north = (np.array(theirs[name]) for name in ("RCOU", "CTUN", "XKF1"))
    assert np.column_stack((dive.pwm.time_s, dive.pwm.value[:, [0, 5]])) == pytest.approx(outputs)
    assert dive.depth.value[:, 0] == pytest.approx(-depth[:, 1])
    # Turning to body axes keeps the length.
    ours = dict(zip(dive.velocity.time_s, np.linalg.norm(dive.velocity.value, axis=1), strict=True))
    for row in north:
        if row[0] in ours:
            assert ours[row[0]] == pytest.approx(np.linalg.norm(row[1:]), rel=1e-6)
    assert len(ours) > 200


def test_a_restart_leaves_the_longest_run(tmp_path: Path) -> None:
    later = [(t + 100.0, s, c, m) for t, s, c, m in contract_dive(10)]
    dive = read_dive(write(tmp_path / "a.tlog", recording([*contract_dive(6), *later])))
    assert len(dive.velocity) == 100
    assert dive.armed.time_s[0] == pytest.approx(5.0, abs=0.05)
    assert any("restarted 1 time" in note for note in dive.notes)


def run_of(arrived_s: float, seconds: int, pwm: float, armed: bool = True) -> list[Stamped]:
    """A vehicle that starts when its first message arrives, and drives one thruster all the time."""
    stamped: list[Stamped] = []
    for k in range(10 * seconds):
        t = k / 10
        stamped.append((arrived_s + t, 1, 1, odometry(t, (0.1, 0.0, 0.0))))
        stamped.append((arrived_s + t, 1, 1, outputs(t, [1500.0, pwm])))
        if k % 10 == 0:
            stamped.append((arrived_s + t, 1, 1, heartbeat(armed=armed)))
    return stamped


@pytest.mark.parametrize("apart_s", [8.0, 900.0])
def test_two_vehicles_of_one_system_id_are_told_and_are_no_restarts_of_one(
    tmp_path: Path, apart_s: float
) -> None:
    """Their clocks looked like hundreds of restarts of one vehicle."""
    both: list[Stamped] = []
    for k in range(200):
        for boot_s, forward in ((k / 10, 0.1), (apart_s + k / 10, 0.5)):
            at_s = k / 10 + 0.004 * forward
            both.append((at_s, 1, 1, odometry(boot_s, (forward, 0.0, 0.0))))
            both.append((at_s, 1, 1, outputs(boot_s, [1500.0, 1600.0])))
    dive = read_dive(write(tmp_path / "a.tlog", recording(both)))
    (told,) = [note for note in dive.notes if "system 1, component" in note]
    assert told.startswith("Two vehicles speak as system 1, component")
    assert "their messages are mixed in this recording, and tell of neither" in told
    assert dive.note_of(Kind.RESTART) == told
    assert not any("restarted" in note for note in dive.notes)


@pytest.mark.parametrize("afloat", [(1500.0, True), (1600.0, False), (0.0, True), (NAN, False)])
def test_a_dive_is_used_rather_than_the_longer_time_afloat_after_a_restart(
    tmp_path: Path, afloat: tuple[float, bool]
) -> None:
    dive = read_dive(
        write(tmp_path / "a.tlog", recording([*run_of(0.0, 12, 1600.0), *run_of(60.0, 40, *afloat)]))
    )
    assert len(dive.velocity) == 120
    assert (
        "The vehicle restarted 1 time during the recording; of 2 runs the one that began at 14:13 UTC, 12 s, is used "
        "(its thrusters moved it the most, for 12 s); the other lasts 40 s."
    ) in dive.notes


def test_where_no_run_was_driven_the_longest_is_used(tmp_path: Path) -> None:
    idle = [*run_of(0.0, 12, 1500.0), *run_of(60.0, 20, 1500.0), *run_of(120.0, 5, 1500.0)]
    dive = read_dive(write(tmp_path / "a.tlog", recording(idle)))
    assert len(dive.velocity) == 200
    assert any("(it is the longest); the others last 12 s, 5 s." in note for note in dive.notes)


def test_an_output_that_stands_off_1500_while_disarmed_is_at_its_neutral_there(tmp_path: Path) -> None:
    afloat = run_of(60.0, 10, 1100.0, armed=False)
    later = [
        (60.0 + k / 10, 1, 1, message)
        for k in range(100, 400)
        for message in (
            odometry(k / 10, (0.0, 0.0, 0.0)), outputs(k / 10, [1500.0, 1100.0]), heartbeat(armed=True)
        )
    ]  # fmt: skip
    dive = read_dive(write(tmp_path / "a.tlog", recording([*run_of(0.0, 12, 1600.0), *afloat, *later])))
    assert len(dive.velocity) == 120
