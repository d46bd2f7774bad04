"""What is known before a dive: from the vehicle file, from an identification, and said in words."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bridge.errors import ConfigError
from bridge.vehicle.config import Prior, VehicleFile, load_vehicle
from identify.planning.knowledge import DAMPING_RATIO, MASS_RATIO, NAMES, after, before_any_dive
from identify.planning.propose import relative_std
from identify.planning.writing import DOUBT, notes

FILE = load_vehicle("ruvifist:hovering")


def with_shape(**changes: Any) -> VehicleFile:
    shape = replace(FILE.vehicle.configurations["hovering"], **changes)
    return replace(FILE, vehicle=replace(FILE.vehicle, configurations={"hovering": shape}))


def identified(**changes: Any) -> dict[str, Any]:
    """The JSON of an identification that found surge, its mass and damping entangled."""
    parameters = [{"name": name, "value": None} for name in NAMES]
    parameters[NAMES.index("M_u")]["value"] = 110.0
    parameters[NAMES.index("D_u")]["value"] = 55.0
    return {
        "configuration": "hovering",
        "vehicle": {"name": "ruvifist"},
        "outcome": "converged",
        "parameters": parameters,
        "covariance": {"of": ["M_u", "D_u"], "matrix": [[1.21, -0.3], [-0.3, 0.5]]},
        "nuisance": {"surge_disturbance_std_n": 0.8, "surge_disturbance_time_constant_s": 4.0,
                     "surge_dvl_noise_std_m_s": 0.006},
        **changes,
    }  # fmt: skip


def test_a_file_without_a_model_is_met_with_generic_ratios_and_says_so() -> None:
    known = before_any_dive(FILE, "hovering")
    assert known.values["M_u"] == pytest.approx(72.0 * MASS_RATIO)
    assert known.values["D_r"] == pytest.approx(10.5 * DAMPING_RATIO)
    assert any("M_u" in sentence and "far off" in sentence for sentence in known.sentences)
    assert np.all(np.isinf(relative_std(known.precision)))


def test_the_files_model_goes_before_a_guess() -> None:
    known = before_any_dive(with_shape(model={"M_u": 120.0, "D_v": 0.0}), "hovering")
    assert known.values["M_u"] == 120.0
    assert known.values["D_v"] == pytest.approx(72.0 * DAMPING_RATIO)


def test_what_neither_a_prior_nor_a_dive_tells_is_a_guess() -> None:
    known = before_any_dive(with_shape(model={"M_v": 120.0}, priors={"M_u": Prior(111.0, 2.22)}), "hovering")
    assert known.guessed == set(NAMES) - {"M_u"}
    assert after(identified(), FILE, "hovering", "a.json").guessed == set(NAMES) - {"M_u", "D_u"}
    vague = identified(covariance={"of": ["M_u", "D_u"], "matrix": [[11.0**2, 0.0], [0.0, 0.5]]})
    assert after(vague, FILE, "hovering", "a.json").guessed == set(NAMES) - {"D_u"}


def test_a_prior_counts_as_known() -> None:
    known = before_any_dive(with_shape(model={"M_u": 120.0}, priors={"M_u": Prior(111.0, 2.22)}), "hovering")
    assert known.values["M_u"] == 111.0
    assert relative_std(known.precision)[NAMES.index("M_u")] == pytest.approx(0.02)


def test_a_vehicle_without_sensors_is_told_what_is_taken_for_granted() -> None:
    known = before_any_dive(load_vehicle("bluerov2_heavy"), "heavy")
    assert any("no DVL and no IMU" in sentence for sentence in known.sentences)


def test_an_identification_brings_its_values_its_widths_and_its_noise() -> None:
    known = after(identified(), FILE, "hovering", "hovering.json")
    widths = dict(zip(NAMES, relative_std(known.precision), strict=True))
    assert known.values["M_u"] == 110.0
    assert widths["M_u"] == pytest.approx(1.1 / 110.0)
    assert widths["D_u"] == pytest.approx(np.sqrt(0.5) / 55.0)
    assert np.isinf(widths["M_v"])
    noise = known.noise[0]
    assert (noise.disturbance, noise.time_constant_s) == (0.8, 4.0)
    assert noise.velocity == pytest.approx(0.006**2 / 10.0)
    assert known.noise[1] == before_any_dive(FILE, "hovering").noise[1]


def test_a_value_that_is_hardly_known_is_not_planned_with_but_its_width_counts() -> None:
    vague = identified(covariance={"of": ["M_u"], "matrix": [[(0.8 * 110.0) ** 2]]})
    known = after(vague, FILE, "hovering", "hovering.json")
    assert known.values["M_u"] == pytest.approx(72.0 * MASS_RATIO)
    assert relative_std(known.precision)[0] == pytest.approx(0.8)
    assert any("M_u" in sentence for sentence in known.sentences)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"configuration": "survey"}, "configuration 'survey'"),
        ({"vehicle": {"name": "other"}}, "vehicle 'other'"),
        ({"covariance": {"of": ["M_u"], "matrix": [[1.0, 2.0]]}}, "not an identification"),
        ({"parameters": 3}, "not an identification"),
        ({"covariance": {"of": ["M_u"], "matrix": [[None]]}}, "no finite number"),
        ({"covariance": {"of": ["M_u"], "matrix": [[-1.0]]}}, "not above 0"),
        ({"covariance": {"of": ["M_u", "D_u"], "matrix": [[0.0, 0.0], [0.0, 0.0]]}}, "not above 0"),
        ({"covariance": {"of": ["M_u", "M_u"], "matrix": [[1.0, 0.5], [0.5, 1.0]]}}, "twice"),
        ({"covariance": {"of": ["M_u", "D_u"], "matrix": [[1.0, 0.5], [0.4, 1.0]]}}, "not symmetric"),
        ({"covariance": {"of": ["M_u", "D_u"], "matrix": [[1.0, 2.0], [2.0, 1.0]]}}, "semi-definite"),
        (
            {"parameters": [{"name": "M_u", "value": 1e300}, {"name": "D_u", "value": 55.0}]},
            "M_u is 1e\\+300",
        ),
        ({"nuisance": {"surge_disturbance_std_n": float("inf")}}, "surge_disturbance_std_n is no finite"),
    ],
)
def test_what_is_no_identification_of_this_configuration_is_refused(
    changes: dict[str, Any], says: str
) -> None:
    with pytest.raises(ConfigError, match=says):
        after(identified(**changes), FILE, "hovering", "odd.json")


def test_the_doubts_of_the_dive_stand_beside_what_a_plan_after_it_promises() -> None:
    doubt = {
        "about": ["M_w"],
        "sentence": "In heave 68 % follows from nothing recorded.",
        "outcome": "converged",
    }
    known = after(identified(doubts=[doubt]), FILE, "hovering", "a.json")
    assert known.doubted == {"M_w": (doubt["sentence"],)}
    assert known.doubts == (doubt["sentence"],)
    assert notes(known)[0] == f"{DOUBT} {doubt['sentence']}"
    assert after(identified(), FILE, "hovering", "a.json").doubted == {}


def test_a_coefficient_that_leans_on_a_doubted_one_is_doubted_too() -> None:
    sentence = "M_w is taken from the other axes alone, and the true D_w may lie below its value."
    doubt = {"about": ["M_w"], "sentence": sentence, "outcome": "converged", "also": ["D_w"]}
    known = after(identified(doubts=[doubt]), FILE, "hovering", "a.json")
    assert known.doubted == {"M_w": (sentence,), "D_w": (sentence,)}


def test_what_a_dive_had_no_readings_for_is_doubted_and_what_it_said_too_little_of_is_not() -> None:
    parameters = identified()["parameters"]
    reasons = {"M_w": "no velocity in heave was recorded", "D_w": "no velocity in heave was recorded",
               "D_u": "the dive says too little of surge"}  # fmt: skip
    told = [{**one, "reason": reasons[one["name"]]} if one["name"] in reasons else one for one in parameters]
    known = after(identified(parameters=told), FILE, "hovering", "a.json")
    sentence = "Of M_w and D_w it told nothing: no velocity in heave was recorded."
    assert known.doubted == {"M_w": (sentence,), "D_w": (sentence,)}
