"""Several runs in one table, told apart by a column: read, proposed, refused, identified as one dive."""

import json
from pathlib import Path

import closed_loop
import numpy as np
import pytest
import yaml

from bridge import exit_codes
from bridge.errors import LogError
from identify.ingest.open import read_dive, read_dives
from tui import cli

COLUMNS = """\
time: {column: t}
runs: {column: trial}
velocity: {columns: [u, null, null], unit: m/s}
pwm: {columns: [T1], unit: N}
"""
VEHICLE = (Path(__file__).resolve().parents[1] / "data" / "vehicles" / "one_axis.yaml").read_text("utf-8")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "columns.yaml").write_text(COLUMNS, encoding="utf-8")
    (tmp_path / "vehicle.yaml").write_text(VEHICLE, encoding="utf-8")
    return tmp_path


def table(folder, trials, seconds=15.0, header="trial,t,u,T1"):
    """Runs of the closed loop below one another, the clock from zero in each; a trial of None leaves its cell empty."""
    lines = [header]
    for seed, trial in enumerate(trials):
        dive = closed_loop.dive(np.random.default_rng(seed), seconds)
        columns = dive.velocity.time_s, dive.velocity.value[:, 0], dive.tau_cmd.value[:, 0]
        word = "" if trial is None else trial
        lines += [
            f"{word}," + ",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)
        ]
    path = folder / "trials.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_each_run_of_a_table_is_a_dive_with_a_clock_of_its_own(folder):
    first, second = read_dives(table(folder, (3, 12)), folder / "columns.yaml")
    assert (first.name, second.name) == ("trials run 3", "trials run 12")
    assert first.sha256 != second.sha256
    for dive in (first, second):
        assert dive.velocity.time_s == pytest.approx(np.arange(150) * 0.1)
    assert first.velocity.value[:, 0] != pytest.approx(second.velocity.value[:, 0])


def test_runs_may_be_named_by_words(folder):
    names = [dive.name for dive in read_dives(table(folder, ("ahead", "astern")), folder / "columns.yaml")]
    assert names == ["trials run ahead", "trials run astern"]


def test_rows_of_no_run_are_left_out_and_counted(folder):
    dives = read_dives(table(folder, (1, None, 2)), folder / "columns.yaml")
    assert [dive.name for dive in dives] == ["trials run 1", "trials run 2"]
    assert "150 rows without a run in 'trial' were left out." in dives[0].notes


def test_one_row_of_no_run_is_called_one_row(folder):
    path = table(folder, (1, None, 2))
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([*lines[:152], *lines[301:]]) + "\n", encoding="utf-8")
    dives = read_dives(path, folder / "columns.yaml")
    assert "1 row without a run in 'trial' was left out." in dives[0].notes


