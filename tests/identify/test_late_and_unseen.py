"""Doubts beside a missing drag: thrust at another time, speeds that nobody read, a search cut off."""

from dataclasses import replace
from types import SimpleNamespace

import closed_loop
import network_tasks
import numpy as np
import pytest
from fakes.shared import shared
from fakes.vehicle import VEHICLE
from soak import rest_in_soak

from bench.missions.mission import draw_one
from bridge.vehicle.config import load_vehicle
from identify.checks.fit.thrust_timing import late_doubts
from identify.checks.fit.unread_speeds import silent_share, unread_doubts
from identify.dive import Signal
from identify.doubt import Outcome
from identify.estimators.axes.axis import Axes
from identify.estimators.axes.build import build_axes
from identify.estimators.axes.forces import axes_with_delay, axis_with_delay
from identify.estimators.likelihood import fit as likelihood_fit
from identify.estimators.likelihood.answer import estimate
from identify.estimators.missing_forces.drag_and_timing import Multiplier
from identify.estimators.table import estimator
from identify.estimators.timing import thrust_delay as delay
from identify.estimators.timing.lateness import by_lateness
from identify.ingest.open import read_dive
from identify.thrust.wrench import wrench

FILE = closed_loop.vehicle_file()


def later(dive, late_s):
    """The dive with its commands stamped so much later than they acted."""
    command = dive.tau_cmd
    return replace(dive, tau_cmd=Signal(command.time_s + late_s, command.value))


def test_thrust_that_is_stamped_late_makes_data_and_model_disagree_and_says_by_how_much_and_what_to_do():
    answer = estimate(
        later(closed_loop.dive(np.random.default_rng(5)), 0.1), FILE, "only", network_tasks.quiet
    )
    (doubt,) = [doubt for doubt in answer.doubts if "acts at another time" in doubt.sentence]
    assert doubt.about == ("M_u", "D_u")
    assert answer.outcome is Outcome.DISAGREES
    assert "(earlier, by about 87 ms; " in doubt.sentence
    assert "doctor --wet" in doubt.sentence


def test_an_axis_that_no_thruster_pushed_is_not_late(monkeypatch):
    """Thrust that hardly changes has no time at which it acts: its small answers to the motion seem to be late."""
    monkeypatch.setattr(Axes, "pushed", ())
    answer = estimate(
        later(closed_loop.dive(np.random.default_rng(5)), 0.1), FILE, "only", network_tasks.quiet
    )
    assert not [doubt for doubt in answer.doubts if "acts at another time" in doubt.sentence]


@pytest.mark.parametrize("method", rest_in_soak(["likelihood", "pinn"]))
def test_a_lag_20_ms_off_is_doubted_in_yaw_on_a_dive_made_elsewhere_and_its_own_lag_is_not(method):
    """Its own lag is 30 ms, its yaw inertia 16.0 kg m2; 20 ms more take 3.6 % off that, seven standard errors."""
    file, dive = load_vehicle(VEHICLE), read_dive(shared("sealed", "open_1", "dive.tlog.gz"))
    curve = file.vehicle.thrust_curve
    assert curve.lag_s == pytest.approx(0.03)
    slow = replace(file, vehicle=replace(file.vehicle, thrust_curve=replace(curve, lag_s=0.05)))
    fit = estimator(method)
    right, wrong = (fit(dive, vehicle_file, "hovering", network_tasks.quiet) for vehicle_file in (file, slow))
    assert right.outcome is Outcome.CONVERGED
    assert abs(right["I_r"].value - 16.0) < 2 * right["I_r"].std
    assert right["I_r"].std < 0.1
    assert wrong.outcome is Outcome.DISAGREES
    (doubt,) = [doubt for doubt in wrong.doubts if "acts at another time" in doubt.sentence]
    assert doubt.about == ("I_r", "D_r")
    assert "(earlier, by about 19 ms; 12 standard errors)" in doubt.sentence
    assert wrong["I_r"].value / right["I_r"].value == pytest.approx(1 - 0.036, abs=0.005)
    assert wrong["I_r"].low95 < 16.0 < wrong["I_r"].high95
    assert wrong["M_u"].std == pytest.approx(right["M_u"].std, rel=0.02)


