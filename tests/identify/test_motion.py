"""What is made of a motion that is known at uniform times."""

import numpy as np

from bridge.vehicle.dynamics import coriolis
from identify.estimators.motion import Motion


def test_the_coriolis_forces_of_any_masses_are_those_of_unit_masses_times_them() -> None:
    rng = np.random.default_rng(3)
    motion, mass = Motion(0.1 * np.arange(50), rng.normal(size=(50, 6))), rng.uniform(1.0, 40.0, 6)
    whole = np.stack(coriolis(mass.tolist(), tuple(motion.nu.T)))
    np.testing.assert_allclose(np.einsum("dkm,k->dm", motion.coriolis, mass), whole, rtol=1e-12, atol=1e-12)
