"""Dives as a stock autopilot records them, made elsewhere: what hides in those that tell their truth is found."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
import yaml

from bridge.vehicle.config import load_vehicle
from identify.diagnose.diagnose import diagnose
from identify.diagnose.result import Diagnosis
from identify.ingest.open import read_dive

FIELD = Path(__file__).resolve().parents[2].parent / "shared" / "field"
HULL = "quadratic_drag"

pytestmark = pytest.mark.skipif(not FIELD.exists(), reason="needs ../shared/field beside the checkout")


def truth(name: str) -> dict[str, float]:
    return dict(yaml.safe_load((FIELD / name / "truth.yaml").read_text())["effect_parameters"])


@cache
def told(name: str, checked: bool = False) -> Diagnosis:
    file = load_vehicle(str(FIELD / "rov.yaml"))
    dive, check = (read_dive(FIELD / name / f"{one}.tlog.gz", None, file) for one in ("dive", "check"))
    return diagnose(dive, file, "rov", check=check if checked else None, progress=lambda *_: None)


def test_of_a_hull_with_nothing_hidden_its_drag_alone_is_told():
    found = told("open_1")
    assert [one.name for one in found.found] == [HULL]
    assert found.verdict == "explained"


def test_an_empty_dive_without_its_velocity_is_not_called_unknown():
    file = load_vehicle(str(FIELD / "rov.yaml"))
    dive = replace(read_dive(FIELD / "open_1" / "dive.tlog.gz", None, file), velocity=None)
    found = diagnose(dive, file, "rov", progress=lambda *_: None)
    assert found.verdict == "no_gap"
    *unread, unseen = found.provisos
    assert [one.split()[0] for one in unread] == ["Surge", "Sway"]
    assert unseen.startswith("In heave, roll, pitch and yaw no unknown force was looked for")


def test_a_current_is_found_within_a_centimetre_a_second_and_holds_on_the_check_dive():
    found = told("open_2", checked=True)
    assert {one.name for one in found.found} == {HULL, "steady_current"}
    assert found.verdict == "explained"
    water = next(one for one in found.found if one.name == "steady_current").parameters
    true = truth("open_2")
    assert water["north"].value == pytest.approx(true["cur_n"], abs=0.01)
    assert water["east"].value == pytest.approx(true["cur_e"], abs=0.01)
    assert found.check is not None
    assert found.check.value > 0.9


@pytest.mark.soak
def test_a_tether_is_found_with_its_stiffness():
    found = told("open_3")
    assert {one.name for one in found.found} == {HULL, "tether"}
    pull = next(one for one in found.found if one.name == "tether").parameters
    assert pull["stiffness"].value == pytest.approx(truth("open_3")["tether_c"], rel=0.1)
