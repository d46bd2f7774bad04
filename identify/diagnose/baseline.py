"""The plain baseline of a diagnosis: each degree of freedom separately, by least squares.

By equation error (Ljung 1999, section 10.1), nu' = a tau(t - delay) - b nu - c |nu| nu - e sin(angle) + trim, with
the delay from a grid. It has no Coriolis forces, no library, no noise model: a diagnosis has to beat it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnose.simulation import EACH, RUN_AWAY
from identify.effects.course import Course, delayed

Array = NDArray[np.float64]

DELAYS_S = np.arange(51) * 0.02
"""Delays of the asked thrust that are tried, s."""

TERMS = 5
THRUST, LINEAR, QUADRATIC, RIGHTING, TRIM = range(TERMS)

RIGHTED = (3, 4)
"""Roll and pitch."""


@dataclass(frozen=True)
class Baseline:
    """terms (6, TERMS): acceleration by asked force (1/kg, 1/(kg m2)), speed, speed times its magnitude, sine of the
    angle and trim. delay_s (6,): delay of the asked thrust."""

    terms: Array
    delay_s: Array

    def flown(self, course: Course, measured: Array, starts: NDArray[np.int64], length: int) -> Array:
        """Velocities (w, length, 6) at the steps after each start, from the measured velocity (n, 6) there, by Heun's
        rule.

        n: every EACH-th instant of the course. The trims are refitted to `measured`, as those of any model are.
        """
        step_s = course.step_s * EACH
        pushed = self._pushed(course)
        trim = np.mean(np.gradient(measured, step_s, axis=0) - pushed + self._drag(measured), axis=0)
        pushed = pushed + trim
        nu, out = measured[starts], np.empty((len(starts), length, 6))
        for k in range(length):
            first = pushed[starts + k] - self._drag(nu)
            second = pushed[starts + k + 1] - self._drag(nu + step_s * first)
            nu = np.clip(nu + 0.5 * step_s * (first + second), -RUN_AWAY, RUN_AWAY)
            out[:, k] = nu
        return out

    def _pushed(self, course: Course) -> Array:
        """Acceleration (n, 6) by thrust and righting moment."""
        force, sines = course.wrench_of(course.asked_n), _sines(course)
        late = [delayed(force[:, [dof]], course.step_s, self.delay_s[dof])[::EACH, 0] for dof in range(6)]
        return np.asarray(self.terms[:, THRUST] * np.stack(late, axis=1) + self.terms[:, RIGHTING] * sines)

    def _drag(self, nu: Array) -> Array:
        return np.asarray(-(self.terms[:, LINEAR] + self.terms[:, QUADRATIC] * np.abs(nu)) * nu)


def baseline_of(course: Course, nu: Array) -> Baseline:
    """Fit the baseline to velocities nu (n, 6) at the times of a dive's course; of all delays, the best is kept."""
    moved = nu[::EACH]
    rate = np.gradient(moved, course.step_s * EACH, axis=0)
    force, sines = course.wrench_of(course.asked_n), _sines(course)
    terms, delay_s = np.zeros((6, TERMS)), np.zeros(6)
    for dof in range(6):
        columns = np.stack(
            [moved[:, dof], np.abs(moved[:, dof]) * moved[:, dof], sines[:, dof], np.ones(len(moved))]
        )
        late = np.stack(
            [delayed(force[:, [dof]], course.step_s, float(by_s))[::EACH, 0] for by_s in DELAYS_S]
        )
        sizes, left = _least_squares(late, columns, rate[:, dof])
        best = int(np.argmin(left))
        terms[dof], delay_s[dof] = sizes[best], DELAYS_S[best]
    return Baseline(terms, delay_s)


def _sines(course: Course) -> Array:
    """Sines (n, 6) of roll and pitch, 0 elsewhere."""
    out = np.zeros((len(course.euler[::EACH]), 6))
    out[:, RIGHTED] = np.sin(course.euler[::EACH, :2])
    return out


def _least_squares(own: Array, shared: Array, value: Array) -> tuple[Array, Array]:
    """Fits of each row of `own` (d, n) together with the rows `shared` (k, n).

    Returns the sizes (d, 1 + k), 0 if undetermined, and the mean squares of the residuals (d,).
    """
    rows = np.vstack([own, shared])
    length = np.sqrt(np.mean(rows**2, axis=1))
    unit = rows / np.where(length > 0, length, 1.0)[:, None]
    square, right, count = unit @ unit.T, unit @ value, len(own)
    sizes, left = np.zeros((count, 1 + len(shared))), np.zeros(count)
    for k in range(count):
        of = np.r_[k, count : len(rows)]
        fitted, *_ = np.linalg.lstsq(square[np.ix_(of, of)], right[of], rcond=1e-9)
        sizes[k] = fitted / np.where(length[of] > 0, length[of], 1.0)
        left[k] = np.mean((value - fitted @ unit[of]) ** 2)
    return sizes, left
