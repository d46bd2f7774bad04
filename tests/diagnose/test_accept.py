"""What a crew accepts: coefficients for the feed-forward, effects for models, and what can't be made up for."""

from dataclasses import replace

import numpy as np
import pytest

from bridge.vehicle.coefficients import BY_NAME
from identify.challenge.case import dive_of, draw_case
from identify.checks.controller import unrecorded
from identify.diagnose.accepted import accepted_of
from identify.diagnose.candidates import Cause
from identify.diagnose.diagnose import diagnose
from identify.diagnose.result import Finding, Value
from identify.effects import (
    actuators,
    environment,
    hydrodynamics,
    rigid_body,
    sensors,
    supply,
)


def found(effect, *values, width=0.01, also=()):
    """A cause with intervals of a hundredth either way, or wider."""
    cause = Cause(effect, np.array(values, dtype=float))
    told = {
        name: Value(value, unit, value - width * abs(value), value + width * abs(value))
        for name, (value, unit) in effect.told(cause.values).items()
        if name != "thruster"
    }
    return Finding(cause, also, {}, 0.99, told, 50.0)


def of_effects(accepted):
    return {name: one.value for name, one in accepted.values.items() if name not in BY_NAME}


def test_without_causes_the_linear_model_alone_is_accepted(nominal, shape):
    accepted = accepted_of((), nominal, shape)
    fitted = {problem.axis.dof for problem in nominal.joint.problems}
    assert {BY_NAME[name].dof for name in accepted.values} <= fitted
    assert accepted.values["M_u"].value == nominal.course.mass[0]
    assert accepted.values["D_u"].low95 < nominal.course.damping[0] < accepted.values["D_u"].high95
    assert (of_effects(accepted), accepted.effects) == ({}, ())


@pytest.mark.parametrize(
    ("effect", "values", "wanted"),
    [
        (hydrodynamics.QUADRATIC_DRAG, (12.0, 0, 0, 0, 0, 3.0), {"X_uu": 12.0, "N_rr": 3.0}),
        (hydrodynamics.COUPLED_DAMPING, (2.0, -1.5), {"Y_r": 2.0, "N_v": -1.5}),
        (hydrodynamics.CROSS_FLOW_LIFT, (5.0, 4.0), {"Y_uv": 5.0, "N_uv": 4.0}),
        (actuators.REVERSE_THRUST_LOSS, (0.7,), {"T_astern": 0.7}),
        (actuators.DEAD_ZONE, (0.6,), {"T_least": 0.6}),
        (actuators.DEAD_ZONE_SHIFTED, (0.6,), {"T_start": 0.6}),
        (supply.LOAD_SAG, (0.05,), {"T_ohm": 0.05}),
        (actuators.weak(2), (0.75,), {"T2_gain": 0.75}),
    ],
    ids=lambda given: getattr(given, "label", ""),
)
def test_each_effect_has_its_own_parameters_on_board(nominal, shape, effect, values, wanted):
    accepted = accepted_of((found(effect, *values),), nominal, shape)
    assert of_effects(accepted) == pytest.approx(wanted)
    assert accepted.sentences == ()
    (kept,) = accepted.effects
    assert (kept.name, kept.label, kept.number) == (effect.name, effect.label, effect.number)
    assert list(kept.parameters.values()) == pytest.approx(list(values))


def test_a_munk_moment_and_a_centre_of_mass_become_moments_of_this_vehicles_masses(nominal, shape):
    causes = (found(hydrodynamics.MUNK_MOMENT_IN_YAW, 1.3), found(rigid_body.CG_OFFSET, 0.02, -0.01))
    told = of_effects(accepted_of(causes, nominal, shape))
    m_u, m_v = nominal.course.mass[:2]
    assert told["N_munk"] == pytest.approx(0.3 * (m_v - m_u))
    assert (told["S_x"], told["S_y"]) == pytest.approx((0.02 * shape.dry_mass_kg, -0.01 * shape.dry_mass_kg))


def test_a_sag_becomes_the_law_of_the_voltage_that_was_measured(nominal, shape):
    course = nominal.course
    falling = replace(nominal, course=replace(course, voltage_v=16.0 - 0.01 * course.since_s))
    begun_v, rate = supply.voltage_law(falling.course.voltage_v, course.since_s)
    told = of_effects(accepted_of((found(supply.BATTERY_SAG_BY_VOLTAGE, 0.8 * rate),), falling, shape))
    assert told == pytest.approx({"T_volt": begun_v, "T_vshare": 0.8})


