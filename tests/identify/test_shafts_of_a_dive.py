"""Thrusters whose shafts lag in speed, identified: the lag is taken for that, and for no delay of the thrust."""

from dataclasses import replace
from types import SimpleNamespace

import closed_loop
import network_tasks
import numpy as np
import pytest

from identify.dive import Signal
from identify.doubt import Outcome
from identify.estimators.likelihood.answer import estimate
from identify.estimators.timing import thrust_timing
from identify.estimators.timing.thrust_timing import Timed, with_timing
from identify.thrust.shafts import wrench_by_shafts
from identify.thrust.wrench import wrench

LAG_S, STEP_S = 0.4, 0.1
AMID = (np.arange(20) + 0.5) / 20
FILE = closed_loop.vehicle_file()
CURVE = replace(FILE.vehicle.thrust_curve, lag_s=LAG_S)
SLOW = replace(FILE, vehicle=replace(FILE.vehicle, thrust_curve=CURVE))


class Shaft:
    """A shaft whose speed follows that asked for: what its thrust has beyond the thrust asked, over each step."""

    def __init__(self):
        self.speed = 0.0

    def __call__(self, _time_s, asked_n):
        wanted = np.sign(asked_n) * np.sqrt(abs(asked_n))
        speed = wanted + (self.speed - wanted) * np.exp(-AMID * STEP_S / LAG_S)
        self.speed = wanted + (self.speed - wanted) * np.exp(-STEP_S / LAG_S)
        return float(np.mean(speed * np.abs(speed))) - asked_n


class Thrust(Shaft):
    """The same of a thrust that lags."""

    def __call__(self, _time_s, asked_n):
        thrust = asked_n + (self.speed - asked_n) * np.exp(-AMID * STEP_S / LAG_S)
        self.speed = asked_n + (self.speed - asked_n) * np.exp(-STEP_S / LAG_S)
        return float(np.mean(thrust)) - asked_n


def recorded(follows, seed=4):
    """A dive whose thruster was asked in newtons, and pushes as `follows` says."""
    dive = closed_loop.dive(np.random.default_rng(seed), 240.0, push=follows)
    asked = Signal(dive.tau_cmd.time_s, dive.tau_cmd.value[:, :1])
    return replace(dive, thrust_cmd=asked, tau_cmd=None, commands_hold=True)


def test_the_mass_of_a_dive_whose_shafts_lag_is_the_true_one_and_no_delay_is_told():
    answer = estimate(recorded(Shaft()), SLOW, "only", network_tasks.quiet)
    assert answer.thrust_delay is None
    assert any("that of their shafts' speed" in note for note in answer.notes)
    assert answer.outcome is Outcome.CONVERGED
    assert answer["M_u"].low95 < closed_loop.MASS < answer["M_u"].high95
    assert answer["D_u"].low95 < closed_loop.DAMPING < answer["D_u"].high95


@pytest.mark.parametrize(("follows", "by_shafts"), [(Shaft, True), (Thrust, False)])
def test_a_delay_beyond_the_lag_is_told_with_the_form_of_the_lag(follows, by_shafts):
    dive = recorded(follows())
    late = Signal(dive.thrust_cmd.time_s - 0.15, dive.thrust_cmd.value)
    answer = estimate(replace(dive, thrust_cmd=late), SLOW, "only", network_tasks.quiet)
    assert any("shafts" in note for note in answer.notes) == by_shafts
    assert answer.thrust_delay.low95_s < 0.15 < answer.thrust_delay.high95_s
    assert answer["M_u"].low95 < closed_loop.MASS < answer["M_u"].high95


def test_a_thrust_that_lags_as_the_vehicle_file_says_is_no_shaft_s():
    answer = estimate(recorded(Thrust()), SLOW, "only", network_tasks.quiet)
    assert not any("shafts" in note for note in answer.notes)
    assert answer["M_u"].low95 < closed_loop.MASS < answer["M_u"].high95


@pytest.mark.parametrize(("axes", "fits_shafts"), [(1, True), (2, False)])
def test_a_delay_that_settles_several_axes_leaves_no_question_of_the_shafts(monkeypatch, axes, fits_shafts):
    plain = Timed(SimpleNamespace(axes=()), SimpleNamespace(fits=dict.fromkeys(range(axes))))
    monkeypatch.setattr(thrust_timing, "wrench", lambda *_: None)
    monkeypatch.setattr(thrust_timing, "wrench_by_shafts", lambda *_: "shafts")
    monkeypatch.setattr(thrust_timing, "axes_with_forces", lambda *_: None)
    monkeypatch.setattr(thrust_timing, "with_delay", lambda *_: None)
    monkeypatch.setattr(Timed, "log_posterior", property(lambda timed: float(timed.by_shafts) * 1e6))
    fitted = []
    timed = with_timing(None, SLOW, "only", plain, lambda built: fitted.append(built), True, lambda _: False)
    assert (timed.by_shafts, bool(fitted)) == (fits_shafts, fits_shafts)


def test_the_thrust_of_shafts_goes_by_the_square_of_their_speed_between_the_commands_too():
    """From rest to 16 N, at commands that come unevenly."""
    time_s = np.array([0.0, 1.0, 1.13, 1.9, 2.0])
    asked = Signal(time_s, np.array([[0.0], *[[16.0]] * 4]))
    dive = replace(recorded(Shaft()), thrust_cmd=asked)
    later = replace(SLOW, vehicle=replace(SLOW.vehicle, thrust_curve=replace(CURVE, delay_s=0.05)))
    shafts = wrench_by_shafts(dive, later, "only", wrench(dive, later, "only"))
    at_s = np.array([0.5, 1.05, 1.1, 1.5, 1.99])
    since_s = np.maximum(at_s - 1.05, 0.0)
    means = shafts.mean_between(at_s - 0.02, at_s + 0.02)[:, 0]
    assert means[[0, 2, 3, 4]] == pytest.approx(
        16.0 * (1.0 - np.exp(-since_s / LAG_S))[[0, 2, 3, 4]] ** 2, abs=0.1
    )
    whole = shafts.mean_between(np.array([1.05]), np.array([2.05]))[0, 0]
    exact = 1.0 - 2.0 * LAG_S * (1.0 - np.exp(-1.0 / LAG_S)) + 0.5 * LAG_S * (1.0 - np.exp(-2.0 / LAG_S))
    assert whole == pytest.approx(16.0 * exact, rel=2e-3)


def test_without_a_lag_or_without_the_thrusters_own_commands_there_is_no_wrench_of_shafts():
    dive = recorded(Shaft())
    assert wrench_by_shafts(dive, FILE, "only", wrench(dive, FILE, "only")) is None
    by_wrench = replace(closed_loop.dive(np.random.default_rng(4), 60.0), thrust_cmd=None)
    assert wrench_by_shafts(by_wrench, SLOW, "only", wrench(by_wrench, SLOW, "only")) is None
