"""What is no recording, or not one of one vehicle and one dive, is refused in one sentence; what is lacking is said."""

from pathlib import Path

import pytest
from built_recordings import Stamped, attitude, contract_dive, heartbeat, recording, servos, write
from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.errors import LogError
from bridge.vehicle.config import load_vehicle
from identify.ingest.open import read_dive


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
