"""What a motion tells of mass and damping: the Fisher information of a linear axis, in the frequency domain.

An axis M nu_dot + D nu = F + d with a coloured force d and noisy readings of nu answers a change of log M by
-M j w V / Z and one of log D by -D V / Z, with V the spectrum of its velocity and Z = M j w + D. The information is the
sum of that over the spectrum of what is read without it, S = N + S_d / |Z|^2 (Whittle 1953; Ljung 1999, eq. 9.54), so

    J_MM = sum w^2 M^2 |V|^2 / (|Z|^2 N + S_d),    J_DD = sum D^2 |V|^2 / (|Z|^2 N + S_d),

and mass and damping are told apart at every frequency, being in quadrature. The trim force takes the mean.
The forces by which axes act on each other count as known, and so do noise levels, whose information stands apart.

Thrust that acts a little later answers as -j w V / (1 + j w L), behind the last part of a lag L: what that has in
common with mass and damping, no dive can tell from them.
"""

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, MASSES
from identify.estimators.lateness import LATER_S
from identify.planning.knowledge import NAMES, AxisNoise, Knowledge

Array = NDArray[np.float64]

TELLING_HZ = 5.0
"""Above that a DVL reads nothing, and no vehicle of this size moves."""


def of_motion(step_s: float, nu: Array, knowledge: Knowledge, dofs: tuple[int, ...]) -> Array:
    """(12, 12) information of log coefficients that the axes `dofs` give, moving as `nu` (n, 6) from rest to rest.

    Rows are `step_s` apart; the order is that of `NAMES`.
    """
    out = np.zeros((len(NAMES), len(NAMES)))
    for dof in dofs:
        mass, damping = MASSES[dof].name, DAMPINGS[dof].name
        found = of_axis(
            step_s, nu[:, dof], knowledge.values[mass], knowledge.values[damping], knowledge.noise[dof]
        )
        for name, value in zip((mass, damping), found, strict=True):
            out[NAMES.index(name), NAMES.index(name)] = value
    return out


def of_timing(step_s: float, nu: Array, knowledge: Knowledge, dofs: tuple[int, ...]) -> Array:
    """(k, 12) information that log coefficients share with when thrust acts, s, in each of the k axes `dofs`."""
    out = np.zeros((len(dofs), len(NAMES)))
    for row, dof in enumerate(dofs):
        mass, damping = MASSES[dof].name, DAMPINGS[dof].name
        m, d = knowledge.values[mass], knowledge.values[damping]
        w, weight = _spectrum(step_s, nu[:, dof], m, d, knowledge.noise[dof])
        impedance, later = m * 1j * w + d, 1j * w / (1 + 1j * w * LATER_S)
        for name, answer in ((mass, m * 1j * w), (damping, d)):
            out[row, NAMES.index(name)] = np.sum((np.conj(answer) * impedance * later).real * weight)
    return out


def of_axis(
    step_s: float, velocity: Array, mass: float, damping: float, noise: AxisNoise
) -> tuple[float, float]:
    """Information of log M and of log D in the velocity (n,) of one axis."""
    w, weight = _spectrum(step_s, velocity, mass, damping, noise)
    return float(np.sum((mass * w) ** 2 * weight)), float(np.sum(damping**2 * weight))


def _read(w: Array, noise: AxisNoise) -> Array:
    """Density of the noise on a velocity that is read, and read once more as the slope of its integral."""
    return np.asarray(1.0 / (1.0 / noise.velocity + 1.0 / (w * w * noise.position)))


def _pushed(w: Array, noise: AxisNoise) -> Array:
    """Density of the disturbance."""
    return np.asarray(
        2 * noise.disturbance**2 * noise.time_constant_s / (1 + (w * noise.time_constant_s) ** 2)
    )


def _spectrum(
    step_s: float, velocity: Array, mass: float, damping: float, noise: AxisNoise
) -> tuple[Array, Array]:
    """Frequencies (m,), rad/s, and |V|^2 / (|Z|^2 N + S_d) there."""
    frequency = np.asarray(np.fft.rfftfreq(len(velocity), step_s), dtype=np.float64)
    power = np.abs(np.fft.rfft(velocity) * step_s) ** 2
    told = (frequency > 0) & (frequency <= TELLING_HZ)
    w = 2 * np.pi * frequency[told]
    power = power[told]
    impedance = (mass * w) ** 2 + damping**2
    # Two for the frequencies below zero, one over the duration for the width of a line.
    weight: Array = 2.0 * power / (impedance * _read(w, noise) + _pushed(w, noise)) / (len(velocity) * step_s)
    return w, weight
