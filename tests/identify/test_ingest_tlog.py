"""A recording of a vehicle that keeps the contract: every signal of it arrives, in SI units."""

import gzip
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_recordings import BOOT_UNIX_S, array, attitude, contract_dive, imu, recording, servos, write
from pymavlink.dialects.v20 import ardupilotmega as mav

from identify.dive import Dive, Signal
from identify.ingest.identity import OPENING_BYTES
from identify.ingest.open import read_dive

SHARED = Path(__file__).resolve().parents[2].parent / "shared"


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


def test_the_configuration_is_that_of_most_of_the_dive_and_none_if_no_number_was_told() -> None:
    time_s = np.arange(4.0)
    told = Signal(time_s, np.array([[np.nan], [2.0], [1.0], [1.0]]))
    dive = Dive("a", Path("a.tlog"), "0" * 64, veh_cfg=told)
    assert dive.configuration_index() == 1
    silent = Signal(time_s, np.full((4, 1), np.nan))
    assert replace(dive, veh_cfg=silent).configuration_index() is None


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


def test_a_recording_is_known_by_its_unfolded_bytes_and_a_cut_one_by_its_beginning(tmp_path: Path) -> None:
    data = recording(contract_dive()) * (1 + OPENING_BYTES // len(recording(contract_dive())))
    dive = read_dive(write(tmp_path / "a.tlog", data))
    folded = read_dive(write(tmp_path / "b.tlog.gz", gzip.compress(data)))
    cut = read_dive(write(tmp_path / "c.tlog", data[:OPENING_BYTES]))
    assert (folded.sha256, folded.opening) == (dive.sha256, dive.opening)
    assert cut.sha256 != dive.sha256
    assert cut.opening == dive.opening != ""
    assert read_dive(write(tmp_path / "d.tlog", data[: OPENING_BYTES - 1])).opening == ""


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
