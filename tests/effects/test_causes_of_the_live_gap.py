"""The live gap monitor writes the forces of its causes anew, as it may not import the effects: they are the same."""

from dataclasses import replace

import numpy as np
import pytest

from bridge.vehicle.coefficients import DAMPINGS, MASSES, QUADRATICS
from bridge.vehicle.config import load_vehicle
from gcs_plugin.monitor.model import model_of
from gcs_plugin.monitor.predictor import DRAGGED, NUDGE_M_S, forces, names_of
from identify.effects import actuators, environment, hydrodynamics, rigid_body

FILE = load_vehicle("ruvifist:hovering")
NORTH_EAST = np.eye(2)


@pytest.fixture
def drawn(rich_course):
    """A course whose body rates are those of its attitude, drawn anew, with its attitude as w x y z."""
    time_s, rng = rich_course.since_s, np.random.default_rng(24)
    euler = 0.25 * np.sin(time_s[:, None] * rng.uniform(0.2, 0.6, 3) + rng.uniform(0, 6, 3))
    euler[:, 2] += 0.1 * time_s
    (sin_r, sin_p, _), (cos_r, cos_p, _) = np.sin(euler).T, np.cos(euler).T
    roll, pitch, yaw = np.gradient(euler, rich_course.step_s, axis=0).T
    nu = rich_course.nu.copy()
    nu[:, 3] = roll - sin_p * yaw
    nu[:, 4] = cos_r * pitch + sin_r * cos_p * yaw
    nu[:, 5] = cos_r * cos_p * yaw - sin_r * pitch
    (sr, sp, sy), (cr, cp, cy) = np.sin(euler.T / 2), np.cos(euler.T / 2)
    attitude = np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=1,
    )
    return replace(rich_course, nu=nu, euler=euler), attitude


@pytest.fixture
def by_name(drawn):
    """The monitor's forces (n, 6) on the drawn course by the names of its causes."""
    course, attitude = drawn
    rows = ((MASSES, course.mass), (DAMPINGS, course.damping), (QUADRATICS, course.quadratic))
    values = {row.name: value for kind, of in rows for row, value in zip(kind, of, strict=True)}
    model = model_of(values, FILE, "hovering")
    columns = forces(model, course.nu, course.thrust_n, attitude, course.position_m)
    return {name: columns[:, k] for k, name in enumerate(names_of(model))}


def test_a_thruster_that_gives_nothing_a_pull_a_line_and_drag_are_those_of_the_effects(drawn, by_name):
    course, _ = drawn
    effects = {
        f"thruster {number}": (actuators.weak(number), [0.0])
        for number in range(1, len(course.configuration.thrusters) + 1)
    }
    effects |= {
        "pull north": (environment.TETHER, [0.0, 1.0, 0.0]),
        "pull east": (environment.TETHER, [0.0, 0.0, 1.0]),
        "line": (environment.TETHER, [1.0, 0.0, 0.0]),
        "pull down": (rigid_body.NET_BUOYANCY, [-1.0]),
    }
    for name, (effect, values) in effects.items():
        wrench = effect.act(course, np.array(values)).wrench
        assert np.abs(wrench).max() > 0.1
        np.testing.assert_allclose(by_name[name], wrench, atol=1e-9, err_msg=name)
    for dof in DRAGGED:
        grown = replace(course, quadratic=np.eye(6)[dof])
        wrench = hydrodynamics.FOULING_SINCE.act(grown, np.array([1.0])).wrench
        np.testing.assert_allclose(by_name[f"drag {dof}"], wrench, atol=1e-12, err_msg=str(dof))


def test_moving_water_is_that_of_the_effect_but_for_the_square_of_its_speed(drawn, by_name):
    course, _ = drawn
    for name, way in zip(("water north", "water east"), NORTH_EAST, strict=True):
        water = environment.STEADY_CURRENT.act(course, NUDGE_M_S * way).water
        wrench = course.pushed_by(water) / NUDGE_M_S
        off = np.abs(by_name[name] - wrench)[2:-2].max(axis=0)
        assert (off < 0.01 * np.abs(wrench[:, :3]).max()).all(), (name, off)
