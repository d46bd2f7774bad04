"""`params` and its files: where values come from, what is doubted in them, and files of another vehicle."""

from functools import partial

import params_line
import pytest
from fakes.vehicle import VEHICLE
from params_line import identified, run, with_sidecar

from bridge import exit_codes
from bridge.vehicle.config import load_vehicle
from gcs_plugin.params.files import system_of, write_parameters
from gcs_plugin.params.identified import write_identified
from gcs_plugin.params.sidecar import Sidecar, read_sidecar, sidecar_path, write_sidecar
from identify.doubt import Doubt, Outcome
from identify.identification import Identification, estimate

vehicle = params_line.vehicle
file = params_line.file


def test_an_identification_in_doubt_is_sent_on_purpose_alone(vehicle, tmp_path, capsys):
    path = identified(tmp_path, outcome="data and model disagree")
    line = ("upload", path, "--vehicle", VEHICLE, "--yes")
    assert run(*line) == exit_codes.BAD_INPUT
    assert "data and model disagree" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0
    assert run(*line, "--despite-doubts") == exit_codes.DONE
    assert vehicle.server.active(1)["M_u"] == 112.0


def test_a_parameter_file_from_an_identification_in_doubt_is_refused_until_told_otherwise(
    vehicle, file, capsys
):
    with_sidecar(file, "data and model disagree")
    assert run("upload", file, "--yes") == exit_codes.BAD_INPUT
    assert "data and model disagree" in capsys.readouterr().err
    assert vehicle.server.active(1) == {}
    assert run("upload", file, "--yes", "--despite-doubts") == exit_codes.DONE


DOUBTED = "warning: M_u is doubted: no rate of turn was recorded"


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
    identification = Identification("likelihood", Outcome.CONVERGED,
                           (estimate("M_u", 111.0, 1.0, 109.0, 113.0),), "hovering",
                           "lake-7", "7" * 64, "hovering", "0" * 64, 60.0, 100, doubts=(doubt,))  # fmt: skip
    path = tmp_path / "a.param"
    write_identified(path, identification.to_json(), load_vehicle(VEHICLE))
    assert "# M_u is doubted: no rate of turn was recorded\n" in path.read_text(encoding="utf-8")
    sidecar = read_sidecar(path)
    assert sidecar.doubted == {"M_u": "no rate of turn was recorded"}


@pytest.mark.parametrize("suffix", [".param", ".parm", ".params"])
def test_what_another_vehicle_held_before_an_upload_is_not_gone_back_to(vehicle, tmp_path, suffix, capsys):
    before = tmp_path / f"2026-05-04T101112Z-before{suffix}"
    write_parameters(before, {"FF1_M_U": 112.0}, system=7, component=191)
    assert run("rollback", str(before), "--yes") == exit_codes.BAD_INPUT
    assert "saved from vehicle 7, this is vehicle 1; nothing was sent" in capsys.readouterr().err
    assert vehicle.server.value("FF1_M_U") == 0.0
    assert run("rollback", str(before), "--yes", "--any-vehicle") == exit_codes.DONE
    assert "was saved from vehicle 7, and this is vehicle 1" in " ".join(capsys.readouterr().out.split())
    assert vehicle.server.value("FF1_M_U") == 112.0


@pytest.mark.usefixtures("vehicle")
def test_files_that_this_program_writes_say_of_which_vehicle_they_are(file, tmp_path):
    shown = tmp_path / "shown.parm"
    assert run("show", "--out", str(shown)) == exit_codes.DONE
    assert run("upload", file, "--yes") == exit_codes.DONE
    (before,) = (tmp_path / "receipts").glob("*-before.param")
    (accepted,) = (tmp_path / "receipts").glob("*-accepted.param")
    assert {system_of(path) for path in (shown, before, accepted)} == {1}


CHANGED = {"vehicle": {"name": "hovering", "sha256": "0"}}


def test_a_vehicle_file_that_has_changed_since_is_a_warning(vehicle, tmp_path, capsys):
    path = identified(tmp_path, **CHANGED)
    assert run("upload", path, "--vehicle", VEHICLE, "--yes") == exit_codes.DONE
    assert "has changed since" in capsys.readouterr().out
    assert vehicle.server.active(1)["M_u"] == 112.0


