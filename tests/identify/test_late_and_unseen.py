"""What is doubted beside a missing drag: thrust at another time, speeds that nobody read, a search cut off."""

from dataclasses import replace

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
from identify.estimators.likelihood import fit as likelihood_fit
from identify.estimators.likelihood.answer import estimate
from identify.estimators.missing_forces.drag_and_timing import Multiplier
from identify.estimators.table import estimator
from identify.estimators.timing.lateness import by_lateness
from identify.ingest.open import read_dive

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
