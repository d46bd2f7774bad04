"""A vehicle that turns over is read right: its righting arm is weak, its thrusters turn it in roll and pitch."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from soak import rows_rest_in_soak

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Configuration, ThrustCurve, Vehicle, VehicleFile
from bridge.vehicle.dynamics import acceleration, restoring
from identify.diagnose.diagnose import diagnose
from identify.dive import Dive, Signal
from identify.doubt import Outcome
from identify.estimators.answer import answered
from identify.estimators.axes.build import build_axes
from identify.estimators.axes.readings import tumbles, turned_by
from identify.estimators.likelihood.answer import estimate
from identify.ingest.rotation import quaternions_from_euler
from identify.nuisance import noise

MASS = (34.0, 40.0, 46.0, 0.9, 1.1, 1.3)
DAMPING = (20.0, 30.0, 35.0, 0.8, 1.0, 1.2)
SHAPE = Configuration(
    dry_mass_kg=24.0,
    inertia_kgm2=(0.6, 0.7, 0.9),
    thrusters=(),
    centre_of_gravity_below_buoyancy_m=0.008,
    thruster_limit_n=20.0,
)
FILE = VehicleFile(
    Path("tumbling.yaml"),
    Vehicle("tumbling", {"only": SHAPE}, thrust_curve=ThrustCurve(lag_s=0.0)),
    None,
    "0" * 64,
)
STEP_S, EVERY = 0.01, 5
RATE_NOISE, TILT_NOISE, VELOCITY_NOISE = 0.004, 0.001, 0.005


@cache
def tumbling(over, seconds=150.0, pitching=0.4, gyro=True):
    """Pulses of `over` N m in roll and `pitching` N m in pitch, pushes of 10 N ahead, rates of turn and attitude at
    20 Hz, the velocity too; a small disturbance. gyro: whether the rates are recorded."""
    rng = np.random.default_rng(3)
    n = int(seconds / STEP_S)
    tau = np.zeros((n, 6))
    for dof, size in ((0, 10.0), (1, 6.0), (2, 6.0), (3, over), (4, pitching), (5, 1.0)):
        at = 0
        while at < n:
            last = at + int(rng.uniform(1.0, 4.0) / STEP_S)
            tau[at:last, dof] = size * rng.uniform(-1.0, 1.0)
            at = last
    push = tau + _coloured(rng, n) * np.array([0.2, 0.2, 0.2, 0.01, 0.01, 0.01])
    nu, attitude = _flown(push)
    time_s = STEP_S * np.arange(n)
    read = slice(None, None, EVERY)
    rows = len(time_s[read])
    quiet = attitude[read] + 0.5 * TILT_NOISE * rng.normal(size=(rows, 4))
    rates = nu[read, 3:] + RATE_NOISE * rng.normal(size=(rows, 3))
    velocity = nu[read, :3] + VELOCITY_NOISE * rng.normal(size=(rows, 3))
    return Dive(
        "tumbling",
        Path("tumbling.csv"),
        "1" * 64,
        tau_cmd=Signal(time_s, tau),
        attitude=Signal(time_s[read], quiet / np.linalg.norm(quiet, axis=1, keepdims=True)),
        gyro=Signal(time_s[read], rates) if gyro else None,
        velocity=Signal(time_s[read], velocity),
    )


def turned_over():
    """The dive that most tests share."""
    return tumbling(over=4.0, pitching=4.0, gyro=True)


def _coloured(rng, n):
    """(n, 6) of standard deviation 1 and a memory of 2 s."""
    keep = np.exp(-STEP_S / 2.0)
    out = np.zeros((n, 6))
    for k in range(1, n):
        out[k] = keep * out[k - 1] + np.sqrt(1 - keep**2) * rng.normal(size=6)
    return out


def _flown(push):
    """Velocities (n, 6) and attitudes (n, 4) under a wrench (n, 6), held over each step; by the midpoint rule."""
    nu, q = np.zeros(6), np.array([1.0, 0.0, 0.0, 0.0])
    velocities, turned = np.zeros((len(push), 6)), np.zeros((len(push), 4))
    for k, tau in enumerate(push):
        velocities[k], turned[k] = nu, q
        middle_nu, middle_q = nu + 0.5 * STEP_S * _faster(nu, q, tau), q + 0.5 * STEP_S * _turning(nu, q)
        nu, q = nu + STEP_S * _faster(middle_nu, middle_q, tau), q + STEP_S * _turning(middle_nu, middle_q)
        q = q / np.linalg.norm(q)
    return velocities, turned


def _faster(nu, q, tau):
    g = restoring(SHAPE, tuple(q.tolist()))
    return np.array(acceleration(MASS, DAMPING, tuple(nu.tolist()), tuple(tau.tolist()), g))


def _turning(nu, q):
    w, x, y, z = q.tolist()
    p, r_, r = nu[3:].tolist()
    return 0.5 * np.array(
        [-x * p - y * r_ - z * r, w * p + y * r - z * r_, w * r_ + z * p - x * r, w * r + x * r_ - y * p]
    )


def fit(dive):
    return answered(estimate(dive, FILE, "only", lambda *_: None), dive, FILE)


@pytest.mark.parametrize(
    ("gyro", "pitching"),
    rows_rest_in_soak([(True, 4.0), (False, 4.0), (True, 0.4), (False, 0.4)]),
    ids=lambda value: {0.4: "in roll", 4.0: "in roll and pitch"}.get(
        value, "gyro" if value else "attitude alone"
    ),
)
def test_a_vehicle_that_turns_over_many_times_has_its_inertias_and_dampings_and_quiet_sensors(gyro, pitching):
    dive = tumbling(over=4.0, pitching=pitching, gyro=gyro)
    assert tumbles(dive)
    answer = fit(dive)
    assert answer.outcome is Outcome.CONVERGED
    truth = (*MASS, *DAMPING)
    for parameter, true in zip(answer.parameters, truth, strict=False):
        assert parameter.identifiable
        assert parameter.value == pytest.approx(true, rel=0.02)
    for dof in ("roll", "pitch", "yaw"):
        assert answer.nuisance[noise(DOFS.index(dof), "attitude", True)] == pytest.approx(TILT_NOISE, rel=0.3)
        if gyro:
            assert answer.nuisance[noise(DOFS.index(dof), "gyro", False)] == pytest.approx(
                RATE_NOISE, rel=0.2
            )


def test_what_a_body_turned_by_runs_on_through_wraps_and_folds():
    rate, time_s = 0.7, np.arange(0.0, 60.0, 0.05)
    level = np.zeros_like(time_s)
    for axis, angles in enumerate(((rate * time_s, level, level), (level, rate * time_s, level))):
        turns = turned_by(Signal(time_s, quaternions_from_euler(*angles)))
        np.testing.assert_allclose(turns.value[:, axis], rate * time_s, atol=1e-9)
        np.testing.assert_allclose(np.delete(turns.value, axis, axis=1), 0.0, atol=1e-9)


def test_the_righting_moment_of_a_vehicle_that_turns_over_is_the_recorded_attitudes_alone():
    time_s = np.arange(0.0, 40.0, 0.05)
    roll, level = 0.6 * time_s, np.zeros_like(time_s)
    dive = replace(
        turned_over().between(0.0, 40.0),
        attitude=Signal(time_s, quaternions_from_euler(roll, level, level)),
    )
    built = build_axes(dive, FILE, "only")
    shape = SHAPE
    arm = shape.centre_of_gravity_below_buoyancy_m * shape.dry_mass_kg * 9.80665
    now = np.interp(built.motion.time_s, time_s, roll)
    np.testing.assert_allclose(built.restoring[3], arm * np.sin(now), atol=1e-3)
    assert {axis.dof: axis.stiffness for axis in built.axes}[3] == 0.0


def test_heave_by_depth_alone_is_not_judged_where_the_vehicle_turns_over():
    dive = replace(turned_over().between(0.0, 60.0), velocity=None)
    depth = 3.0 + np.sin(dive.attitude.time_s)[:, None]
    built = build_axes(replace(dive, depth=Signal(dive.attitude.time_s, depth)), FILE, "only")
    assert {axis.dof for axis in built.axes} == {3, 4, 5}
    assert "turns over" in built.missing[2]
    assert "record the DVL" in built.missing[2]


def test_a_few_readings_of_a_vehicle_on_its_side_are_no_tumbling():
    dive = tumbling(over=0.1, seconds=30.0)
    assert not tumbles(dive)
    wild = dive.attitude.value.copy()
    wild[100:104] = quaternions_from_euler(np.full(4, 2.0), np.zeros(4), np.zeros(4))
    assert not tumbles(replace(dive, attitude=Signal(dive.attitude.time_s, wild)))
    wild[100:110] = wild[100]
    assert tumbles(replace(dive, attitude=Signal(dive.attitude.time_s, wild)))


def test_turning_over_is_no_gap():
    diagnosis = diagnose(turned_over(), FILE, "only", progress=lambda *_: None)
    assert diagnosis.verdict == "no_gap"
    assert not diagnosis.findings
