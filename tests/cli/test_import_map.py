"""`seatrial import FILE --map`: what it shows, writes and refuses, and what a mapped import says of physics."""

import json

import numpy as np
import pytest
import yaml

from bridge import exit_codes
from identify.ingest.mapping.profiles import Profile
from tui import cli
from tui.column_map import drawn


@pytest.fixture
def log(tmp_path, monkeypatch):
    """A vehicle that turns about z by a formula; its gyro has the wrong sign."""
    monkeypatch.chdir(tmp_path)
    t = np.arange(0.0, 30.0, 0.05)
    yaw, r = np.degrees(1.5 * np.sin(0.5 * t)), 0.75 * np.cos(0.5 * t)
    pulse = 1500 + 200 * np.sin(0.5 * t)
    rows = np.column_stack([t, yaw, -r, pulse, np.where(t < 25, 7.0, 8.0), np.zeros_like(t)])
    path = tmp_path / "tank.csv"
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header="t,yaw_deg,r,T1,mood,spare", comments="")
    return path


def test_it_shows_every_column_writes_the_map_and_says_what_to_do_next(log, capsys):
    assert cli.main(["import", str(log), "--map", "columns.yaml"]) == exit_codes.DONE
    said = " ".join(capsys.readouterr().out.split())
    assert "yaw_deg euler 3 deg" in said
    assert "mood not used - 7" in said
    assert "6 columns, of which 1 not used, unchanging or a second clock, is left out here" in said
    assert "spare" not in said
    assert "check gyro: The gyro contradicts how the attitude turns" in said
    assert f"seatrial import {log} --columns columns.yaml" in said
    written = yaml.safe_load((log.parent / "columns.yaml").read_text(encoding="utf-8"))
    assert written["gyro"] == {"columns": [None, None, "r"], "unit": "rad/s", "scale": [1, 1, -1]}


def test_a_file_of_which_no_name_is_known_is_shown_before_it_is_refused(tmp_path, capsys):
    path = tmp_path / "fahrt.csv"
    rows = "\n".join(f"{0.1 * k:.1f},{k % 7},{k % 3}" for k in range(200))
    path.write_text(f"time,Fahrt,Kurs\n{rows}\n", encoding="utf-8")
    assert cli.main(["import", str(path), "--map", str(tmp_path / "map.yaml")]) == exit_codes.BAD_INPUT
    shown = capsys.readouterr()
    assert "Fahrt not used - 0 3" in " ".join(shown.out.split())
    assert "no column but the time is known by its name" in " ".join(shown.err.split())
    assert not (tmp_path / "map.yaml").exists()


def test_without_a_name_the_map_is_named_after_the_log(log):
    assert cli.main(["import", str(log), "--map"]) == exit_codes.DONE
    assert (log.parent / "tank-columns.yaml").exists()


@pytest.mark.parametrize("words", [["--map", "columns.yaml"], ["--map"]])
def test_it_never_writes_over_a_file(words, log, refused):
    for name in ("columns.yaml", "tank-columns.yaml"):
        (log.parent / name).write_text("mine", encoding="utf-8")
    assert "never overwritten" in refused("import", log, *words)
    assert (log.parent / "columns.yaml").read_text(encoding="utf-8") == "mine"
    assert (log.parent / "tank-columns.yaml").read_text(encoding="utf-8") == "mine"


def test_its_json_has_the_profiles_the_choices_and_the_next_commands(log, capsys):
    assert cli.main(["import", str(log), "--map", "columns.yaml", "--json", "-"]) == exit_codes.DONE
    output = json.loads(capsys.readouterr().out)
    mood = next(column for column in output["columns"] if column["name"] == "mood")
    assert (mood["taken_for"], mood["least"], mood["median"], mood["largest"]) == ("", 7.0, 7.0, 8.0)
    assert mood["rate_hz"] == pytest.approx(20.0)
    chosen = {choice["signal"]: choice for choice in output["signals"]}
    assert chosen["gyro"]["scale"] == [1.0, 1.0, -1.0]
    assert chosen["pwm"]["confidence"] == "likely"
    assert output["next"][0].endswith("--columns columns.yaml")


def test_a_mapped_import_names_what_contradicts_physics_and_the_edit_of_the_map(log, capsys):
    columns = log.parent / "wrong.yaml"
    columns.write_text(
        'time: {column: t}\neuler: {columns: ["-", "-", yaw_deg], unit: deg}\n'
        "gyro: {columns: [null, null, r], unit: rad/s}\n",
        encoding="utf-8",
    )
    assert cli.main(["import", str(log), "--columns", str(columns)]) == exit_codes.DONE
    said = " ".join(capsys.readouterr().out.split())
    assert "note: The gyro contradicts how the attitude turns" in said
    assert "multiply `scale` of `gyro` by [1, 1, -1]." in said
    assert cli.main(["import", str(log), "--map", "right.yaml"]) == exit_codes.DONE
    capsys.readouterr()
    words = ["import", str(log), "--columns", "right.yaml", "--json", "-"]
    assert cli.main(words) == exit_codes.DONE
    assert json.loads(capsys.readouterr().out)["contradictions"] == []


def test_options_that_need_the_map_first_are_refused_beside_it(log, refused):
    assert "--out: has no use with --map" in refused("import", log, "--map", "columns.yaml", "--out", "dive")
    assert not (log.parent / "columns.yaml").exists()


def test_a_file_that_is_no_table_is_refused_in_a_sentence(tmp_path, refused):
    (tmp_path / "notes.txt").write_text("hello", encoding="utf-8")
    assert "give a .csv" in refused("import", tmp_path / "notes.txt", "--map")


def test_a_course_is_drawn_from_its_lowest_to_its_highest_mean():
    def course(*means):
        return drawn(Profile("x", 9, 1.0, 0.0, 0.0, 0.0, 0.0, means))

    assert course(0.0, 0.5, 1.0) == "▁▅█"
    assert course(3.0, 3.0) == "▁▁"
    assert course() == "-"


def test_a_narrow_terminal_gets_the_table_without_what_it_misses_least(log, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "60")
    assert cli.main(["import", str(log), "--map", "columns.yaml"]) == exit_codes.DONE
    table = capsys.readouterr().out.partition("\n\n")[0].splitlines()[1:]
    assert max(map(len, table)) <= 60
    assert "column taken for unit least largest" in " ".join(" ".join(table).split())
    assert "median" not in " ".join(table)
