"""`seatrial export`, and what `diagnose --accept` writes: exported, simulated, taken by a vehicle."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from full_disk import fill
from identified_json import identified

from bridge import exit_codes
from bridge.exit_codes import UsageError
from bridge.onboard.parameters import ParameterServer
from bridge.vehicle.coefficients import AcceptedEffect
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.parameters import vehicle_table
from gcs_plugin.params.sidecar import read_sidecar, write_sidecar
from identify.diagnose.result import Accepted, Value
from identify.diagnose.shrink.shrunk import Shrink
from identify.dive import Dive
from identify.doubt import Doubt, Outcome
from tui import cli
from tui.accept_diagnosis import accept, accepted_before
from tui.accepted_priors import accepted_in
from tui.commands.params import targets_of
from tui.commands.simulate import accepted_truth
from tui.parameter_files import Leave, accepted_model

BUNDLED = Path(__file__).resolve().parents[2] / "configs" / "vehicles"


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
    path = identified(tmp_path / "a.json")
    assert export(path, "--vehicle", "ruvifist", "--to", "stonefish") == exit_codes.DONE
    captured = capsys.readouterr()
    assert ET.fromstring(captured.out).tag == "scenario"
    assert "what did not fit into stonefish" in captured.err


def test_a_vehicle_file_with_a_model_is_taken_as_it_is(tmp_path):
    out = tmp_path / "a.json"
    assert export("bluerov2_heavy", "--to", "ardusub-json", "--out", out) == exit_codes.DONE
    plant = json.loads(out.read_text(encoding="utf-8"))["plant"]
    assert plant["total_mass"] == pytest.approx([19.86, 20.62, 32.18, 0.449, 0.365, 0.592])
    assert plant["intervals_95"] == {}


def test_what_did_not_fit_is_written_as_json_too(tmp_path, capsys):
    out, report = tmp_path / "a.sdf", tmp_path / "told.json"
    path = identified(tmp_path / "a.json")
    words = (path, "--vehicle", "ruvifist", "--to", "gazebo", "--out", out, "--json")
    assert export(*words, report) == exit_codes.DONE
    data = json.loads(report.read_text(encoding="utf-8"))
    assert (data["target"], data["file"]) == ("gazebo", str(out))
    assert "thruster lag 0.05 s" in [part["what"] for part in data["left_out"]]
    assert all(part["reason"] for part in data["left_out"])
    assert any("M_w" in note for note in data["notes"])
    assert "M_w" in data["unknown"]
    assert "M_u" not in data["unknown"]
    capsys.readouterr()
    assert export(*words, "-") == exit_codes.DONE
    assert json.loads(capsys.readouterr().out)["target"] == "gazebo"


def test_what_did_not_fit_is_written_though_the_reader_of_the_lines_has_left(tmp_path, monkeypatch):
    def left(*_):
        raise BrokenPipeError

    monkeypatch.setattr("tui.show.say", left)
    path, report = identified(tmp_path / "a.json"), tmp_path / "told.json"
    export(path, "--vehicle", "ruvifist", "--to", "gazebo", "--out", tmp_path / "a.sdf", "--json", report)
    assert json.loads(report.read_text(encoding="utf-8"))["target"] == "gazebo"


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ("a.json --vehicle ruvifist --to unity", "the targets are gazebo, stonefish, ardusub-json"),
        ("a.json --to gazebo", "needs --vehicle"),
        ("a.json --vehicle bluerov2_heavy --to gazebo", "is not: nothing was written"),
        ("a.json --vehicle ruvifist:survey --to gazebo", "is not: nothing was written"),
        ("empty.json --vehicle ruvifist --to gazebo", "no identifiable parameter"),
        ("ruvifist:hovering --to gazebo", "has no model"),
        ("bluerov2_heavy --vehicle ruvifist --to gazebo", "--vehicle says nothing"),
        ("b.jsn --vehicle ruvifist --to gazebo", "b.jsn: no such file"),
        (
            "dives --to gazebo",
            "dives: is a folder, and --to gazebo takes a model; give the JSON that seatrial",
        ),
        ("ruvifist --to gazebo", "has survey, hovering; name one: ruvifist:CONFIGURATION"),
        ("bluerov2_heavy --to gazebo --json -", "add --out"),
    ],
)
def test_what_can_not_be_exported_is_told(tmp_path, monkeypatch, words, why, refused):
    monkeypatch.chdir(tmp_path)
    identified(Path("a.json"))
    identified(Path("empty.json"), parameters=[])
    Path("dives").mkdir()
    assert why in refused("export", *words.split())


def test_one_in_doubt_is_written_only_where_the_user_says_so(tmp_path, refused):
    path = identified(tmp_path / "a.json", outcome="data and model disagree")
    words = (path, "--vehicle", "ruvifist", "--to", "gazebo", "--out", tmp_path / "a.sdf")
    assert "nothing was written" in refused("export", *words)
    assert not (tmp_path / "a.sdf").exists()
    assert export(*words, "--despite-doubts") == exit_codes.DONE


def test_a_doubted_value_that_is_exported_is_told(tmp_path, capsys):
    doubt = {
        "about": ["M_u", "M_w"],
        "outcome": "converged",
        "sentence": "No rate of turn was recorded: dive again.",
        "problem": "No rate of turn was recorded",
        "remedy": "dive again.",
    }
    path, report = identified(tmp_path / "a.json", doubts=[doubt]), tmp_path / "told.json"
    words = (path, "--vehicle", "ruvifist", "--to", "gazebo", "--out", tmp_path / "a.sdf", "--json", report)
    assert export(*words) == exit_codes.DONE
    shown = capsys.readouterr().out
    assert "warning: M_u is doubted: no rate of turn was recorded" in shown
    assert "M_w is doubted" not in shown
    assert json.loads(report.read_text(encoding="utf-8"))["doubted"] == {
        "M_u": "no rate of turn was recorded"
    }


def test_a_file_that_finds_no_room_is_named_with_what_did_not_fit_and_leaves_what_lay_there(
    tmp_path, monkeypatch, capsys
):
    out, words = tmp_path / "a.sdf", ("--vehicle", "ruvifist", "--to", "gazebo", "--out")
    out.write_text("older", encoding="utf-8")
    fill(monkeypatch, tmp_path, ".sdf")
    assert export(identified(tmp_path / "a.json"), *words, out) == exit_codes.BAD_INPUT
    output = capsys.readouterr()
    assert "what did not fit into gazebo" in output.out
    assert "a.sdf: can't be written (No space left on device)" in output.err
    assert out.read_text("utf-8") == "older"


FILE = load_vehicle("ruvifist:hovering")
VALUES = {"M_u": 111.0, "D_u": 55.0, "X_uu": 60.0, "T_start": 0.8, "T2_gain": 0.75, "N_v": -2.0}
NO_DRAG = dict.fromkeys(("X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr"), 0.0)
DRAG = AcceptedEffect("quadratic_drag", "quadratic_drag", NO_DRAG | {"X_uu": 60.0})
WEAK = AcceptedEffect("weak_thruster", "weak_thruster of thruster 2", {"gain": 0.75}, 2)
WAVES = AcceptedEffect("waves", "waves", {"force_amplitude": 1.0})
LEGS = "name: short\nlegs:\n  - {name: ahead, phase: acceleration, duration_s: 3, surge_m_s: 0.3, transient_s: 3}\n"


def written(tmp_path, verdict="explained", doubts=(), dive=None, first=(), heldout=None, check=None):
    """The file, and the output."""
    values = {name: Value(value, "", value - 0.1, value + 0.1) for name, value in VALUES.items()}
    accepted = Accepted(values, (DRAG, WEAK, WAVES), ("Waves are the water's.",), doubts)
    simple_namespace = SimpleNamespace(
        accepted=accepted, findings=(), configuration="hovering", verdict=verdict, first=first, hull=None,
        heldout=heldout, check=check,
    )  # fmt: skip
    path = tmp_path / "out.param"
    return path, accept(path, simple_namespace, dive or Dive("planted", tmp_path, "ab" * 32), FILE)


@pytest.fixture
def param(tmp_path):
    return written(tmp_path)[0]


@pytest.mark.parametrize(("closes", "outcome"), [(0.11, Outcome.DISAGREES), (0.9, Outcome.CONVERGED)])
def test_a_model_that_the_check_dive_does_not_bear_out_is_sent_to_no_vehicle_without_being_asked_for(
    tmp_path, closes, outcome
):
    """The diagnosis says of such causes to send nothing of them to the vehicle."""
    foretold, measured = (
        Shrink(3.0, 1.0, 0.98, 0.95, 1.0),
        Shrink(3.0, 2.8, closes, closes - 0.1, closes + 0.09),
    )
    path, sentences = written(tmp_path, heldout=foretold, check=measured)
    assert read_sidecar(path).outcome == outcome.value
    asked = sentences[-1].endswith("with --despite-doubts, because the check dive does not bear it out")
    assert asked is (outcome is Outcome.DISAGREES)


def test_what_can_not_be_made_up_for_is_told_and_how_to_send_the_rest(tmp_path):
    path, sentences = written(tmp_path)
    assert sentences == (
        "Waves are the water's.",
        "How the next dive tracks is not foretold: the simulated vehicle has no waves.",
        f"accepted: {path}; seatrial params upload {path} sends it to the vehicle",
    )


def test_nothing_is_accepted_of_a_dive_whose_motion_runs_against_its_thrust(tmp_path):
    path, (sentence,) = written(
        tmp_path, first=("The recorded motion does not go the way the thrust pushes.",)
    )
    assert sentence.startswith(f"{path} was not written: the motion does not go the way the thrust pushes")
    assert not path.exists()


def test_where_something_is_left_unexplained_an_upload_needs_a_word(tmp_path):
    path, sentences = written(tmp_path, "unknown")
    assert "--despite-doubts" in sentences[-1]
    with pytest.raises(UsageError, match="data and model disagree"):
        targets_of(path, Leave())
    assert targets_of(path, Leave(doubts=True)).values["FF1_X_UU"] == 60.0
    assert accepted_truth(path, FILE, "hovering")[0].quadratic[0] == 60.0


def test_a_vehicle_takes_every_accepted_value_and_flies_it_once_committed(param):
    server = ParameterServer(None, vehicle_table(FILE.vehicle))
    targets = targets_of(param, Leave())
    for name, value in targets.values.items():
        assert server.write(name, value, armed=False) is None
    assert server.active(1) == {}
    assert server.write("FF_COMMIT", float(server.staged_crc), armed=False) is None
    assert {name: server.active(1)[name] for name in VALUES} == pytest.approx(VALUES)
    assert "by diagnose: converged" in targets.notes[0]
    assert targets.values["FF1_Y_VV"] == 0.0
    assert targets.whole


def test_the_sidecar_keeps_where_it_came_from_and_the_effects(param):
    sidecar = read_sidecar(param)
    assert (sidecar.dive, sidecar.dive_sha256, sidecar.vehicle) == ("planted", "ab" * 32, "ruvifist")
    assert sidecar.effects == (DRAG, WEAK, WAVES)
    assert sidecar.intervals["FF1_N_V"].low95 == pytest.approx(-2.1)
    values, of_file = accepted_model(param, FILE, Leave())
    assert values == pytest.approx(VALUES)
    assert of_file == sidecar


def test_a_later_diagnosis_takes_values_and_effects_from_it(param):
    before = accepted_before(param, FILE, "hovering", Leave())
    assert before.values["M_u"].value == pytest.approx(111.0, rel=1e-4)
    assert (before.effects, before.notes) == ((DRAG, WEAK, WAVES), ())
    assert "X_uu" not in accepted_in(param, 0.0, Leave()).priors, "the drag is one of its effects"
    with pytest.raises(UsageError, match="is of configuration 'hovering', the dive of 'survey'"):
        accepted_before(param, FILE, "survey", Leave())


def test_a_later_diagnosis_takes_nothing_of_another_vehicle_and_of_its_effects(param):
    other = replace(FILE, vehicle=replace(FILE.vehicle, name="another"))
    with pytest.raises(
        UsageError, match="is of vehicle 'ruvifist', the dive of 'another'; give what was accepted"
    ):
        accepted_before(param, other, "hovering", Leave())


def test_a_later_diagnosis_does_not_hold_a_doubted_value_against_its_dive_and_says_so(param):
    sidecar = read_sidecar(param)
    write_sidecar(param, replace(sidecar, doubted={"D_u": "no gyro was recorded"}))
    before = accepted_before(param, FILE, "hovering", Leave())
    assert "M_u" in before.values
    assert "D_u" not in before.values
    assert before.notes == (
        "Of what was accepted, D_u is doubted: no gyro was recorded; not held against this dive.",
    )
    despite = accepted_before(param, FILE, "hovering", Leave(doubts=True))
    assert "D_u" in despite.values
    assert despite.notes == ("Of what was accepted, D_u is doubted: no gyro was recorded.",)
    # Doubts say which values of a fit that did not converge may be wrong; without them it may be any.
    disagrees = replace(sidecar, outcome=Outcome.DISAGREES.value, doubted={"D_u": "no gyro was recorded"})
    write_sidecar(param, disagrees)
    assert accepted_before(param, FILE, "hovering", Leave()).values == before.values
    write_sidecar(param, replace(disagrees, doubted={}))
    with pytest.raises(UsageError, match="nothing was compared; dive again, or give --despite-doubts"):
        accepted_before(param, FILE, "hovering", Leave())
    write_sidecar(param, replace(sidecar, doubted=dict.fromkeys(("M_u", "D_u"), "no gyro was recorded")))
    with pytest.raises(UsageError, match="all that it holds is doubted"):
        accepted_before(param, FILE, "hovering", Leave())


def test_a_file_of_another_vehicle_or_without_a_sidecar_is_refused(param, tmp_path):
    with pytest.raises(UsageError, match="is of vehicle 'ruvifist', configuration 'hovering'"):
        accepted_model(param, load_vehicle("ruvifist:survey"), Leave())
    alone = tmp_path / "alone.param"
    alone.write_text("FF1_M_U,111\n", encoding="utf-8")
    with pytest.raises(UsageError, match="has no sidecar"):
        accepted_model(alone, FILE, Leave())


def test_it_is_exported_with_its_effects(param, tmp_path, capsys):
    out = tmp_path / "out.json"
    line = ["export", str(param), "--vehicle", "ruvifist:hovering", "--to", "ardusub-json", "--out", str(out)]
    assert cli.main(line) == exit_codes.DONE
    plant = json.loads(out.read_text(encoding="utf-8"))["plant"]
    assert plant["quadratic_damping"][0] == 60.0
    assert plant["thrusters"][1]["gain"] == 0.75
    assert plant["intervals_95"]["X_uu"] == pytest.approx([59.9, 60.1])
    assert {"M_u", "D_u", "T_start", "T2_gain"} <= set(plant["intervals_95"])
    assert "N_v" not in plant["intervals_95"]
    assert "accepted effects (waves)" in capsys.readouterr().out
    assert cli.main([*line[:2], *line[4:]]) == exit_codes.BAD_INPUT


def test_it_is_what_a_simulated_vehicle_truly_is(param):
    truth, sentences = accepted_truth(param, FILE, "hovering")
    assert (truth.model["M_u"], truth.quadratic[0]) == (111.0, 60.0)
    assert truth.effects == pytest.approx({"X_uu": 60.0, "T_start": 0.8, "T2_gain": 0.75})
    assert sentences == ("not simulated: waves",)
    with pytest.raises(UsageError, match="is of vehicle"):
        accepted_truth(param, replace(FILE, vehicle=replace(FILE.vehicle, name="other")), "hovering")


def test_a_mission_is_dived_with_it(param, tmp_path, capsys):
    legs = tmp_path / "short.yaml"
    legs.write_text(LEGS, encoding="utf-8")
    line = ["simulate", "--vehicle", "ruvifist:hovering", "--out", str(tmp_path), "--mission"]
    assert cli.main([*line, str(legs), "--accepted", str(param)]) == exit_codes.DONE
    assert "not simulated: waves" in capsys.readouterr().err
    assert list(tmp_path.glob("*/telemetry.tlog"))
    afloat = ["idle", "--accepted", str(param), "--link", "udpout:127.0.0.1:9", "--seconds", "0.1"]
    assert cli.main([*line, *afloat]) == exit_codes.DONE


def test_a_recording_that_contradicts_itself_is_accepted_with_its_doubts_and_not_sent_without_a_word(
    tmp_path, monkeypatch
):
    doubt = Doubt(("D_u", "I_r"), "The DVL is late", "mend it.", Outcome.DISAGREES)
    monkeypatch.setattr("identify.checks.contradictions.turning_doubts", lambda _dive: (doubt,))
    path, sentences = written(tmp_path)
    assert "D_u is doubted: the DVL is late" in sentences
    assert sentences[-1].endswith("with --despite-doubts, because the recording contradicts itself")
    assert read_sidecar(path).doubted == {"D_u": "the DVL is late"}
    with pytest.raises(UsageError, match="data and model disagree"):
        targets_of(path, Leave())


def test_what_the_fit_beside_the_causes_gets_wrong_is_in_the_sidecar_and_stops_an_upload(tmp_path):
    late = Doubt(("M_u", "D_u"), "In surge thrust acts late", "mend the lag.", Outcome.DISAGREES)
    path, sentences = written(tmp_path, doubts=(late,))
    assert "M_u, D_u are doubted: in surge thrust acts late" in sentences
    assert sentences[-1].endswith("with --despite-doubts, because the model does not fit the dive")
    assert read_sidecar(path).doubted == dict.fromkeys(("M_u", "D_u"), "in surge thrust acts late")
    with pytest.raises(UsageError, match="data and model disagree"):
        targets_of(path, Leave())
