"""The one definition of the nominal dynamics, against vectors and matrices."""

import numpy as np
import pytest

from bridge.vehicle.config import Configuration, Thruster
from bridge.vehicle.dynamics import acceleration, coriolis, restoring

RNG = np.random.default_rng(7)
MASS, DAMPING, NU, TAU, G = (
    RNG.uniform(0.5, 2.0, 6) * RNG.choice([1.0, sign], 6) for sign in (1, 1, -1, -1, -1)
)


def test_the_coriolis_forces_are_those_of_the_momenta_in_a_turning_frame():
    velocity, rate, momentum, spin = NU[:3], NU[3:], MASS[:3] * NU[:3], MASS[3:] * NU[3:]
    whole = [*np.cross(rate, momentum), *(np.cross(velocity, momentum) + np.cross(rate, spin))]
    assert coriolis(MASS.tolist(), NU.tolist()) == pytest.approx(whole)


def test_forces_balance():
    change = np.array(acceleration(MASS, DAMPING, NU, TAU, G))
    assert MASS * change + coriolis(MASS, NU) + DAMPING * NU + G == pytest.approx(TAU)


def test_weight_below_the_buoyancy_rights_a_body_and_what_it_floats_by_lifts_it():
    body = Configuration(
        10.0, (1.0, 2.0, 4.0), (Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),),
        net_buoyancy_n=3.0, centre_of_gravity_below_buoyancy_m=0.02,
    )  # fmt: skip
    half = 0.2 / 2
    level, rolled, pitched = (
        (1.0, 0, 0, 0),
        (np.cos(half), np.sin(half), 0, 0),
        (np.cos(half), 0, np.sin(half), 0),
    )
    arm = 0.02 * 10.0 * 9.80665
    assert restoring(body, level) == pytest.approx((0.0, 0.0, 3.0, 0.0, 0.0, 0.0))
    tilted = (0.0, 3.0 * np.sin(0.2), 3.0 * np.cos(0.2), arm * np.sin(0.2), 0.0, 0.0)
    assert restoring(body, rolled) == pytest.approx(tilted)
    tilted = (-3.0 * np.sin(0.2), 0.0, 3.0 * np.cos(0.2), 0.0, arm * np.sin(0.2), 0.0)
    assert restoring(body, pitched) == pytest.approx(tilted)
