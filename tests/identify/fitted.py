"""Fits as an estimator hands them over, made up: values, correlations and information as a test wants them."""

from pathlib import Path

import numpy as np

from bridge.vehicle.coefficients import ADDED_MASS_NAMES, COEFFICIENTS
from bridge.vehicle.config import Configuration, Prior, ThrustCurve, Thruster, Vehicle, VehicleFile
from identify.dive import Dive
from identify.doubt import Outcome
from identify.identification import Identification, Information, added_mass, estimate
from identify.statistics import Z95

NOT_DIVED = "the thrusters never pushed there"


def shape(**keys) -> Configuration:
    thruster = Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    return Configuration(dry_mass_kg=72.0, inertia_kgm2=(3.0, 9.0, 10.0), thrusters=(thruster,), **keys)


def vehicle_file(scale_std: float = 0.1, **keys) -> VehicleFile:
    vehicle = Vehicle("made up", {"only": shape(**keys)}, thrust_curve=ThrustCurve(scale_std=scale_std))
    return VehicleFile(Path("made-up.yaml"), vehicle, None, "0" * 64)


def dive() -> Dive:
    """A dive that holds nothing: what is judged here is the fit alone."""
    return Dive("dive-7", Path("dive-7.tlog"), "1" * 64)


def fit(
    values: dict[str, float],
    relative: np.ndarray,
    information: Information | None = None,
    method: str = "likelihood",
    outcome: Outcome = Outcome.CONVERGED,
    **keys,
) -> Identification:
    """`relative` (n, n): covariance of the logarithms of `values`; all other coefficients were not dived."""
    names, nan = list(values), float("nan")
    std = np.sqrt(np.diag(relative))
    totals = []
    for c in COEFFICIENTS:
        if c.name not in values:
            totals.append(estimate(c.name, nan, nan, nan, nan, NOT_DIVED))
            continue
        value, s = values[c.name], float(std[names.index(c.name)])
        reason = "the dive says too little of it" if s > 0.3 else ""
        ends = (value * np.exp(-Z95 * s), value * np.exp(Z95 * s))
        totals.append(estimate(c.name, value, value * s, *map(float, ends), reason))
    size = np.array(list(values.values()))
    return Identification(
        method,
        outcome,
        (*totals, *(added_mass(total, shape()) for total in totals[: len(ADDED_MASS_NAMES)])),
        "only",
        "dive-7",
        "1" * 64,
        "made up",
        "0" * 64,
        100.0,
        1000,
        covariance=np.asarray(relative) * np.outer(size, size),
        covariance_of=tuple(names),
        information=information,
        **keys,
    )


def prior(value: float, relative_std: float, rests_on: str = "weight", source: str = "") -> Prior:
    return Prior(value, value * relative_std, source, rests_on)


def gaussian(e, s):
    """Log likelihood of innovations of these variances, without constants; -inf if a variance is not positive."""
    return -0.5 * float(np.sum(np.log(s) + e * e / s)) if np.all(s > 0) else -np.inf


def weigh(e, s, de, ds):
    """Gradient (p,) and information (p, p) from innovations and variances (n,) and their derivatives (p, n)."""
    root = np.sqrt(s)
    slope, widening, whitened = de / root, ds / s, e / root
    gradient = -(slope @ whitened) - 0.5 * (widening @ (1.0 - whitened**2))
    return gradient, slope @ slope.T + 0.5 * widening @ widening.T
