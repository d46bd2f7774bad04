"""A file of another vehicle, a sensor that is mounted another way round, a sensor that stands still: each is told."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fakes.planted import diagnosed, planted_nominal

from bridge.vehicle.config import VehicleFile
from identify.challenge.case import dive_of, draw_case
from identify.checks.actuation.thrust_response import mounting_hints
from identify.diagnose.cleaned import without_spikes, without_still_velocity
from identify.diagnose.notes import idle_note, mass_hints
from identify.dive import Dive, Signal
from identify.effects.hydrodynamics import QUADRATIC_DRAG


@pytest.fixture(scope="module")
def case():
    return draw_case(3_860_000_011, names=[], seconds=110.0)


@pytest.fixture(scope="module")
def nominal(case):
    return planted_nominal(case)


def of_mass(file: VehicleFile, name: str, mass_kg: float):
    return replace(file.vehicle.configurations[name], dry_mass_kg=mass_kg)


@pytest.mark.parametrize(
    ("mass_kg", "said"), [(200.0, "below the vehicle file's dry mass of 200 kg"), (3.0, "at more than")]
)
def test_masses_that_no_such_vehicle_has_hint_at_the_file_of_another(case, nominal, mass_kg, said):
    (hint,) = mass_hints(nominal, [0.02] * 6, of_mass(case.file, case.configuration, mass_kg))
    assert said in hint
    assert "M_v" in hint
    assert "the file may be of another vehicle" in hint
    assert mass_hints(nominal, [2.0] * 6, of_mass(case.file, case.configuration, mass_kg)) == ()


def test_the_file_of_the_vehicle_itself_gives_no_hint(case, nominal):
    shape = case.file.vehicle.configurations[case.configuration]
    assert mass_hints(nominal, [0.02] * 6, shape) == ()
    assert nominal.mirrored == nominal.swapped == ()


def test_a_dive_in_which_the_thrusters_mostly_rested_says_how_long_they_pushed(nominal):
    asked_n = np.zeros_like(nominal.course.asked_n)
    step_s, pushed = nominal.course.step_s, len(asked_n) // 5
    asked_n[:pushed, 0] = 5.0
    (note,) = idle_note(replace(nominal.course, asked_n=asked_n))
    assert f"pushed for {step_s * pushed:.0f} s of {step_s * len(asked_n):.0f} s alone" in note
    asked_n[: 2 * pushed, 1] = -5.0
    assert idle_note(replace(nominal.course, asked_n=asked_n)) == ()


@pytest.mark.parametrize(
    ("signs", "order", "said"),
    [
        ((1, -1, 1), [0, 1, 2], "In sway the recorded velocity runs against the thrust: the mounting of the DVL"),
        ((1, 1, 1), [1, 0, 2], "The recorded velocity in surge goes with the thrust in sway, and that in sway with"),
    ],
    ids=["of the wrong sign", "swapped"],
)  # fmt: skip
def test_a_velocity_in_other_axes_hints_at_how_the_dvl_is_mounted(case, signs, order, said):
    dive = dive_of(case)
    turned = planted_nominal(case, with_velocity(dive, (dive.velocity.value * signs)[:, order]))
    assert mounting_hints(turned.mirrored, turned.swapped)[0].startswith(said)


def test_spikes_are_left_out_and_told_beside_the_verdict(case):
    dive = dive_of(case)
    value = dive.velocity.value.copy()
    read = np.flatnonzero(np.isfinite(value[:, 0]))[20::40]
    value[read, 0] += 1.0
    sound, (spikes,) = without_spikes(with_velocity(dive, value))
    assert np.isnan(sound.velocity.value[read, 0]).all()
    assert np.isnan(sound.velocity.value).sum() == np.isnan(value).sum() + len(read)
    assert (spikes.dof, spikes.count) == (0, len(read))
    assert spikes.share == pytest.approx(1 / 40, rel=0.1)
    diagnosis = diagnosed(case, QUADRATIC_DRAG, dive=with_velocity(dive, value))
    assert diagnosis.verdict == "no_gap"
    (proviso,) = diagnosis.provisos
    assert f"these spikes were left out: {len(read)} in surge (2.5 %)" in proviso


def test_a_sound_velocity_has_no_spikes_and_an_autopilot_s_own_is_not_looked_at(case):
    dive = dive_of(case)
    assert without_spikes(dive) == (dive, ())
    stop = np.where(np.arange(200) < 96, 0.6, 0.0)[:, None] * np.ones(3)
    assert without_spikes(Dive("stop", Path("stop"), "", Signal(np.arange(200) / 8.0, stop)))[1] == ()
    value = dive.velocity.value.copy()
    value[100::50] += 1.0
    spiky = with_velocity(replace(dive, velocity_is_filtered=True), value)
    assert without_spikes(spiky) == (spiky, ())


def test_each_reading_that_the_filters_leave_out_costs_as_much_as_one_at_six_standard_deviations(case):
    dive = dive_of(case)
    at = np.flatnonzero(np.isfinite(dive.velocity.value[:, 0]))[50::50]

    def fit(surge):
        value = dive.velocity.value.copy()
        value[at, 0] = surge
        return planted_nominal(case, with_velocity(dive, value))

    without = fit(np.nan)
    surge, of_surge = without.joint.at(without.theta)[0], without.joint.slices[0]
    _, variance = surge.filtered(without.theta[of_surge], np.inf)
    each = 0.5 * (6.0**2 + np.log(np.nanmedian(variance)))
    cost = without.log_posterior - fit(3.0).log_posterior
    assert cost == pytest.approx(each * len(at), rel=0.1)


def test_an_axis_that_settles_too_quickly_for_the_recorded_commands_is_left_out_and_named(
    case, nominal, monkeypatch
):
    settles_s = nominal.course.mass / nominal.course.damping
    fitted = sorted((problem.axis.dof for problem in nominal.joint.problems), key=lambda dof: settles_s[dof])
    between_s = float(np.sqrt(settles_s[fitted[0]] * settles_s[fitted[1]]))
    monkeypatch.setattr("identify.diagnose.filters.judged_axes.QUICKEST_S", between_s)
    without = planted_nominal(case)
    assert {problem.axis.dof for problem in without.joint.problems} == {*fitted[1:]}
    assert "too quickly to be told from recorded commands" in without.built.missing[fitted[0]]


def test_a_velocity_that_stood_still_for_most_of_a_dive_is_left_out_and_for_less_is_not(case):
    dive = dive_of(case)
    start, end = dive.span_s
    half = 0.5 * (end - start)
    still = replace(dive, frozen={"velocity": ((start, start + 1.02 * half),)})
    without, (sentence,) = without_still_velocity(still)
    assert without.velocity is None
    assert "check the DVL" in sentence
    briefly = replace(dive, frozen={"velocity": ((start, start + 0.98 * half),)})
    assert without_still_velocity(briefly) == (briefly, ())


def with_velocity(dive, value):
    return replace(dive, velocity=Signal(dive.velocity.time_s, value))
