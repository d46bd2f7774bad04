"""What is doubted is let in, and intervals hold the truth then: with a drag or a lateness that the model lacks."""

from dataclasses import replace

import closed_loop
import network_tasks
import numpy as np
import pytest
from fakes.shared import shared
from fakes.vehicle import VEHICLE
from soak import rest_in_soak

from bridge.vehicle.config import load_vehicle
from identify.dive import Signal
from identify.doubt import Outcome
from identify.estimators.axes.build import build_axes
from identify.estimators.likelihood.fit import fit_axes
from identify.estimators.missing_forces.drag_and_timing import (
    NOTHING,
    Admitted,
    Doubts,
    Multiplier,
    admitted,
    by_hidden_steps,
    doubts_of,
    timing_of,
)
from identify.estimators.table import estimator
from identify.ingest.open import read_dive
from identify.statistics import Z95

FILE = closed_loop.vehicle_file()
BOTH = pytest.mark.parametrize("method", ["likelihood", "pinn"])
SURGE, DAMPING_OF_SURGE = 0, 6
EVEN = np.ones(2)
UNTIMED = np.zeros((0, 18))


def fitted(dive, file=FILE, configuration="only"):
    built = build_axes(dive, file, configuration)
    return fit_axes(built, file.vehicle.configurations[configuration], network_tasks.quiet)


def test_without_anything_let_in_an_interval_stays_as_it_is():
    assert NOTHING.std(3, 0.02) == 0.02
    assert NOTHING.reach(3, 0.02, np.array([0.9, 1.3])) == pytest.approx((Z95 * 0.018, Z95 * 0.026))


def test_an_interval_holds_those_of_both_models_and_the_shift_as_an_error():
    shift = np.zeros(18)
    shift[0] = 0.03
    below, above = Admitted(shift, np.full(18, 2.0), UNTIMED).reach(0, 0.01, EVEN)
    assert above == pytest.approx(0.03 + Z95 * 0.02)
    assert below == pytest.approx(Z95 * np.hypot(0.01, 0.03))


def test_where_nothing_is_doubted_nothing_is_let_in():
    fit = fitted(closed_loop.dive(np.random.default_rng(4), 120.0))
    timing = np.full((1, 18), 0.02)
    admission = admitted(fit.joint, fit.theta, (), (), timing)
    assert not admission.shift.any()
    assert admission.std(0, 0.01) == pytest.approx(np.hypot(0.01, 0.02))
    assert admission.reach(0, 0.01, EVEN) == pytest.approx((Z95 * np.hypot(0.01, 0.02),) * 2)
    assert admission.covariance == pytest.approx(np.full((18, 18), 0.02**2))


def test_the_error_by_timing_covers_what_readings_that_are_late_by_that_change_of_a_mass():
    """And is less than twice that."""
    recorded = closed_loop.dive(np.random.default_rng(4), 120.0)
    fit, times = fitted(recorded), 40
    (by_timing,) = timing_of(doubts_of(fit.joint, fit.theta))
    read = recorded.velocity
    late = fitted(replace(recorded, velocity=Signal(read.time_s + times * 0.0005, read.value)))
    change = (late.log_value[SURGE] - fit.log_value[SURGE]) / times
    assert 0.5 < -change / by_timing[SURGE] < 1.0


def test_thrust_is_late_only_beyond_what_stamps_are_off_by():
    none, late = Multiplier(0.0, 0.0, np.zeros(18)), Multiplier(9.0, 2e-3, np.zeros(18))
    assert Doubts(none, late).is_late
    assert not Doubts(none, late, stamped_s=2.5e-3).is_late
    assert not Doubts(none, replace(late, score=4.0)).is_late
    trusted_less = fitted(replace(closed_loop.dive(np.random.default_rng(4), 60.0), stamped_s=2.5e-3))
    assert doubts_of(trusted_less.joint, trusted_less.theta)[SURGE].stamped_s == 2.5e-3


