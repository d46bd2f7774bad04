"""How far a rival's model closes the gap on another dive of the vehicle, by the same flight as the diagnosis's."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bench.diagnosis.rivals.said import Said
from identify.diagnose.nominal import Nominal, refitted
from identify.diagnose.shrink import with_coefficients
from identify.diagnose.simulation import Simulation, beyond_motion_of, simulation_of, slope_of

Array = NDArray[np.float64]

HORIZON_S = 5.0


def closed(said: Said, nominal: Nominal, check: Nominal) -> tuple[Array, Array]:
    """Rms drifts (6,) after 5 s on the check dive, by the nominal model and with what the rival adds; m/s and rad/s.

    Masses, dampings and causes are those of the first dive; trims are the check dive's own, as for the diagnosis.
    """
    course = replace(check.course, mass=said.now.course.mass, damping=said.now.course.damping)
    own = refitted(check, [cause.act(course) for cause in said.causes]) if said.causes else check
    nu = own.motion.nu
    after = simulation_of(own, with_coefficients(own, said.now), nu, slope=slope_of(said.causes, course))
    before = simulation_of(
        check, with_coefficients(check, nominal), nu + beyond_motion_of(said.causes, course)
    )
    return _drift(before), _drift(after)


def _drift(model: Simulation) -> Array:
    length = round(HORIZON_S / model.step_s)
    starts = np.arange(0, len(model.time_s) - length - 1, length)
    off = model.off(starts, [length], np.zeros_like(model.nu))[:, 0]
    return np.asarray(np.sqrt(np.mean(off**2, axis=0)))
