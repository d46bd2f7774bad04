"""A compass' deviation: near thrusters and steel its heading is off by an angle that goes with the heading itself.

On legs of a few headings that looks like a gyro's scale, or like turns that nobody pushed; over whole turns it comes to
nothing. So it is a nuisance wherever a heading is read beside a gyro.
"""

import numpy as np

from bridge.arrays import Array

HALF_CIRCLE_RAD, QUARTER_RAD = 0.1, 0.04
"""Usual deviation with the sine and cosine of the heading, and of twice the heading (coefficients B to E: NGA, Handbook
of Magnetic Compass Adjustment, 2004)."""


def deviations(heading: Array) -> Array:
    """The deviation (n, 4) of usual size by each of the four coefficients along a heading (n,), rad, from the first."""
    columns = np.column_stack(
        [
            HALF_CIRCLE_RAD * np.sin(heading),
            HALF_CIRCLE_RAD * np.cos(heading),
            QUARTER_RAD * np.sin(2.0 * heading),
            QUARTER_RAD * np.cos(2.0 * heading),
        ]
    )
    return np.asarray(columns - columns[0])
