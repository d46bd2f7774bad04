"""Dives as a stock autopilot records them, made elsewhere: what hides in those that tell their truth is found."""

from dataclasses import replace

import pytest
import yaml
from fakes.shared import shared
from soak import rest_in_soak

from bridge.vehicle.config import VehicleFile, load_vehicle
from identify.diagnose.diagnose import diagnose
from identify.diagnose.result import Diagnosis
from identify.dive import Dive
from identify.ingest.open import read_dive

HULL = "quadratic_drag"
WHOLE_S = 1000.0
short_or_whole = pytest.mark.parametrize("seconds", rest_in_soak([110.0, WHOLE_S]))


def vehicle() -> VehicleFile:
    return load_vehicle(str(shared("field", "rov.yaml")))


def truth(name: str) -> dict[str, float]:
    return dict(yaml.safe_load(shared("field", name, "truth.yaml").read_text())["effect_parameters"])


def begun(name: str, seconds: float) -> Dive:
    """The beginning of a dive."""
    dive = read_dive(shared("field", *name.split("/")), None, vehicle())
    start_s, _ = dive.span_s
    return dive.between(start_s, start_s + seconds)


def diagnosis_of(name: str, seconds: float) -> Diagnosis:
    return diagnose(begun(f"{name}/dive.tlog.gz", seconds), vehicle(), "rov", progress=lambda *_: None)


@pytest.mark.slow
@short_or_whole
def test_of_a_hull_with_nothing_hidden_its_drag_alone_is_told(seconds):
    diagnosis = diagnosis_of("open_1", seconds)
    assert [finding.name for finding in diagnosis.findings] == [HULL]
    assert diagnosis.verdict == "explained"


@pytest.mark.soak
def test_another_dive_of_that_hull_in_which_yaw_is_hardly_used_is_not_called_unknown():
    """Forces in yaw that make no drift beyond noise saved more than its drag in surge and sway did."""
    dive = read_dive(shared("field", "open_1", "check.tlog.gz"), None, vehicle())
    diagnosis = diagnose(dive, vehicle(), "rov", progress=lambda *_: None)
    assert [finding.name for finding in diagnosis.findings] == [HULL]
    assert diagnosis.verdict == "partly"


@pytest.mark.soak
@short_or_whole
def test_an_empty_dive_without_its_velocity_is_not_called_unknown(seconds):
    file = vehicle()
    dive = replace(begun("open_1/dive.tlog.gz", seconds), velocity=None)
    diagnosis = diagnose(dive, file, "rov", progress=lambda *_: None)
    assert diagnosis.verdict == "no_gap"
    *unread, unseen = diagnosis.provisos
    assert [proviso.split()[0] for proviso in unread] == ["Surge", "Sway"]
    assert unseen.startswith("In heave, roll, pitch and yaw no unknown force was looked for")


@pytest.mark.soak
@pytest.mark.parametrize(
    ("name", "effect", "parameters", "within"),
    [
        ("open_2", "steady_current", {"north": "cur_n", "east": "cur_e"}, {"abs": 0.01}),
        ("open_3", "tether", {"stiffness": "tether_c"}, {"rel": 0.1}),
    ],
)
def test_water_and_tether_are_found_with_their_size(name, effect, parameters, within):
    diagnosis, true = diagnosis_of(name, WHOLE_S), truth(name)
    assert {finding.name for finding in diagnosis.findings} == {HULL, effect}
    values = next(finding for finding in diagnosis.findings if finding.name == effect).parameters
    for parameter, key in parameters.items():
        assert values[parameter].value == pytest.approx(true[key], **within)
