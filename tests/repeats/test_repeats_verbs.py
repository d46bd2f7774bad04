"""`identify --together` keeps what runs of one push have in common; `diagnose --accepted` judges further ones by it."""

import json

import numpy as np
import pytest

from bridge import exit_codes
from identify.ingest.rotation import euler_angles
from tui.cli import main

MAP = """
time: {column: t, unit: s}
gyro: {columns: [p, q, r], unit: rad/s}
euler: {columns: [roll, pitch, yaw], unit: rad}
depth: {columns: [depth], unit: m}
pwm: {columns: [m1, m2, m3, m4], unit: us}
voltage: {columns: [volt], unit: V}
"""


def write(dives, folder):
    folder.mkdir()
    rng = np.random.default_rng(9)
    for number, dive in enumerate(dives):
        time_s = dive.depth.time_s
        euler = np.column_stack(euler_angles(dive.attitude.value))
        rates = np.gradient(np.unwrap(euler, axis=0), time_s, axis=0)
        noisy = [part + 1e-3 * rng.standard_normal(part.shape) for part in (rates, euler, dive.depth.value)]
        table = np.column_stack([time_s, *noisy, dive.pwm.value, dive.voltage.value])
        head = "t,p,q,r,roll,pitch,yaw,depth,m1,m2,m3,m4,volt"
        np.savetxt(folder / f"run{number}.csv", table, delimiter=",", header=head, comments="", fmt="%.6f")
    return str(folder)


@pytest.fixture(scope="module")
def place(sound, tmp_path_factory):
    folder = tmp_path_factory.mktemp("repeats")
    (folder / "columns.yaml").write_text(MAP, encoding="utf-8")
    write(sound.but(push_s=6.0).dives(20, 1), folder / "sound")
    write(sound.but(push_s=6.0, gains=(1.0, 1.0, 0.5, 1.0)).dives(8, 2), folder / "weak")
    wanted = [str(folder / "sound"), "--together", "--json", str(folder / "sound.json")]
    code = main(["identify", *wanted, *given(folder, sound)])
    assert code in (exit_codes.DONE, exit_codes.NO)
    return folder


def given(folder, sound):
    return ["--vehicle", str(sound.file.path), "--columns", str(folder / "columns.yaml")]


def test_a_weak_thruster_shows_in_runs_that_tell_no_model(place, sound, capsys):
    answer = place / "answer.json"
    wanted = ["--accepted", str(place / "sound.json"), "--json", str(answer), *given(place, sound)]
    assert main(["diagnose", str(place / "weak"), *wanted]) == exit_codes.DONE
    assert "Weak thruster 3 explains the gap" in " ".join(capsys.readouterr().out.split())
    data = json.loads(answer.read_text(encoding="utf-8"))
    assert [effect["name"] for effect in data["effects"]] == ["weak_thruster"]
    assert data["effects"][0]["parameters"]["thruster"]["value"] == 3
    assert len(data["runs"]["used"]) == 8


def test_runs_of_another_manoeuvre_are_left_out_and_told(place, sound, tmp_path, capsys):
    runs = write([*sound.but(push_s=6.0).dives(3, 3), sound.but(rest_s=0.0).dive()], tmp_path / "runs")
    assert (
        main(["diagnose", runs, "--accepted", str(place / "sound.json"), *given(place, sound)])
        == exit_codes.DONE
    )
    said = " ".join(capsys.readouterr().out.split())
    assert "1 more does not go from rest into a steady push, and was left out." in said


def test_they_have_no_page_and_no_model_to_accept(place, sound, tmp_path, capsys):
    wanted = [
        "--accepted",
        str(place / "sound.json"),
        "--report",
        str(tmp_path / "page.html"),
        *given(place, sound),
    ]
    assert main(["diagnose", str(place / "weak"), *wanted]) == exit_codes.BAD_INPUT
    assert "tells no model to check, accept or draw" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(("what", "of"), [("vehicle", {"name": "another"}), ("configuration", "another")])
def test_runs_accepted_of_another_vehicle_or_configuration_are_refused(
    place, sound, tmp_path, capsys, what, of
):
    data = json.loads((place / "sound.json").read_text(encoding="utf-8"))
    data[what] = data[what] | of if isinstance(of, dict) else of
    (tmp_path / "other.json").write_text(json.dumps(data), encoding="utf-8")
    wanted = ["--accepted", str(tmp_path / "other.json"), *given(place, sound)]
    assert main(["diagnose", str(place / "weak"), *wanted]) == exit_codes.BAD_INPUT
    assert f"is of {what} 'another', the dive of" in " ".join(capsys.readouterr().err.split())


def test_damaged_marks_in_an_accepted_file_are_refused(place, sound, tmp_path, capsys):
    data = json.loads((place / "sound.json").read_text(encoding="utf-8"))
    data["repeats"]["mean"] = [0.0]
    (tmp_path / "wrong.json").write_text(json.dumps(data), encoding="utf-8")
    wanted = ["--accepted", str(tmp_path / "wrong.json"), *given(place, sound)]
    assert main(["diagnose", str(place / "weak"), *wanted]) == exit_codes.BAD_INPUT
    assert "holds no accepted runs" in " ".join(capsys.readouterr().err.split())