def without_sidecar(tmp_path, vehicle, configuration="hovering"):
    """The file of `identify --param` without its sidecar."""
    values = (estimate("M_u", 112.0, 1.0, 110.0, 114.0), estimate("D_u", 56.0, 1.0, 54.0, 58.0))
    identification = Identification("likelihood", Outcome.CONVERGED, values, configuration, "lake-7", "7" * 64, vehicle,
                           "0" * 64, 60.0, 100)  # fmt: skip
    path = tmp_path / "moved.param"
    write_identified(path, identification.to_json(), load_vehicle(VEHICLE))
    sidecar_path(path).unlink()
    return str(path)


def saved(tmp_path, *, beside=False):
    """What vehicle 7 held, with a sidecar `beside` it or none."""
    path = tmp_path / "saved.params"
    write_parameters(path, {"FF1_M_U": 112.0, "FF1_D_U": 56.0}, system=7, component=191)
    if beside:
        about = Sidecar("ab", "cd", "hovering", "likelihood", "0.1", {}, "hovering", "lake", "converged")
        write_sidecar(path, about)
    return str(path)


def of_another_boat(tmp_path):
    path = tmp_path / "new.param"
    with_sidecar(path, "converged")
    return str(path)


@pytest.mark.usefixtures("file")
@pytest.mark.parametrize(
    ("make", "why"),
    [
        (partial(identified, vehicle={"name": "otter", "sha256": "0"}), "is of vehicle 'otter'"),
        (partial(identified, configuration="survey"), "is of configuration 'survey'"),
        (of_another_boat, "is of vehicle 'ruvifist'"),
        (partial(without_sidecar, vehicle="otherboat"), "is of vehicle 'otherboat', and"),
        (saved, "saved from vehicle 7, this is vehicle 1; nothing was sent"),
        (partial(saved, beside=True), "saved from vehicle 7"),
    ],
)
@pytest.mark.parametrize("action", ["diff", "upload"])
def test_a_file_of_another_vehicle_is_refused_unless_on_purpose(vehicle, tmp_path, capsys, make, why, action):
    line = (make(tmp_path), "--vehicle", f"{VEHICLE}:hovering")
    assert run(action, *line) == exit_codes.BAD_INPUT
    assert why in " ".join(capsys.readouterr().err.split())
    assert vehicle.server.value("FF1_M_U") == 0.0
    assert run("upload", *line, "--yes", "--any-vehicle") == exit_codes.DONE
    assert vehicle.server.value("FF1_M_U") > 0.0
    assert "warning:" in capsys.readouterr().out


def test_a_roll_back_takes_the_vehicle_file_as_an_upload_does_and_refuses_what_another_vehicle_held(
    vehicle, tmp_path, capsys
):
    path = identified(tmp_path)
    assert run("upload", path, "--vehicle", VEHICLE, "--yes") == exit_codes.DONE
    other = without_sidecar(tmp_path, "otherboat")
    assert run("rollback", other, "--vehicle", VEHICLE, "--yes") == exit_codes.BAD_INPUT
    assert "is of vehicle 'otherboat', and" in " ".join(capsys.readouterr().err.split())
    assert vehicle.server.active(1)["M_u"] == 112.0
    assert run("rollback", "--vehicle", VEHICLE, "--yes") == exit_codes.DONE
    assert vehicle.server.active(1) == {}


UNCHECKED = (
    "note: vehicle file and intervals of new.param could not be checked: new.param.json is not beside it"
)


@pytest.mark.usefixtures("vehicle")
def test_without_its_sidecar_a_file_is_taken_and_what_could_not_be_checked_is_said(file, capsys):
    assert run("diff", file) == exit_codes.NO
    assert UNCHECKED in " ".join(capsys.readouterr().out.split())
    assert run("upload", file, "--yes") == exit_codes.DONE
    assert UNCHECKED in " ".join(capsys.readouterr().out.split())
    assert run("rollback", "--yes") == exit_codes.DONE
    assert "could not be checked" not in capsys.readouterr().out
    with_sidecar(file, "converged")
    assert run("diff", file) == exit_codes.NO
    assert "could not be checked" not in capsys.readouterr().out
