"""Compares the mass and damping in a feed-forward with those that the PID's force shows; see `raising`."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS
from identify.dive import Array
from identify.filters import AlignedDive
from identify.glance.criteria import ANEW, Criterion
from identify.validate import LEAST_SLOPE, Phases

RATE_HZ: Final = 10.0
LEAST_LIKENESS: Final = 0.8
SIZES: Final = (0.5**0.5, 2.0**0.5)
FLOWN: Final = (0.5, 2.0)
LATE_S: Final = 2.0
"""Time for which a vehicle still moves after its reference: the PID is late by up to that."""

MEMORY_S: Final = 4.0
"""Longest time over which the residuals of the PID's force are taken as correlated."""

Mask = NDArray[np.bool_]


def beside_pid(
    dof: int, reference: Array, fed: Array, pid: Array, motion: AlignedDive, of: Phases
) -> list[Criterion]:
    """Compare feed-forward and PID of an axis.

    `reference` (n, 14), `fed` (TAU_FF) and `pid` (TAU_PID) (n,) are given at the instants of `motion`, `of` holds the
    phases of the axis.
    """
    wanted = np.column_stack([reference[:, 6 + dof], reference[:, dof]])
    (mass, damping), *_ = np.linalg.lstsq(wanted[of.any], fed[of.any], rcond=None)
    near = _widened(of.any, LATE_S) & motion.valid
    seen = np.column_stack([motion.nu_dot[:, dof], motion.nu[:, dof]])[near]
    (of_mass, of_damping), (mass_error, damping_error) = _fitted(seen, pid[near])
    like = _likeness(seen @ [mass, damping], pid[near])
    words = f"{like:.2f} between feed-forward and PID, at least {LEAST_LIKENESS:g}"
    axis = DOFS[dof]
    criteria = [Criterion(f"{axis} likeness", like >= LEAST_LIKENESS, words, ANEW)]
    units = ("kg", "N/(m/s)") if dof < 3 else ("kg m²", "N m/(rad/s)")
    # A reference that jumps from speed to speed has no acceleration, so the feed-forward's mass does not show.
    if np.abs(wanted[:, 0]).max() > LEAST_SLOPE:
        criteria.append(_size(f"{axis} mass", mass, of_mass, mass_error, units[0]))
    return [*criteria, _size(f"{axis} damping", damping, of_damping, damping_error, units[1])]


def _size(what: str, fed: float, seen: float, error: float, unit: str) -> Criterion:
    low, middle, high = (fed / max(value, 1e-9) for value in (seen + 1.96 * error, seen, seen - 1.96 * error))
    shown = f"{fed:.3g} {unit} fed, PID {seen:.3g} ± {1.96 * error:.2g}: "
    words = f"{shown}×{middle:.2f} ({SIZES[0]:.2f} to {SIZES[1]:.2f})"
    if high < SIZES[0] or low > SIZES[1]:
        return Criterion(what, False, words, ANEW)
    if not (SIZES[0] <= middle <= SIZES[1] and FLOWN[0] <= low and high <= FLOWN[1]):
        return Criterion(what, None, f"{shown}not shown well enough")
    return Criterion(what, True, words)


def _fitted(x: Array, y: Array) -> tuple[Array, Array]:
    """Least-squares factors of the columns of x (n, k) for y (n,), and their standard errors.

    The standard errors allow for correlated residuals (Newey and West 1987).
    """
    factors, *_ = np.linalg.lstsq(x, y, rcond=None)
    pull = x * (y - x @ factors)[:, None]
    spread = pull.T @ pull
    steps = round(MEMORY_S * RATE_HZ)
    for k in range(1, min(steps, len(pull))):
        apart = (1 - k / steps) * pull[k:].T @ pull[:-k]
        spread += apart + apart.T
    inverse = np.linalg.pinv(x.T @ x)
    error: Array = np.sqrt(np.maximum(np.diag(inverse @ spread @ inverse), 0.0))
    return np.asarray(factors, np.float64), error


def _widened(mask: Mask, seconds: float) -> Mask:
    """Extend each stretch of the mask by `seconds` at its end."""
    late = np.convolve(mask, np.ones(round(seconds * RATE_HZ) + 1))[: len(mask)]
    return np.asarray(late > 0)


def _likeness(a: Array, b: Array) -> float:
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0 else 0.0
