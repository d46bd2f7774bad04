"""`estimate`: what the trained network says of a dive, as an Identification."""

import time

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, DOFS, MASSES
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.estimators.axes import build_axes
from identify.estimators.doubts import DOUBTFUL_SCORE
from identify.estimators.innovations import POSITION
from identify.estimators.pinn.fit import Fit, Progress, fit_network
from identify.estimators.pinn.training import MOST_PASSES
from identify.estimators.said import drag_doubt, long_enough, strange_doubts, too_little, unsettled_doubt
from identify.estimators.unseen import unseen_doubts
from identify.identification import (
    LARGEST_RELATIVE_STD,
    Z95,
    Doubt,
    Estimate,
    Identification,
    Information,
    added_mass,
    outcome_of,
)
from identify.identification import estimate as as_estimate

Array = NDArray[np.float64]


def estimate(dive: Dive, file: VehicleFile, configuration: str, progress: Progress) -> Identification:
    """Total masses and linear dampings of all axes that the dive drives, with 95 % intervals.

    Raises FitError where the recording is too short, or holds no thruster command at all.
    """
    began = time.perf_counter()
    long_enough(dive)
    built = build_axes(dive, file, configuration)
    shape = file.vehicle.configurations[configuration]
    fit = fit_network(dive, file, configuration, built, progress) if built.axes else None
    totals = tuple(_one(c.name, c.dof, fit, built.missing) for c in (*MASSES, *DAMPINGS))
    doubts = (*strange_doubts(built.strange), *unseen_doubts(built), *(() if fit is None else _doubts(fit)))
    names, covariance = ((), np.zeros((0, 0))) if fit is None else _covariance(fit, totals)
    return Identification(
        "pinn",
        outcome_of(totals, doubts),
        (*totals, *(added_mass(total, shape) for total in totals[:6])),
        configuration,
        dive.name,
        dive.sha256,
        file.vehicle.name,
        file.sha256,
        dive.duration_s,
        sum(int(np.isfinite(axis.reading).sum()) for axis in built.axes),
        covariance,
        names,
        {} if fit is None else _nuisance(fit),
        (*dive.notes, *built.notes),
        time.perf_counter() - began,
        information=None if fit is None else _information(fit),
        doubts=doubts,
        rest_on_righting=built.rest_on_righting,
    )


def _place(fit: Fit, name: str) -> int:
    """Where a coefficient stands among the fit's values."""
    coefficient = BY_NAME[name]
    axis = fit.layout.dofs.index(coefficient.dof)
    return coefficient.dof if coefficient.kind == "mass" else 6 + axis


def _shift(fit: Fit, dof: int, place: int) -> float:
    """By what share a value changes once the quadratic drag of its own axis is let in, where one is missing."""
    axis = fit.layout.dofs.index(dof)
    return float(fit.drag_shift[axis, place]) if abs(fit.drag_score[axis]) > DOUBTFUL_SCORE else 0.0


def _one(name: str, dof: int, fit: Fit | None, missing: dict[int, str]) -> Estimate:
    """A coefficient with the interval of its logarithm, or the reason why it has none."""
    if fit is None or dof not in fit.layout.dofs:
        nan = float("nan")
        return as_estimate(name, nan, nan, nan, nan, missing[dof])
    place = _place(fit, name)
    value, shift = float(fit.values[place]), _shift(fit, dof, place)
    std = float(np.hypot(np.sqrt(fit.covariance[place, place]), shift))
    axis = fit.layout.dofs.index(dof)
    below, above = fit.stretch[axis if place == dof else len(fit.layout.dofs) + axis]
    reason, widest = "", std * float(max(below, above))
    if widest > LARGEST_RELATIVE_STD:
        reason = too_little(name, DOFS[dof], widest, shift, value * float(np.exp(shift)))
    low, high = value * np.exp(-Z95 * std * below), value * np.exp(Z95 * std * above)
    return as_estimate(name, value, value * std, float(low), float(high), reason)


def _covariance(fit: Fit, totals: tuple[Estimate, ...]) -> tuple[tuple[str, ...], Array]:
    """Names and covariance of the coefficients that were fitted."""
    fitted = [total for total in totals if BY_NAME[total.name].dof in fit.layout.dofs]
    places = [_place(fit, total.name) for total in fitted]
    relative = fit.covariance[np.ix_(places, places)].copy()
    for row, (one, place) in enumerate(zip(fitted, places, strict=True)):
        for column, (other, beside) in enumerate(zip(fitted, places, strict=True)):
            dof = BY_NAME[one.name].dof
            if dof == BY_NAME[other.name].dof:
                relative[row, column] += _shift(fit, dof, place) * _shift(fit, dof, beside)
    values = np.array([total.value for total in fitted])
    return tuple(total.name for total in fitted), relative * np.outer(values, values)


def _information(fit: Fit) -> Information:
    """What the dive tells of mass, damping and trim of all axes, all else projected out; trims in shares of the
    force that drove their axis."""
    of, places, scale = [], [], []
    n = len(fit.layout.dofs)
    for axis, dof in enumerate(fit.layout.dofs):
        of += [MASSES[dof].name, DAMPINGS[dof].name, f"{DOFS[dof]}_trim"]
        places += [dof, 6 + axis, 6 + n + axis]
        scale += [1.0, 1.0, float(np.sqrt(np.mean(fit.layout.push[:, axis] ** 2)))]
    return Information(tuple(of), fit.information_of(places) * np.outer(scale, scale))


def _doubts(fit: Fit) -> tuple[Doubt, ...]:
    told = [
        drag_doubt(dof, float(score))
        for dof, score in zip(fit.layout.dofs, fit.drag_score, strict=True)
        if abs(score) > DOUBTFUL_SCORE
    ]
    if not fit.settled:
        names = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in fit.layout.dofs)
        told.append(unsettled_doubt(names, "the network", f"{MOST_PASSES} passes"))
    return tuple(told)


def _nuisance(fit: Fit) -> dict[str, float]:
    """Noise levels and trims by name, with the unit in the name."""
    out: dict[str, float] = {}
    n = len(fit.layout.dofs)
    for axis, dof in enumerate(fit.layout.dofs):
        force = "n" if dof < 3 else "nm"
        out[f"{DOFS[dof]}_disturbance_std_{force}"] = float(fit.disturbance[axis])
        out[f"{DOFS[dof]}_disturbance_time_constant_s"] = float(fit.time_constant_s[axis])
        out[f"{DOFS[dof]}_trim_{force}"] = float(fit.values[6 + n + axis])
    for channel, name in enumerate(fit.layout.channel_name):
        dof = fit.layout.dofs[fit.layout.channel_axis[channel]]
        placed = fit.layout.channel_reads[channel] == POSITION
        unit = ("m" if dof < 3 else "rad") if placed else ("m_s" if dof < 3 else "rad_s")
        out[f"{DOFS[dof]}_{name}_noise_std_{unit}"] = float(fit.sensor[channel])
    return out
