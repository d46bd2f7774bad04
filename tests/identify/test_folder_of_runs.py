"""A folder of runs: one column map proposed for all, what is checked of it, and what is said of runs that differ."""

import numpy as np
import pytest
import yaml
from turning_vehicle import readings, usual

from bridge import exit_codes
from identify.run.joined_runs import kinds_of
from tui import cli


def run(folder, name, *, seconds=20.0, start_s=0.0, clock=None, without=(), signs=()):
    """A run as CSV: depth in centimetres, angles in degrees, the columns of `signs` turned round."""
    read = readings(seconds + start_s)
    rows = read["t"] >= start_s
    columns = {key: values[rows] for key, values in usual(read).items() if key not in without}
    columns["t"] = columns["t"] - start_s if clock is None else clock[: rows.sum()]
    for key in ("roll", "pitch", "yaw"):
        columns[key] = np.degrees(columns[key])
    columns["depth"] = 100.0 * columns["depth"]
    for key in signs:
        columns[key] = -columns[key]
    header = ",".join(columns)
    np.savetxt(
        folder / f"{name}.csv", np.column_stack([*columns.values()]), "%.9g", ",", header=header, comments=""
    )


@pytest.fixture
def runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "runs"
    folder.mkdir()
    for k in range(4):
        run(folder, f"lap{k}", seconds=15.0 + k, start_s=3.0 * k)
    return folder


def proposed(capsys):
    code = cli.main(["import", "runs", "--map", "made.yaml"])
    printed = capsys.readouterr()
    assert code == exit_codes.DONE, printed.err
    with open("made.yaml", encoding="utf-8") as written:
        return " ".join(printed.out.split()), yaml.safe_load(written)


@pytest.mark.usefixtures("runs")
def test_one_map_is_proposed_for_all_runs_of_a_folder_and_serves_them(capsys):
    said, written = proposed(capsys)
    assert written["depth"] == {"columns": ["depth"], "unit": "cm"}
    assert written["euler"] == {"columns": ["roll", "pitch", "yaw"], "unit": "deg"}
    assert "seatrial diagnose runs --columns made.yaml" in said
    assert "kinds" not in said
    assert cli.main(["import", "runs", "--columns", "made.yaml"]) == exit_codes.DONE
    out = " ".join(capsys.readouterr().out.split())
    assert "4 runs are one dive of 66 s" in out
    assert "velocity 3300 50.0 0 0 0" in out, "the time between two runs is no gap"
    assert "contradicts" not in out


def test_a_run_that_speaks_for_another_sign_is_named_and_the_map_is_that_of_the_others(runs, capsys):
    run(runs, "lap9", seconds=25.0, signs=("r",))
    said, written = proposed(capsys)
    assert "Gyro: lap9.csv of 5 runs speaks for another unit, sign or column than the others" in said
    assert "scale" not in written["gyro"]
    assert cli.main(["import", "runs", "--columns", "made.yaml"]) == exit_codes.DONE
    assert "note: lap9: The gyro contradicts how the attitude turns" in " ".join(
        capsys.readouterr().out.split()
    )


def test_runs_with_other_columns_and_those_that_cannot_be_read_are_named(runs, capsys):
    run(runs, "lap9", without=("ax", "ay", "az"))
    (runs / "lap8.csv").write_text("", encoding="utf-8")
    said, written = proposed(capsys)
    assert "Other columns than the other 4 runs has lap9.csv" in said
    assert "note: Left out: runs/lap8.csv: is empty" in said
    assert written["specific_force"]["columns"] == ["ax", "ay", "az"]


def test_a_text_of_notes_and_a_damaged_run_are_left_out_of_a_folder_and_named(runs, capsys):
    proposed(capsys)
    (runs / "notes.txt").write_text("calm day\nwind 2\n", encoding="utf-8")
    damaged = (runs / "lap3.csv").read_text(encoding="utf-8").splitlines()
    damaged[100] = "0.1,0.2"
    (runs / "lap3.csv").write_text("\n".join(damaged), encoding="utf-8")
    assert cli.main(["import", "runs", "--columns", "made.yaml"]) == exit_codes.DONE
    out = " ".join(capsys.readouterr().out.split())
    assert "3 runs are one dive of 48 s: lap0, lap1 and lap2." in out
    assert "The run notes.txt was left out: has no column 'u'; it has day, calm: mend the column map." in out
    assert "The run lap3.csv was left out: row 101 has 2 cells, the first line names 19; mend it." in out
    assert cli.main(["import", "runs/lap3.csv", "--columns", "made.yaml"]) == exit_codes.BAD_INPUT
    (runs / "lap2.csv").write_text("", encoding="utf-8")
    (runs / "lap1.csv").write_text("", encoding="utf-8")
    capsys.readouterr()
    assert cli.main(["import", "runs", "--columns", "made.yaml"]) == exit_codes.BAD_INPUT
    assert "runs/lap1.csv: is empty" in " ".join(capsys.readouterr().err.split())


def test_a_clock_of_the_day_is_known_by_the_run_that_passes_a_minute(runs, capsys):
    second = np.arange(2000) // 50
    for k in range(4):
        run(runs, f"lap{k}", clock=160003.0 + 100 * k + second)
    run(runs, "lap4", clock=np.where(second < 17, 172043.0, 172100.0 - 17) + second)
    _, written = proposed(capsys)
    assert written["time"] == {"column": "t", "unit": "hhmmss"}


def test_names_of_two_kinds_are_told_wherever_runs_are_joined(runs, capsys):
    for k in range(3):
        run(runs, f"rov{k}", seconds=16.0, start_s=1.0 + k)
    said, _ = proposed(capsys)
    sentence = "The names of the runs are of 2 kinds (lap0.csv and 3 more and rov0.csv and 2 more)"
    assert sentence in said
    assert cli.main(["import", "runs", "--columns", "made.yaml"]) == exit_codes.DONE
    assert sentence.replace(".csv", "") in " ".join(capsys.readouterr().out.split())


def test_runs_with_a_name_each_are_of_no_kinds():
    assert kinds_of(["calm", "square", "turns"]) == ()
    assert kinds_of(["run 2", "run 11"]) == ()


@pytest.mark.usefixtures("runs")
def test_a_folder_of_runs_is_no_dive_folder_to_be_made(capsys):
    proposed(capsys)
    assert cli.main(["import", "runs", "--columns", "made.yaml", "--out", "dive"]) == exit_codes.BAD_INPUT
    assert "is a folder of runs as it is; leave it out" in " ".join(capsys.readouterr().err.split())


def test_a_column_of_words_in_some_runs_that_is_empty_in_others_refuses_no_folder(runs, capsys):
    for name, event in (("lap0", ""), ("lap1", "pinged"), ("lap2", ""), ("lap3", "pinged")):
        header, *rows = (runs / f"{name}.csv").read_text().splitlines()
        (runs / f"{name}.csv").write_text("\n".join([f"{header},event", *(f"{row},{event}" for row in rows)]))
    said, written = proposed(capsys)
    assert written["depth"] == {"columns": ["depth"], "unit": "cm"}
    assert "event" in said
