"""Heave is doubted where its controller's depth was not recorded, and where depth and velocity differ in time."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import fitted
import numpy as np
import pytest
from fakes.planted import quiet

from bench.missions.mission import draw_one
from bridge.vehicle.config import Water
from identify.checks.actuation.controller import depthless_doubts
from identify.checks.sensors.descent_timing import descent_timing_doubts, late_s, with_depth_of_the_dvl
from identify.dive import Dive, Run, Signal
from identify.doubt import Outcome
from identify.estimators.answer import answered
from identify.estimators.likelihood.answer import estimate

BARE = {"depth": None, "pressure": None, "nu_fb": None, "tau_pid": None, "nu_ref": None}


@cache
def mission():
    return draw_one(100_361, seconds=60.0, kind="depth steps")


def fit_of(*names):
    fit = fitted.fit(dict.fromkeys(names, 100.0), 1e-4 * np.eye(len(names)))
    return replace(fit, configuration=mission().configuration)


def doubts(dive, *names):
    valued = {*(names or ("M_u", "M_w", "D_w"))}
    return depthless_doubts(dive, mission().file, mission().configuration, valued)


def bare(**keys):
    return replace(mission().dive, **{**BARE, **keys})


def test_heave_is_doubted_where_neither_depth_nor_what_the_controller_used_is_recorded():
    (doubt,) = doubts(bare())
    assert doubt.about == ("M_w", "D_w")
    assert doubt.outcome is Outcome.DISAGREES
    assert doubt.sentence.startswith(
        "Depth is not recorded, nor are NU_FB, TAU_PID and NU_REF: a vehicle that holds its depth thrusts by a "
        "reading that the recording lacks, which a fit of heave takes for mass, so M_w and D_w may be off"
    )
    (doubt,) = doubts(bare(nu_fb=mission().dive.nu_fb, tau_pid=mission().dive.tau_pid), "M_w")
    assert doubt.about == ("M_w",)
    assert doubt.sentence.startswith("Depth is not recorded, nor is NU_REF: ")


@pytest.mark.parametrize("seed", range(100_362, 100_366))
def test_an_honest_dive_is_not_doubted(seed):
    dived = draw_one(seed, seconds=30.0)
    assert depthless_doubts(dived.dive, dived.file, dived.configuration, {"M_w", "D_w"}) == ()


def test_a_recorded_depth_pressure_or_wrench_of_the_controller_is_enough():
    whole = mission().dive
    pressure = Signal(whole.depth.time_s, 1e5 + 1e4 * whole.depth.value)
    assert doubts(bare(depth=whole.depth)) == ()
    assert doubts(bare(pressure=pressure)) == ()
    assert doubts(replace(whole, depth=None, pressure=None)) == ()


def test_a_controller_that_was_off_in_heave_used_nothing():
    off = Signal(mission().dive.tau_pid.time_s, np.zeros((len(mission().dive.tau_pid), 6)))
    assert doubts(bare(tau_pid=off)) == ()


def test_thrust_in_a_few_steps_is_no_controllers():
    pwm = mission().dive.pwm
    steps = pwm.value[(np.arange(len(pwm)) // 100) * 100]
    assert doubts(bare(pwm=Signal(pwm.time_s, steps), tau_cmd=None)) == ()


def test_heave_that_was_not_found_or_not_pushed_is_none_to_doubt():
    assert doubts(bare(), "M_u") == ()
    assert doubts(bare(pwm=None, tau_cmd=None)) == ()
    assert doubts(Dive("d", bare().source, "0" * 64), "M_w") == ()


def test_the_answer_of_any_method_ends_in_the_doubt():
    answer = answered(fit_of("M_w", "D_w"), bare(), mission().file)
    assert answer.outcome is Outcome.DISAGREES
    assert any(sentence.startswith("Depth is not recorded") for sentence in answer.sentences)


WATER = Water()
T = np.arange(0.0, 120.0, 0.02)
PACES = np.array([0.3, 0.7, 1.1, 1.6, 2.3])
W = 0.05 * np.sin(np.outer(T, PACES) + PACES).sum(axis=1)
DEPTH = 5.0 - 0.05 * ((np.cos(np.outer(T, PACES) + PACES) - np.cos(PACES)) / PACES).sum(axis=1)
VELOCITY = np.column_stack([0.4 + 0.3 * np.sin(0.5 * T), 0.15 * np.sin(0.9 * T), W])
"""A level vehicle that rises and sinks at several paces."""


def dive(velocity_late_s=0.0, noise=0.0):
    """Readings at 5 and 10 Hz, with noise in m/s and m."""
    rng = np.random.default_rng(7)
    fifth, tenth = slice(0, None, 10), slice(0, None, 5)
    velocity = VELOCITY[fifth] + noise * rng.standard_normal((len(T[fifth]), 3))
    depth = DEPTH[tenth, None] + noise * rng.standard_normal((len(T[tenth]), 1))
    return Dive(
        "sinking",
        Path("sinking.tlog"),
        "0" * 64,
        velocity=Signal(T[fifth] + velocity_late_s, velocity),
        depth=Signal(T[tenth], depth),
        attitude=Signal(T, np.tile([1.0, 0.0, 0.0, 0.0], (len(T), 1))),
    )


@pytest.mark.parametrize("late", [0.25, -0.4])
def test_the_delay_between_velocity_and_depth_is_found_and_doubts_heave(late):
    assert late_s(dive(late, noise=2e-3), WATER) == pytest.approx(late, abs=0.051)
    (doubt,) = descent_timing_doubts(dive(late, noise=2e-3), WATER)
    assert doubt.about == ("M_w", "D_w")
    assert doubt.outcome is Outcome.DISAGREES
    first = "The DVL's velocity is stamped some" if late > 0 else "The depth is stamped some"
    assert doubt.problem.startswith(first)


@pytest.mark.parametrize(("late", "noise"), [(0.0, 2e-3), (0.05, 2e-3), (0.3, 0.5)])
def test_healthy_stamps_and_what_noise_hides_raise_no_doubt(late, noise):
    assert descent_timing_doubts(dive(late, noise), WATER) == ()


def test_without_a_depth_or_an_attitude_and_of_an_autopilots_own_filter_nothing_is_told():
    assert late_s(replace(dive(0.3), velocity_is_filtered=True), WATER) == 0.0
    assert late_s(replace(dive(0.3), depth=None), WATER) == 0.0
    assert late_s(replace(dive(0.3), attitude=None), WATER) == 0.0


def test_a_depth_of_another_clock_is_taken_by_the_dvls_within_each_run():
    runs = tuple(
        Run(name, Path(name), "", start_s, start_s + 60.0) for name, start_s in (("a", 0.0), ("b", 60.0))
    )
    late = replace(dive(0.25), runs=runs)
    moved = with_depth_of_the_dvl(late, WATER)
    assert late_s(moved, WATER) == 0.0
    by = late_s(late, WATER)
    assert by == pytest.approx(0.25, abs=0.03)
    shifted = late.depth.time_s + by
    stays = ((late.depth.time_s <= 60.0) == (shifted <= 60.0)) & (shifted <= late.span_s[1])
    assert moved.depth.time_s == pytest.approx(shifted[stays], abs=1e-9)
    healthy = dive(noise=2e-3)
    assert with_depth_of_the_dvl(healthy, WATER) is healthy


def test_heave_is_right_where_the_dvl_is_stamped_late_and_the_thrusts_delay_tells_by_how_much():
    mission = draw_one(100_203, seconds=120.0, kind="depth steps")
    velocity = mission.dive.velocity
    late = replace(mission.dive, velocity=Signal(velocity.time_s + 0.3, velocity.value))
    answer = estimate(late, mission.file, mission.configuration, quiet)
    for name in ("M_w", "D_w"):
        assert answer[name].low95 < mission.truth[name] < answer[name].high95, name
    assert answer.thrust_delay.delay_s == pytest.approx(0.3, abs=0.05)
