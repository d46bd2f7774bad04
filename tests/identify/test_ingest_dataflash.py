"""DataFlash logs built record by record, and a real one read beside pymavlink's own reader."""

import struct
from pathlib import Path

import numpy as np
import pytest
from pymavlink.DFReader import DFReader_binary

from bridge.errors import LogError
from identify.ingest.open import read_dive

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
MAGIC = b"\xa3\x95"
ATT, RCOU, IMU, ARM = 1, 2, 3, 4


def form(kind: int, name: str, letters: str, columns: str, size: int) -> bytes:
    return (
        MAGIC
        + b"\x80"
        + struct.pack("<BB4s16s64s", kind, size + 3, name.encode(), letters.encode(), columns.encode())
    )


def log(samples: int = 40) -> bytes:
    """A tenth of a second a step: heading 90 degrees, roll rising by 0.05 degrees a step."""
    data = form(0x80, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 86)
    data += form(ATT, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw", 14)
    data += form(RCOU, "RCOU", "QHHH", "TimeUS,C1,C2,C3", 14)
    data += form(IMU, "IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", 33)
    data += form(ARM, "ARM", "QB", "TimeUS,ArmState", 9)
    for k in range(samples):
        us = 2_000_000 + 100_000 * k
        data += MAGIC + bytes([ATT]) + struct.pack("<QhhH", us, 5 * k, 0, 9000)
        data += MAGIC + bytes([RCOU]) + struct.pack("<QHHH", us, 1500 + k, 1400, 0)
        for instance in (0, 1):
            data += MAGIC + bytes([IMU]) + struct.pack("<QB6f", us, instance, instance, 0, 0.25, 0, 0, -9.8)
        if k == 20:
            data += MAGIC + bytes([ARM]) + struct.pack("<QB", us, 1)
    return data


def test_units_instances_and_unused_outputs_come_out_right(tmp_path: Path) -> None:
    path = tmp_path / "dive.BIN"
    path.write_bytes(log())
    dive = read_dive(path)
    assert dive.attitude is not None
    half_roll = np.deg2rad(0.05 * 10) / 2
    c, s = np.cos(np.pi / 4), np.sin(np.pi / 4)
    expected = [c * np.cos(half_roll), c * np.sin(half_roll), s * np.sin(half_roll), s * np.cos(half_roll)]
    assert dive.attitude.value[10] == pytest.approx(expected, abs=1e-9)
    assert dive.attitude.time_s[10] == pytest.approx(3.0)
    assert dive.pwm is not None
    assert dive.pwm.value[3] == pytest.approx([1503, 1400])
    assert dive.gyro is not None
    assert dive.gyro.value.tolist() == [[0.0, 0.0, 0.25]] * 40
    assert dive.armed is not None
    assert dive.armed.held_at(np.array([2.5, 4.5]))[:, 0].tolist() == [0.0, 1.0]


def test_a_damaged_stretch_is_skipped_and_counted(tmp_path: Path) -> None:
    data = bytearray(log())
    data[1500:1540] = bytes(40)
    path = tmp_path / "dive.BIN"
    path.write_bytes(bytes(data))
    dive = read_dive(path)
    assert dive.attitude is not None
    assert 37 <= len(dive.attitude) <= 39
    assert any("damaged" in note for note in dive.notes)


def test_a_log_cut_anywhere_still_opens(tmp_path: Path) -> None:
    whole = log()
    path = tmp_path / "dive.bin"
    for end in range(700, len(whole), 97):
        path.write_bytes(whole[:end])
        assert read_dive(path).pwm is not None


def test_a_log_of_formats_alone_says_that_it_holds_nothing(tmp_path: Path) -> None:
    path = tmp_path / "dive.BIN"
    path.write_bytes(log(0))
    with pytest.raises(LogError, match="holds no"):
        read_dive(path)


def test_a_real_log_agrees_with_pymavlink(capfd: pytest.CaptureFixture[str]) -> None:
    path = SHARED / "data" / "ardusub_dives" / "small.BIN"
    if not path.exists():
        pytest.skip(f"{path} is not here")
    dive = read_dive(path)
    reader = DFReader_binary(str(path))
    theirs: dict[str, list[tuple[float, ...]]] = {"RCOU": [], "XKF1": [], "CTUN": []}
    while (message := reader.recv_match(type=list(theirs))) is not None:
        fields = {"RCOU": ("C1", "C6"), "XKF1": ("VN", "VE", "VD"), "CTUN": ("Alt",)}[message.get_type()]
        theirs[message.get_type()].append((message.TimeUS * 1e-6, *(getattr(message, f) for f in fields)))
    reader.filehandle.close()
    capfd.readouterr()
    assert dive.pwm is not None
    assert dive.depth is not None
    assert dive.velocity is not None
    outputs, depth, north = (np.array(theirs[name]) for name in ("RCOU", "CTUN", "XKF1"))
    assert np.column_stack((dive.pwm.time_s, dive.pwm.value[:, [0, 5]])) == pytest.approx(outputs)
    assert dive.depth.value[:, 0] == pytest.approx(-depth[:, 1])
    # Turning to body axes keeps the length.
    ours = dict(zip(dive.velocity.time_s, np.linalg.norm(dive.velocity.value, axis=1), strict=True))
    for row in north:
        if row[0] in ours:
            assert ours[row[0]] == pytest.approx(np.linalg.norm(row[1:]), rel=1e-6)
    assert len(ours) > 200
