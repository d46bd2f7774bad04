"""Each method's answer to a dive, as plain data that a cache can keep."""

import math
from importlib import import_module
from typing import cast

from bench.remembered import Data
from bridge.errors import FitError
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.estimators.table import Estimator, estimator
from identify.nuisance import trim

OWN = {
    "closed form": "bench.baselines.closed_form",
    "least squares": "bench.baselines.least_squares",
    "PySINDy": "bench.baselines.sindy",
    "PySINDy weak": "bench.baselines.sindy_weak",
}
TITLES = {
    "likelihood": "likelihood",
    "pinn": "pinn",
    "closed form": "closed form of the paper's loss",
    "least squares": "finite-difference least squares",
}
"""The methods that `shorter_recordings` and `prediction` compare, the product's first."""


def method(name: str) -> Estimator:
    """`estimate` of one of the product's methods or of the benchmark's own."""
    return cast(Estimator, import_module(OWN[name]).estimate) if name in OWN else estimator(name)


def answered(name: str, dive: Dive, file: VehicleFile, configuration: str) -> Data:
    """A method's answer to a dive as JSON; if it refuses, the answer is empty and states the reason.

    `value` and `half95`, half the width of the 95 % interval, by coefficient, of the identifiable coefficients; no
    `half95` of a method that states no interval. `trim` (6,): the estimated steady wrench, N and N m. `refusal`: why
    there is no value, "" otherwise.
    """
    try:
        identified = method(name)(dive, file, configuration, lambda *_report: None)
    except FitError as error:
        return {"value": {}, "half95": {}, "trim": [0.0] * 6, "refusal": str(error)}
    stated = [p for p in identified.parameters if p.identifiable and p.name in BY_NAME]
    return {
        "value": {p.name: p.value for p in stated},
        "half95": {p.name: (p.high95 - p.low95) / 2 for p in stated if math.isfinite(p.high95 - p.low95)},
        "trim": [identified.nuisance.get(trim(dof), 0.0) for dof in range(6)],
        "refusal": "",
    }
