"""What speaks for a vehicle file that is of another vehicle, in sentences."""

from collections.abc import Sequence

import numpy as np

from bridge.vehicle.coefficients import MASSES
from bridge.vehicle.config import Configuration
from identify.bounds import MOST_ADDED
from identify.diagnose.nominal import Nominal
from identify.identification import Z95
from identify.report.text import significant


def mass_hints(now: Nominal, log_stds: Sequence[float], shape: Configuration) -> tuple[str, ...]:
    """That masses in surge, sway or heave are none that a rigid body of the file's mass has in water; log_stds (axes,):
    their relative standard errors."""
    light, heavy = [], []
    for problem, std in zip(now.joint.problems, log_stds, strict=True):
        dof = problem.axis.dof
        if dof > 2 or dof in now.doubted:
            continue
        rigid, rigid_std = shape.rigid_body(dof)
        mass, wide = float(now.course.mass[dof]), float(np.exp(Z95 * std))
        told = f"{MASSES[dof].name} {significant(mass, 3)} kg"
        if mass * wide < rigid - Z95 * rigid_std:
            light.append(told)
        if mass / wide > (1.0 + MOST_ADDED) * (rigid + Z95 * rigid_std):
            heavy.append(told)
    dry = f"the vehicle file's dry mass of {shape.dry_mass_kg:g} kg"
    whats = (
        (light, f"below {dry}, which no water can take away"),
        (heavy, f"at more than {dry} can come to with the water round it"),
    )
    return tuple(
        f"{', '.join(told)} came out {what}: the file may be of another vehicle, or its mass or thrust is wrong; look "
        "at that before you rely on any cause."
        for told, what in whats
        if told
    )
