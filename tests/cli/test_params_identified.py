"""`params` and what was identified: where a file comes from, what is doubted in it, and what it takes back."""

import json
from pathlib import Path

import params_line
import pytest
from fakes.vehicle import VEHICLE
from params_line import DESPITE_HALF, identified, run, with_sidecar

from bridge.vehicle.config import load_vehicle
from gcs_plugin.params.files import Sidecar, read_sidecar, write_sidecar
from gcs_plugin.params.identified import write_identified
from identify.identification import Doubt, Identification, Outcome, estimate
from tui import exit_codes

vehicle = params_line.vehicle
file = params_line.file


@pytest.mark.parametrize("action", ["diff", "upload"])
def test_outcome_and_notes_of_an_identification_stand_above_the_plan(vehicle, tmp_path, action, capsys):
    del vehicle
    run(action, identified(tmp_path), "--vehicle", VEHICLE, *(["--yes"] if action == "upload" else []))
    shown = capsys.readouterr().out
    assert shown.index("outcome: converged") < shown.index("the thrusters saturated") < shown.index("FF1_M_U")


def test_an_identification_in_doubt_is_sent_on_purpose_alone(vehicle, tmp_path, capsys):
    path = identified(tmp_path, outcome="data and model disagree")
    line = ("upload", path, "--vehicle", VEHICLE, "--yes")
    assert run(*line) == exit_codes.BAD_INPUT
    assert "data and model disagree" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0
    assert run(*line, "--despite-doubts") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 112.0


def test_diff_shows_an_identification_in_doubt(vehicle, tmp_path, capsys):
    del vehicle
    path = identified(tmp_path, outcome="stopped at a bound")
    assert run("diff", path, "--vehicle", VEHICLE) == exit_codes.NO
    assert "outcome: stopped at a bound" in capsys.readouterr().out


@pytest.mark.parametrize("data", [{}, {"parameters": []}, {"configuration": "hovering"}, {"identified": {}}])
def test_a_json_that_is_no_identification_is_said_so(vehicle, tmp_path, data, capsys):
    del vehicle
    path = tmp_path / "other.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    assert run("diff", str(path), "--vehicle", VEHICLE) == exit_codes.BAD_INPUT
    assert "is not an identification" in capsys.readouterr().err


def test_upload_takes_the_json_of_an_identification(vehicle, tmp_path):
    path = identified(tmp_path)
    assert run("upload", path, "--vehicle", VEHICLE, "--yes") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 112.0
    assert "M_v" not in vehicle.server.active(1)


def test_a_parameter_file_from_an_identification_in_doubt_is_refused_until_told_otherwise(
    vehicle, file, capsys
):
    with_sidecar(file, "data and model disagree")
    assert run("upload", file, "--yes") == exit_codes.BAD_INPUT
    assert "data and model disagree" in capsys.readouterr().err
    assert vehicle.server.active(1) == {}
    assert run("upload", file, "--yes", "--despite-doubts") == exit_codes.DONE


@pytest.mark.usefixtures("vehicle")
def test_a_parameter_file_with_a_sidecar_says_where_it_comes_from(file, capsys):
    with_sidecar(file, "converged")
    run("diff", file)
    shown = capsys.readouterr()
    assert (
        "from lake-7 of ruvifist, configuration hovering, by likelihood: converged" in shown.out + shown.err
    )


DOUBTED = "warning: M_u is doubted: no rate of turn was recorded"


@pytest.mark.usefixtures("vehicle")
def test_each_doubted_value_that_a_parameter_file_sends_is_told(file, capsys):
    doubted = {"M_u": "no rate of turn was recorded", "M_w": "it was weighed by others"}
    write_sidecar(
        Path(file), Sidecar("dive", "vehicle", "hovering", "likelihood", "0.1.0", {}, doubted=doubted)
    )
    assert run("diff", file) == exit_codes.NO
    shown = capsys.readouterr().out
    assert DOUBTED in shown
    assert "M_w is doubted" not in shown
    run("diff", file, "--only", "FF1_D_U")
    assert "is doubted" not in capsys.readouterr().out
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert DOUBTED in capsys.readouterr().out


@pytest.mark.usefixtures("vehicle")
def test_each_doubted_value_that_an_identification_sends_is_told(tmp_path, capsys):
    doubt = {
        "about": ["M_u", "M_w"],
        "sentence": "No rate of turn was recorded: dive again.",
        "outcome": "converged",
    }
    path = identified(tmp_path, doubts=[doubt])
    run("diff", path, "--vehicle", VEHICLE)
    shown = capsys.readouterr().out
    assert DOUBTED in shown
    assert f"warning: {doubt['sentence']}" in shown
    assert "M_w is doubted" not in shown


def test_a_parameter_file_and_its_sidecar_keep_what_is_doubted(tmp_path):
    doubt = Doubt(("M_u", "M_w"), "No rate of turn was recorded", "dive again.")
    found = Identification("likelihood", Outcome.CONVERGED, (estimate("M_u", 111.0, 1.0, 109.0, 113.0),), "hovering",
                           "lake-7", "7" * 64, "hovering", "0" * 64, 60.0, 100, doubts=(doubt,))  # fmt: skip
    path = tmp_path / "a.param"
    write_identified(path, found.to_json(), load_vehicle(VEHICLE))
    assert "# M_u is doubted: no rate of turn was recorded\n" in path.read_text(encoding="utf-8")
    sidecar = read_sidecar(path)
    assert sidecar is not None
    assert sidecar.doubted == {"M_u": "no rate of turn was recorded"}


def test_a_model_without_effects_takes_back_those_accepted_before_and_says_so(vehicle, file, capsys):
    vehicle.server.write("FF1_X_UU", 12.5, False)
    vehicle.server.write("FF_COMMIT", float(vehicle.server.staged_crc), False)
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert vehicle.server.active(1)["X_uu"] == 12.5
    write_sidecar(
        Path(file), Sidecar("", "", "hovering", "likelihood", "1", vehicle="ruvifist", outcome="converged")
    )
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert "taken back: FF1_X_UU" in capsys.readouterr().out
    assert "X_uu" not in vehicle.server.active(1)


def test_an_effect_that_a_model_takes_back_is_a_line_that_can_be_chosen(vehicle, file, capsys):
    vehicle.server.write("FF1_X_UU", 12.5, False)
    vehicle.server.write("FF_COMMIT", float(vehicle.server.staged_crc), False)
    with_sidecar(file, "converged")
    assert run("upload", file, "--yes", "--only", "FF1_M_U", *DESPITE_HALF) == exit_codes.DONE
    assert vehicle.server.active(1)["X_uu"] == 12.5
    vehicle.clock.advance_to(vehicle.clock.now_s + 2.0)
    assert run("upload", file, "--yes", "--only", "FF1_X_UU") == exit_codes.DONE
    assert "X_uu" not in vehicle.server.active(1)
    capsys.readouterr()
    assert run("upload", file, "--yes", "--only", "FF1_Y_VV") == exit_codes.BAD_INPUT
    assert "nothing of FF1_Y_VV is to be changed" in capsys.readouterr().err
