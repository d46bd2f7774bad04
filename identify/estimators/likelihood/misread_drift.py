"""The moments of drift that misread velocities make: a disturbance of roll, pitch and yaw that grows with the speed.

A hull that drifts is turned by the difference of two masses times the product of two velocities (Munk 1924). The
velocity of an autopilot's own filter is off by a centimetre a second for about a second, and at a metre a second that
makes a moment many times that of the sea. Without it, the seconds in which a hull went fast and pitched outweighed all
others, and a cause was found that came near their error.
"""

from dataclasses import replace

import numpy as np

from bridge.arrays import Array
from identify.estimators.axes.axis import Axis
from identify.estimators.axes.events import LOUDNESS, QUIETEST, levels, told_apart
from identify.estimators.axes.motion import Motion
from identify.estimators.filter.state import POSITION
from identify.estimators.likelihood.axis import DISTURBANCE, AxisLikelihood
from identify.estimators.likelihood.joint import JointLikelihood

DRIFT_MOMENTS = {3: (1, 2), 4: (2, 0), 5: (0, 1)}
"""By degree of freedom, the two velocities whose product turns the hull by the difference of their masses (Munk
1924)."""


def with_misread_drift(joint: JointLikelihood, theta: Array, motion: Motion) -> JointLikelihood:
    """The likelihood with these moments, by the masses and the errors of the velocities at theta.

    An error lasts about as long as the sea's disturbance, whose memory the moments share. The same likelihood without
    velocities of an autopilot's filter.
    """
    error = np.zeros(6)
    for problem, of_axis in zip(joint.problems, joint.slices, strict=True):
        error[problem.axis.dof] = _velocity_error(problem, theta[of_axis])
    if not error.any():
        return joint
    masses, nu = joint.at(theta)[0].masses, motion.nu
    problems = []
    for problem, of_axis in zip(joint.problems, joint.slices, strict=True):
        axis = problem.axis
        if axis.dof in DRIFT_MOMENTS:
            a, b = DRIFT_MOMENTS[axis.dof]
            square = (masses[a] - masses[b]) ** 2 * ((nu[:, a] * error[b]) ** 2 + (nu[:, b] * error[a]) ** 2)
            sea = float(np.exp(2.0 * theta[of_axis][DISTURBANCE]))
            problem = problem.with_axis(
                _misread(axis, motion.mean_between(square, axis.before_s, axis.time_s), sea, masses[axis.dof])
            )
        problems.append(problem)
    return replace(joint, problems=tuple(problems))


def _misread(axis: Axis, square: Array, sea: float, inertia: float) -> Axis:
    """The axis with its steps grouped by the ratio of this moment's mean square (n,) to the sea's.

    The moment is kept per inertia. Where no thruster turns a hull, its inertia, its righting moment and the masses that
    turn it may all grow by one factor; a moment that stayed as it was would then be smaller beside them, and seem
    likelier.
    """
    step, of, level = told_apart(axis, levels(square / sea))
    misread = np.where(level > levels(np.array(QUIETEST)), np.sqrt(sea * LOUDNESS**level) / inertia, 0.0)
    return replace(
        axis, different_s=axis.different_s[of], white_times=axis.white_times[of], misread=misread, step=step
    )


def _velocity_error(problem: AxisLikelihood, theta: Array) -> float:
    """Standard deviation, m/s, of the motion's velocity along an axis: of an autopilot's filter, or by depth too."""
    std, time_s = problem.coloured(theta)
    axis = problem.axis
    depth = axis.state_read == POSITION
    if not std or not depth.any():
        return std
    noise = float(np.exp(theta[problem.noise_index + int(axis.channel[depth][0])]))
    return error_by_depth(std, time_s, noise, float(np.median(np.diff(axis.time_s[depth]))))


def error_by_depth(std: float, time_s: float, depth_noise_m: float, spacing_s: float) -> float:
    """Standard deviation, m/s, of a heave velocity whose slow error (standard deviation `std`, memory `time_s`) is
    mended by depth (`axes.readings.with_heave_of_depth`).

    A filter 1 / (1 + (f / f_c)^4) takes the slope of depth below its corner, where both errors weigh the same, and the
    velocity, whose error walks at random, above.
    """
    density = depth_noise_m**2 * spacing_s
    corner = (2.0 * std**2 / (time_s * density)) ** 0.25
    return min(std, float(np.sqrt(density * corner**3 / np.sqrt(8.0))))