def test_a_lateness_that_no_clock_can_have_is_told_as_something_else():
    none = np.zeros(12)
    by_timing, absurd = late_doubts(
        {0: Multiplier(9.0, 0.1, none), 1: Multiplier(-30.0, -8.3, none)}, (0, 1, 5)
    )
    assert by_timing.about == ("M_u", "D_u")
    assert "(later, by about 100 ms; 9 standard errors)" in by_timing.sentence
    assert absurd.about == ("M_v", "D_v")
    assert absurd.sentence.startswith(
        "In sway the motion does not follow from the thrust, and timing does not explain it"
    )
    assert " ms" not in absurd.sentence


def test_an_axis_that_is_off_the_same_way_as_another_is_late_by_what_no_fit_can_size():
    none = np.zeros(12)
    (doubt,) = late_doubts({0: Multiplier(9.0, 0.4, none), 2: Multiplier(30.0, 0.7, none)}, (0, 2))
    assert doubt.about == ("M_u", "M_w", "D_u", "D_w")
    words = "(later, by how much can't be told from this fit; 30 standard errors): masses and dampings there are off, "
    assert words in doubt.sentence


def test_axes_that_are_late_alike_make_all_that_thrust_pushed_doubtful():
    late = {dof: Multiplier(-9.0, -0.15, np.zeros(12)) for dof in (0, 1)}
    (doubt,) = late_doubts(late, (0, 1, 2, 5))
    assert doubt.about == ("M_u", "M_v", "M_w", "I_r", "D_u", "D_v", "D_w", "D_r")
    assert (
        "masses and dampings there and in heave and yaw, where the same clock is likely off, are off by that, and"
        in doubt.sentence
    )
    (doubt,) = late_doubts({0: late[0]}, (0, 1, 2, 5))
    assert doubt.about == ("M_u", "D_u")
    assert "masses and dampings there are off by that, and" in doubt.sentence


def test_a_force_that_is_later_differs_by_its_slope():
    """A ramp of 10 N/s that comes one second later is 10 N less, wherever the ramp was before too."""
    dive = closed_loop.dive(np.random.default_rng(5), 60.0)
    command = dive.tau_cmd
    ramp = np.zeros_like(command.value)
    ramp[:, 0] = 10.0 * command.time_s
    (axis, *_) = build_axes(replace(dive, tau_cmd=Signal(command.time_s, ramp)), FILE, "only").axes
    shape = by_lateness(axis.force, 0.5 * axis.step_s)
    inner = (axis.time_s > axis.time_s[0] + 1.0) & (axis.step_s > 0)
    assert np.mean(shape[inner]) == pytest.approx(-10.0, rel=0.02)


def test_a_dive_without_a_dvl_is_doubted_where_it_turns():
    mission = draw_one(100_002, seconds=40.0, kind="rocking")
    seen = build_axes(mission.dive, mission.file, mission.configuration)
    assert unread_doubts(seen) == ()
    blind = replace(mission.dive, velocity=None)
    (doubt,) = unread_doubts(build_axes(blind, mission.file, mission.configuration))
    assert doubt.about[:3] == ("I_p", "I_q", "I_r")
    assert doubt.sentence.startswith("No velocity was recorded in surge")
    assert doubt.outcome is Outcome.CONVERGED


def test_a_long_gap_of_the_dvl_is_doubted_and_a_short_one_is_not():
    mission = draw_one(100_002, seconds=40.0, kind="rocking")

    def silent(seconds):
        signal = mission.dive.velocity
        value = signal.value.copy()
        value[(signal.time_s > 10.0) & (signal.time_s < 10.0 + seconds)] = np.nan
        dive = replace(mission.dive, velocity=Signal(signal.time_s, value))
        return build_axes(dive, mission.file, mission.configuration)

    assert unread_doubts(silent(3.0)) == ()
    built = silent(20.0)
    (doubt,) = unread_doubts(built)
    assert "of the dive no velocity was read in surge and sway" in doubt.sentence
    assert silent_share(built.axes[0]) == pytest.approx(0.5, abs=0.06)


def test_a_search_that_is_cut_off_is_told(monkeypatch):
    monkeypatch.setattr(likelihood_fit, "PASSES", 1)
    mission = draw_one(100_002, seconds=40.0, kind="rocking")
    answer = estimate(mission.dive, mission.file, mission.configuration, network_tasks.quiet)
    assert answer.outcome is Outcome.AT_BOUND
    assert any(
        "stopped at its bound of 1 passes before it settled" in sentence for sentence in answer.sentences
    )


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
