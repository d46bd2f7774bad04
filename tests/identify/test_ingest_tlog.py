"""Recordings built message by message, so that every value that must come out is known."""

import gzip
import math
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.errors import LogError
from bridge.framing import Encoder
from bridge.vehicle.config import load_vehicle
from identify.ingest.identity import OPENING_BYTES
from identify.ingest.open import read_dive

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
BOOT_UNIX_S = 1_790_000_000.0
NAN = float("nan")

Stamped = tuple[float, int, int, Any]


def heartbeat(kind: int = mav.MAV_TYPE_SUBMARINE, autopilot: int = 0, armed: bool = True) -> Any:
    return mav.MAVLink_heartbeat_message(kind, autopilot, 128 if armed else 0, 0, 4, 3)


def odometry(boot_s: float, velocity: tuple[float, float, float], quality: int = 90) -> Any:
    cov = [NAN] * 21
    return mav.MAVLink_odometry_message(
        int(boot_s * 1e6),
        20,
        12,
        NAN,
        NAN,
        NAN,
        [1.0, 0, 0, 0],
        *velocity,
        NAN,
        NAN,
        NAN,
        cov,
        cov,
        0,
        0,
        quality,
    )


def imu(boot_s: float, identifier: int, updated: int, gyro: tuple[float, float, float]) -> Any:
    us = int(boot_s * 1e6)
    return mav.MAVLink_highres_imu_message(us, 0, 0, -9.81, *gyro, 0, 0, 0, 0, 0, 0, 0, updated, identifier)


def array(boot_s: float, name: str, values: Iterable[float], version: int = 1) -> Any:
    padded = [*values, *[0.0] * 58][:58]
    return mav.MAVLink_debug_float_array_message(int(boot_s * 1e6), name.encode(), 256 * version, padded)


def outputs(boot_s: float, pwm: list[float]) -> Any:
    return mav.MAVLink_actuator_output_status_message(int(boot_s * 1e6), 255, [*pwm, *[0.0] * 32][:32])


def servos(boot_us: int, pwm: list[int], port: int = 0) -> Any:
    return mav.MAVLink_servo_output_raw_message(boot_us % 2**32, port, *[*pwm, *[0] * 16][:16])


def ned_velocity(boot_s: float, velocity: tuple[float, float, float]) -> Any:
    return mav.MAVLink_local_position_ned_message(int(boot_s * 1e3), 0, 0, 0, *velocity)


def attitude(boot_s: float, yaw: float) -> Any:
    return mav.MAVLink_attitude_message(int(boot_s * 1e3), 0, 0, yaw, 0, 0, 0.1)


def recording(messages: Iterable[Stamped], boot_unix_s: float = BOOT_UNIX_S) -> bytes:
    """The bytes of a `.tlog` of (arrival in boot seconds, system, component, message)."""
    encoders: dict[tuple[int, int], Encoder] = {}
    records = b""
    for arrival_s, system, component, message in messages:
        encoder = encoders.setdefault((system, component), Encoder(system, component))
        records += struct.pack(">Q", round((boot_unix_s + arrival_s) * 1e6)) + encoder.encode(message)
    return records


def contract_dive(seconds: int = 10) -> list[Stamped]:
    """Ten messages a second of a vehicle that keeps the contract; surge is a tenth of the time."""
    said: list[Stamped] = []
    for k in range(10 * seconds):
        t = 5.0 + k / 10
        own = [
            odometry(t, (t / 10, 0.2, -0.1)) if k != 3 else odometry(t, (NAN, NAN, NAN), -1),
            imu(t, 0, 0b111111, (0.1, 0.2, 0.3)),
            imu(t, 1, 32, (0.0, 0.0, 0.35)),
            outputs(t, [1500.0, 1600.0]),
            array(t, "TAU_CMD", (1, 2, 3, 4, 5, 6)),
            array(t, "NU_REF", range(14)),
            array(t, "RPM", (0.0, -700.0)),
            mav.MAVLink_attitude_quaternion_message(int(t * 1e3), 1, 0, 0, 0, 0, 0, 0),
            mav.MAVLink_scaled_pressure2_message(int(t * 1e3), 1100.5, 0, 2000),
        ]
        said += [(t + 0.02, 1, 1, message) for message in own]
        if k % 10 == 0:
            slow = [
                heartbeat(),
                mav.MAVLink_system_time_message(int((BOOT_UNIX_S + t) * 1e6), int(t * 1e3)),
                mav.MAVLink_named_value_float_message(int(t * 1e3), b"VEH_CFG", 1.0),
                mav.MAVLink_battery_status_message(0, 0, 0, 0, [16300, *[65535] * 9], 10, 0, 0, 50),
            ]
            said += [(t + 0.02, 1, 1, message) for message in slow]
            said.append((t + 0.02, 255, 190, heartbeat(mav.MAV_TYPE_GCS, 8, False)))
    return said


