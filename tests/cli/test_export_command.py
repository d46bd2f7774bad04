"""`seatrial export`: which model it takes, where it writes, and what it says."""

import json
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from full_disk import fill

from gcs_plugin.params.files import Sidecar, write_sidecar
from tui import cli, exit_codes

BUNDLED = Path(__file__).resolve().parents[2] / "configs" / "vehicles"


def identified(path, **changed):
    parameters = [
        {"name": "M_u", "value": 111.0, "std": 1.1, "low95": 109.0, "high95": 113.0, "identifiable": True},
        {"name": "D_u", "value": 56.0, "std": 0.5, "low95": 55.0, "high95": 57.0, "identifiable": True},
        {"name": "M_w", "value": 999.0, "std": 500.0, "identifiable": False, "reason": "too little"},
        {"name": "X_udot", "value": 39.0, "std": 1.0, "identifiable": True},
    ]
    data = {
        "method": "likelihood", "outcome": "converged", "configuration": "hovering", "parameters": parameters,
        "vehicle": {"name": "ruvifist", "sha256": "0" * 64},
    }  # fmt: skip
    path.write_text(json.dumps(data | changed), encoding="utf-8")
    return path


def export(*words):
    return cli.main(["export", *map(str, words)])


def test_an_identification_becomes_a_file_and_what_did_not_fit_is_shown(tmp_path, capsys):
    out = tmp_path / "a.sdf"
    code = export(identified(tmp_path / "a.json"), "--vehicle", "ruvifist", "--to", "gazebo", "--out", out)
    assert code == exit_codes.DONE
    root = ET.parse(out).getroot()
    assert float(root.findtext(".//fluid_added_mass/xx")) == 39.0
    assert float(root.findtext(".//xU")) == -56.0
    assert float(root.findtext(".//fluid_added_mass/zz")) == 0.0
    shown = capsys.readouterr().out
    assert "what did not fit into gazebo" in shown
    assert "thruster lag 0.05 s" in shown
    assert "note: M_w was not identified" in shown


def test_without_a_file_standard_output_is_the_file_alone(tmp_path, capsys):
    assert (
        export(identified(tmp_path / "a.json"), "--vehicle", "ruvifist", "--to", "stonefish")
        == exit_codes.DONE
    )
    captured = capsys.readouterr()
    assert ET.fromstring(captured.out).tag == "scenario"
    assert "what did not fit into stonefish" in captured.err


def test_a_vehicle_file_with_a_model_is_taken_as_it_is(tmp_path):
    out = tmp_path / "a.json"
    assert export("bluerov2_heavy", "--to", "ardusub-json", "--out", out) == exit_codes.DONE
    plant = json.loads(out.read_text(encoding="utf-8"))["plant"]
    assert plant["total_mass"] == pytest.approx([19.86, 20.62, 32.18, 0.449, 0.365, 0.592])
    assert plant["intervals_95"] == {}


def test_an_identification_without_intervals_is_written_all_the_same(tmp_path, capsys):
    bare = [{"name": "M_u", "value": 111.0, "low95": None, "high95": None, "identifiable": True}]
    path = identified(tmp_path / "a.json", parameters=bare)
    assert export(path, "--vehicle", "ruvifist", "--to", "gazebo") == exit_codes.DONE
    captured = capsys.readouterr()
    assert "95 %" not in captured.out + captured.err


def test_what_did_not_fit_is_written_as_json_too(tmp_path, capsys):
    out, told = tmp_path / "a.sdf", tmp_path / "told.json"
    path = identified(tmp_path / "a.json")
    assert (
        export(path, "--vehicle", "ruvifist", "--to", "gazebo", "--out", out, "--json", told)
        == exit_codes.DONE
    )
    data = json.loads(told.read_text(encoding="utf-8"))
    assert (data["target"], data["file"]) == ("gazebo", str(out))
    assert "thruster lag 0.05 s" in [part["what"] for part in data["left_out"]]
    assert all(part["reason"] for part in data["left_out"])
    assert any("M_w" in note for note in data["notes"])
    assert "M_w" in data["unknown"]
    assert "M_u" not in data["unknown"]
    capsys.readouterr()
    assert (
        export(path, "--vehicle", "ruvifist", "--to", "gazebo", "--out", out, "--json", "-")
        == exit_codes.DONE
    )
    assert json.loads(capsys.readouterr().out)["target"] == "gazebo"


def refused(capsys, *words):
    assert export(*words) == exit_codes.BAD_INPUT
    return capsys.readouterr().err


