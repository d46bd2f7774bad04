"""`identify --together` and `diagnose` of several recordings: tables of short runs, named or in a folder."""

import json
from pathlib import Path

import closed_loop
import numpy as np
import pytest

from bridge import exit_codes
from tui import cli

VEHICLE = (Path(__file__).resolve().parents[1] / "data" / "vehicles" / "one_axis.yaml").read_text("utf-8")
COLUMNS = """\
time: {column: t}
velocity: {columns: [u, null, null], unit: m/s}
pwm: {columns: [X], unit: N}
"""


def table(path, seed, seconds=15.0, thrust=1.0):
    """A run of the closed loop as CSV; its times begin anew in each."""
    dive = closed_loop.dive(np.random.default_rng(seed), seconds)
    columns = (dive.velocity.time_s, dive.velocity.value[:, 0], thrust * dive.tau_cmd.value[:, 0])
    lines = ["t,u,X", *(",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def folder(tmp_path):
    """A vehicle file, a column map, and a folder of five runs of 15 s."""
    (tmp_path / "vehicle.yaml").write_text(VEHICLE, encoding="utf-8")
    (tmp_path / "columns.yaml").write_text(COLUMNS, encoding="utf-8")
    (tmp_path / "runs").mkdir()
    for seed in range(5):
        table(tmp_path / "runs" / f"run{seed}.csv", seed)
    return tmp_path


def seatrial(verb, folder, *words):
    more = ("--vehicle", folder / "vehicle.yaml", "--columns", folder / "columns.yaml")
    return cli.main([verb, *map(str, (*words, *more))])


def said(capsys):
    return " ".join(capsys.readouterr().err.split())


def test_a_folder_of_runs_is_identified_as_one_dive(folder, capsys):
    out = folder / "hull.json"
    assert seatrial("identify", folder, folder / "runs", "--together", "--json", out) == exit_codes.DONE
    answer = json.loads(out.read_text(encoding="utf-8"))
    assert [run["name"] for run in answer["runs"]["used"]] == [f"run{seed}" for seed in range(5)]
    assert answer["runs"]["left_out"] == {}
    by_name = {parameter["name"]: parameter for parameter in answer["parameters"]}
    assert by_name["M_u"]["low95"] < closed_loop.MASS < by_name["M_u"]["high95"]
    assert by_name["D_u"]["low95"] < closed_loop.DAMPING < by_name["D_u"]["high95"]
    printed = " ".join(capsys.readouterr().out.split())
    assert "5 runs, run0 to run4: likelihood" in printed
    assert "5 runs are one dive of 74 s: run0, run1, run2, run3 and run4." in printed


def test_a_run_without_a_push_is_named_in_what_is_written(folder):
    table(folder / "runs" / "adrift.csv", 9, thrust=0.0)
    out = folder / "hull.json"
    assert seatrial("identify", folder, folder / "runs", "--together", "--json", out) == exit_codes.DONE
    runs = json.loads(out.read_text(encoding="utf-8"))["runs"]
    assert len(runs["used"]) == 5
    assert runs["left_out"]["adrift"].startswith("no thruster pushed in all the dive")


@pytest.mark.usefixtures("sketched")
def test_the_page_names_each_run_with_its_file(folder):
    page = folder / "report.html"
    assert seatrial("identify", folder, folder / "runs", "--together", "--report", page) == exit_codes.DONE
    html = page.read_text(encoding="utf-8")
    provenance = html[html.index("<h2>Provenance</h2>") :]
    assert all(f"run{seed}.csv" in provenance for seed in range(5))


def test_a_folder_of_runs_without_together_is_refused_with_what_to_give(folder, capsys):
    assert seatrial("identify", folder, folder / "runs") == exit_codes.BAD_INPUT
    assert "runs: holds 5 recordings; name one of them, or give --together" in said(capsys)


@pytest.mark.parametrize("method", ["pinn", "likelihood+pinn"])
def test_another_method_than_the_likelihood_is_refused(folder, method, capsys):
    words = (folder / "runs", "--together", "--method", method)
    assert seatrial("identify", folder, *words) == exit_codes.BAD_INPUT
    assert "several runs together are identified by likelihood alone" in said(capsys)


def test_several_recordings_are_one_diagnosis(folder, capsys):
    out = folder / "gap.json"
    runs = [folder / "runs" / f"run{seed}.csv" for seed in (3, 1, 2)]
    assert seatrial("diagnose", folder, *runs, "--json", out) == exit_codes.DONE
    answer = json.loads(out.read_text(encoding="utf-8"))
    assert [run["name"] for run in answer["runs"]["used"]] == ["run1", "run2", "run3"]
    assert "3 runs are one dive of 45 s: run1, run2 and run3." in " ".join(capsys.readouterr().out.split())


def test_a_run_that_is_diagnosed_is_no_check(folder, capsys):
    words = (folder / "runs", "--check", folder / "runs" / "run3.csv")
    assert seatrial("diagnose", folder, *words) == exit_codes.BAD_INPUT
    assert "so it can't show how far the gap shrinks" in said(capsys)


def test_a_simulators_run_that_is_too_short_alone_is_named_however_many_are_held_against_it(folder, capsys):
    runs = [folder / "runs" / f"run{seed}.csv" for seed in range(3)]
    assert seatrial("diagnose", folder, *runs[:2], "--against", runs[2]) == exit_codes.NO
    assert f"{runs[2]}: lasts 14 s, too short" in said(capsys)
