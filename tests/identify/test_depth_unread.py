"""Heave is doubted where its controller may have used a depth that the recording lacks, and nothing can tell."""

from dataclasses import replace
from functools import cache

import fitted
import numpy as np
import pytest

from bench.missions.mission import draw_one
from identify.checks.actuation.controller import depthless_doubts
from identify.dive import Dive, Signal
from identify.doubt import Outcome
from identify.estimators.answer import answered

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
