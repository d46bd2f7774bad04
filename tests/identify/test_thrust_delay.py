"""Thrust that acts later than the vehicle file says: found over a grid, with an interval, and the values with it."""

from dataclasses import replace
from types import SimpleNamespace

import closed_loop
import network_tasks
import numpy as np
import pytest

from identify.dive import Signal
from identify.doubt import Outcome
from identify.estimators.axes.build import build_axes
from identify.estimators.axes.forces import axes_with_delay, axis_with_delay
from identify.estimators.likelihood.answer import estimate
from identify.estimators.timing import thrust_delay as delay
from identify.thrust.wrench import wrench

FILE = closed_loop.vehicle_file()


def recorded(late_s, seed=3, seconds=120.0):
    """A dive whose commands are stamped so much earlier than they acted."""
    dive = closed_loop.dive(np.random.default_rng(seed), seconds)
    return replace(dive, tau_cmd=Signal(dive.tau_cmd.time_s - late_s, dive.tau_cmd.value))


def with_curve(**changes):
    curve = replace(FILE.vehicle.thrust_curve, **changes)
    return replace(FILE, vehicle=replace(FILE.vehicle, thrust_curve=curve))


@pytest.mark.parametrize("late_s", [0.03, 0.8])
def test_a_delay_up_to_a_second_is_found_and_the_values_are_those_with_it(late_s):
    answer = estimate(recorded(late_s), FILE, "only", network_tasks.quiet)
    lateness = answer.thrust_delay
    assert lateness.low95_s < late_s < lateness.high95_s
    assert lateness.high95_s - lateness.low95_s < 0.02
    assert answer["M_u"].low95 < closed_loop.MASS < answer["M_u"].high95
    assert answer["D_u"].low95 < closed_loop.DAMPING < answer["D_u"].high95
    assert answer.outcome is Outcome.CONVERGED


class Likelihood:
    """Log likelihoods that fall by the square of the distance to the best delay, without a fit."""

    def __init__(self, best_s, width_s):
        self._best_s, self._width_s = best_s, width_s

    def top(self, by_s, _enough):
        return -(((by_s - self._best_s) / self._width_s) ** 2)


@pytest.mark.parametrize("width_s", [1e-3, 1e-4])
def test_a_delay_far_from_where_the_grid_is_best_is_reached_on_a_steep_slope(width_s):
    found_s, half_s = delay._near(Likelihood(0.345, width_s), 0.3, 0.02)
    assert found_s == pytest.approx(0.345, abs=0.1 * width_s)
    assert half_s == pytest.approx(1.39 * width_s, rel=0.1)


def test_what_is_told_says_what_to_write_into_the_vehicle_file():
    answer = estimate(recorded(0.12), with_curve(delay_s=0.05), "only", network_tasks.quiet)
    lateness = answer.thrust_delay
    assert lateness.later_s == pytest.approx(0.07, abs=0.01)
    assert lateness.delay_s == pytest.approx(0.12, abs=0.01)
    assert answer.to_json()["thrust_delay"]["delay_s"] == lateness.delay_s
    (doubt,) = [doubt for doubt in answer.doubts if "Thrust acts" in doubt.sentence]
    assert doubt.about == ("M_u", "D_u")
    assert "beyond the vehicle file's lag and its delay of 0.05 s" in doubt.sentence
    assert f"write delay_s: {lateness.delay_s:.3g} into the vehicle file" in doubt.sentence


def test_with_that_delay_in_the_vehicle_file_the_same_values_come_without_a_word():
    answer = estimate(recorded(0.12), FILE, "only", network_tasks.quiet)
    mended = with_curve(delay_s=answer.thrust_delay.delay_s)
    again = estimate(recorded(0.12), mended, "only", network_tasks.quiet)
    assert again.thrust_delay is None
    assert again.doubts == ()
    assert again["M_u"].value == pytest.approx(answer["M_u"].value, rel=2e-3)


@pytest.mark.parametrize("seed", range(2))
def test_thrust_at_its_own_time_has_no_delay(seed):
    assert estimate(recorded(0.0, seed), FILE, "only", network_tasks.quiet).thrust_delay is None


def test_a_dive_that_doubts_no_lag_of_its_vehicle_file_is_not_searched(monkeypatch):
    monkeypatch.setattr(delay, "_profile", lambda *_: pytest.fail("searched"))
    answer = estimate(recorded(0.0), with_curve(lag_s=1e-3), "only", network_tasks.quiet)
    assert answer.thrust_delay is None


def test_the_interval_of_a_mass_holds_what_its_delay_is_unsure_by():
    answer = estimate(recorded(0.12), FILE, "only", network_tasks.quiet)
    known = estimate(
        recorded(0.12), with_curve(delay_s=answer.thrust_delay.delay_s), "only", network_tasks.quiet
    )
    assert answer["M_u"].std > 1.02 * known["M_u"].std


def test_axes_that_are_moved_are_those_of_a_vehicle_file_with_that_delay():
    dive = recorded(0.0)
    plain, slow = (build_axes(dive, file, "only") for file in (FILE, with_curve(delay_s=0.13)))
    (moved,) = axes_with_delay(plain, wrench(dive, FILE, "only"), 0.13).axes
    (right,) = slow.axes
    shared = np.intersect1d(moved.time_s, right.time_s)[1:]
    force, other = (axis.force[np.isin(axis.time_s, shared)] for axis in (moved, right))
    assert len(shared) > 1000
    assert force == pytest.approx(other, abs=1e-7)
    (same,) = (axis_with_delay(axis, plain, wrench(dive, FILE, "only"), 0.0) for axis in plain.axes)
    assert same.force == pytest.approx(plain.axes[0].force)


def test_a_parabola_says_where_it_has_fallen_by_that_of_a_95_percent_interval():
    at = np.array([0.1, 0.12, 0.15])
    vertex, half = delay._parabola(at, 7.0 - 0.5 * ((at - 0.13) / 0.004) ** 2)
    assert vertex == pytest.approx(0.13)
    assert half == pytest.approx(1.96 * 0.004, rel=1e-3)


@pytest.mark.parametrize(
    ("search", "delay_s"), [(delay.coarse_delay_s, 0.0), (delay.coarse_delay_of_all_s, 0.4)]
)
def test_a_delay_that_no_smaller_one_leads_to_is_found_by_looking_everywhere(monkeypatch, search, delay_s):
    profile = delay._Profile(lambda by_s: by_s, {0.0: 0.0})
    nats = {0.0: 100.0, 0.4: 900.0}
    monkeypatch.setattr(delay, "_profile", lambda *_: profile)
    monkeypatch.setattr(delay, "log_posterior", lambda by_s, _theta: nats[by_s])
    monkeypatch.setattr(
        delay, "climb", lambda by_s, *_: SimpleNamespace(theta=by_s, log_likelihood=nats.get(by_s, 90.0))
    )
    assert search(None, None, None, None) == delay_s
