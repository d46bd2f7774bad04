"""A vehicle that floats at the ends of a recording is left out there; one that never dived is warned of."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import fitted
import numpy as np
import pytest

from bridge.simulator.plant import Plant
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.thrusters import Allocator, Pulses, thrust_curve
from identify.checks.fit.at_the_surface import draught_m
from identify.dive import Dive, Signal
from identify.doubt import Outcome
from identify.estimators.answer import answered
from identify.estimators.axes.afloat import under_water
from identify.estimators.axes.build import build_axes
from identify.estimators.likelihood.answer import estimate
from identify.thrust.wrench import wrench

FILE = load_vehicle("bluerov2")
SHAPE = FILE.vehicle.configurations["standard"]
CURVE = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
FLOATS_S, DIVES_S, HZ = 15.0, 45.0, 50.0
LEAST_N = 0.05


@cache
def dived():
    """It floats with thrusters at rest, goes down, is pushed up and down, and comes up to float again."""
    plant = Plant(
        SHAPE,
        CURVE,
        FILE.vehicle.thrust_curve.lag_s,
        load_truth(FILE, "standard").calm(),
        np.random.default_rng(1),
    )
    allocator, pulses, rng = Allocator(SHAPE, CURVE), Pulses(CURVE, 0.05), np.random.default_rng(2)
    rows = []
    for k in range(round((2 * FLOATS_S + DIVES_S) * HZ)):
        since_s = k / HZ - FLOATS_S
        push = np.zeros(6)
        if 0 < since_s < DIVES_S:
            push[2] = SHAPE.net_buoyancy_n + (1.5 if since_s < 8.0 else 6.0 * (-1) ** round(since_s / 2))
        pwm = pulses(allocator.allocate(push)[0])
        rows.append((plant.time_s, plant.state[9], plant.state[2], *pwm))
        plant.advance(tuple(pwm), 1 / HZ)
    time_s, heave, depth, *pwm = np.array(rows).T
    read = slice(None, None, 5)
    velocity = np.zeros((len(time_s[read]), 3))
    velocity[:, 2] = heave[read] + 0.002 * rng.standard_normal(len(velocity))
    depth = depth[read] + 0.005 * rng.standard_normal(len(velocity))
    return Dive(
        "afloat", Path("afloat.tlog"), "0" * 64,
        velocity=Signal(time_s[read], velocity), depth=Signal(time_s[read], depth[:, None]),
        pwm=Signal(time_s, np.column_stack(pwm)),
    )  # fmt: skip


def spans(dive):
    forces = wrench(dive, FILE, "standard")
    return under_water(forces.spans_s, forces, dive.depth, LEAST_N)


def test_heave_is_identified_by_what_was_under_water_alone():
    answer = estimate(dived(), FILE, "standard", lambda *_: None)
    true = SHAPE.model
    for parameter in answer.parameters:
        if parameter.name in ("M_w", "D_w", "Z_ww"):
            assert parameter.low95 <= true[parameter.name] <= parameter.high95, parameter
            assert parameter.value == pytest.approx(true[parameter.name], rel=0.05)
    assert any(note.startswith("At the surface the vehicle floats") for note in answer.notes)


def test_both_ends_are_left_out_and_said():
    ((start_s, end_s),), (note,) = spans(dived())
    depth = dived().depth
    assert depth.between(start_s, end_s).value.min() > 0.05
    assert FLOATS_S < start_s < FLOATS_S + 3.0
    assert depth.between(end_s + 0.5, np.inf).value.max() < 0.2
    assert f"the first {start_s:.0f} s and the last {75 - end_s:.0f} s" in note


def test_a_dive_that_begins_and_ends_under_water_is_kept_whole():
    dive = dived().between(20.0, 55.0)
    ((start_s, end_s),), notes = spans(dive)
    assert (start_s, end_s) == (dive.pwm.time_s[0], dive.pwm.time_s[-1])
    assert notes == ()


def test_of_a_recording_that_ends_afloat_only_the_end_is_told():
    ((_, end_s),), (note,) = spans(dived().between(20.0, 75.0))
    assert f": the last {75 - end_s:.0f} s of thruster commands are left out." in note


@pytest.mark.parametrize(
    ("ends_s", "depth"),
    [
        pytest.param(90.0, lambda depth_m: depth_m + 3.0, id="it rests deep"),
        pytest.param(90.0, lambda depth_m: 0.05 * depth_m, id="manoeuvres just below the surface"),
        pytest.param(FLOATS_S, lambda depth_m: depth_m, id="it floats all along"),
        pytest.param(90.0, None, id="without depth nothing tells"),
    ],
)
def test_what_does_not_float_at_its_ends_or_all_along_is_kept_whole(ends_s, depth):
    dive = dived().between(0.0, ends_s)
    forces = wrench(dive, FILE, "standard")
    at = depth and Signal(dive.depth.time_s, depth(dive.depth.value))
    assert under_water(forces.spans_s, forces, at, LEAST_N) == (forces.spans_s, ())


def test_a_wave_at_the_start_is_no_dive():
    dive = dived()
    value = dive.depth.value.copy()
    value[(dive.depth.time_s > 5.0) & (dive.depth.time_s < 6.0)] = 0.3
    forces = wrench(dive, FILE, "standard")
    ((start_s, _),), _ = under_water(forces.spans_s, forces, Signal(dive.depth.time_s, value), LEAST_N)
    assert start_s > FLOATS_S


def test_the_events_of_every_axis_begin_under_water():
    ((start_s, end_s),), _ = spans(dived())
    (heave,) = build_axes(dived(), FILE, "standard", [2]).axes
    assert start_s - 0.01 <= heave.time_s[0]
    assert heave.time_s[-1] <= end_s + 0.01


TIME_S = np.arange(0.0, 120.0, 0.1)


def doubts_of(depth_m, **keys):
    made = fitted.fit({"M_u": 100.0, "D_u": 50.0}, 1e-4 * np.eye(2))
    dive = replace(fitted.dive(), depth=Signal(TIME_S, np.asarray(depth_m, dtype=float)[:, None]), **keys)
    return answered(made, dive, fitted.vehicle_file())


def test_a_hull_is_as_high_as_a_cube_of_its_water():
    assert draught_m(72.0, 998.2) == pytest.approx(0.416, abs=5e-4)


@pytest.mark.parametrize("zero_m", [-0.1, 0.0, 0.2])
def test_a_vehicle_that_stays_at_the_surface_is_identified_with_a_warning(zero_m):
    answer = doubts_of(zero_m + 0.1 * np.sin(TIME_S))
    (doubt,) = answer.doubts
    assert doubt.problem == "The vehicle hardly left the surface: its depth stays within 0.42 m of zero"
    assert "dive a metre or more deep" in doubt.remedy
    assert doubt.about == ("M_u", "D_u")
    assert answer.outcome is Outcome.CONVERGED
    assert answer.values() == {"M_u": 100.0, "D_u": 50.0}


def test_a_depth_above_the_water_is_warned_of_with_the_ways_out():
    (doubt,) = doubts_of(-5.2 + 0.5 * np.sin(TIME_S)).doubts
    assert doubt.problem == "The depth is above the water: 5.2 m in the median"
    assert "`scale: -1`" in doubt.remedy
    assert "`surface_pressure_hpa`" in doubt.remedy


@pytest.mark.parametrize(
    "depth_m",
    [np.where((TIME_S > 50.0) & (TIME_S < 70.0), 2.0, 0.0), 0.5 + 0 * TIME_S, np.nan * TIME_S],
    ids=["it begins and ends there", "half the depth of a tank of a metre", "all unknown"],
)
def test_a_dive_that_is_not_known_to_have_stayed_at_the_surface_is_not_warned_of(depth_m):
    assert doubts_of(depth_m).doubts == ()
