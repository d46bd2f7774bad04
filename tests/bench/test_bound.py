"""The Cramer-Rao bound: its derivatives, its score, and what it says of simple dives."""

from dataclasses import replace

import numpy as np
import pytest

from bench.bound import cramer_rao, information, kernel
from bench.missions import Mission
from bench.missions.mission import draw_one
from identify.estimators.table import estimator

SEED = 100_002


def model_of(mission: Mission) -> kernel.Model:
    drawn = mission.drawn
    return kernel.Model(
        drawn.mass, drawn.damping, drawn.trim, drawn.righting_nm, 3.0, drawn.disturbance_std,
        drawn.disturbance_time_s,
    )  # fmt: skip


@pytest.fixture(scope="module")
def mission() -> Mission:
    return draw_one(SEED, seconds=60.0)


@pytest.fixture(scope="module")
def state() -> np.ndarray:
    return np.random.default_rng(1).uniform(-0.3, 0.3, kernel.STATES)


def moved(model: kernel.Model, x: np.ndarray, tau: np.ndarray) -> np.ndarray:
    out = np.zeros(kernel.STATES)
    kernel._motion(x, tau, model, out)
    return out


def test_the_jacobian_is_the_slope_of_the_motion(mission: Mission, state: np.ndarray) -> None:
    model, tau, a = model_of(mission), np.arange(6.0), np.zeros((kernel.STATES, kernel.STATES))
    kernel._jacobian(state, model.mass, model, a)
    h = 1e-6
    found = np.column_stack(
        [(moved(model, state + h * e, tau) - moved(model, state - h * e, tau)) / (2 * h) for e in np.eye(17)]
    )
    found[6:12, 6:12] = -np.diag(1 / model.disturbance_time_s)
    assert a == pytest.approx(found, abs=1e-6)


def test_the_slope_by_a_parameter_is_that_of_the_motion(mission: Mission, state: np.ndarray) -> None:
    model, tau = model_of(mission), np.arange(6.0)
    out = np.zeros((kernel.STATES, kernel.PARAMETERS))
    kernel._by_parameter(state, moved(model, state, tau), model, out)
    h = 1e-6
    for dof in range(6):
        scaled = np.ones(6)
        scaled[dof] = np.exp(h)
        for column, up, down in (
            (dof, model._replace(mass=model.mass * scaled), model._replace(mass=model.mass / scaled)),
            (
                6 + dof,
                model._replace(damping=model.damping * scaled),
                model._replace(damping=model.damping / scaled),
            ),
        ):
            slope = (moved(up, state, tau) - moved(down, state, tau))[:6] / (2 * h)
            assert out[:6, column] == pytest.approx(slope, abs=1e-5)


def likelihood_at(mission: Mission, **changes: np.ndarray) -> float:
    return information(replace(mission, drawn=replace(mission.drawn, **changes))).log_likelihood


def test_the_gradient_is_the_slope_of_the_likelihood(mission: Mission) -> None:
    found, drawn, h = information(mission), mission.drawn, 1e-4
    spread = np.sqrt(np.diag(found.information))
    for dof in (0, 1, 5):
        scaled = np.ones(6)
        scaled[dof] = np.exp(h)
        by_mass = [
            likelihood_at(mission, mass=drawn.mass * s, disturbance_std=drawn.disturbance_std * s)
            for s in (scaled, 1 / scaled)
        ]
        by_damping = [likelihood_at(mission, damping=drawn.damping * s) for s in (scaled, 1 / scaled)]
        for place, (up, down) in ((dof, by_mass), (6 + dof, by_damping)):
            slope = (up - down) / (2 * h)
            assert found.gradient[place] / spread[place] == pytest.approx(slope / spread[place], abs=0.15)


@pytest.mark.soak
def test_over_many_repeats_one_scoring_step_from_the_truth_errs_as_much_as_the_bound_says() -> None:
    errors = []
    for repeat in range(40):
        found = information(draw_one(100_012, repeat, seconds=30.0))
        step = found.covariance @ found.gradient
        errors.append(step[:12] / np.sqrt(np.diag(found.covariance)[:12]))
    assert np.mean(np.square(errors)) == pytest.approx(1.0, abs=0.15)
    assert np.max(np.abs(np.mean(errors, axis=0))) < 4.0 / np.sqrt(40)


def test_twice_the_dive_tells_half_the_variance() -> None:
    once, twice = (cramer_rao(draw_one(100_010, seconds=s, kind="together")) for s in (100.0, 198.0))
    ratios = [once[name] / twice[name] for name in ("M_u", "D_u", "M_v", "D_v", "I_r", "D_r")]
    assert np.mean(ratios) == pytest.approx(np.sqrt(2), rel=0.15)


@pytest.mark.soak
def test_where_the_axes_say_little_of_each_other_it_is_what_the_likelihood_claims() -> None:
    ratios = []
    for repeat in range(3):
        mission = draw_one(100_010, repeat, seconds=90.0, kind="square")
        least = cramer_rao(mission)
        found = estimator("likelihood")(
            mission.dive, mission.file, mission.configuration, lambda *_report: None
        )
        ratios += [found[n].std / found[n].value / least[n] for n in ("M_u", "D_u", "M_v", "D_v")]
    assert np.exp(np.mean(np.log(ratios))) == pytest.approx(1.0, abs=0.15)


def test_a_dive_without_velocity_says_next_to_nothing_of_damping() -> None:
    mission = draw_one(100_010, seconds=30.0, kind="square")
    deaf = replace(mission.dive.velocity, value=np.full_like(mission.dive.velocity.value, np.nan))
    assert cramer_rao(replace(mission, dive=replace(mission.dive, velocity=deaf)))["D_u"] > 0.5
