"""PySINDy (Brunton, Proctor and Kutz 2016) with the library of the true terms of each axis.

Given the true terms, its sparse regression has nothing left to select: threshold 0, so that no true term is dropped.
It regresses acceleration on force: the mass is the inverse of the force's coefficient, the damping is the velocity's
coefficient over the force's. The derivative is PySINDy's recommendation for noisy data, SmoothedFiniteDifference with
its defaults (Savitzky-Golay, cubic, 11 samples). It states no interval. Needs the optional extra `bench`.
"""

import numpy as np
import pysindy

from bench.baselines.regression import RATE_HZ, AxisAnswer, AxisTerms, axis_by_axis
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.identification import Identification
from identify.progress import Progress

UNFILTERED_HZ = RATE_HZ / 2
RIDGE = 1e-8


def estimate(dive: Dive, file: VehicleFile, configuration: str, progress: Progress) -> Identification:
    return axis_by_axis(
        "PySINDy",
        lambda axis: fitted(axis, _differentiated()),
        dive,
        file,
        configuration,
        progress,
        UNFILTERED_HZ,
    )


def _differentiated() -> pysindy.SINDy:
    return pysindy.SINDy(
        optimizer=optimizer(),
        feature_library=pysindy.PolynomialLibrary(degree=1),
        differentiation_method=pysindy.SmoothedFiniteDifference(),
    )


def optimizer() -> pysindy.STLSQ:
    """Sequentially thresholded least squares that drops nothing."""
    return pysindy.STLSQ(threshold=0.0, alpha=RIDGE, normalize_columns=True)


def fitted(axis: AxisTerms, model: pysindy.SINDy) -> AxisAnswer:
    """The model's coefficients of force and velocity; each term is scaled to 1, which changes no answer."""
    inputs = np.column_stack([axis.force, axis.products])
    scale = np.maximum(np.std(inputs, axis=0), 1e-12)
    model.fit(axis.velocity[:, None], t=1.0 / axis.rate_hz, u=inputs / scale)
    names = model.get_feature_names()
    by_name = dict(zip(names, np.asarray(model.coefficients())[0], strict=True))
    by_force = float(by_name["u0"] / scale[0])
    return AxisAnswer(1.0 / by_force, -float(by_name["x0"]) / by_force)
