"""Commands that are no number and readings that can't be: held, cut out or left out, and told."""

from dataclasses import replace

import closed_loop
import numpy as np
import pytest

from bridge.errors import FitError
from bridge.vehicle.config import CONFIGS
from bridge.vehicle.thrusters import thrust_curve
from identify.checks.impossible import without_impossible
from identify.dive import Signal
from identify.estimators.likelihood import estimate
from identify.forces import wrench
from identify.ingest.commands import HELD_S, held_commands, with_known_commands

FILE = closed_loop.vehicle_file()


def quiet(*_told):
    """Nobody listens."""


def by_pulses(seconds=200.0):
    """The closed loop with its thrust as pulse widths of one thruster, and no wrench recorded."""
    whole = closed_loop.dive(np.random.default_rng(100_003), seconds=seconds)
    force = whole.tau_cmd.value[:, :1]
    curve = FILE.vehicle.thrust_curve
    pulses = np.linspace(1100.0, 1900.0, 8001)
    thrust = thrust_curve(curve, CONFIGS / "thrusters").thrust(pulses)
    us = np.interp(force[:, 0], thrust, pulses)
    return replace(whole, tau_cmd=None, pwm=Signal(whole.tau_cmd.time_s, us[:, None]))


def unknown(dive, lacking):
    value = dive.pwm.value.copy()
    value[lacking] = np.nan
    return replace(dive, pwm=Signal(dive.pwm.time_s, value))


def test_a_few_commands_that_are_no_number_leave_the_mass_right_and_are_told():
    dive = by_pulses()
    spoilt = unknown(dive, np.random.default_rng(4).random(len(dive.pwm)) < 0.02)
    found = with_known_commands(spoilt)
    assert np.isfinite(found.pwm.value).all()
    assert found.duration_s == spoilt.duration_s
    (note,) = found.notes
    assert "are no number in output 1: the command before holds for up to 0.5 s" in note
    mass = estimate(found, FILE, "only", quiet)["M_u"]
    assert mass.value == pytest.approx(closed_loop.MASS, rel=0.05)


def test_an_unknown_stretch_without_tau_cmd_leaves_the_longest_known_part():
    dive = by_pulses()
    time_s = dive.pwm.time_s
    found = with_known_commands(unknown(dive, (time_s > 79.95) & (time_s < 85.0)))
    assert np.isfinite(found.pwm.value).all()
    assert found.span_s[0] == pytest.approx(85.0)
    assert found.notes[-1].startswith(
        "Before its first number, or for more than 0.5 s, the command in output 1 is unknown, and no TAU_CMD is "
    )
    assert "only the longest part in which all are known is used, 115 s of 200 s" in found.notes[-1]


def test_commands_unknown_at_the_beginning_alone_are_cut_off_and_the_rest_is_known():
    dive = by_pulses()
    found = with_known_commands(unknown(dive, dive.pwm.time_s < dive.pwm.time_s[2]))
    assert np.isfinite(found.pwm.value).all()
    assert len(found.pwm) == len(dive.pwm) - 2
    assert "is used, 199.70 s of 199.90 s" in found.notes[-1]
    assert wrench(found, FILE, "only").notes == ()


def test_an_output_that_is_no_number_all_the_dive_is_named_and_nothing_is_cut():
    dive = by_pulses()
    never = unknown(dive, np.ones(len(dive.pwm), bool))
    found = with_known_commands(never)
    assert found.notes == (
        "Output 1 is no number all the dive: what was asked of a thruster there is unknown.",
    )
    assert found.duration_s == never.duration_s
    with pytest.raises(
        FitError, match="tell no wrench, as output 1 is no number all the dive; check what sends"
    ):
        wrench(found, FILE, "only")
    tau = Signal(dive.pwm.time_s, np.zeros((len(dive.pwm), 6)))
    assert wrench(replace(found, tau_cmd=tau), FILE, "only").asked == pytest.approx(0.0)


def test_one_command_that_is_no_number_is_told_as_one():
    dive = by_pulses()
    (note,) = with_known_commands(unknown(dive, [7])).notes
    assert note.startswith("1 thruster command (0.1 %) is no number in output 1: ")


def test_outputs_that_drive_no_thruster_may_be_unknown():
    dive = by_pulses()
    light = np.column_stack([dive.pwm.value, np.full(len(dive.pwm), np.nan)])
    recorded = replace(dive, pwm=Signal(dive.pwm.time_s, light))
    assert with_known_commands(recorded, 1) is recorded


def test_a_command_holds_for_so_long_and_no_longer():
    time_s = np.array([0.0, 0.2, HELD_S, 1.0, 1.4, 2.0])
    value = np.array([1600.0, np.nan, 1700.0, 1650.0, np.nan, 1550.0])
    held = held_commands(Signal(time_s, value[:, None])).value[:, 0]
    assert held == pytest.approx([1600.0, 1600.0, 1700.0, 1650.0, np.nan, 1550.0], nan_ok=True)


@pytest.mark.parametrize("wild", [1e30, -25.0, np.inf])
def test_one_reading_that_no_vehicle_can_have_made_is_left_out_and_told(wild):
    dive = closed_loop.dive(np.random.default_rng(100_003), seconds=100.0)
    value = dive.velocity.value.copy()
    value[500, 0] = wild
    found = without_impossible(replace(dive, velocity=Signal(dive.velocity.time_s, value)))
    assert len(found.velocity) == len(dive.velocity) - 1
    (note,) = found.notes
    assert note.startswith(
        "1 reading of the velocity (0.1 %) is beyond 20 m/s, which no vehicle reaches: it is left out"
    )
    assert estimate(found, FILE, "only", quiet)["M_u"].value == pytest.approx(closed_loop.MASS, rel=0.1)


def test_one_wild_reading_of_very_many_is_no_zero_percent():
    value = np.zeros((5000, 3))
    value[[7, 9], 1] = 1e30
    dive = closed_loop.dive(np.random.default_rng(100_003), seconds=30.0)
    found = without_impossible(replace(dive, velocity=Signal(np.arange(5000.0), value)))
    (note,) = found.notes
    assert note.startswith(
        "2 readings of the velocity (less than 0.1 %) are beyond 20 m/s, which no vehicle reaches: they"
    )


def test_an_output_that_says_that_it_is_none_is_unknown():
    dive = by_pulses()
    value = dive.pwm.value.copy()
    value[3] = 65535.0
    assert np.isnan(without_impossible(replace(dive, pwm=Signal(dive.pwm.time_s, value))).pwm.value[3, 0])


def test_an_honest_dive_is_left_as_it_is():
    dive = by_pulses()
    assert with_known_commands(without_impossible(dive)) is dive


@pytest.mark.parametrize("name", ["ff_mode", "veh_cfg"])
def test_a_mode_or_configuration_that_is_no_whole_number_is_left_out_and_told(name):
    said = Signal(np.arange(5.0), np.array([[np.nan], [1.0], [np.inf], [0.5], [2.0]]))
    dive = replace(closed_loop.dive(np.random.default_rng(1), seconds=10.0), **{name: said})
    found = without_impossible(dive)
    assert found.signals()[name].value[:, 0].tolist() == [1.0, 2.0]
    assert found.signals()[name].time_s.tolist() == [1.0, 4.0]
    assert found.notes[-1] == (
        f"{name.upper()} is no whole number in 60.0 % of what tells it: left out, as not said."
    )
    never = replace(dive, **{name: Signal(np.zeros(1), np.full((1, 1), np.nan))})
    assert name not in without_impossible(never).signals()
