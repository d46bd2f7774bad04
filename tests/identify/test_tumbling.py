"""A vehicle that turns over: its angles wrap, fold and change places, and nothing of that may reach a reading."""

from dataclasses import replace

import numpy as np
import pytest
import tumbling
from soak import rows_rest_in_soak

from bridge.vehicle.coefficients import DOFS
from identify.answer import answered
from identify.diagnose.diagnose import diagnose
from identify.dive import Signal
from identify.estimators.axes import build_axes
from identify.estimators.likelihood import estimate
from identify.estimators.places import tumbles, turned_by
from identify.identification import Outcome, noise
from identify.ingest.rotation import quaternions_from_euler


def fit(dive):
    return answered(estimate(dive, tumbling.FILE, "only", lambda *_: None), dive, tumbling.FILE)


@pytest.mark.parametrize(
    ("gyro", "pitching"),
    rows_rest_in_soak([(True, 4.0), (False, 4.0), (True, 0.4), (False, 0.4)], keep=2),
    ids=lambda told: {0.4: "in roll", 4.0: "in roll and pitch"}.get(
        told, "gyro" if told else "attitude alone"
    ),
)
def test_a_vehicle_that_turns_over_many_times_has_its_inertias_and_dampings_and_quiet_sensors(gyro, pitching):
    dive = tumbling.dive(over=4.0, pitching=pitching, gyro=gyro)
    assert tumbles(dive)
    found = fit(dive)
    assert found.outcome is Outcome.CONVERGED
    truth = (*tumbling.MASS, *tumbling.DAMPING)
    for one, true in zip(found.parameters, truth, strict=False):
        assert one.identifiable
        assert one.value == pytest.approx(true, rel=0.02)
    for dof in ("roll", "pitch", "yaw"):
        assert found.nuisance[noise(DOFS.index(dof), "attitude", True)] == pytest.approx(
            tumbling.TILT_NOISE, rel=0.3
        )
        if gyro:
            assert found.nuisance[noise(DOFS.index(dof), "gyro", False)] == pytest.approx(
                tumbling.RATE_NOISE, rel=0.2
            )


def test_what_a_body_turned_by_runs_on_through_wraps_and_folds():
    rate, time_s = 0.7, np.arange(0.0, 60.0, 0.05)
    level = np.zeros_like(time_s)
    for axis, angles in enumerate(((rate * time_s, level, level), (level, rate * time_s, level))):
        found = turned_by(Signal(time_s, quaternions_from_euler(*angles)))
        np.testing.assert_allclose(found.value[:, axis], rate * time_s, atol=1e-9)
        np.testing.assert_allclose(np.delete(found.value, axis, axis=1), 0.0, atol=1e-9)


def test_the_righting_moment_of_a_vehicle_that_turns_over_is_the_recorded_attitudes_alone():
    time_s = np.arange(0.0, 40.0, 0.05)
    roll, level = 0.6 * time_s, np.zeros_like(time_s)
    dive = replace(
        tumbling.dive(over=4.0, seconds=40.0),
        attitude=Signal(time_s, quaternions_from_euler(roll, level, level)),
    )
    built = build_axes(dive, tumbling.FILE, "only")
    shape = tumbling.SHAPE
    arm = shape.centre_of_gravity_below_buoyancy_m * shape.dry_mass_kg * 9.80665
    now = np.interp(built.motion.time_s, time_s, roll)
    np.testing.assert_allclose(built.restoring[3], arm * np.sin(now), atol=1e-3)
    assert {axis.dof: axis.stiffness for axis in built.axes}[3] == 0.0


def test_heave_by_depth_alone_is_not_judged_where_the_vehicle_turns_over():
    dive = tumbling.dive(over=4.0, seconds=60.0, velocity=False)
    depth = 3.0 + np.sin(dive.attitude.time_s)[:, None]
    built = build_axes(replace(dive, depth=Signal(dive.attitude.time_s, depth)), tumbling.FILE, "only")
    assert {axis.dof for axis in built.axes} == {3, 4, 5}
    assert "turns over" in built.missing[2]
    assert "record the DVL" in built.missing[2]


def test_a_few_readings_of_a_vehicle_on_its_side_are_no_tumbling():
    dive = tumbling.dive(over=0.1, seconds=30.0)
    assert not tumbles(dive)
    wild = dive.attitude.value.copy()
    wild[100:104] = quaternions_from_euler(np.full(4, 2.0), np.zeros(4), np.zeros(4))
    assert not tumbles(replace(dive, attitude=Signal(dive.attitude.time_s, wild)))
    wild[100:110] = wild[100]
    assert tumbles(replace(dive, attitude=Signal(dive.attitude.time_s, wild)))


def test_turning_over_is_no_gap():
    found = diagnose(tumbling.dive(over=4.0, pitching=4.0), tumbling.FILE, "only", progress=lambda *_: None)
    assert found.verdict == "no_gap"
    assert not found.findings
