"""`seatrial prior`: accepted values go into the vehicle file, wider, and nothing else in it changes."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from identified_json import identified

from bridge import exit_codes
from bridge.errors import ConfigError
from bridge.schema import build
from bridge.vehicle.config import Prior, Vehicle, load_vehicle
from gcs_plugin.params.sidecar import Interval, Sidecar, write_sidecar
from identify.doubt import Outcome
from identify.identification import Identification, estimate
from identify.priors import with_priors
from tui import cli
from tui.accepted_priors import accepted_in
from tui.commands.prior import with_priors_written
from tui.parameter_files import Leave

BUNDLED = Path(__file__).resolve().parents[2] / "configs" / "vehicles" / "ruvifist.yaml"


@pytest.fixture
def vehicle(tmp_path):
    path = tmp_path / "our.yaml"
    shutil.copy(BUNDLED, path)
    return path


def accept(source, vehicle, *more):
    return cli.main(["prior", str(source), "--vehicle", str(vehicle), *map(str, more)])


def priors(vehicle, configuration="hovering"):
    return load_vehicle(str(vehicle)).vehicle.configurations[configuration].priors


def test_what_was_identified_becomes_priors_wider_by_ageing(vehicle, tmp_path):
    before = vehicle.read_text(encoding="utf-8")
    assert accept(identified(tmp_path / "a.json"), vehicle) == exit_codes.DONE
    result = priors(vehicle)
    assert set(result) == {"M_u", "D_u"}
    assert result["M_u"] == Prior(111.0, 3.51, "hovering-7 of 2026-11-20, likelihood", "thrust", "7" * 64)
    assert result["D_u"].std == pytest.approx(56.0 * (0.01**2 + 0.1**2) ** 0.5, rel=1e-2)
    assert priors(vehicle, "survey") == {}
    after = vehicle.read_text(encoding="utf-8").splitlines()
    added = [line for line in after if "priors:" in line or "hovering-7" in line]
    assert len(added) == 3
    assert [line for line in after if line not in added] == before.splitlines()


def test_a_second_time_replaces_the_first_and_the_file_grows_no_more(vehicle, tmp_path):
    accept(identified(tmp_path / "a.json"), vehicle)
    lines = len(vehicle.read_text(encoding="utf-8").splitlines())
    accept(identified(tmp_path / "b.json", dive={"name": "hovering-8"}), vehicle, "--widen", 20)
    assert priors(vehicle)["M_u"].source == "hovering-8, likelihood"
    assert priors(vehicle)["M_u"].std == pytest.approx(22.2, rel=0.01)
    assert len(vehicle.read_text(encoding="utf-8").splitlines()) == lines


def test_a_replaced_prior_is_shown_and_what_its_dive_told_is_not_lost_in_silence(vehicle, tmp_path, capsys):
    accept(identified(tmp_path / "a.json"), vehicle)
    first = capsys.readouterr().out
    assert "new" in first
    assert "warning" not in first
    accept(identified(tmp_path / "b.json", dive={"name": "planned-1", "sha256": "8" * 64}), vehicle)
    second = " ".join(capsys.readouterr().out.split())
    assert "replaces 111.0 ± 3.5 (hovering-7 of 2026-11-20, likelihood)" in second
    assert "warning: the new values of M_u, D_u did not rest on the priors that they replace" in second
    assert f"seatrial identify of this dive with --vehicle {vehicle}" in second


@pytest.mark.parametrize(
    "changed",
    [
        {"dive": {"name": "planned-1", "sha256": "8" * 64}, "prior_dives": ["7" * 16]},
        {"dive": {"name": "hovering-7 anew", "sha256": "7" * 64}},
    ],
)
def test_a_prior_that_the_new_one_rests_on_is_replaced_without_a_warning(vehicle, tmp_path, capsys, changed):
    accept(identified(tmp_path / "a.json"), vehicle)
    accept(identified(tmp_path / "b.json", **changed), vehicle)
    shown = capsys.readouterr().out
    assert "replaces 111.0 ± 3.5" in shown
    assert "warning" not in shown


def test_the_same_priors_again_are_as_before(vehicle, tmp_path, capsys):
    accept(identified(tmp_path / "a.json"), vehicle)
    capsys.readouterr()
    accept(identified(tmp_path / "a.json"), vehicle)
    shown = capsys.readouterr().out
    assert shown.count("as before") == 2
    assert "replaces" not in shown


def test_a_weighed_prior_stays(vehicle, tmp_path):
    weighed = {"M_u": Prior(110.0, 1.0, "towed", "weight")}
    text = with_priors_written(vehicle.read_text(encoding="utf-8"), "hovering", weighed, "our.yaml")
    vehicle.write_text(text, encoding="utf-8")
    accept(identified(tmp_path / "a.json"), vehicle)
    assert priors(vehicle)["M_u"] == weighed["M_u"]
    assert priors(vehicle)["D_u"].rests_on == "thrust"


@pytest.mark.parametrize(("value", "std"), [(0.002, 8e-5), (2e-5, 1.25e-6), (3e6, 4e5)])
def test_a_prior_that_is_written_as_a_power_of_ten_is_read_again(vehicle, value, std):
    small = {"I_r": Prior(value, std, "swung", "weight")}
    text = with_priors_written(vehicle.read_text(encoding="utf-8"), "hovering", small, "our.yaml")
    vehicle.write_text(text, encoding="utf-8")
    assert priors(vehicle) == small


def test_what_a_weighed_prior_made_of_the_thrust_is_taken_out(vehicle, tmp_path):
    accept(identified(tmp_path / "a.json", weighed=True), vehicle)
    assert priors(vehicle)["D_u"].rests_on == "thrust"
    assert priors(vehicle)["D_u"].value == pytest.approx(0.9 * 56.0)


def test_what_did_not_converge_is_refused_unless_it_may_pass(vehicle, tmp_path, capsys):
    before = vehicle.read_text(encoding="utf-8")
    doubtful = identified(tmp_path / "a.json", outcome="data and model disagree")
    assert accept(doubtful, vehicle) == exit_codes.BAD_INPUT
    assert "nothing was written" in " ".join(capsys.readouterr().err.split())
    assert vehicle.read_text(encoding="utf-8") == before
    assert accept(doubtful, vehicle, "--despite-doubts") == exit_codes.DONE
    assert "M_u" in priors(vehicle)


DOUBT = {
    "about": ["M_u"], "outcome": "converged",
    "sentence": "No rate of turn was recorded in roll: M_u may be off; record a gyro.",
    "problem": "No rate of turn was recorded in roll", "remedy": "M_u may be off; record a gyro.",
}  # fmt: skip
CLAUSE = "M_u is doubted: no rate of turn was recorded in roll"


def test_a_doubted_value_is_no_prior_unless_it_may_pass_and_the_others_are(vehicle, tmp_path, capsys):
    source = identified(tmp_path / "a.json", doubts=[DOUBT])
    assert accept(source, vehicle) == exit_codes.DONE
    assert set(priors(vehicle)) == {"D_u"}
    assert f"warning: {CLAUSE}; not taken" in " ".join(capsys.readouterr().out.split())
    assert accept(source, vehicle, "--despite-doubts") == exit_codes.DONE
    assert set(priors(vehicle)) == {"M_u", "D_u"}
    shown = " ".join(capsys.readouterr().out.split())
    assert f"warning: {CLAUSE}" in shown
    assert "not taken" not in shown


def test_priors_left_out_for_resting_on_the_dive_are_no_doubt_of_its_values(vehicle, tmp_path):
    source = identified(tmp_path / "a.json")
    assert accept(source, vehicle) == exit_codes.DONE
    prior = priors(vehicle)["M_u"]
    covariance = np.array([[1.0]])
    identification = Identification("likelihood", Outcome.CONVERGED,
                           (estimate("M_u", 111.0, 1.0, 109.0, 113.0),), "hovering",
                           "again", "7" * 64, "ruvifist", "0" * 64, 60.0, 100, covariance, ("M_u",))  # fmt: skip
    (doubt,) = with_priors(identification, {"M_u": prior}, 0.0).doubts
    again = identified(tmp_path / "b.json", doubts=[doubt.to_json()])
    assert accept(again, vehicle) == exit_codes.DONE
    assert accepted_in(again, None, Leave()).doubted == {}


def test_a_sidecar_has_its_thrust_shift_taken_out_and_its_doubts_refused(vehicle, tmp_path, capsys):
    param = tmp_path / "a.param"
    param.write_text("FF1_M_U,111\nFF1_D_U,56\n", encoding="utf-8")
    intervals = {
        "FF1_M_U": Interval("M_u", "kg", 109.0, 111.0),
        "FF1_D_U": Interval("D_u", "N/(m/s)", 55.0, 57.0),
    }
    sidecar = Sidecar("1" * 64, "0" * 64, "hovering", "likelihood", "0.1", intervals, "ruvifist", "dive-9", "converged",
                   thrust_shift=0.1, doubted={"D_u": "no rate of turn was recorded in roll"})  # fmt: skip
    write_sidecar(param, sidecar)
    assert accept(param, vehicle) == exit_codes.DONE
    (prior,) = priors(vehicle).values()
    assert prior.value == pytest.approx(100.0, rel=1e-3)
    assert (prior.dive_sha256, prior.source) == ("1" * 64, "dive-9, likelihood")
    assert "D_u is doubted: no rate of turn was recorded in roll" in " ".join(capsys.readouterr().out.split())
    write_sidecar(param, replace(sidecar, outcome="stopped at a bound"))
    assert accept(param, vehicle) == exit_codes.BAD_INPUT


def test_the_beginning_of_the_recording_and_the_earlier_dives_go_with_a_prior(vehicle, tmp_path):
    dive = {"name": "hovering-7", "sha256": "7" * 64, "opening": "9" * 64}
    accept(identified(tmp_path / "a.json", dive=dive), vehicle)
    assert priors(vehicle)["M_u"].dives == ("7" * 16, "9" * 16)
    param = tmp_path / "a.param"
    param.write_text("FF1_M_U,111\n", encoding="utf-8")
    sidecar = Sidecar("1" * 64, "0" * 64, "hovering", "likelihood", "0.1",
                   {"FF1_M_U": Interval("M_u", "kg", 109.0, 111.0)}, dive_opening="8" * 64,
                   prior_dives=("3" * 16,))  # fmt: skip
    write_sidecar(param, sidecar)
    assert accept(param, vehicle) == exit_codes.DONE
    assert priors(vehicle)["M_u"].dives == ("1" * 16, "8" * 16, "3" * 16)


def test_a_vehicle_of_seatrials_own_is_not_written_to(tmp_path, capsys):
    before = BUNDLED.read_text(encoding="utf-8")
    assert accept(identified(tmp_path / "a.json"), "ruvifist") == exit_codes.BAD_INPUT
    assert "copy it" in " ".join(capsys.readouterr().err.split())
    assert BUNDLED.read_text(encoding="utf-8") == before


def test_a_file_written_on_one_line_is_left_as_it_is(tmp_path, capsys):
    data = yaml.safe_load(BUNDLED.read_text(encoding="utf-8"))
    path = tmp_path / "flow.yaml"
    path.write_text(yaml.safe_dump(data, default_flow_style=True), encoding="utf-8")
    before = path.read_text(encoding="utf-8")
    assert accept(identified(tmp_path / "a.json"), path) == exit_codes.BAD_INPUT
    assert "put the priors there yourself" in " ".join(capsys.readouterr().err.split())
    assert path.read_text(encoding="utf-8") == before


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"parameters": []}, "no identifiable parameter"),
        ({"configuration": "flying"}, "no configuration 'flying'"),
        ({"vehicle": {"name": "bluerov2", "sha256": "0" * 64}}, "is of vehicle 'bluerov2'"),
        ({"parameters": "none"}, "is not an identification"),
        (
            {"doubts": [DOUBT | {"about": ["M_u", "D_u"]}]},
            "M_u, D_u are doubted: no rate of turn was recorded in roll",
        ),
    ],
)
def test_a_file_that_says_nothing_is_refused_and_nothing_written(vehicle, tmp_path, capsys, changed, words):
    before = vehicle.read_text(encoding="utf-8")
    assert accept(identified(tmp_path / "a.json", **changed), vehicle) == exit_codes.BAD_INPUT
    assert words in " ".join(capsys.readouterr().err.split())
    assert vehicle.read_text(encoding="utf-8") == before


def test_the_text_keeps_comments_and_the_other_configurations():
    text = (
        "configurations:\n"
        "  # lean\n"
        "  a:  # first\n"
        "    dry_mass_kg: 1.0\n"
        "    priors:\n"
        "      M_u: {value: 1, std: 1}\n"
        "      # gone with it\n"
        "    veh_cfg: 1  # kept\n"
        "  b:\n"
        "    priors: {M_u: {value: 2, std: 1}}\n"
        "water: {}\n"
    )
    out = with_priors_written(text, "a", {"D_u": Prior(5.0, 0.5, 'towed "slow"')}, "x.yaml")
    data = yaml.safe_load(out)
    assert data["configurations"]["a"]["priors"] == {
        "D_u": {"value": 5, "std": 0.5, "rests_on": "weight", "source": 'towed "slow"'}
    }
    assert data["configurations"]["b"]["priors"]["M_u"]["value"] == 2
    assert data["configurations"]["a"]["veh_cfg"] == 1
    assert "# lean" in out
    assert "# kept" in out


@pytest.mark.parametrize(
    ("priors", "words"),
    [
        ({"M_x": {"value": 1.0, "std": 1.0}}, "priors: unknown coefficient 'M_x'"),
        ({"M_u": {"value": 1.0, "std": 0.0}}, "std must be above 0"),
        ({"M_u": {"value": 1.0}}, "'std' is missing"),
        ({"M_u": {"value": 1.0, "std": 0.1, "rests_on": "hope"}}, "'hope' is not one of weight, thrust"),
    ],
)
def test_a_wrong_prior_in_a_vehicle_file_is_told_with_its_key(priors, words):
    data = yaml.safe_load(BUNDLED.read_text(encoding="utf-8"))
    data["configurations"]["hovering"]["priors"] = priors
    with pytest.raises(ConfigError, match=words):
        build(Vehicle, data, "our.yaml")