def write(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def test_every_signal_of_the_contract_arrives_in_si_units(tmp_path: Path) -> None:
    dive = read_dive(write(tmp_path / "a.tlog", recording(contract_dive())))
    assert dive.velocity is not None
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
    assert not dive.velocity_is_filtered


def test_a_dvl_without_bottom_lock_stays_unknown(tmp_path: Path) -> None:
    dive = read_dive(write(tmp_path / "a.tlog", recording(contract_dive())))
    assert dive.velocity is not None
    assert np.isnan(dive.velocity.value[3]).all()
    assert np.isfinite(dive.velocity.value[4]).all()


def test_fog_and_imu_are_told_apart_and_fields_that_are_not_new_are_left_out(tmp_path: Path) -> None:
    stale = (5.55, 1, 1, imu(5.55, 0, 0b000111, (9.0, 9.0, 9.0)))
    said = sorted([*contract_dive(), stale], key=lambda m: m[0])
    dive = read_dive(write(tmp_path / "a.tlog", recording(said)))
    assert dive.gyro is not None
    assert dive.specific_force is not None
    assert 9.0 not in dive.gyro.value
    assert 5.55 in dive.specific_force.time_s


def test_an_array_of_another_contract_version_is_not_read(tmp_path: Path) -> None:
    said = [m for m in contract_dive() if getattr(m[3], "msgname", "") != "DEBUG_FLOAT_ARRAY"]
    said += [(5.0, 1, 1, array(5.0, "TAU_CMD", (1.0,), version=2))]
    assert read_dive(write(tmp_path / "a.tlog", recording(said))).tau_cmd is None


@pytest.mark.parametrize("name", ["dive.tlog.gz", "dive.tlog"])
def test_a_cut_recording_is_read_to_where_it_ends(tmp_path: Path, name: str) -> None:
    data = recording(contract_dive())
    whole = gzip.compress(data) if name.endswith("gz") else data
    dive = read_dive(write(tmp_path / name, whole[: len(whole) * 2 // 3]))
    assert dive.velocity is not None
    assert len(dive.velocity) > 30
    assert any("middle of a record" in note for note in dive.notes)


def test_a_recording_is_known_by_its_unfolded_bytes_and_a_cut_one_by_its_beginning(tmp_path: Path) -> None:
    data = recording(contract_dive()) * (1 + OPENING_BYTES // len(recording(contract_dive())))
    dive = read_dive(write(tmp_path / "a.tlog", data))
    folded = read_dive(write(tmp_path / "b.tlog.gz", gzip.compress(data)))
    cut = read_dive(write(tmp_path / "c.tlog", data[:OPENING_BYTES]))
    assert (folded.sha256, folded.opening) == (dive.sha256, dive.opening)
    assert cut.sha256 != dive.sha256
    assert cut.opening == dive.opening != ""
    assert read_dive(write(tmp_path / "d.tlog", data[: OPENING_BYTES - 1])).opening == ""


def test_damage_in_the_middle_costs_only_what_it_hit(tmp_path: Path) -> None:
    data = bytearray(recording(contract_dive()))
    data[5000:5040] = b"\xfd" * 40
    dive = read_dive(write(tmp_path / "a.tlog", bytes(data)))
    assert dive.velocity is not None
    assert len(dive.velocity) >= 99
    assert any("damaged" in note for note in dive.notes)


def test_a_dive_folder_joins_its_recordings(tmp_path: Path) -> None:
    data = recording(contract_dive())
    first = recording(contract_dive(4))
    folder = tmp_path / "2026-11-20T0912Z-hovering"
    folder.mkdir()
    write(folder / "telemetry.tlog", first)
    write(folder / "telemetry.2.tlog", data[len(first) :])
    dive = read_dive(folder)
    assert dive.velocity is not None
    assert len(dive.velocity) == 100
    assert dive.name == "2026-11-20T0912Z-hovering"


def test_mavlink_1_frames_are_read(tmp_path: Path) -> None:
    old = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    records = b""
    for k in range(30):
        for message in (attitude(k / 10, 0.5), servos(k * 100_000, [1500, 1700])):
            records += struct.pack(">Q", round((BOOT_UNIX_S + k / 10) * 1e6)) + message.pack(
                old, force_mavlink1=True
            )
    dive = read_dive(write(tmp_path / "a.tlog", records))
    assert dive.pwm is not None
    assert dive.pwm.value[7] == pytest.approx([1500, 1700])
    assert dive.attitude is not None
    assert dive.attitude.value[0] == pytest.approx([np.cos(0.25), 0, 0, np.sin(0.25)])


def test_a_restart_leaves_the_longest_run(tmp_path: Path) -> None:
    later = [(t + 100.0, s, c, m) for t, s, c, m in contract_dive(10)]
    dive = read_dive(write(tmp_path / "a.tlog", recording([*contract_dive(6), *later])))
    assert dive.velocity is not None
    assert len(dive.velocity) == 100
    assert dive.armed is not None
    assert dive.armed.time_s[0] == pytest.approx(5.0, abs=0.05)
    assert any("restarted 1 time" in note for note in dive.notes)


def run_of(arrived_s: float, seconds: int, pwm: float, armed: bool = True) -> list[Stamped]:
    """A vehicle that starts when its first message arrives, and drives one thruster all the time."""
    said: list[Stamped] = []
    for k in range(10 * seconds):
        t = k / 10
        said.append((arrived_s + t, 1, 1, odometry(t, (0.1, 0.0, 0.0))))
        said.append((arrived_s + t, 1, 1, outputs(t, [1500.0, pwm])))
        if k % 10 == 0:
            said.append((arrived_s + t, 1, 1, heartbeat(armed=armed)))
    return said


@pytest.mark.parametrize("afloat", [(1500.0, True), (1600.0, False), (0.0, True), (NAN, False)])
def test_a_dive_is_used_rather_than_the_longer_time_afloat_after_a_restart(
    tmp_path: Path, afloat: tuple[float, bool]
) -> None:
    dive = read_dive(
        write(tmp_path / "a.tlog", recording([*run_of(0.0, 12, 1600.0), *run_of(60.0, 40, *afloat)]))
    )
    assert dive.velocity is not None
    assert len(dive.velocity) == 120
    assert (
        "The vehicle restarted 1 time during the recording; of 2 runs the one that began at 14:13 UTC, 12 s, is used "
        "(its thrusters moved it the most, for 12 s); the other lasts 40 s."
    ) in dive.notes


def test_where_no_run_was_driven_the_longest_is_used(tmp_path: Path) -> None:
    idle = [*run_of(0.0, 12, 1500.0), *run_of(60.0, 20, 1500.0), *run_of(120.0, 5, 1500.0)]
    dive = read_dive(write(tmp_path / "a.tlog", recording(idle)))
    assert dive.velocity is not None
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
    assert dive.velocity is not None
    assert len(dive.velocity) == 120


def ardusub_dive(boot_s: float = 0.0) -> list[Stamped]:
    """Ten seconds of an ArduSub that moves north at 1 m/s while it heads east."""
    said: list[Stamped] = []
    for k in range(100):
        t = boot_s + k / 10
        own = [
            attitude(t, np.pi / 2),
            ned_velocity(t, (1.0, 0.0, 0.2)),
            servos(round(t * 1e6), [1500, 1600, 0, 1400]),
            servos(round(t * 1e6), [1111] * 4, port=1),
            mav.MAVLink_scaled_imu2_message(int(t * 1e3), 0, 0, -1000, 0, 0, 250, 0, 0, 0),
            mav.MAVLink_global_position_int_message(int(t * 1e3), 0, 0, 0, -2500, 0, 0, 0, 0),
        ]
        said += [(t, 1, 1, message) for message in own]
        if k % 10 == 0:
            said.append((t, 1, 1, heartbeat(autopilot=3, armed=k >= 50)))
            said.append((t, 255, 190, heartbeat(mav.MAV_TYPE_GCS, 8, False)))
    return said


def test_ardusub_velocity_is_turned_from_north_east_down_into_body_axes(tmp_path: Path) -> None:
    dive = read_dive(write(tmp_path / "a.tlog", recording(ardusub_dive())))
    assert dive.velocity is not None
    assert dive.velocity.value[40] == pytest.approx([0.0, -1.0, 0.2], abs=1e-6)
    assert dive.velocity_is_filtered
    assert dive.depth is not None
    assert dive.depth.value[0] == pytest.approx([2.5])
    assert dive.gyro is not None
    assert dive.gyro.value[0] == pytest.approx([0, 0, 0.25])
    assert dive.armed is not None
    assert dive.armed.value[:, 0].tolist() == [0.0] * 5 + [1.0] * 5


def test_servo_outputs_end_at_the_first_that_is_never_driven(tmp_path: Path) -> None:
    dive = read_dive(write(tmp_path / "a.tlog", recording(ardusub_dive())))
    assert dive.pwm is not None
    assert dive.pwm.value[0] == pytest.approx([1500, 1600])


def of_outputs(path: Path, pwm: list[float]) -> Any:
    said = [(k / 10, 1, 1, outputs(k / 10, pwm)) for k in range(100)]
    return read_dive(write(path, recording([*said, (10.0, 1, 1, imu(10.0, 0, 56, (0.1, 0.2, 0.3)))]))).pwm


def test_an_output_that_is_never_a_number_counts_as_driven(tmp_path: Path) -> None:
    value = of_outputs(tmp_path / "a.tlog", [NAN, 1500.0, 1600.0]).value
    assert value.shape == (100, 3)
    assert np.isnan(value[:, 0]).all()
    assert value[0, 1:] == pytest.approx([1500.0, 1600.0])


def test_unused_outputs_may_all_be_no_number(tmp_path: Path) -> None:
    assert of_outputs(tmp_path / "a.tlog", [1500.0, 1600.0, *[NAN] * 30]).value.shape == (100, 2)


def test_the_32_bit_microseconds_of_servo_outputs_are_unwrapped(tmp_path: Path) -> None:
    boot_s = 2 * 4294.967296 - 5.0
    dive = read_dive(write(tmp_path / "a.tlog", recording(ardusub_dive(boot_s))))
    assert dive.pwm is not None
    assert dive.pwm.time_s == pytest.approx(boot_s + np.arange(100) / 10, abs=1e-4)


def test_position_deltas_of_a_dvl_driver_come_before_the_filtered_velocity(tmp_path: Path) -> None:
    said = ardusub_dive()
    for k in range(100):
        t = k / 10
        delta = mav.MAVLink_vision_position_delta_message(
            int(t * 1e6), 100_000, [0] * 3, [0.05, 0.0, 0.01], 100
        )
        said.append((t, 255, 0, delta))
    said.sort(key=lambda m: m[0])
    dive = read_dive(write(tmp_path / "a.tlog", recording(said)))
    assert dive.velocity is not None
    assert dive.velocity.value[10] == pytest.approx([0.5, 0.0, 0.1], abs=1e-6)
    assert dive.velocity.time_s[10] == pytest.approx(0.95, abs=1e-3)
    assert not dive.velocity_is_filtered


def test_a_bridge_beside_an_autopilot_is_put_on_one_clock(tmp_path: Path) -> None:
    """The bridge booted 60 s after the autopilot; both say what happens at the same instant."""
    said: list[Stamped] = []
    for k in range(100):
        t = 5.0 + k / 10
        said.append((t, 1, 191, odometry(t, (t, 0.0, 0.0))))
        said += [(t, 1, 191, imu(t, 0, 0b111111, (0.0, 0.0, 0.1)))]
        said.append((t, 1, 1, servos(round((t + 60) * 1e6), [1500, 1600])))
        said.append((t, 1, 1, mav.MAVLink_scaled_pressure2_message(int((t + 60) * 1e3), 1100.0, 0, 2000)))
    dive = read_dive(write(tmp_path / "a.tlog", recording(said)))
    assert dive.pwm is not None
    assert dive.velocity is not None
    assert dive.pwm.time_s == pytest.approx(dive.velocity.time_s, abs=1e-3)


def test_two_vehicles_in_one_recording_are_named(tmp_path: Path) -> None:
    second = [(t, 2, c, m) for t, s, c, m in contract_dive() if s == 1]
    with pytest.raises(LogError, match=r"several vehicles.*system 1 .*system 2"):
        read_dive(write(tmp_path / "a.tlog", recording([*contract_dive(), *second])))


def test_a_passer_by_does_not_spoil_a_recording(tmp_path: Path) -> None:
    passer_by = [(t, 2, c, m) for t, s, c, m in contract_dive(1) if s == 1]
    dive = read_dive(write(tmp_path / "a.tlog", recording([*contract_dive(), *passer_by])))
    assert dive.velocity is not None
    assert len(dive.velocity) == 100
    assert any("system 1 is taken" in note for note in dive.notes)


def test_a_recording_of_the_ground_station_alone_says_so(tmp_path: Path) -> None:
    said = [(k / 1.0, 255, 190, heartbeat(mav.MAV_TYPE_GCS, 8, False)) for k in range(20)]
    with pytest.raises(LogError, match="no vehicle's telemetry"):
        read_dive(write(tmp_path / "a.tlog", recording(said)))


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("notes.tlog", b"this is a text file, renamed\n" * 50, "no MAVLink frame"),
        ("empty.tlog", b"", "is empty"),
        ("empty.csv", b"", "column map"),
        ("empty.BIN", b"", "is empty"),
        ("dive.docx", b"x", "can't tell what this is"),
        ("noise.BIN", bytes(range(256)) * 20, "no DataFlash records"),
    ],
)
def test_what_is_no_recording_gets_one_sentence(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    with pytest.raises(LogError, match=said) as caught:
        read_dive(write(tmp_path / name, content))
    assert "\n" not in str(caught.value)


def test_a_missing_file_and_an_empty_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no such file"):
        read_dive(tmp_path / "nowhere.tlog")
    with pytest.raises(LogError, match="holds no recording"):
        read_dive(tmp_path)


@pytest.mark.parametrize("nothing", [b"", bytes(5), bytes(100)])
def test_a_file_that_was_begun_and_holds_nothing_takes_no_dive_with_it(
    tmp_path: Path, nothing: bytes
) -> None:
    write(tmp_path / "telemetry.tlog", nothing)
    write(tmp_path / "telemetry.2.tlog", recording(contract_dive(4)))
    write(tmp_path / "telemetry.3.tlog", recording(contract_dive(8)[380:]))
    dive = read_dive(tmp_path)
    assert dive.velocity is not None
    assert len(dive.velocity) == 80
    assert "1 of its files holds nothing, and the others are used." in dive.notes
    for name in ("telemetry.2.tlog", "telemetry.3.tlog"):
        write(tmp_path / name, nothing)
    with pytest.raises(LogError, match=r"telemetry\.tlog: (is empty|holds no MAVLink frame)"):
        read_dive(tmp_path)


def test_one_wild_time_moves_nothing_but_its_own_message(tmp_path: Path) -> None:
    said = contract_dive()
    honest = read_dive(write(tmp_path / "honest.tlog", recording(said)))
    wild = next(k for k, item in enumerate(said) if item[0] > 9.0)
    said[wild] = (*said[wild][:3], odometry(9e8, (0.4, 0.2, -0.1)))
    dive = read_dive(write(tmp_path / "wild.tlog", recording(said)))
    assert dive.velocity is not None
    assert honest.velocity is not None
    assert dive.velocity.time_s == pytest.approx(honest.velocity.time_s, abs=0.03)
    assert dive.span_s == honest.span_s
    assert "1 messages state a time that can't be; when they arrived is taken." in dive.notes
    assert not any("restarted" in note for note in dive.notes)


def test_a_wild_time_of_a_message_that_sets_no_clock_is_when_it_arrived(tmp_path: Path) -> None:
    said = contract_dive()
    said = [
        (t, s, c, array(9e8, "TAU_CMD", range(6)) if t > 14.9 and m.id == 350 else m) for t, s, c, m in said
    ]
    dive = read_dive(write(tmp_path / "wild.tlog", recording(said)))
    assert dive.tau_cmd is not None
    assert dive.tau_cmd.time_s[-1] == pytest.approx(14.9, abs=0.03)


def test_times_that_lie_years_apart_are_refused_in_one_sentence(tmp_path: Path) -> None:
    said = [(t if t < 10 else t + 4e8, s, c, m) for t, s, c, m in contract_dive() if m.id in (0, 331)]
    late = [(t, s, c, odometry(t, (0, 0, 0)) if m.id == 331 else m) for t, s, c, m in said]
    with pytest.raises(LogError, match=r"late\.tlog: its times lie 4\.63e\+03 days apart") as caught:
        read_dive(write(tmp_path / "late.tlog", recording(late)))
    assert "\n" not in str(caught.value)


def test_a_folder_of_several_dives_is_not_taken_for_one(tmp_path: Path) -> None:
    for name in ("dive.tlog", "check.tlog"):
        write(tmp_path / name, recording(contract_dive(1)))
    with pytest.raises(LogError, match=r"several recordings \(check.tlog, dive.tlog\)"):
        read_dive(tmp_path)


def test_what_a_recording_lacks_is_said(tmp_path: Path) -> None:
    said: list[Stamped] = []
    for k in range(20):
        said.append((k / 2, 1, 1, servos(k * 500_000, [1500, 1600])))
        said.append((k / 2, 1, 1, attitude(k / 2, 0.0)))
    notes = " ".join(read_dive(write(tmp_path / "a.tlog", recording(said))).notes)
    assert "No velocity is recorded: mass and damping in surge, sway and heave" in notes
    assert "Thruster commands come at 2.0 Hz" in notes


def test_a_recording_that_does_not_fit_the_vehicle_is_noted(tmp_path: Path) -> None:
    path = write(tmp_path / "a.tlog", recording(contract_dive()))
    assert any("8 thrusters" in note for note in read_dive(path, vehicle=load_vehicle("ruvifist")).notes)


def shared(*parts: str) -> Path:
    path = SHARED.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"{path} is not here")
    return path


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
    assert dive.velocity is not None
    assert dive.velocity.rate_hz == pytest.approx(10.0)
    assert dive.fog is not None
    assert dive.gyro is not None
    assert np.abs(dive.fog.value[:, 0] - dive.gyro.value[:, 2]).mean() < 0.01
    assert dive.specific_force is not None
    assert dive.specific_force.value[:, 2].mean() == pytest.approx(-9.81, abs=0.02)


@pytest.mark.parametrize("name", ["2023-04-18.tlog", "small.tlog"])
def test_real_dives_with_slow_commands_are_read_and_judged(name: str) -> None:
    dive = read_dive(shared("data", "ardusub_dives", name))
    assert dive.pwm is not None
    assert dive.pwm.rate_hz == pytest.approx(2.0, abs=0.1)
    assert any("too slow" in note for note in dive.notes)
    assert dive.specific_force is not None
    assert np.linalg.norm(dive.specific_force.value, axis=1).mean() == pytest.approx(9.8, abs=0.3)


def test_infinite_angles_are_unknown_and_warn_nobody(tmp_path: Path) -> None:
    said = contract_dive()
    for k, angle in enumerate((math.inf, 0.2, -math.inf) * 100):
        message = attitude(5.0 + k / 30, angle)
        said.append((5.0 + k / 30, 1, 1, message))
    dive = read_dive(write(tmp_path / "a.tlog", recording(sorted(said, key=lambda one: one[0]))))
    assert dive.attitude is not None
    assert np.isfinite(dive.attitude.value).all(axis=1).tolist() == [False, True, False] * 100
    assert dive.attitude.value[1] == pytest.approx([math.cos(0.1), 0.0, 0.0, math.sin(0.1)])
