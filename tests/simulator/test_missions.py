"""Missions, and the true model that a simulated vehicle has."""

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bridge.errors import ConfigError
from bridge.simulator.missions import hovering, load_mission, mission_named, survey, validation
from bridge.simulator.truth import Truth, load_truth
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.legs import Leg, Mission

SHAPES = load_vehicle("ruvifist").vehicle.configurations
ALL = [
    survey(),
    survey("linear"),
    hovering(),
    hovering("linear"),
    validation(sways=True),
    validation(sways=False),
]


@cache
def sampled(mission, rate_hz=10.0):
    time_s = np.arange(0, mission.duration_s, 1 / rate_hz)
    references = [mission.reference(t) for t in time_s]
    return (
        np.array([r.nu for r in references]),
        np.array([r.nu_dot for r in references]),
        np.array([(r.heading_rad, r.depth_m) for r in references]),
    )


@pytest.mark.parametrize(("mission", "samples"), [(survey(), 10_500), (hovering(), 8_000)])
def test_the_papers_missions_have_its_number_of_samples_at_10_hz(mission, samples):
    assert mission.duration_s * 10 == pytest.approx(samples, rel=0.02)


@pytest.mark.parametrize("sways", [True, False])
def test_the_validation_is_short_and_starts_and_ends_at_rest(sways):
    mission = validation(sways=sways)
    assert 60 < mission.duration_s < 120
    assert {mission.legs[0].phase, mission.legs[-1].phase} == {"rest"}
    for time_s in (0.0, mission.duration_s):
        assert mission.reference(time_s).nu == (0.0,) * 6


@pytest.mark.parametrize("mission", ALL, ids=lambda m: f"{m.name} {m.duration_s:.0f}")
def test_heading_and_depth_are_the_integrals_of_their_rates(mission):
    nu, _, pose = sampled(mission, 20.0)
    np.testing.assert_allclose(pose[1:, 0] - pose[0, 0], np.cumsum(nu[:-1, 5] + nu[1:, 5]) / 40, atol=5e-3)
    np.testing.assert_allclose(pose[1:, 1] - pose[0, 1], np.cumsum(nu[:-1, 2] + nu[1:, 2]) / 40, atol=1e-4)


@pytest.mark.parametrize("mission", [survey(), hovering(), validation(sways=True)], ids=lambda m: m.name)
def test_a_smooth_mission_has_velocities_without_a_jump_and_their_true_derivatives(mission):
    nu, nu_dot, _ = sampled(mission, 20.0)
    assert np.abs(np.diff(nu, axis=0)).max() < 0.01
    np.testing.assert_allclose(np.gradient(nu, 0.05, axis=0)[1:-1], nu_dot[1:-1], atol=2e-3)


def test_the_linear_heading_turns_at_a_constant_rate_with_no_acceleration_at_all():
    nu, nu_dot, _ = sampled(survey("linear"))
    assert set(np.round(np.unique(nu[:, 5]), 9)) == {0.0, round(math.radians(6), 9)}
    assert not nu_dot[:, 5].any()


def test_the_survey_goes_four_laps_of_a_closed_rectangle_at_four_speeds_at_the_papers_depth():
    mission = survey()
    nu, _, pose = sampled(mission, 20.0)
    track = np.cumsum(nu[:, 0] * np.exp(1j * pose[:, 0])) / 20
    assert abs(track[-1]) < 0.1
    assert pose[-1, 0] == pytest.approx(4 * 2 * math.pi)
    steady = {leg.surge_m_s for leg in mission.legs if leg.phase == "steady"}
    assert steady == {0.5, 0.4, 0.3, 0.2}
    assert all(
        leg.transient_s == 5.0 for leg in mission.legs if leg.phase in ("acceleration", "deceleration")
    )
    under_way = [mission.reference(t).depth_m for t in np.arange(40.0, mission.duration_s - 40, 1.0)]
    np.testing.assert_allclose(under_way, 0.6)


def test_hovering_moves_ahead_and_aside_at_a_constant_heading_and_then_turns_both_ways():
    nu, _, pose = sampled(hovering())
    moving = np.hypot(nu[:, 0], nu[:, 1]) > 0
    assert np.abs(pose[moving, 0]).max() < 1e-12
    np.testing.assert_allclose([nu[:, k].max() for k in (0, 1)], 0.4)
    np.testing.assert_allclose([nu[:, k].min() for k in (0, 1)], -0.4)
    assert nu[:, 5].max() == -nu[:, 5].min() > 0.1


def test_a_mission_that_moves_sideways_is_refused_where_the_vehicle_cannot():
    with pytest.raises(ConfigError, match="sideways"):
        mission_named("hovering", SHAPES["survey"])
    assert not any(leg.sway_m_s for leg in mission_named("validation", SHAPES["survey"]).legs)
    assert any(leg.sway_m_s for leg in mission_named("validation", SHAPES["hovering"]).legs)


def test_an_unknown_mission_is_refused_with_the_names_there_are():
    with pytest.raises(ConfigError, match="survey, hovering, validation"):
        mission_named("surbey", SHAPES["survey"])


@pytest.mark.parametrize("name", ["legs.yaml", "plans/legs", "legs.yml"])
def test_a_mission_file_that_is_not_there_is_not_found(name):
    with pytest.raises(ConfigError, match=f"mission file '{name}' is not found"):
        mission_named(name, SHAPES["survey"])