def test_a_run_that_cannot_be_read_is_left_out_and_named(folder):
    path = table(folder, (1, 2, 3))
    rows = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()]
    of_second = [row for row in rows if row[0] == "2"]
    for row in of_second[len(of_second) // 2 :]:
        row[1] = str(float(row[1]) + 6e6)
    path.write_text("\n".join(",".join(row) for row in rows) + "\n", encoding="utf-8")
    first, third = read_dives(path, folder / "columns.yaml")
    assert (first.name, third.name) == ("trials run 1", "trials run 3")
    (note,) = (note for note in first.notes if note.startswith("Run 2 was left out"))
    assert "69.4 days apart" in note


def test_a_table_of_which_most_runs_cannot_be_read_is_refused(folder):
    path = table(folder, (1, 2))
    (folder / "columns.yaml").write_text(
        COLUMNS.replace("[u, null, null]", "[v, null, null]"), encoding="utf-8"
    )
    with pytest.raises(LogError, match="has no column 'v'"):
        read_dives(path, folder / "columns.yaml")


def test_a_table_of_several_runs_is_no_single_dive(folder):
    path = table(folder, (1, 2))
    with pytest.raises(LogError, match=r"holds 2 runs.*trials run 1 to trials run 2.*identify --together"):
        read_dive(path, folder / "columns.yaml")


def test_a_table_of_one_run_is_a_dive(folder):
    assert read_dive(table(folder, (7,)), folder / "columns.yaml").name == "trials run 7"


def test_a_column_that_the_table_lacks_is_named_with_those_it_has(folder):
    (folder / "columns.yaml").write_text(COLUMNS.replace("trial", "attempt"), encoding="utf-8")
    with pytest.raises(LogError, match=r"no column 'attempt' for the runs; it has .*trial"):
        read_dives(table(folder, (1, 2)), folder / "columns.yaml")


def test_a_measurement_names_no_runs(folder):
    (folder / "columns.yaml").write_text(COLUMNS.replace("trial", "u"), encoding="utf-8")
    with pytest.raises(LogError, match=r"'u' has \d+ values in 300 rows, so it names no runs"):
        read_dives(table(folder, (1, 2)), folder / "columns.yaml")


def test_the_runs_of_a_table_are_identified_together(folder):
    path, out = table(folder, (1, 2, 3, 4, 10)), folder / "hull.json"
    words = (
        "identify",
        path,
        "--together",
        "--vehicle",
        "vehicle.yaml",
        "--columns",
        "columns.yaml",
        "--json",
        out,
    )
    assert cli.main([*map(str, words)]) == exit_codes.DONE
    answer = json.loads(out.read_text(encoding="utf-8"))
    assert [run["name"] for run in answer["runs"]["used"]] == [f"trials run {k}" for k in (1, 2, 3, 4, 10)]
    mass = next(parameter for parameter in answer["parameters"] if parameter["name"] == "M_u")
    assert mass["low95"] < closed_loop.MASS < mass["high95"]


def test_a_map_is_proposed_with_the_column_that_changes_where_the_clock_starts_anew(folder, capsys):
    path = table(folder, (1, 2, 3))
    assert cli.main(["import", str(path), "--map", "made.yaml"]) == exit_codes.DONE
    said = " ".join(capsys.readouterr().out.split())
    assert "trial run -" in said
    assert "'trial' changes where the clock starts anew, so it is taken for the number of the run." in said
    written = yaml.safe_load((folder / "made.yaml").read_text(encoding="utf-8"))
    assert written["runs"] == {"column": "trial"}
    assert written["time"] == {"column": "t", "unit": "s"}
    assert written["velocity"]["columns"] == ["u", None, None]
    assert len(read_dives(path, folder / "made.yaml")) == 3


def test_no_column_is_taken_for_the_runs_where_the_clock_runs_on(folder):
    path = table(folder, (1, 2))
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(lines[:151]) + "\n", encoding="utf-8")
    assert cli.main(["import", str(path), "--map", "made.yaml"]) == exit_codes.DONE
    assert "runs" not in yaml.safe_load((folder / "made.yaml").read_text(encoding="utf-8"))


def test_an_import_of_a_table_says_how_many_runs_it_holds_and_files_it(folder, capsys):
    path = table(folder, (1, 2, 3))
    words = ("import", path, "--columns", "columns.yaml", "--out", "made")
    assert cli.main([*map(str, words)]) == exit_codes.DONE
    assert "3 runs are one dive of 45 s" in " ".join(capsys.readouterr().out.split())
    assert [dive.name for dive in read_dives(folder / "made")] == [f"made run {k}" for k in (1, 2, 3)]


def test_runs_in_any_order_of_the_day_are_known_by_where_the_clock_leaps(folder, capsys):
    began = (202252, 162000, 201510)
    lines = ["trial,time,u,T1"]
    for seed, start in enumerate(began):
        dive = closed_loop.dive(np.random.default_rng(seed), 15.0)
        rows = zip(dive.velocity.time_s, dive.velocity.value[:, 0], dive.tau_cmd.value[:, 0], strict=True)
        lines += [f"{seed},{start + int(t)},{u:.9g},{force:.9g}" for t, u, force in rows]
    path = folder / "trials.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert cli.main(["import", str(path), "--map", "made.yaml"]) == exit_codes.DONE
    assert "so it is taken for the number of the run" in " ".join(capsys.readouterr().out.split())
    assert yaml.safe_load((folder / "made.yaml").read_text(encoding="utf-8"))["runs"] == {"column": "trial"}
