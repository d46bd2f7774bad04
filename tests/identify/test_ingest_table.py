"""Tables and the maps that say what their columns hold."""

import re
from pathlib import Path

import numpy as np
import pytest
from built_recordings import of_table
from fakes.shared import shared

from bridge.errors import ConfigError, LogError
from identify.dive import Dive
from identify.ingest.mapping.column_map import column_map
from identify.ingest.open import read_dive

MAP = """
time: {column: ms, unit: ms}
velocity: {columns: [u, v, "-"], unit: cm/s}
euler: {columns: ["-", "-", heading], unit: deg, offset: [0, 0, -10]}
gyro: {columns: ["-", "-", r], unit: deg/s, scale: [1, 1, -1]}
pwm: {columns: [T1, T2], unit: us}
tau_cmd: {columns: [X, "-", "-", "-", "-", N], unit: N}
notes: ["From the tank."]
"""
HEADER = "ms,u,v,heading,r,T1,T2,X,N\n"


def dive_of(tmp_path: Path, rows: str, columns: str = MAP) -> Dive:
    return of_table(tmp_path, HEADER + rows, columns)


def test_units_offsets_and_scales_are_applied_in_that_order(tmp_path: Path) -> None:
    rows = "0,50,-20,100,90,1500,1600,3,1\n100,,0,100,90,1500,1600,4,2\n"
    dive = dive_of(tmp_path, rows)
    assert dive.velocity.time_s.tolist() == [0.0, 0.1]
    assert dive.velocity.value[0] == pytest.approx([0.5, -0.2, 0.0])
    assert np.isnan(dive.velocity.value[1, 0])
    assert dive.attitude.value[0] == pytest.approx([np.cos(np.pi / 4), 0, 0, np.sin(np.pi / 4)])
    assert dive.gyro.value[0] == pytest.approx([0, 0, -np.pi / 2])
    assert dive.tau_cmd.value[1] == pytest.approx([4, 0, 0, 0, 0, 2])
    assert "From the tank." in dive.notes


def test_a_row_that_leaves_a_signal_empty_holds_no_sample_of_it(tmp_path: Path) -> None:
    rows = "0,50,-20,100,90,1500,1600,3,1\n50,,,,,1500,1700,,\n100,nan,nan,100,90,,,4,2\n"
    dive = dive_of(tmp_path, rows)
    assert dive.velocity.time_s.tolist() == dive.attitude.time_s.tolist() == [0.0, 0.1]
    assert np.isnan(dive.velocity.value[1, :2]).all()
    assert dive.pwm.time_s.tolist() == [0.0, 0.05]
    assert dive.pwm.value[:, 1].tolist() == [1600.0, 1700.0]


def test_a_cut_last_row_is_left_out_and_said(tmp_path: Path) -> None:
    dive = dive_of(tmp_path, "0,1,1,0,0,1500,1500,0,0\n100,1,1,0,0,1500,1500,0,0\n200,1,1")
    assert len(dive.pwm) == 2
    assert any("cut off" in note for note in dive.notes)


def test_rows_of_one_time_count_once(tmp_path: Path) -> None:
    row = "1,1,0,0,1500,1500,0,0\n"
    dive = dive_of(tmp_path, f"0,{row}100,{row}100,{row}50,{row}")
    assert dive.pwm.time_s.tolist() == [0.0, 0.05, 0.1]
    assert any("1 row without a time of its own" in note for note in dive.notes)


def test_rows_of_one_time_that_hold_a_signal_each_are_one_row(tmp_path: Path) -> None:
    rows = (
        "0,50,-20,,,,,,\n0,,,100,,,,,\n0,,,,90,,,,\n0,,,,,1500,1600,3,1\n100,50,-20,,,,,,\n100,,,100,90,,,,\n"
    )
    dive = dive_of(tmp_path, rows)
    whole = dive_of(tmp_path, "0,50,-20,100,90,1500,1600,3,1\n100,50,-20,100,90,,,,\n")
    assert dive.notes == whole.notes
    assert dive.counts == whole.counts
    for name in ("velocity", "attitude", "gyro", "pwm", "tau_cmd"):
        signal, other = getattr(dive, name), getattr(whole, name)
        assert signal.time_s.tolist() == other.time_s.tolist()
        assert signal.value.tolist() == other.value.tolist()