@pytest.mark.parametrize(
    ("effect", "size"), [(rigid_body.ENTRAINED_WATER, 3.0), (actuators.THRUST_GAIN, 0.9)]
)
def test_what_a_refit_takes_up_is_sent_once_in_the_masses_and_dampings(nominal, shape, effect, size):
    accepted = accepted_of((found(effect, size),), nominal, shape)
    assert accepted.values == accepted_of((), nominal, shape).values
    assert "is in the masses and dampings of this dive" in accepted.sentences[-1]


@pytest.mark.parametrize(
    ("effect", "values", "words"),
    [
        (sensors.DVL_MISALIGNMENT, (0.05,), "DVL misalignment lies in what is read"),
        (environment.STEADY_CURRENT, (0.05, 0.1), "Steady current is the water's"),
        (actuators.SATURATION, (15.0,), "Saturation is in the model, but the feed-forward can't make up for it"),
        (supply.BATTERY_SAG, (2e-4,), "Battery sag is in the model, but the feed-forward can't"),
        (hydrodynamics.MUNK_MOMENT, (1.3,), "the feed-forward makes up for it in yaw"),
        (hydrodynamics.QUADRATIC_DRAG, (9.0, 0, 20.0, 0, 0, 0), "Z_ww: there is no feed-forward in heave"),
        (actuators.weak(1), (0.1,), "T1_gain 0.1 out of bounds: it is not sent"),
    ],
    ids=lambda given: getattr(given, "label", ""),
)  # fmt: skip
def test_what_the_feed_forward_can_not_make_up_for_is_told_and_still_in_the_model(
    nominal, shape, effect, values, words
):
    accepted = accepted_of((found(effect, *values),), nominal, shape)
    assert words in " ".join(accepted.sentences)
    assert [one.name for one in accepted.effects] == [effect.name]


def test_a_cause_that_the_dive_can_not_tell_from_another_is_accepted_with_a_word_about_it(nominal, shape):
    one = found(hydrodynamics.QUADRATIC_DRAG, 9.0, 0, 0, 0, 0, 0, also=("inflow_loss",))
    (sentence,) = accepted_of((one,), nominal, shape).sentences
    assert sentence.endswith("though this dive can't tell it from inflow loss.")


def test_a_parameter_that_may_as_well_be_none_is_neither_sent_nor_in_the_model(nominal, shape):
    one = found(hydrodynamics.QUADRATIC_DRAG, 9.0, 0, 0, 7.0, 0, 0)
    vague = replace(one, parameters=one.parameters | {"K_pp": Value(7.0, "N m s2/rad2", -1.0, 15.0)})
    accepted = accepted_of((vague,), nominal, shape)
    assert of_effects(accepted) == {"X_uu": 9.0}
    assert accepted.effects[0].parameters["K_pp"] == 0.0
    assert accepted.sentences == ()


def test_an_axis_that_the_dive_hardly_moves_keeps_what_the_vehicle_has(nominal, shape, monkeypatch):
    monkeypatch.setattr("identify.diagnose.accepted.LEAST_KNOWN", 0.0)
    accepted = accepted_of((), nominal, shape)
    assert accepted.values == {}
    assert "M_u and D_u stay as the vehicle has them: this dive hardly tells them." in accepted.sentences


def test_a_parameter_that_was_not_told_is_not_written_into_the_model(nominal, shape):
    one = found(hydrodynamics.QUADRATIC_DRAG, 30, 40, 50, 3000, 2, 3)
    one = replace(one, parameters={name: v for name, v in one.parameters.items() if name != "K_pp"})
    (effect,) = accepted_of((one,), nominal, shape).effects
    assert (effect.parameters["X_uu"], effect.parameters["K_pp"]) == (30.0, 0.0)


def test_axes_whose_controller_used_what_was_not_recorded_stay_as_the_vehicle_has_them(nominal, shape):
    heard = replace(nominal, doubted=(0, 5))
    accepted = accepted_of((), heard, shape)
    assert not {"M_u", "D_u", "I_r", "D_r"} & set(accepted.values)
    assert "M_v" in accepted.values
    (told,) = accepted.sentences
    assert told.startswith(
        "M_u, D_u, I_r and D_r stay as the vehicle has them: in surge and yaw the controller used"
    )


def test_a_dive_whose_feedback_log_is_wrong_gives_no_masses_to_the_vehicle():
    case = draw_case(3_850_000_002, names=["wrong_feedback_log"], size=0.7, seconds=120.0)
    found = diagnose(
        dive_of(case),
        case.file,
        case.configuration,
        effects=(hydrodynamics.QUADRATIC_DRAG,),
        progress=lambda *_report: None,
    )
    assert [one.name for one in found.findings] == ["wrong_feedback_log"]
    doubted = {one.dof for one in unrecorded(dive_of(case), case.file.vehicle.water)}
    assert doubted >= {0, 1}
    assert not {BY_NAME[name].dof for name in found.accepted.values if name in BY_NAME} & doubted
