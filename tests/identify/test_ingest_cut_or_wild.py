"""A recording that is cut, damaged or tells times that can't be: what it still holds is read."""

import gzip
import math
from pathlib import Path

import numpy as np
import pytest
from built_recordings import array, attitude, contract_dive, odometry, recording, write

from bridge.errors import LogError
from identify.ingest.open import read_dive


@pytest.mark.parametrize("name", ["dive.tlog.gz", "dive.tlog"])
def test_a_cut_recording_is_read_to_where_it_ends(tmp_path: Path, name: str) -> None:
    data = recording(contract_dive())
    whole = gzip.compress(data) if name.endswith("gz") else data
    dive = read_dive(write(tmp_path / name, whole[: len(whole) * 2 // 3]))
    assert dive.velocity is not None
    assert len(dive.velocity) > 30
    assert any("middle of a record" in note for note in dive.notes)


def test_damage_in_the_middle_costs_only_what_it_hit(tmp_path: Path) -> None:
    data = bytearray(recording(contract_dive()))
    data[5000:5040] = b"\xfd" * 40
    dive = read_dive(write(tmp_path / "a.tlog", bytes(data)))
    assert dive.velocity is not None
    assert len(dive.velocity) >= 99
    assert any("damaged" in note for note in dive.notes)


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


def test_infinite_angles_are_unknown_and_warn_nobody(tmp_path: Path) -> None:
    said = contract_dive()
    for k, angle in enumerate((math.inf, 0.2, -math.inf) * 100):
        message = attitude(5.0 + k / 30, angle)
        said.append((5.0 + k / 30, 1, 1, message))
    dive = read_dive(write(tmp_path / "a.tlog", recording(sorted(said, key=lambda one: one[0]))))
    assert dive.attitude is not None
    assert np.isfinite(dive.attitude.value).all(axis=1).tolist() == [False, True, False] * 100
    assert dive.attitude.value[1] == pytest.approx([math.cos(0.1), 0.0, 0.0, math.sin(0.1)])
