"""PySINDy's weak form (Messenger and Bortz 2021): no derivative of the data, each term integrated against bumps.

`WeakPDELibrary` over time alone, with the same true terms as `sindy`. Needs the optional extra `bench`.
"""

import warnings

import numpy as np
import pysindy

from bench.baselines.regression import AxisTerms, axis_by_axis
from bench.baselines.sindy import UNFILTERED_HZ, fitted, optimizer
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.identification import Identification
from identify.progress import Progress

BUMP_S = 2.0
BUMPS_PER_S = 2.0
POWER = 4
SEED = 0


def estimate(dive: Dive, file: VehicleFile, configuration: str, progress: Progress) -> Identification:
    with warnings.catch_warnings():
        # PySINDy warns of its own use of its axes' labels.
        warnings.simplefilter("ignore")
        return axis_by_axis(
            "PySINDy weak",
            lambda axis: fitted(axis, _weak(axis)),
            dive,
            file,
            configuration,
            progress,
            UNFILTERED_HZ,
        )


def _weak(axis: AxisTerms) -> pysindy.SINDy:
    time_s = np.arange(len(axis.force)) / axis.rate_hz
    np.random.seed(SEED)  # noqa: NPY002  PySINDy places its bumps with numpy's global generator
    library = pysindy.WeakPDELibrary(
        function_library=pysindy.PolynomialLibrary(degree=1, include_bias=False),
        spatiotemporal_grid=time_s,
        include_bias=True,
        K=round(BUMPS_PER_S * time_s[-1]),
        H_xt=[BUMP_S / 2],
        p=POWER,
    )
    return pysindy.SINDy(optimizer=optimizer(), feature_library=library)
