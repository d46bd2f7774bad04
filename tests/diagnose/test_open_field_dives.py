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
short_or_whole = pytest.mark.parametrize("seconds", rest_in_soak([150.0, WHOLE_S]))


def vehicle() -> VehicleFile:
    return load_vehicle(str(shared("field", "rov.yaml")))


def truth(name: str) -> dict[str, float]:
    return dict(yaml.safe_load(shared("field", name, "truth.yaml").read_text())["effect_parameters"])


def begun(name: str, seconds: float) -> Dive:
    """The beginning of a dive."""
    dive = read_dive(shared("field", *name.split("/")), None, vehicle())
    start_s, _ = dive.span_s
    return dive.between(start_s, start_s + seconds)


def told(name: str, seconds: float, checked: bool = False) -> Diagnosis:
    file = vehicle()
    dive, check = (begun(f"{name}/{one}.tlog.gz", seconds) for one in ("dive", "check"))
    return diagnose(dive, file, "rov", check=check if checked else None, progress=lambda *_: None)


@short_or_whole
def test_of_a_hull_with_nothing_hidden_its_drag_alone_is_told(seconds):
    found = told("open_1", seconds)
    assert [one.name for one in found.findings] == [HULL]
    assert found.verdict == "explained"


@pytest.mark.soak
@short_or_whole
def test_an_empty_dive_without_its_velocity_is_not_called_unknown(seconds):
    file = vehicle()
    dive = replace(begun("open_1/dive.tlog.gz", seconds), velocity=None)
    found = diagnose(dive, file, "rov", progress=lambda *_: None)
    assert found.verdict == "no_gap"
    *unread, unseen = found.provisos
    assert [one.split()[0] for one in unread] == ["Surge", "Sway"]
    assert unseen.startswith("In heave, roll, pitch and yaw no unknown force was looked for")


@pytest.mark.soak
@short_or_whole
def test_a_current_is_found_within_a_centimetre_a_second_and_holds_on_the_check_dive(seconds):
    found = told("open_2", seconds, checked=True)
    assert {one.name for one in found.findings} == {HULL, "steady_current"}
    assert found.verdict == "explained"
    water = next(one for one in found.findings if one.name == "steady_current").parameters
    true = truth("open_2")
    assert water["north"].value == pytest.approx(true["cur_n"], abs=0.01)
    assert water["east"].value == pytest.approx(true["cur_e"], abs=0.01)
    assert found.check.value > 0.9


@pytest.mark.soak
def test_a_tether_is_found_with_its_stiffness():
    found = told("open_3", WHOLE_S)
    assert {one.name for one in found.findings} == {HULL, "tether"}
    pull = next(one for one in found.findings if one.name == "tether").parameters
    assert pull["stiffness"].value == pytest.approx(truth("open_3")["tether_c"], rel=0.1)
