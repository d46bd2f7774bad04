"""Fisher information of a motion about mass and damping: of a linear axis, in the frequency domain.

An axis M nu_dot + D nu = F + d with a coloured force d and noisy readings of nu responds to a change of log M by -M j
w V / Z and to a change of log D by -D V / Z, with V the spectrum of its velocity and Z = M j w + D. The information
is the sum of the squared response over the spectrum of the readings without that response, S = N + S_d / |Z|^2
(Whittle 1953; Ljung 1999, eq. 9.54), so

    J_MM = sum w^2 M^2 |V|^2 / (|Z|^2 N + S_d),    J_DD = sum D^2 |V|^2 / (|Z|^2 N + S_d),

and mass and damping are separable at every frequency, being in quadrature. The trim force takes the mean. The
coupling forces between axes count as known, and so do noise levels, whose information is independent.

Later thrust gives the response -j w V / (1 + j w L), behind the last part of a lag L. No dive can separate the part
of that response that resembles the ones of mass and damping.
"""

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, MASSES
from identify.estimators.lateness import LATER_S
from identify.planning.knowledge import NAMES, AxisNoise, Knowledge

Array = NDArray[np.float64]

TELLING_HZ = 5.0
"""Above this frequency a DVL reads nothing, and no vehicle of this size moves."""


def of_motion(step_s: float, nu: Array, knowledge: Knowledge, dofs: tuple[int, ...]) -> Array:
    """Information (12, 12) about log coefficients from the axes `dofs`, moving as `nu` (n, 6) from rest to rest.

    Rows are `step_s` apart; the order is that of `NAMES`.
    """
    out = np.zeros((len(NAMES), len(NAMES)))
    for dof in dofs:
        mass, damping = MASSES[dof].name, DAMPINGS[dof].name
        information = of_axis(
            step_s, nu[:, dof], knowledge.values[mass], knowledge.values[damping], knowledge.noise[dof]
        )
        for name, value in zip((mass, damping), information, strict=True):
            out[NAMES.index(name), NAMES.index(name)] = value
    return out


def of_timing(step_s: float, nu: Array, knowledge: Knowledge, dofs: tuple[int, ...]) -> Array:
    """Information (k, 12) that log coefficients share with the time of thrust, s, in each of the k axes `dofs`."""
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
    """Information about log M and log D in the velocity (n,) of an axis."""
    w, weight = _spectrum(step_s, velocity, mass, damping, noise)
    return float(np.sum((mass * w) ** 2 * weight)), float(np.sum(damping**2 * weight))


def _read(w: Array, noise: AxisNoise) -> Array:
    """Noise density of a velocity that is measured directly and also as the slope of its measured integral."""
    return np.asarray(1.0 / (1.0 / noise.velocity + 1.0 / (w * w * noise.position)))


def _pushed(w: Array, noise: AxisNoise) -> Array:
    """Spectral density of the disturbance."""
    return np.asarray(
        2 * noise.disturbance**2 * noise.time_constant_s / (1 + (w * noise.time_constant_s) ** 2)
    )


def _spectrum(
    step_s: float, velocity: Array, mass: float, damping: float, noise: AxisNoise
) -> tuple[Array, Array]:
    """Frequencies (m,), rad/s, and |V|^2 / (|Z|^2 N + S_d) at these."""
    frequency = np.asarray(np.fft.rfftfreq(len(velocity), step_s), dtype=np.float64)
    power = np.abs(np.fft.rfft(velocity) * step_s) ** 2
    used = (frequency > 0) & (frequency <= TELLING_HZ)
    w = 2 * np.pi * frequency[used]
    power = power[used]
    impedance = (mass * w) ** 2 + damping**2
    # Factor 2 for the negative frequencies, 1 / duration for the width of a spectral line.
    weight: Array = 2.0 * power / (impedance * _read(w, noise) + _pushed(w, noise)) / (len(velocity) * step_s)
    return w, weight