def test_a_mission_file_gives_steps_ramps_and_square_waves(tmp_path):
    path = tmp_path / "plan.yaml"
    path.write_text(
        "name: plan\nlegs:\n"
        "  - {name: wave, duration_s: 4.0, surge_m_s: 0.3, yaw_rad_s: 0.1, alternate: 3}\n"
        "  - {duration_s: 6.0, phase: rest, transient_s: 5.0}\n"
    )
    mission = mission_named(str(path), SHAPES["survey"])
    assert mission.duration_s == 18.0
    assert [mission.reference(t).nu[0] for t in (1.0, 5.0, 9.0, 17.5)] == [0.3, -0.3, 0.3, 0.0]
    assert 0 < mission.reference(14.0).nu[0] < 0.3
    assert [leg.name for leg in mission.legs] == ["wave", "wave", "wave", "leg 2"]
    assert mission.legs[-1].phase == "rest"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("name: x\nlegs: []\n", "at least one"),
        ("name: x\nlegs:\n  - {duration_s: 0.0}\n", "duration above 0"),
        ("name: x\nlegs:\n  - {duration_s: 2.0, transient_s: 3.0}\n", "transient no longer"),
        ("name: x\nlegs:\n  - {duration_s: 2.0, surge: 3.0}\n", "surge_m_s"),
        ("name: x\nlegs:\n  - {duration_s: 2.0, alternate: 0}\n  - {duration_s: 2.0}\n", "1 leg or more"),
        ("name: x\nlegs:\n  - {duration_s: 2.0, alternate: -3}\n  - {duration_s: 2.0}\n", "1 leg or more"),
    ],
)
def test_a_mission_file_that_makes_no_sense_is_refused(tmp_path, text, says):
    (tmp_path / "plan.yaml").write_text(text)
    with pytest.raises(ConfigError, match=says):
        load_mission(tmp_path / "plan.yaml")


def test_before_and_after_a_mission_its_ends_hold():
    mission = Mission("x", (Leg(2.0, "turn", "turning", yaw_rad_s=0.5),), 1.0, 0.25)
    assert mission.reference(-1.0).heading_rad == 0.25
    assert mission.reference(99.0).heading_rad == pytest.approx(1.25)
    assert mission.spans() == ((mission.legs[0], 0.0, 2.0),)


FILE = load_vehicle("ruvifist")
BLUEROV2 = Path(__file__).resolve().parents[1] / "data" / "vehicles" / "bluerov2.yaml"


def test_the_papers_figures_are_taken_for_added_mass_on_top_of_72_kg():
    survey, hovering = load_truth(FILE, "survey"), load_truth(FILE, "hovering")
    assert survey.model["M_u"] == pytest.approx(72 + 24.4)
    assert (survey.model["D_u"], survey.model["D_r"]) == (42.13, 21.8)
    assert hovering.mass == (111.6, 112.41, 134.0, 5.2, 15.5, 16.0)
    assert hovering.damping == (56.24, 53.05, 95.0, 18.0, 26.0, 26.07)


def test_the_total_is_nowhere_less_than_the_rigid_body():
    for name, shape in FILE.vehicle.configurations.items():
        rigid = (shape.dry_mass_kg,) * 3 + shape.inertia_kgm2
        assert all(total > body for total, body in zip(load_truth(FILE, name).mass, rigid, strict=True))


def test_a_vehicle_without_a_truth_is_told_what_is_missing():
    with pytest.raises(ConfigError, match=r"bluerov2\.truth\.yaml, and its own model (is empty|lacks).*M_u"):
        load_truth(load_vehicle(str(BLUEROV2)), "bluerov2")


def test_a_complete_model_in_the_vehicle_file_serves_as_truth(tmp_path):
    model = load_truth(FILE, "hovering").model
    text = BLUEROV2.read_text() + "    model: {" + ", ".join(f"{k}: {v}" for k, v in model.items()) + "}\n"
    (tmp_path / "mine.yaml").write_text(text)
    truth = load_truth(load_vehicle(str(tmp_path / "mine.yaml")), "bluerov2")
    assert truth.model == model
    assert truth.disturbance_n == pytest.approx(0.35 * 13.5 / 72)


@pytest.mark.parametrize("change", [{"M_u": -1.0}, {"Z_z": 1.0}])
def test_a_truth_outside_the_list_or_its_bounds_is_refused(change):
    with pytest.raises(ValueError, match=next(iter(change))):
        Truth(load_truth(FILE, "survey").model | change, 0.0, 0.0)


def test_a_truth_may_hold_effects_that_the_simulator_has_and_no_others():
    model = load_truth(FILE, "hovering").model
    assert Truth(model, 0.0, 0.0, effects={"X_uu": 60.0, "T2_gain": 0.8}).quadratic == (60.0, 0, 0, 0, 0, 0)
    with pytest.raises(ValueError, match="'N_munk' can't be simulated"):
        Truth(model, 0.0, 0.0, effects={"N_munk": 1.0})
    with pytest.raises(ValueError, match="X_uu is -1"):
        Truth(model, 0.0, 0.0, effects={"X_uu": -1.0})