def test_a_table_joined_of_several_logs_is_read_alike_whether_it_says_nan_or_nothing(tmp_path: Path) -> None:
    rows = (
        "0,50,-20,,,,,,\n0,,,100,,,,,\n0,,,,90,,,,\n0,,,,,1500,1600,,\n50,,,,95,,,,\n"
        "100,50,-20,,,,,,\n100,,,100,90,,,,\n150,,,,,1500,1700,,\n"
    )
    blank, said = (tmp_path / name for name in ("blank", "said"))
    for folder in (blank, said):
        folder.mkdir()
    dive, other = dive_of(blank, rows), dive_of(said, re.sub(r"(?<=,)(?=[,\n])", "nan", rows))
    assert other.notes == dive.notes
    for name in ("velocity", "attitude", "gyro", "pwm"):
        signal, nan = getattr(dive, name), getattr(other, name)
        assert nan.time_s.tolist() == signal.time_s.tolist()
        assert nan.value.tolist() == signal.value.tolist()
    assert other.gyro.time_s.tolist() == [0.0, 0.05, 0.1]
    assert other.pwm.time_s.tolist() == [0.0, 0.15]


def test_of_rows_of_one_time_that_clash_the_first_is_kept_and_the_rest_counted(tmp_path: Path) -> None:
    first, clash, fits = "0,50,-20,,,,,,\n", "0,60,-20,100,90,,,,\n", "0,50,-20,,,1500,1600,,\n"
    dive = dive_of(tmp_path, f"{first}{clash}{fits}100,50,-20,,,1500,1600,,\n")
    assert dive.velocity.value[0, 0] == 0.5
    assert dive.attitude is None or len(dive.attitude) == 0
    assert dive.pwm.time_s.tolist() == [0.0, 0.1]
    assert any("1 row without a time of its own was left out" in note for note in dive.notes)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("0,1,one,0,0,1500,1500,0,0\n", "row 2 holds 'one', which is no number"),
        ("0,1\n0,1,1,0,0,1500,1500,0,0\n", "row 2 has 2 cells, the first line names 9"),
        ("", "holds no rows"),
    ],
)
def test_a_table_that_is_none_is_refused_with_its_row(tmp_path: Path, rows: str, said: str) -> None:
    with pytest.raises(LogError, match=said):
        dive_of(tmp_path, rows)


def test_a_column_that_is_not_there_is_named_with_those_that_are(tmp_path: Path) -> None:
    columns = MAP.replace("T2]", "T9]")
    with pytest.raises(LogError, match=r"no column 'T9'; it has ms, u, v"):
        dive_of(tmp_path, "0,1,1,0,0,1500,1500,0,0\n", columns)


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ("velocty: {columns: [u, v, w], unit: m/s}", "did you mean 'velocity'"),
        ("velocity: {columns: [u, v, w], unit: m/h}", "unit 'm/h' is none of m/s"),
        ("velocity: {columns: [u, v], unit: m/s}", "needs 3 columns, 2 are given"),
        ("gyro: {columns: [p, q, r], unit: rad/s, offset: [1]}", "offset needs one number for each"),
        ("depth: {columns: z, unit: m, scale: x}", r"depth: scale\[0\]: expected a number"),
        ("velocity: {columns: [null, null, null], unit: m/s}", "every column is unknown"),
        ("euler: {columns: [r, p, null], unit: deg}", "euler: can't be known in part"),
        ("tau_cmd: {columns: [X, null, null, null, null, N], unit: N}", "tau_cmd: can't be known in part"),
        (
            "velocity_is_filtered: true\nvelocity: {columns: [u, null, w], unit: m/s}",
            "velocity: can't be known in part",
        ),
    ],
)
def test_a_wrong_column_map_is_refused_with_its_key(tmp_path: Path, columns: str, said: str) -> None:
    path = tmp_path / "columns.yaml"
    path.write_text(f"time: {{column: t}}\n{columns}\n")
    with pytest.raises(ConfigError, match=said):
        column_map(path)


