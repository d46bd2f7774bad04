"""The likelihood of an axis before its fit: its priors, whose middle is the starting point."""

from collections.abc import Sequence

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import Configuration, Damping
from identify.estimators.axes.axis import Axis
from identify.estimators.likelihood.axis import (
    COLOURED_S,
    DAMPING,
    AxisLikelihood,
    shapes_of,
)

PRIOR_STD = (1.5, 2.5, 3.0, 1.0)
"""Prior standard deviations of log mass, damping, disturbance and its time constant: they matter only if a dive has
no information."""

MASS_RATIO, DAMPING_RATIO, DISTURBANCE_SHARE, TIME_S = 1.4, 0.7, 7e-3, 2.0
"""Start of the climb: mass, damping and disturbance as shares of the rigid body's mass or inertia, and the
disturbance's time constant."""

UNMEASURED_SHARE = 0.5
"""Standard deviation of a mass that the dive does not determine, as a share of the rigid body's."""

SMALL = 0.01
NOTICEABLE = 0.05
TRIM_SHARE = 0.05
"""Standard deviation of the trim force as a share of one thruster's limit."""

WHITE_SPREAD = 1.0
"""Prior standard deviation of the log white force about the value that rounding of pulses gives."""

COLOURED_SPREAD = 0.7
"""Prior standard deviation of the logarithms of an autopilot's velocity error and of its time constant."""

SECOND_POLE, SECOND_POLE_SPREAD = -3.0, 2.5
"""Prior middle and spread of the log odds of a disturbance's evenness, 4 T1 T2 / (T1 + T2)^2 of its two poles."""

QUADRATIC_RATIO, QUADRATIC_SPREAD = 4.0, 1.5
"""Prior middle of quadratic drag, in rigid-body masses per metre or inertias per radian, and prior standard deviation
of its logarithm."""

NO_DAMPING = 1e-3
"""Linear damping of a hull whose model has none, as a share of the rigid body's mass or inertia."""


def likelihood_of(
    axis: Axis,
    configuration: Configuration,
    masses: Array,
    unmeasured: Sequence[int],
    damped: Damping = "linear",
) -> AxisLikelihood:
    """Return the likelihood of an axis, with `masses` (6,) in its Coriolis forces; the mean of its prior is the
    starting point.

    The error of an `unmeasured` axis's mass becomes a factor to fit, if its force is noticeable in this axis.
    """
    rigid = configuration.rigid_body(axis.dof)[0]
    disturbance = DISTURBANCE_SHARE * rigid
    trim = max(TRIM_SHARE * configuration.thruster_limit_n * (1.0 if axis.dof < 3 else 0.2), 1e-3)
    width = [trim] * axis.trims
    loose = []
    for dof in unmeasured:
        spread = UNMEASURED_SHARE * configuration.rigid_body(dof)[0]
        if spread * np.std(axis.coriolis[:, dof]) > NOTICEABLE * disturbance:
            loose.append(dof)
            width.append(spread)
    middle = [0.0] * len(width)
    if damped != "linear":
        width.append(QUADRATIC_SPREAD)
        middle.append(float(np.log(QUADRATIC_RATIO * rigid)))
    width += [timing.spread for timing in axis.timing]
    middle += [0.0] * len(axis.timing)
    shapes = shapes_of(axis, tuple(loose), damped)
    noises = [(channel.noise, channel.noise_spread) for channel in axis.channels]
    if axis.white_force:
        noises.append((axis.white_force, WHITE_SPREAD))
    noises += (
        [(axis.channels[0].coloured, COLOURED_SPREAD), (COLOURED_S, COLOURED_SPREAD)]
        if axis.is_coloured
        else [(float(np.exp(SECOND_POLE)), SECOND_POLE_SPREAD)]
    )
    linear = NO_DAMPING if damped == "quadratic" else DAMPING_RATIO
    motion = [np.log(MASS_RATIO * rigid), np.log(linear * rigid), np.log(disturbance), np.log(TIME_S)]
    start = [*motion, *middle, *(np.log(noise) for noise, _ in noises)]
    difference = [*[1e-4] * len(motion), *(1e-3 * np.array(width)), *[1e-4] * len(noises)]
    known = list(PRIOR_STD)
    if damped == "quadratic":
        known[DAMPING] = SMALL
    prior_std = [*known, *width, *(spread for _, spread in noises)]
    return AxisLikelihood(
        axis,
        masses,
        shapes,
        tuple(loose),
        axis.reading,
        np.array(start),
        np.array(prior_std) ** -2.0,
        np.array(difference),
        damped=damped,
    )
