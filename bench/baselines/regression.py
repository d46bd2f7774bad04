"""Each axis's equation of motion as a regression on its true terms alone.

    tau_i - g_i = M_i nu_dot_i + D_i nu_i + (two products of velocities) + a constant
The products are those of C(nu) nu with a diagonal M; their coefficients are free.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import COEFFICIENTS, DOFS
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.dynamics import restoring
from identify.align import AlignedDive, aligned
from identify.dive import Dive
from identify.doubt import Outcome
from identify.identification import Estimate, Identification
from identify.identification import estimate as one_estimate
from identify.progress import Progress
from identify.statistics import Z95

PRODUCTS = (
    ((2, 4), (1, 5)),
    ((0, 5), (2, 3)),
    ((1, 3), (0, 4)),
    ((1, 2), (4, 5)),
    ((0, 2), (3, 5)),
    ((0, 1), (3, 4)),
)
"""Velocities whose products push each axis (Fossen 2011, eq. 6.44 for a diagonal M)."""

RATE_HZ = 20.0

LEAST_DRIVE = 1e-3
"""An axis whose thrust has less spread than this share of one thruster's limit (N, or N m) counts as not pushed."""


@dataclass(frozen=True)
class AxisTerms:
    """Terms of one axis on a uniform grid, (n,) each: thrust less restoring force, velocity, the two products."""

    dof: int
    rate_hz: float
    force: Array
    velocity: Array
    acceleration: Array
    products: Array


@dataclass(frozen=True)
class AxisAnswer:
    """Mass and damping with their standard deviations; NaN if the method states none."""

    mass: float
    damping: float
    mass_std: float = float("nan")
    damping_std: float = float("nan")


def axis_terms(dive: Dive, file: VehicleFile, name: str, rate_hz: float, cutoff_hz: float) -> list[AxisTerms]:
    """The terms of every axis that the dive pushes, at times with known bottom velocity.

    Raises FitError if the thrusters push no axis.
    """
    shape = file.vehicle.configurations[name]
    grid = aligned(dive, file, name, rate_hz, cutoff_hz)
    g = np.column_stack([np.broadcast_to(x, len(grid)) for x in restoring(shape, list(grid.attitude.T))])
    axes = []
    for dof in range(6):
        if grid.has[dof] and np.std(grid.tau[:, dof]) > LEAST_DRIVE * shape.thruster_limit_n:
            axes.append(_terms(grid, g, dof, rate_hz))
    if not axes:
        raise FitError(f"{dive.name}: the thrusters pushed no axis; dive with changes of speed")
    return axes


def _terms(grid: AlignedDive, g: Array, dof: int, rate_hz: float) -> AxisTerms:
    nu = grid.nu
    products = np.column_stack([nu[:, a] * nu[:, b] for a, b in PRODUCTS[dof]])
    return AxisTerms(dof, rate_hz, grid.tau[:, dof] - g[:, dof], nu[:, dof], grid.nu_dot[:, dof], products)


def axis_by_axis(
    method: str,
    fitted: Callable[[AxisTerms], AxisAnswer],
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    progress: Progress,
    cutoff_hz: float,
) -> Identification:
    """Masses and dampings of every axis that the dive pushes, each `fitted` by itself; the terms have RATE_HZ.

    Raises FitError if the thrusters push no axis.
    """
    started = time.perf_counter()
    terms = axis_terms(dive, file, configuration, RATE_HZ, cutoff_hz)
    answers = {axis.dof: fitted(axis) for axis in terms}
    progress(1.0, "solved")
    return Identification(
        method,
        Outcome.CONVERGED,
        tuple(_parameter(c.name, answers.get(c.dof), c.kind == "mass", DOFS[c.dof]) for c in COEFFICIENTS),
        configuration,
        dive.name,
        dive.sha256,
        file.vehicle.name,
        file.sha256,
        dive.duration_s,
        len(terms[0].force),
        wall_s=time.perf_counter() - started,
    )


def _parameter(name: str, answer: AxisAnswer | None, is_mass: bool, axis: str) -> Estimate:
    nan = float("nan")
    if answer is None:
        return one_estimate(name, nan, nan, nan, nan, f"the thrusters never pushed in {axis}")
    value = answer.mass if is_mass else answer.damping
    std = answer.mass_std if is_mass else answer.damping_std
    return one_estimate(name, value, std, value - Z95 * std, value + Z95 * std)
