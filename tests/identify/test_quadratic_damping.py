"""Quadratic damping as a coefficient like any other, where the vehicle file says that the hull has it."""

import math
from dataclasses import replace

import closed_loop
import network_tasks
import numpy as np
import pytest

from bridge.errors import FitError
from bridge.vehicle.config import Prior
from gcs_plugin.params.identified import parameters_from_identification
from identify.checks.actuation.controller import steered_doubts
from identify.dive import Signal
from identify.doubt import Outcome
from identify.estimators.axes.build import build_axes
from identify.estimators.identifiability import with_drag_forces
from identify.estimators.likelihood import intervals
from identify.estimators.likelihood.axis import DAMPING
from identify.estimators.likelihood.priors import likelihood_of
from identify.estimators.table import estimator

QUADRATIC = 40.0


def file_with(damping, **changes):
    file = closed_loop.vehicle_file()
    shape = replace(file.vehicle.configurations["only"], damping=damping, **changes)
    return replace(file, vehicle=replace(file.vehicle, configurations={"only": shape}))


def fit(dive, damping="both", method="likelihood", **changes):
    return estimator(method)(dive, file_with(damping, **changes), "only", network_tasks.quiet)


@pytest.fixture(scope="module")
def squared():
    """A hull with quadratic damping alone, whose vehicle file says so."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(closed_loop, "DAMPING", 0.0)
        dive = closed_loop.dive(np.random.default_rng(3), 120.0, quadratic=200.0)
    return fit(dive, "quadratic")


@pytest.fixture(scope="module")
def both():
    return fit(closed_loop.dive(np.random.default_rng(3), 120.0, quadratic=QUADRATIC))


@pytest.fixture(scope="module")
def without():
    """A hull that has no quadratic damping, with a vehicle file that lets it have some."""
    return fit(closed_loop.dive(np.random.default_rng(1), 120.0))


def test_both_dampings_come_with_intervals_that_hold_the_truth_and_in_the_covariance(both):
    truth = {"M_u": closed_loop.MASS, "D_u": closed_loop.DAMPING, "X_uu": QUADRATIC}
    assert both.outcome is Outcome.CONVERGED
    for name, value in truth.items():
        assert both[name].low95 < value < both[name].high95
        assert both[name].identifiable
    assert both["X_uu"].unit == "N s2/m2"
    assert both.covariance_of == ("M_u", "D_u", "X_uu")
    assert np.sqrt(both.covariance[2, 2]) == pytest.approx(both["X_uu"].std, rel=0.01)
    assert both["D_u"].partner.name == "X_uu"


@pytest.mark.soak
def test_of_twenty_dives_seventeen_intervals_or_more_hold_each_truth():
    inside = dict.fromkeys(("M_u", "D_u", "X_uu"), 0)
    for seed in range(20):
        answer = fit(closed_loop.dive(np.random.default_rng(100 + seed), 60.0, quadratic=QUADRATIC))
        truth = {"M_u": closed_loop.MASS, "D_u": closed_loop.DAMPING, "X_uu": QUADRATIC}
        for name, value in truth.items():
            inside[name] += answer[name].low95 <= value <= answer[name].high95
    assert min(inside.values()) >= 17


def test_dampings_that_trade_are_both_kept_and_their_sum_is_told(both):
    (force,) = both.drag_forces
    truth = closed_loop.DAMPING * force.speed + QUADRATIC * force.speed**2
    assert force.correlation < -0.9
    assert force.low95 < truth < force.high95
    assert force.relative_std < 0.02
    assert any("D_u and X_uu hold together (correlation -0.9" in note for note in both.notes)
    data = both.to_json()["drag_forces"][0]
    assert (data["linear"], data["quadratic"]) == ("D_u", "X_uu")
    assert data["force"] == force.force


def test_a_hull_without_quadratic_damping_may_as_well_have_none_and_is_no_fault(without):
    assert without.outcome is Outcome.CONVERGED
    assert without["X_uu"].low95 == 0.0
    assert without["X_uu"].high95 < 15.0
    assert without["X_uu"].identifiable
    assert without["D_u"].low95 < closed_loop.DAMPING < without["D_u"].high95
    assert all(
        math.isfinite(parameter.value)
        for parameter in without.parameters
        if parameter.name in ("D_u", "X_uu")
    )


@pytest.fixture(scope="module")
def problem():
    """The likelihood of surge, of a hull with both dampings."""
    dive = closed_loop.dive(np.random.default_rng(3), 60.0, quadratic=QUADRATIC)
    file = file_with("both")
    (name,) = file.vehicle.configurations
    axis = build_axes(dive, file, name).axes[0]
    return likelihood_of(axis, file.vehicle.configurations[name], np.full(6, closed_loop.MASS), (), "both")


def test_a_drag_is_made_of_no_speed_that_runs_away(problem):
    assert np.isfinite(problem.slowed(problem.prior_mean).shapes).all()
    wild = problem.prior_mean.copy()
    wild[DAMPING] += 20.0
    with pytest.raises(np.linalg.LinAlgError, match="run away"):
        problem.slowed(wild)
    with pytest.raises(np.linalg.LinAlgError, match="no number"):
        problem.score(wild)


def test_the_gradient_by_quadratic_drag_is_that_of_the_likelihood(problem):
    """Drag brakes the hull, and damps what disturbs it: the gradient is the sum of both."""
    theta, step = problem.prior_mean, np.zeros(len(problem.prior_mean))
    step[problem.quadratic_index] = 1e-3
    slope = (problem.log_likelihood(theta + step) - problem.log_likelihood(theta - step)) / (2 * step.sum())
    gradient, _ = problem.score(theta)
    assert gradient[problem.quadratic_index] == pytest.approx(slope, rel=0.02)


def test_each_run_tells_of_quadratic_drag_once_and_all_runs_together_as_the_dive_does(problem):
    theta = problem.prior_mean
    ((rows, gradient, information),) = problem.score_by_run(theta)
    assert len({*rows.tolist()}) == len(rows)
    assert problem.quadratic_index in rows
    whole, information_of_whole = problem.score(theta)
    assert gradient == pytest.approx(whole[rows])
    assert information == pytest.approx(information_of_whole[np.ix_(rows, rows)])


def test_a_hull_whose_damping_is_quadratic_has_no_linear_one_and_says_so(squared):
    assert squared["X_uu"].low95 < 200.0 < squared["X_uu"].high95
    assert squared.outcome is Outcome.CONVERGED
    assert math.isnan(squared["D_u"].value)
    assert squared["D_u"].reason == "the vehicle file's damping is quadratic: its hull has no linear damping"
    assert "D_u" not in squared.covariance_of
    assert not any("surge damping" in direction.sentence for direction in squared.null_directions)


def test_a_linear_damping_that_a_quadratic_hull_lacks_is_missed():
    answer = fit(closed_loop.dive(np.random.default_rng(5), 300.0, quadratic=QUADRATIC), "quadratic")
    (doubt,) = [doubt for doubt in answer.doubts if "grows as the speed itself" in doubt.sentence]
    assert doubt.about == ("M_u", "X_uu")
    assert "write damping: both" in doubt.sentence


@pytest.mark.parametrize("method", ["pinn", "bench.reproduce.paper"])
def test_a_method_without_quadratic_damping_refuses_and_names_the_one_that_has_it(method):
    with pytest.raises(FitError, match=r"damping: both, and the model of method .* take --method likelihood"):
        fit(closed_loop.dive(np.random.default_rng(3), 60.0), method=method)


def test_a_prior_of_quadratic_damping_is_part_of_the_value(both):
    prior = {"X_uu": Prior(QUADRATIC, 0.5, rests_on="thrust")}
    answer = fit(closed_loop.dive(np.random.default_rng(3), 120.0, quadratic=QUADRATIC), priors=prior)
    assert answer["X_uu"].std < 0.6 < both["X_uu"].std
    assert answer["D_u"].std < 0.5 * both["D_u"].std
    assert answer["X_uu"].share_from_prior > 0.9


def test_all_that_was_identified_goes_to_the_vehicle(both):
    assert set(parameters_from_identification(both.to_json(), 0)) == {"FF0_M_U", "FF0_D_U", "FF0_X_UU"}


def test_a_hull_with_quadratic_damping_alone_takes_its_earlier_linear_one_back(squared):
    values = parameters_from_identification(squared.to_json(), 0)
    assert values["FF0_D_U"] == 0.0
    assert values["FF0_X_UU"] > 0.0


def test_of_a_sum_that_is_known_loosely_nothing_is_kept(both):
    indices = [both.covariance_of.index(name) for name in ("D_u", "X_uu")]
    covariance = both.covariance.copy()
    covariance[np.ix_(indices, indices)] = np.diag([40.0**2, 80.0**2])
    loose = [replace(parameter, identifiable=False, reason="too little") for parameter in both.parameters]
    answer = with_drag_forces(replace(both, covariance=covariance, parameters=tuple(loose)))
    assert not answer["D_u"].identifiable
    assert not answer["X_uu"].identifiable
    kept = with_drag_forces(replace(both, parameters=tuple(loose)))
    assert kept["D_u"].identifiable
    assert kept["X_uu"].reason == ""


@pytest.mark.parametrize("middle", [3.0, 1.0, -0.5, -4.0])
def test_what_is_left_without_the_negative_part_is_that_of_a_truncated_normal_distribution(middle):
    from scipy.stats import truncnorm

    std = 2.0
    exact = truncnorm(-middle / std, np.inf, middle, std)
    mean, covariance = intervals._without_negative(
        np.array([middle, 5.0]), std**2 * np.array([[1.0, -0.8], [-0.8, 1.0]]), 0
    )
    assert mean[0] == pytest.approx(exact.mean())
    assert covariance[0, 0] == pytest.approx(exact.var(), rel=1e-6)
    assert mean[1] == pytest.approx(5.0 - 0.8 * (exact.mean() - middle))
    low, high = intervals._interval(middle, std)
    assert high == pytest.approx(exact.ppf(0.975), rel=1e-6)
    assert low == 0.0


def test_a_drag_that_is_surely_there_keeps_its_normal_interval():
    low, high = intervals._interval(10.0, 2.0)
    assert (low, high) == pytest.approx((10.0 - 1.96 * 2.0, 10.0 + 1.96 * 2.0), abs=1e-3)


def test_where_an_autopilot_may_have_steered_by_what_its_log_lacks_the_values_are_doubted(both):
    dive = closed_loop.dive(np.random.default_rng(3), 120.0, quadratic=QUADRATIC)
    log = replace(dive, velocity_is_filtered=True, nu_fb=None, tau_pid=None, nu_ref=None, commands_hold=True)
    fitted = {p.name for p in both.parameters if np.isfinite(p.value)}
    (doubt,) = steered_doubts(log, file_with("both"), "only", fitted)
    assert doubt.about == ("M_u", "D_u", "X_uu")
    assert doubt.outcome is Outcome.CONVERGED
    assert steered_doubts(dive, file_with("both"), "only", fitted) == ()
    by_stick = np.zeros_like(dive.tau_cmd.value)
    by_stick[len(by_stick) // 2 :, 0] = 10.0
    stuck = replace(log, tau_cmd=Signal(dive.tau_cmd.time_s, by_stick))
    assert steered_doubts(stuck, file_with("both"), "only", fitted) == ()