def test_an_unknown_target_is_answered_with_the_targets(tmp_path, capsys):
    said = refused(capsys, identified(tmp_path / "a.json"), "--vehicle", "ruvifist", "--to", "unity")
    assert "unity" in said
    assert "gazebo, stonefish, ardusub-json" in said


def test_a_model_that_is_none_or_of_another_vehicle_is_refused(tmp_path, capsys):
    path = identified(tmp_path / "a.json")
    assert "needs --vehicle" in refused(capsys, path, "--to", "gazebo")
    assert "is not: nothing was written" in refused(
        capsys, path, "--vehicle", "bluerov2_heavy", "--to", "gazebo"
    )
    assert "is not: nothing was written" in refused(
        capsys, path, "--vehicle", "ruvifist:survey", "--to", "gazebo"
    )
    assert "has no model" in refused(capsys, "ruvifist:hovering", "--to", "gazebo")
    assert "--vehicle says nothing" in refused(
        capsys, "bluerov2_heavy", "--vehicle", "ruvifist", "--to", "gazebo"
    )
    empty = identified(tmp_path / "b.json", parameters=[])
    assert "no identifiable parameter" in refused(capsys, empty, "--vehicle", "ruvifist", "--to", "gazebo")


def test_one_in_doubt_is_written_only_where_the_user_says_so(tmp_path, capsys):
    path = identified(tmp_path / "a.json", outcome="data and model disagree")
    words = (path, "--vehicle", "ruvifist", "--to", "gazebo", "--out", tmp_path / "a.sdf")
    assert "nothing was written" in refused(capsys, *words)
    assert not (tmp_path / "a.sdf").exists()
    assert export(*words, "--despite-doubts") == exit_codes.DONE


def test_no_input_is_written_over(tmp_path, capsys):
    vehicle = tmp_path / "our.yaml"
    shutil.copy(BUNDLED / "bluerov2_heavy.yaml", vehicle)
    before = vehicle.read_bytes()
    assert "would write over" in refused(capsys, f"{vehicle}:heavy", "--to", "gazebo", "--out", vehicle)
    assert "would write over" in refused(capsys, vehicle, "--to", "gazebo", "--out", vehicle)
    assert vehicle.read_bytes() == before
    assert "add --out" in refused(capsys, vehicle, "--to", "gazebo", "--json", "-")


def test_a_doubted_value_that_is_exported_is_told(tmp_path, capsys):
    doubt = {
        "about": ["M_u", "M_w"],
        "outcome": "converged",
        "sentence": "No rate of turn was recorded: dive again.",
        "problem": "No rate of turn was recorded",
        "remedy": "dive again.",
    }
    path, told = identified(tmp_path / "a.json", doubts=[doubt]), tmp_path / "told.json"
    words = (path, "--vehicle", "ruvifist", "--to", "gazebo", "--out", tmp_path / "a.sdf", "--json", told)
    assert export(*words) == exit_codes.DONE
    shown = capsys.readouterr().out
    assert "warning: M_u is doubted: no rate of turn was recorded" in shown
    assert "M_w is doubted" not in shown
    assert json.loads(told.read_text(encoding="utf-8"))["doubted"] == {"M_u": "no rate of turn was recorded"}


def test_a_sidecars_doubts_are_told_where_its_values_are_exported(tmp_path, capsys):
    param = tmp_path / "a.param"
    param.write_text("FF1_M_U,111\n", encoding="utf-8")
    told = Sidecar("1" * 64, "0" * 64, "hovering", "likelihood", "0.1", vehicle="ruvifist", outcome="converged",
                   doubted={"M_u": "no rate of turn was recorded"})  # fmt: skip
    write_sidecar(param, told)
    assert (
        export(param, "--vehicle", "ruvifist", "--to", "gazebo", "--out", tmp_path / "a.sdf")
        == exit_codes.DONE
    )
    assert "warning: M_u is doubted: no rate of turn was recorded" in capsys.readouterr().out


def test_a_file_that_finds_no_room_is_named_with_what_did_not_fit_and_leaves_what_lay_there(
    tmp_path, monkeypatch, capsys
):
    out, words = tmp_path / "a.sdf", ("--vehicle", "ruvifist", "--to", "gazebo", "--out")
    out.write_text("older", encoding="utf-8")
    fill(monkeypatch, tmp_path, ".sdf")
    assert export(identified(tmp_path / "a.json"), *words, out) == exit_codes.BAD_INPUT
    told = capsys.readouterr()
    assert "what did not fit into gazebo" in told.out
    assert "a.sdf: can't be written (No space left on device)" in told.err
    assert out.read_text("utf-8") == "older"
