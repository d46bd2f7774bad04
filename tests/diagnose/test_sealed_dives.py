"""Dives that were made elsewhere: of two the truth is known, of the others the answers keep to the form."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest
from soak import rest_in_soak

from bridge.vehicle.config import load_vehicle
from identify.diagnose.diagnose import diagnose
from identify.ingest.open import read_dive

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared"
SEALED = SHARED / "sealed"
SCHEMA = Path(__file__).resolve().parents[1] / "data" / "answers.schema.json"
WHOLE_S = 1000.0
short_or_whole = pytest.mark.parametrize("seconds", rest_in_soak([200.0, WHOLE_S]))
ANSWERS = ROOT / "tests" / "data" / "sealed_answers"


def told(name, seconds, lag_s=0.03):
    if not SEALED.is_dir():
        pytest.skip("no shared data beside the checkout")
    file = load_vehicle(str(ROOT / "tests/data/vehicles/hovering.yaml"))
    curve = replace(file.vehicle.thrust_curve, lag_s=lag_s)
    file = replace(file, vehicle=replace(file.vehicle, thrust_curve=curve))
    dives = (read_dive(SEALED / name / f"{which}.tlog.gz") for which in ("dive", "check"))
    dive, check = (one.between(one.span_s[0], one.span_s[0] + seconds) for one in dives)
    return diagnose(dive, file, "hovering", check=check, progress=lambda *_report: None)


@short_or_whole
def test_a_dive_that_hides_nothing_has_no_gap(seconds):
    found = told("open_1", seconds)
    assert found.verdict == "no_gap"
    assert found.findings == ()
    assert found.gap.before == pytest.approx(1.0, abs=0.15)
    assert found.check.after == pytest.approx(1.0, abs=0.15)


@short_or_whole
def test_a_drag_that_is_hidden_is_named_with_its_size_and_nothing_else_is(seconds):
    found = told("open_2", seconds)
    assert [one.name for one in found.findings] == ["quadratic_drag"]
    truth = {"X_uu": 30.37, "Y_vv": 28.65, "N_rr": 10.43}
    for name, value in truth.items():
        one = found.findings[0].parameters[name]
        std = (one.high95 - one.low95) / 3.92
        assert abs(one.value - value) < 3.3 * std, name
    assert found.check.after < found.check.before
    assert found.heldout.after < found.heldout.before


@pytest.mark.soak
@pytest.mark.parametrize("lag_s", [0.05, 0.01])
def test_a_lag_of_the_vehicle_file_that_is_20_ms_off_is_named_with_the_true_one(lag_s):
    found = told("open_1", WHOLE_S, lag_s)
    assert (found.verdict, [one.name for one in found.findings]) == ("explained", ["thruster_lag"])
    true = found.findings[0].parameters["time_constant"]
    assert true.low95 < 0.03 < true.high95


@pytest.mark.parametrize("letter", "abcdefg")
def test_the_answers_to_the_sealed_dives_keep_to_the_schema(letter):
    answer = json.loads((ANSWERS / f"{letter}.json").read_text(encoding="utf-8"))
    jsonschema.validate(answer, json.loads(SCHEMA.read_text(encoding="utf-8")))
    assert sum(one["share"] for one in answer["gap"]["where"]) == pytest.approx(1.0)
