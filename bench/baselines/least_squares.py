"""Finite-difference least squares: filter, differentiate, regress (Klein and Morelli 2006, ch. 5, equation error).

Velocity and thrust go through the same zero-phase low-pass, velocity through central differences; each axis's force
is then regressed on acceleration, velocity, the two products and a constant. The intervals are the textbook's, as if
the residuals were white.
"""

import numpy as np

from bench.baselines.regression import AxisAnswer, AxisTerms, axis_by_axis
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.identification import Identification
from identify.progress import Progress

CUTOFF_HZ = 0.5
"""The best of 0.3, 0.5, 1, 2 and 5 Hz on missions that the benchmark does not use; there, force on acceleration came
out better than acceleration on force."""


def estimate(
    dive: Dive, file: VehicleFile, configuration: str, progress: Progress, cutoff_hz: float = CUTOFF_HZ
) -> Identification:
    return axis_by_axis("least squares", fitted, dive, file, configuration, progress, cutoff_hz)


def fitted(axis: AxisTerms) -> AxisAnswer:
    """Ordinary least squares: covariance s^2 (X'X)^-1."""
    table = np.column_stack([axis.acceleration, axis.velocity, axis.products, np.ones(len(axis.force))])
    scale = np.maximum(np.abs(table).max(axis=0), 1e-12)
    inverse = np.linalg.pinv((table / scale).T @ (table / scale), hermitian=True) / np.outer(scale, scale)
    coefficient = inverse @ (table.T @ axis.force)
    residual = axis.force - table @ coefficient
    variance = float(residual @ residual) / (len(residual) - table.shape[1])
    mass_std, damping_std, *_ = np.sqrt(variance * np.diag(inverse)).tolist()
    return AxisAnswer(float(coefficient[0]), float(coefficient[1]), mass_std, damping_std)
