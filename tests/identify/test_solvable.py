"""Dives whose equations have no solution: refused in a sentence that names the axes, whatever broke them."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import closed_loop
import network_tasks
import numpy as np
import pytest
from soak import rows_rest_in_soak

from bench.missions.mission import draw_one
from bridge.errors import FitError
from identify.dive import Dive, Signal
from identify.estimators.axes.build import build_axes
from identify.estimators.likelihood.axis import TIME_CONSTANT
from identify.estimators.likelihood.priors import likelihood_of
from identify.estimators.refusals import no_solution
from identify.estimators.table import METHODS, estimator, judged

BY_ITSELF = list(METHODS)


def changed(dive, change, *names):
    return replace(dive, **{name: change(getattr(dive, name)) for name in names})


def values(change):
    return lambda signal: Signal(signal.time_s, change(signal.value.copy()))


def column(number, value):
    def change(table):
        table[:, number] = value
        return table

    return values(change)


def at_the_middle(value):
    def change(table):
        table[len(table) // 2] = value
        return table

    return values(change)


def alternating(table):
    return 1e4 * np.where(np.arange(len(table)) % 2, 1.0, -1.0)[:, None] * np.ones_like(table)


def twice(signal):
    """Every other reading at the time of the one before."""
    time_s = signal.time_s.copy()
    time_s[1::2] = time_s[: len(time_s) - 1 : 2]
    return Signal(time_s, signal.value)


def two(signal):
    return Signal(signal.time_s[[0, -1]], signal.value[[0, -1]])


SPOILT = {
    "nothing but what stood still": lambda d: changed(
        d, values(lambda v: v[:1] * np.ones_like(v)), "velocity", "gyro", "attitude", "depth"
    ),
    "a channel that stands still": lambda d: changed(d, column(0, 0.3), "velocity"),
    "no thrust in surge": lambda d: changed(d, column(0, 0.0), "tau_cmd", "tau_pid"),
    "two readings": lambda d: changed(d, two, "velocity", "gyro", "attitude", "depth"),
    "an IMU of zeros": lambda d: changed(d, values(np.zeros_like), "gyro"),
    "attitudes of zeros": lambda d: changed(d, values(np.zeros_like), "attitude"),
    "times twice": lambda d: changed(d, twice, "velocity", "gyro", "attitude", "depth"),
    "one reading of 1e200 m/s": lambda d: changed(d, at_the_middle(1e200), "velocity"),
    "readings of 1e4 m/s": lambda d: changed(d, values(alternating), "velocity"),
    "a command that is no number": lambda d: changed(d, at_the_middle(np.nan), "tau_cmd", "tau_pid"),
    "readings that are all infinite": lambda d: changed(d, values(lambda v: v * np.inf), "velocity"),
    "surge alone": lambda d: replace(d, gyro=None, fog=None, attitude=None, depth=None),
}


@pytest.fixture(scope="module")
def mission():
    drawn = draw_one(100_001, seconds=25.0)
    return replace(drawn, dive=replace(drawn.dive, pwm=None, fog=None))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(("method", "spoilt"), rows_rest_in_soak(product(BY_ITSELF, SPOILT), len(SPOILT) + 1))
def test_whatever_a_recording_holds_the_answer_is_in_numbers_or_a_refusal_that_names_axes(
    mission, method, spoilt
):
    """No other error reaches the user, and nothing is told that is no number."""
    try:
        answer = estimator(method)(
            SPOILT[spoilt](mission.dive), mission.file, mission.configuration, network_tasks.quiet
        )
    except FitError as refused:
        assert any(axis in str(refused) for axis in ("surge", "roll"))  # noqa: PT017
        return
    for parameter in answer.parameters:
        numbers = (parameter.value, parameter.std, parameter.low95, parameter.high95)
        assert np.isfinite(numbers).all() if parameter.identifiable else parameter.reason


def fit(change):
    dive = changed(closed_loop.dive(np.random.default_rng(3), seconds=30.0), change, "velocity")
    return estimator("likelihood")(dive, closed_loop.vehicle_file(), "only", network_tasks.quiet)


def test_readings_that_no_vehicle_makes_are_told_with_their_size_and_axis():
    with pytest.raises(
        FitError, match=r"equations of surge have no solution; readings there reach 1e\+200 m/s .* leave"
    ):
        fit(values(lambda table: np.where(np.arange(len(table))[:, None] == 100, (1e200, 0.0, 0.0), table)))


def test_a_singular_matrix_and_a_value_that_is_no_number_are_both_refused():
    dive = closed_loop.dive(np.random.default_rng(3), seconds=30.0)
    answer = estimator("likelihood")(dive, closed_loop.vehicle_file(), "only", network_tasks.quiet)

    def singular(*_arguments):
        return np.linalg.inv(np.zeros((2, 2)))

    def no_number(*_arguments):
        totals = [replace(p, low95=np.nan) if p.name == "M_u" else p for p in answer.parameters]
        return replace(answer, parameters=tuple(totals))

    for fitted in (singular, no_number):
        with pytest.raises(
            FitError, match=r"equations of surge have no solution; look there .* vehicle file"
        ):
            judged(fitted)(dive, closed_loop.vehicle_file(), "only", network_tasks.quiet)


def test_forces_that_are_no_numbers_leave_their_axes_out_with_the_reason():
    dive = changed(closed_loop.dive(np.random.default_rng(3), seconds=30.0), at_the_middle(np.nan), "tau_cmd")
    answer = estimator("likelihood")(dive, closed_loop.vehicle_file(), "only", network_tasks.quiet)
    assert answer["M_u"].reason.startswith("the forces in surge are not finite: a thruster command")


def test_a_dive_that_depth_and_attitude_alone_tell_of_is_refused_with_their_axes():
    time_s = np.arange(0.0, 30.0, 0.1)
    depth, level = Signal(time_s, time_s[:, None]), Signal(time_s, np.tile([1.0, 0.0, 0.0, 0.0], (300, 1)))
    dive = Dive("d", Path("d.bag"), "0" * 64, depth=depth, attitude=level)
    assert "the equations of heave, roll, pitch and yaw have no solution" in str(no_solution(dive))


def test_a_disturbance_that_forgets_faster_than_numbers_go_has_no_likelihood():
    """A climb on readings that are wildly off may come to it, and has to turn back."""
    file = closed_loop.vehicle_file()
    (axis,) = build_axes(closed_loop.dive(np.random.default_rng(1), 30.0), file, "only").axes
    problem = likelihood_of(axis, file.vehicle.configurations["only"], np.full(6, 72.0), ())
    theta = problem.prior_mean.copy()
    assert np.isfinite(problem.log_likelihood(theta))
    theta[TIME_CONSTANT] = -800.0
    with np.errstate(divide="ignore", invalid="ignore"):
        assert problem.log_likelihood(theta) == -np.inf
