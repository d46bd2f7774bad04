"""A mass whose own axis was steered by an unrecorded reading is what the other axes' Coriolis forces say of it."""

from dataclasses import replace
from functools import cache

import closed_loop
import numpy as np
from fakes.planted import quiet

from bench.missions.mission import draw_one
from identify.dive import Signal
from identify.doubt import Outcome
from identify.estimators.axes.build import build_axes
from identify.estimators.likelihood.answer import estimate
from identify.estimators.likelihood.fit import fit_axes
from identify.estimators.table import estimator
from identify.estimators.timing.autopilot_velocity import lasting_axes

HEAVE = 2


@cache
def mission(seed=100111, **keys):
    return draw_one(seed, **keys)


def without_depth(dived):
    """The dive of a controller that held a depth which its recording lacks."""
    return replace(dived.dive, depth=None)


@cache
def found_without_depth():
    dived = mission()
    return estimator("likelihood")(without_depth(dived), dived.file, dived.configuration, quiet)


def test_the_other_axes_tell_the_mass_whose_own_controller_used_an_unrecorded_depth():
    answer = found_without_depth()
    assert answer.weighed_by_others == ("M_w",)
    assert answer["M_w"].identifiable
    assert answer["M_w"].relative_std < 0.05
    assert abs(answer["M_w"].value - mission().truth["M_w"]) < 3 * answer["M_w"].std


def test_a_mass_told_by_the_others_is_a_warning_and_no_disagreement():
    answer = found_without_depth()
    assert answer.outcome is Outcome.CONVERGED
    (doubt,) = [doubt for doubt in answer.doubts if doubt.about == ("M_w",)]
    assert doubt.sentence.startswith("In heave ")
    assert (
        "so M_w is taken from the other axes' Coriolis forces alone, and the true D_w may lie below its value"
        in doubt.sentence
    )


def test_a_velocity_that_the_recording_lacks_leaves_the_mass_to_the_others_too():
    dived = mission(100106)
    fed = dived.dive.nu_fb.value.copy()
    fed[:, 0] += 0.02 * np.random.default_rng(100_107).normal(size=len(fed))
    other = replace(dived.dive, nu_fb=Signal(dived.dive.nu_fb.time_s, fed))
    answer = estimate(other, dived.file, dived.configuration, quiet)
    assert answer.weighed_by_others == ("M_u",)
    assert abs(answer["M_u"].value - dived.truth["M_u"]) < 3 * answer["M_u"].std
    bare = estimate(dived.dive, dived.file, dived.configuration, quiet)
    assert bare.weighed_by_others == ()
    assert answer["M_u"].std > bare["M_u"].std


def autopilots_log(dived):
    """The dive as a stock autopilot logs it: velocities of its own filter, and no word of its controller."""
    unsaid = {"depth": None, "nu_fb": None, "tau_pid": None, "nu_ref": None, "tau_cmd": None}
    return replace(dived.dive, **unsaid, velocity_is_filtered=True)


def test_the_mass_in_heave_of_an_autopilots_log_is_what_the_other_axes_say_for_it_holds_a_depth_unseen():
    dived = mission()
    log = autopilots_log(dived)
    answer = estimate(log, dived.file, dived.configuration, quiet)
    assert answer.weighed_by_others == ("M_w",)
    assert abs(answer["M_w"].value - dived.truth["M_w"]) < 3 * answer["M_w"].std
    built = lasting_axes(log, dived.file, dived.configuration)
    heave = replace(built, axes=tuple(axis for axis in built.axes if axis.dof == HEAVE))
    by_its_own = fit_axes(heave, dived.file.vehicle.configurations[dived.configuration], lambda *_: None)
    assert np.exp(by_its_own.log_value[HEAVE]) > 4 / 3 * dived.truth["M_w"]


def test_an_axis_that_is_alone_has_no_mass_then_and_is_advised_what_to_record():
    dive = closed_loop.dive(np.random.default_rng(100_001), seconds=120.0, hidden_noise=0.02)
    answer = estimator("likelihood")(dive, closed_loop.vehicle_file(), "only", quiet)
    assert not answer["M_u"].identifiable
    assert not answer["X_udot"].identifiable
    assert answer["D_u"].identifiable
    assert answer["M_u"].reason.startswith("in surge ")
    assert "of the controller's wrench (TAU_PID) follows from nothing recorded" in answer["M_u"].reason
    assert any(
        "which say too little of it, and the true D_u may lie below its value; record" in sentence
        for sentence in answer.sentences
    )
    assert not any("surge mass" in direction.sentence for direction in answer.null_directions)


def test_thrust_in_a_doubted_axis_moves_its_own_mass_alone():
    """Half as much thrust again makes its own equation half as heavy again; the other axes hear nothing of it."""
    dived = mission()
    shape = dived.drawn.configuration
    built = build_axes(without_depth(dived), dived.file, dived.configuration)
    pushed = replace(
        built,
        axes=tuple(replace(a, force=1.5 * a.force) if a.dof == HEAVE else a for a in built.axes),
    )
    plain, other = (fit_axes(axes, shape, quiet, (HEAVE,)) for axes in (built, pushed))
    std = np.sqrt(np.diag(plain.covariance))
    for dof in (0, 1, 2, 5):
        assert abs(other.log_value[dof] - plain.log_value[dof]) < 0.25 * std[dof]
    pooled = fit_axes(pushed, shape, quiet)
    assert abs(pooled.log_value[HEAVE] - plain.log_value[HEAVE]) > 0.5 * std[HEAVE]
