"""Whether the feed-forward of one axis is right, by the PID beside it or by its tracking errors; limits: `raising`."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from bridge.arrays import Array, Mask
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.mode import Mode
from identify.align import AlignedDive, low_pass
from identify.dive import Dive
from identify.statistics import covariance_of_sum
from identify.validation.tracking import (
    CUTOFF_HZ,
    LEAST_SLOPE,
    SHORTEST_RUN_S,
    Phases,
    lever_of,
    phases,
    tracking_errors,
)
from identify.words import significant

OF_THE_TIME: Final = 0.99
RATE_HZ: Final = 10.0
LEAST_LIKENESS: Final = 0.8
SIZES: Final = (0.5**0.5, 2.0**0.5)
FLOWN: Final = (0.5, 2.0)
LATE_S: Final = 2.0
"""Time for which a vehicle still moves after its reference: the PID is late by up to that."""

MEMORY_S: Final = 4.0
"""Longest time over which the residuals of the PID's force are taken as correlated."""

PAPER_STEADY, PAPER_SPEEDING_UP = 0.0336 / 0.5, 0.0212 / 0.5
MOST_OF_PAPER: Final = 2.0
MOST_LEFT: Final = 0.5


@dataclass(frozen=True)
class Criterion:
    """A check of a dive.

    quantity: the quantity checked, such as `surge mass`. passed: None if the dive does not show it. words: the figure
    with its limit. mend: what to do if the check fails. by_motion: judged by the forces or errors of an axis, which the
    sea may have made.
    """

    quantity: str
    passed: bool | None
    words: str
    mend: str = ""
    by_motion: bool = False


def _judged(name: str, passed: bool, words: str) -> Criterion:
    """A criterion by the motion of an axis."""
    mend = "identify from this dive, upload, and dive in shadow again"
    return Criterion(name, passed, words, mend, by_motion=True)


def of_axis(dof: int, mode: Mode, dive: Dive, motion: AlignedDive, file: VehicleFile) -> list[Criterion]:
    """The criteria of an axis that is driven in `mode`; the dive holds NU_REF, TAU_FF and TAU_PID."""
    assert dive.nu_ref is not None
    assert dive.tau_ff is not None
    assert dive.tau_pid is not None
    reference = dive.nu_ref.at(motion.time_s)
    of, axis = phases(reference[:, dof], reference[:, 6 + dof]), DOFS[dof]
    if of.steady.sum() < SHORTEST_RUN_S * RATE_HZ:
        return [Criterion(axis, None, f"no speed was held for {SHORTEST_RUN_S:g} s: nothing is known of it")]
    fed = dive.tau_ff.at(motion.time_s)[:, dof]
    zero = float(np.mean((np.nan_to_num(fed) == 0.0)[of.any]))
    if zero > 1 - OF_THE_TIME:
        words = (
            f"TAU_FF is zero in {100 * zero:.0f} % of the motion: a coefficient is missing or out of bounds"
        )
        mend = "read what the vehicle said, and upload a set that it can fly"
        return [Criterion(f"{axis} not fed", False, words, mend)]
    if mode is Mode.ALONE:
        return _by_errors(dof, dive, file)
    pid = low_pass(dive.tau_pid.at(motion.time_s)[:, dof], RATE_HZ, CUTOFF_HZ)
    if mode is Mode.BOTH:
        return [_left_to_pid(axis, fed, pid, of)]
    if not motion.has[dof]:
        return [Criterion(axis, None, "no speed was measured there: nothing is known of it")]
    return _beside_pid(dof, reference, fed, pid, motion, of)


def _by_errors(dof: int, dive: Dive, file: VehicleFile) -> list[Criterion]:
    """Feed-forward alone: tracking error at a held speed and while accelerating."""
    axis = DOFS[dof]
    tracking = tracking_errors(dive, lever_of(file)).axis(axis)
    assert dive.nu_ref is not None
    if tracking is None or not tracking.speeds:
        return [Criterion(axis, None, "no speed was held: nothing is known of it")]
    worst = max(abs(at.error) / at.speed for at in tracking.speeds)
    top = float(np.nanmax(np.abs(dive.nu_ref.value[:, dof])))
    judged = [("held speed", worst, MOST_OF_PAPER * PAPER_STEADY, "speed held")]
    # A reference that jumps from speed to speed does not speed up, and of one that does so at once no delay is known.
    if math.isfinite(tracking.acceleration_less_delay):
        growing = tracking.acceleration_less_delay / top
        judged.append(
            ("speeding up", growing, MOST_OF_PAPER * PAPER_SPEEDING_UP, "top speed, its delay taken out")
        )
    return [
        _judged(
            f"{axis} {situation}",
            share <= limit,
            f"off by {100 * share:.1f} % of the {of}, at most {100 * limit:.1f} %",
        )
        for situation, share, limit, of in judged
    ]


def _left_to_pid(axis: str, fed: Array, pid: Array, of: Phases) -> Criterion:
    share = float(np.abs(pid[of.steady]).mean() / np.abs(fed[of.steady]).mean())
    words = (
        f"{100 * share:.0f} % of the feed-forward's force at a held speed, at most {100 * MOST_LEFT:.0f} %"
    )
    return _judged(f"{axis} left to the PID", share <= MOST_LEFT, words)


def _beside_pid(
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
    criteria = [_judged(f"{axis} likeness", like >= LEAST_LIKENESS, words)]
    units = ("kg", "N/(m/s)") if dof < 3 else ("kg m²", "N m/(rad/s)")
    # A reference that jumps from speed to speed has no acceleration, so the feed-forward's mass does not show.
    if np.abs(wanted[:, 0]).max() > LEAST_SLOPE:
        criteria.append(_size(f"{axis} mass", mass, of_mass, mass_error, units[0]))
    return [*criteria, _size(f"{axis} damping", damping, of_damping, damping_error, units[1])]


def _size(name: str, fed: float, seen: float, error: float, unit: str) -> Criterion:
    low, middle, high = (fed / max(value, 1e-9) for value in (seen + 1.96 * error, seen, seen - 1.96 * error))
    shown = f"{significant(fed)} {unit} fed, PID {significant(seen)} ± {significant(1.96 * error, 2)}: "
    # A quantity of the other sign has no ratio to the fed one.
    ratio = f"×{middle:.2f}" if seen > 0 else "of the other sign"
    words = f"{shown}{ratio} ({SIZES[0]:.2f} to {SIZES[1]:.2f})"
    if high < SIZES[0] or low > SIZES[1]:
        return _judged(name, False, words)
    if not (SIZES[0] <= middle <= SIZES[1] and FLOWN[0] <= low and high <= FLOWN[1]):
        return Criterion(name, None, f"{shown}not shown well enough")
    return Criterion(name, True, words)


def _fitted(x: Array, y: Array) -> tuple[Array, Array]:
    """Least-squares factors of the columns of x (n, k) for y (n,), and their standard errors.

    The standard errors allow for correlated residuals.
    """
    factors, *_ = np.linalg.lstsq(x, y, rcond=None)
    spread = covariance_of_sum(x * (y - x @ factors)[:, None], round(MEMORY_S * RATE_HZ))
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