def test_a_lone_column_and_a_number_for_all_columns_need_no_list(tmp_path: Path) -> None:
    path = tmp_path / "columns.yaml"
    path.write_text(
        "time: {column: t}\npressure: {columns: p, unit: hPa, offset: 1013.25}\n"
        "gyro: {columns: [p, q, r], unit: rad/s, scale: 1e-3, offset: 2}\n"
    )
    read = column_map(path)
    assert read.pressure is not None
    assert read.gyro is not None
    assert (read.pressure.columns, read.pressure.offset) == (("p",), (1013.25,))
    assert (read.gyro.offset, read.gyro.scale) == ((2.0,) * 3, (0.001,) * 3)


def test_an_unknown_map_names_those_that_are_bundled() -> None:
    with pytest.raises(ConfigError, match=r"no such column map.*bolt"):
        column_map(Path("boltt"))


def test_commands_that_hold_by_the_map_are_told_up_to_the_end(tmp_path: Path) -> None:
    map_text = "time: {column: t}\ndepth: {columns: [z], unit: m}\npwm: {columns: [a], unit: us}\ncommands_hold: true\n"
    rows = "t,z,a\n0,0,1500\n0.5,0.1,\n1,0.2,1600\n1.5,0.3,\n4,0.6,\n"
    dive = of_table(tmp_path, rows, map_text)
    pwm = dive.pwm
    assert dive.commands_hold
    assert pwm.held_at(np.array([0.0, 0.95, 1.0, 3.9, 4.0]))[:, 0].tolist() == [1500, 1500, 1600, 1600, 1600]
    assert pwm.rate_hz == pytest.approx(20.0)


def test_commands_that_hold_over_years_fill_no_memory(tmp_path: Path) -> None:
    rows = "".join(f"{ms},1,1,0,0,1500,1500,0,0\n" for k in range(20) for ms in [k + (k > 9) * 1.79e15])
    with pytest.raises(LogError, match=r"its times lie 2\.07e\+07 days apart"):
        dive_of(tmp_path, rows, f"{MAP}commands_hold: true\n")


@pytest.mark.parametrize("hold", ["", "commands_hold: true\n"])
def test_columns_without_any_number_are_a_signal_that_is_missing(tmp_path: Path, hold: str) -> None:
    map_text = MAP.replace("tau_cmd", "#") + 'armed: {columns: [X], unit: "1"}\n' + hold
    dive = dive_of(tmp_path, "".join(f"{k},1,1,0,0,,,,\n" for k in range(3)), map_text)
    assert dive.pwm is None
    assert any("Neither thruster commands nor wrenches" in note for note in dive.notes)
    assert not any("never armed" in note for note in dive.notes)


def test_speeds_of_the_shafts_alone_are_said_to_be_thrust_by_a_vehicle_file(tmp_path: Path) -> None:
    map_text = (
        "time: {column: t}\ngyro: {columns: [p, q, r], unit: rad/s}\nrpm: {columns: [a, b], unit: rpm}\n"
    )
    rows = "t,p,q,r,a,b\n" + "".join(f"{0.05 * k},0,0,{0.1 * k},{20 * k},{-20 * k}\n" for k in range(9))
    dive = of_table(tmp_path, rows, map_text)
    assert dive.rpm is not None
    assert any("shafts' speeds" in note and "forward_n_s2" in note for note in dive.notes)
    assert not any("Neither thruster commands" in note for note in dive.notes)


@pytest.mark.parametrize("name", ["Yaw_test_3.csv", "Depth_test_4.csv", "depth_test.csv"])
def test_bolt_tables_are_read_and_what_they_lack_is_said(name: str) -> None:
    dive = read_dive(shared("data", "bolt_auv", name), Path("bolt"))
    assert dive.pwm.value.shape[1] == 8
    notes = " ".join(dive.notes)
    assert "There is no velocity to go by" in notes
    assert "roll, pitch and yaw are identified by the attitude alone" in notes


def test_fossen_runs_give_motion_but_no_force() -> None:
    dive = read_dive(shared("data", "fossen_simulator", "otter_a.csv"), Path("fossen_otter"))
    assert len(dive.velocity) == 6000
    # The file's propeller speeds are rad/s.
    assert dive.rpm.value[1] == pytest.approx(np.array([-3.301362, 52.247483]) * 30 / np.pi, rel=1e-6)
    assert any("nothing can be identified" in note for note in dive.notes)
