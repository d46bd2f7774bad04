"""Every axis over the whole mission: exact figures of a drawn dive, and go or no-go on what moves unasked."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from test_raising import FILE, failed, flown, judged, under

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.forecast import Credit
from bridge.vehicle.mode import Mode
from identify.dive import Dive, Signal
from identify.thrust.given_thrust import Given
from identify.validation.against_forecast import MadeUp, sea_of
from identify.validation.raising import MOST_UNASKED, go_no_go
from identify.validation.tracking import tracking_errors, whole_errors

RATE_HZ = 20.0
STILL: Mapping[int, float] = MappingProxyType({})


def held(errors, rest=STILL, seconds=200.0):
    """Surge is asked for from 50 s to 130 s and followed exactly; each axis errs by a constant while it is, and by
    another constant before and after."""
    time_s = np.arange(0.0, seconds, 1 / RATE_HZ)
    moves = (time_s >= 50.0) & (time_s < 130.0)
    reference, nu = np.zeros((len(time_s), 14)), np.zeros((len(time_s), 6))
    reference[moves, 0] = nu[moves, 0] = 0.4
    under_way = (time_s >= 50.0) & (time_s <= 135.0)
    for dof in range(6):
        nu[:, dof] += np.where(under_way, errors.get(dof, 0.0), rest.get(dof, 0.0))
    return Dive(
        "d",
        Path("d.tlog"),
        "0",
        velocity=Signal(time_s, nu[:, :3]),
        gyro=Signal(time_s, nu[:, 3:]),
        nu_ref=Signal(time_s, reference),
    )


def of(dive):
    return {error.axis: error for error in whole_errors(dive)}


def test_every_axis_is_measured_all_the_time_and_also_where_it_is_not_asked_to_move():
    given = {0: 0.010, 1: -0.050, 2: 0.020, 3: 0.002, 4: 0.003, 5: math.radians(2.3)}
    by_axis = of(held(given, rest={1: 0.004}))
    assert list(by_axis) == list(DOFS)
    for dof, axis in enumerate(DOFS):
        # The filter rounds the two corners of each step.
        assert by_axis[axis].rms == pytest.approx(abs(given[dof]), rel=0.02)
        assert by_axis[axis].noise == pytest.approx(0.0, abs=1e-3)
    assert by_axis["sway"].unasked == pytest.approx(0.050, rel=0.02)
    assert by_axis["sway"].rest == pytest.approx(0.004, rel=0.15)
    assert by_axis["surge"].asked == pytest.approx(0.4 * math.sqrt(80 / 85), rel=1e-3)
    assert math.isnan(by_axis["surge"].unasked)
    assert (by_axis["surge"].unit, by_axis["yaw"].unit) == ("m/s", "rad/s")


def test_a_rest_within_the_mission_is_told_as_rest_and_apart_from_the_mission():
    first, then = (held({0: 0.010}, rest={0: 0.050}, seconds=160.0) for _ in range(2))
    twice = {
        name: Signal(np.append(a.time_s, 160.0 + b.time_s), np.vstack([a.value, b.value]))
        for name, a in first.signals().items()
        for b in (then.signals()[name],)
    }
    surge = of(replace(first, **twice))["surge"]
    assert surge.rms == pytest.approx(0.010, rel=0.05)
    assert surge.rest == pytest.approx(0.050, rel=0.05)


def test_an_axis_that_was_asked_to_move_a_moment_ago_still_comes_to_rest():
    dive = held({})
    reference = dive.nu_ref.value.copy()
    reference[:, 1] = np.where((dive.nu_ref.time_s >= 50) & (dive.nu_ref.time_s < 100), 0.2, 0.0)
    nu = dive.velocity.value.copy()
    nu[:, 1] = reference[:, 1]
    nu[(dive.nu_ref.time_s >= 100) & (dive.nu_ref.time_s < 104), 1] = 0.1
    late = replace(
        dive, nu_ref=Signal(dive.nu_ref.time_s, reference), velocity=Signal(dive.velocity.time_s, nu)
    )
    assert of(late)["sway"].unasked < 0.002
    assert of(late)["sway"].rms == pytest.approx(0.1 * math.sqrt(4 / 85), rel=0.1)


@pytest.mark.parametrize("lacking", [{"nu_ref": None}, {"velocity": None, "gyro": None}])
def test_without_a_reference_or_readings_there_is_nothing_to_measure(lacking):
    assert whole_errors(replace(held({}), **lacking)) == ()
    assert tracking_errors(held({})).whole == whole_errors(held({}))


def test_an_axis_whose_reference_is_never_known_is_left_out_and_the_others_are_measured():
    """It was shown with NaN for its errors."""
    dive = held(STILL)
    reference = dive.nu_ref.value.copy()
    reference[:, 1] = np.nan
    unknown = replace(dive, nu_ref=Signal(dive.nu_ref.time_s, reference))
    assert of(unknown).keys() == of(dive).keys() - {"sway"}
    assert of(unknown)["surge"] == of(dive)["surge"]


def test_a_reference_that_never_moves_is_no_mission():
    dive = held({})
    still = replace(dive, nu_ref=Signal(dive.nu_ref.time_s, 0.0 * dive.nu_ref.value))
    assert whole_errors(still) == ()


def disturbed(mode, dof, size, at_rest=0.0):
    """A sound dive of `test_raising` in which an axis also sways at 0.2 Hz, while the vehicle is under way."""
    dive = flown(mode, axes=(0,))
    time_s = dive.nu_ref.time_s
    moving = np.abs(dive.nu_ref.value[:, 0]) > 1e-3
    under_way = (time_s >= time_s[moving][0]) & (time_s <= time_s[moving][-1] + 5)
    extra = np.where(under_way, size, at_rest) * math.sqrt(2) * np.sin(2 * np.pi * 0.2 * time_s)
    velocity, gyro = dive.velocity.value.copy(), dive.gyro.value.copy()
    (velocity if dof < 3 else gyro)[:, dof % 3] += extra
    pid = dive.tau_pid.value.copy()
    pid[:, dof] = 0.01
    return replace(
        dive, velocity=Signal(time_s, velocity), gyro=Signal(time_s, gyro), tau_pid=Signal(time_s, pid)
    )


@pytest.mark.parametrize("mode", [Mode.SHADOW, Mode.ALONE])
@pytest.mark.parametrize(
    ("dof", "size", "go"),
    [
        (1, 0.009, True),
        (1, 0.011, False),
        (2, 0.011, False),
        (5, math.radians(0.27), True),
        (5, math.radians(0.33), False),
        (3, math.radians(0.33), False),
    ],
)
def test_an_axis_that_moves_unasked_is_no_go_beyond_10_mm_s_or_0_3_deg_s(mode, dof, size, go):
    raising = judged(disturbed(mode, dof, size))
    wanted = [] if go else [f"{DOFS[dof]} moves unasked"]
    assert [name for name in failed(raising) if "asked" in name] == wanted
    if not go:
        assert not raising.go
        assert "See what moves it: diagnose this dive" in raising.sentence


def test_there_is_advice_other_than_to_diagnose_the_dive_if_more_is_known():
    raising = go_no_go(disturbed(Mode.SHADOW, 1, 0.02), FILE, "hovering", instead="upload gap.param")
    assert raising.sentence.endswith("sway moves unasked. Upload gap.param.")


@pytest.mark.parametrize("gave", [Given(0.8, 0.01), Given(1.0, 0.01), None])
def test_what_a_weak_thruster_moves_in_shadow_is_no_reason_not_to_make_up_for_it(gave):
    thruster = MadeUp(Credit(1, 1.0, 0.8, None, acting=False), 0.8, gave, acts=False)
    raising = go_no_go(disturbed(Mode.SHADOW, 5, math.radians(0.6)), FILE, "hovering", made_up=[thruster])
    (yaw,) = (
        each for each in raising.criteria if each.quantity in {"yaw moves unasked", "yaw not asked to move"}
    )
    weak = gave == Given(0.8, 0.01)
    assert raising.go is weak
    assert yaw.passed is (None if weak else False)
    assert yaw.words.endswith("; but thruster 1 is not made up for in shadow") is weak
    # Where the dive does not tell what it gives, one in still water tells of it and of yaw: a diagnosis would not.
    assert raising.sentence.endswith("it shows what it gives.") is (gave is None)
    assert "See what moves it" not in raising.sentence
    # No thruster of the feed-forward moves heave.
    sinking = go_no_go(disturbed(Mode.SHADOW, 2, 0.05), FILE, "hovering", made_up=[thruster])
    assert "heave moves unasked" in failed(sinking)


def test_two_degrees_a_second_of_yaw_are_told_in_degrees():
    (yaw,) = [
        c
        for c in judged(disturbed(Mode.SHADOW, 5, math.radians(2.0))).criteria
        if c.quantity == "yaw moves unasked"
    ]
    assert yaw.words == "2.0 deg/s rms while others move, at most 0.30 deg/s"


def test_axes_that_keep_still_share_a_line():
    (line,) = [
        c for c in judged(disturbed(Mode.SHADOW, 1, 0.0)).criteria if c.quantity == "not asked to move"
    ]
    assert line.passed
    assert line.words.endswith("rms, at most 10 mm/s and 0.30 deg/s")
    assert MOST_UNASKED["m/s"] == 0.010


def test_an_axis_that_nothing_holds_is_measured_and_not_judged():
    """A mission that pushes sway by itself, or a vehicle that has no thrust there."""
    dive = disturbed(Mode.SHADOW, 1, 0.2)
    pid = dive.tau_pid.value.copy()
    pid[:, 1] = 0.0
    pushed = replace(dive, tau_pid=Signal(dive.tau_pid.time_s, pid))
    sway = {error.axis: error for error in whole_errors(pushed)}["sway"]
    assert sway.rms == pytest.approx(0.2, rel=0.05)
    assert math.isnan(sway.unasked)
    assert judged(pushed).go
    alone = replace(pushed, ff_mode=Signal(dive.ff_mode.time_s, np.full_like(dive.ff_mode.value, 2.0)))
    assert not judged(alone).go


def test_what_moves_as_much_at_rest_is_the_sea_s_and_not_judged():
    raising = judged(disturbed(Mode.SHADOW, 1, 0.03, at_rest=0.02))
    (sway,) = [c for c in raising.criteria if c.quantity == "sway not asked to move"]
    assert sway.passed is None
    assert sway.words.endswith("at rest: the sea")
    assert raising.go


def test_a_vehicle_that_turns_meets_the_sea_in_surge_and_in_sway():
    """It lay with the sea ahead, and moves sideways once it has turned."""
    assert sea_of(whole_errors(disturbed(Mode.SHADOW, 0, 0.03, at_rest=0.02)))["sway"] == pytest.approx(
        0.02, rel=0.1
    )
    dive = disturbed(Mode.SHADOW, 1, 0.03)
    ahead = disturbed(Mode.SHADOW, 0, 0.0, at_rest=0.02)
    (alone,) = [c for c in judged(dive).criteria if c.quantity == "sway moves unasked"]
    both = replace(
        dive, velocity=Signal(dive.velocity.time_s, dive.velocity.value + ahead.velocity.value * [1, 0, 0])
    )
    (sway,) = [c for c in judged(both).criteria if c.quantity == "sway not asked to move"]
    assert (alone.passed, sway.passed) == (False, None)


def in_swell(mode: Mode, size: float) -> Dive:
    """A sound dive of `test_raising` in surge, which the sea moves to and fro by so much, rms."""
    dive = flown(mode, axes=(0,))
    swell = size * math.sqrt(2) * np.sin(2 * np.pi * 0.2 * dive.velocity.time_s)
    moved = dive.velocity.value + swell[:, None] * [1.0, 0.0, 0.0]
    return replace(dive, velocity=Signal(dive.velocity.time_s, moved))


def test_in_a_swell_what_the_pid_does_is_no_fault_of_the_feed_forward():
    calm, swell = (judged(in_swell(Mode.BOTH, size)) for size in (0.0, 0.05))
    assert failed(calm) == ["surge left to the PID"]
    assert failed(swell) == []
    (left,) = [c for c in swell.criteria if c.quantity == "surge left to the PID"]
    assert left.words.endswith("; but the sea moves it")


def test_in_a_swell_a_no_go_asks_for_a_calmer_sea_rather_than_for_a_model_of_this_dive():
    dive = in_swell(Mode.SHADOW, 0.05)
    pid = dive.tau_pid.value.copy()
    pid[:, 0] += 40.0 * np.sin(2 * np.pi * 0.2 * dive.tau_pid.time_s)
    raising = judged(under(dive, pid))
    assert "surge likeness" in failed(raising)
    assert raising.sentence.endswith("Dive in shadow again in a calmer sea.")