def test_slow_samples_of_the_commands_leave_a_mass_as_open_as_what_they_do_in_between():
    recorded = closed_loop.dive(np.random.default_rng(4), 120.0)
    fit = fitted(recorded)
    assert by_hidden_steps(fit.joint, fit.theta).shape == (0, 18)
    command, open_by = recorded.tau_cmd, []
    for every_s in (0.1, 0.5):
        every = round(every_s * command.rate_hz)
        seldom = Signal(command.time_s[::every], command.value[::every])
        slow = fitted(replace(recorded, tau_cmd=seldom, commands_hold=False))
        (by_steps,) = by_hidden_steps(slow.joint, slow.theta)
        assert set(np.flatnonzero(by_steps).tolist()) == {SURGE, DAMPING_OF_SURGE}
        open_by.append(abs(by_steps[SURGE]))
    assert 0.0 < open_by[0] < open_by[1] < 0.2


@BOTH
def test_a_dive_without_a_doubt_is_as_wide_as_its_information_says(method):
    answer = estimator(method)(
        closed_loop.dive(np.random.default_rng(3), 120.0), FILE, "only", network_tasks.quiet
    )
    assert answer.outcome is Outcome.CONVERGED
    width = np.log(answer["M_u"].high95 / answer["M_u"].low95) / (2 * Z95)
    assert width == pytest.approx(answer["M_u"].relative_std, rel=0.1)


def test_letting_a_drag_in_moves_the_linear_damping_to_the_truth():
    fit = fitted(closed_loop.dive(np.random.default_rng(4), quadratic=40.0))
    admission = admitted(fit.joint, fit.theta, [SURGE], (), UNTIMED)
    off = np.log(closed_loop.DAMPING) - fit.log_value[DAMPING_OF_SURGE]
    assert off < -0.15
    std = admission.looser[DAMPING_OF_SURGE] * np.sqrt(fit.covariance[DAMPING_OF_SURGE, DAMPING_OF_SURGE])
    assert abs(admission.shift[DAMPING_OF_SURGE] - off) < 3 * std


def test_letting_in_a_lateness_of_any_size_moves_the_mass_to_the_truth():
    dive = closed_loop.dive(np.random.default_rng(5))
    command = dive.tau_cmd
    early = replace(dive, tau_cmd=Signal(command.time_s - 0.15, command.value))
    fit = fitted(early)
    admission = admitted(fit.joint, fit.theta, (), [SURGE], UNTIMED)
    off = np.log(closed_loop.MASS) - fit.log_value[SURGE]
    assert abs(off) > 0.05
    # A lag is let in where the thrust has a delay: it goes the right way, and half as far again.
    assert off < 0.0
    assert 1.0 < admission.shift[SURGE] / off < 1.6


def test_a_doubt_is_the_same_a_step_off_the_maximum():
    fit = fitted(closed_loop.dive(np.random.default_rng(4), 120.0, quadratic=40.0))
    off = fit.theta.copy()
    off[:2] += 0.5 * np.sqrt(np.diag(fit.fits[SURGE].covariance))[:2]
    there, near = (doubts_of(fit.joint, theta)[SURGE].drag.score for theta in (fit.theta, off))
    assert there > 5.0
    assert near == pytest.approx(there, rel=0.1)


@pytest.mark.parametrize("method", rest_in_soak(["likelihood", "pinn"]))
def test_masses_and_dampings_of_a_dive_made_elsewhere_with_quadratic_drag_lie_in_their_intervals(method):
    """What its maker says of it, masses and linear dampings of the axes that its thrusters drive."""
    truth = {"M_u": 111.6, "M_v": 112.41, "M_w": 134.0, "I_r": 16.0}
    truth |= {"D_u": 56.24, "D_v": 53.05, "D_w": 95.0, "D_r": 26.07}
    file = load_vehicle(VEHICLE)
    answer = estimator(method)(
        read_dive(shared("sealed", "open_2", "dive.tlog.gz")), file, "hovering", network_tasks.quiet
    )
    assert answer.outcome is Outcome.DISAGREES
    assert sum("speed squared" in doubt.sentence for doubt in answer.doubts) == 3
    known = {name: answer[name] for name in truth if np.isfinite(answer[name].value)}
    outside = {name for name, value in known.items() if not value.low95 < truth[name] < value.high95}
    assert outside == set()
    # Its controller's heave follows from nothing recorded: only the likelihood asks the other axes for that mass.
    assert set(truth) - set(known) == ({"M_w"} if method == "pinn" else set())
    assert all(value.std < 0.02 * value.value for name, value in known.items() if name[0] in "MI")
