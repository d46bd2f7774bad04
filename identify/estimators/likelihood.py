"""Innovations maximum likelihood: a Kalman filter on the vehicle's dynamics with a Gauss-Markov disturbance.

Closed loop does no harm here: the likelihood of each reading given all before it is the same whether or not a
controller chose the thrust from those readings (Ljung 1999, section 13.4), as long as the readings that the
controller used are among them. Noise levels and the disturbance's time constant are fitted with the
coefficients; intervals come from the Fisher information.
"""

import time
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from bridge.errors import FitError
from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive, Signal
from identify.estimators.axes import build_axes
from identify.estimators.doubts import Doubts, doubts_of, unexplained_feedback
from identify.estimators.innovations import POSITION
from identify.estimators.likelihood_axis import (
    DAMPING,
    DISTURBANCE,
    FORCES,
    MASS,
    TIME_CONSTANT,
    AxisFit,
    fit_axes,
)
from identify.identification import Estimate, Identification, Outcome, added_mass
from identify.identification import estimate as as_estimate

Array = NDArray[np.float64]

SHORTEST_DIVE_S = 20.0
LARGEST_RELATIVE_STD = 0.30
"""A relative standard error above this is called not identifiable."""

Z95 = 1.959963984540054


def estimate(
    dive: Dive, file: VehicleFile, configuration: str, progress: Callable[[float, str], None]
) -> Identification:
    """Total masses and linear dampings of all axes that the dive drives, with 95 % intervals.

    Raises FitError where the recording is too short, or holds no thruster command at all.
    """
    began = time.perf_counter()
    if dive.duration_s < SHORTEST_DIVE_S:
        raise FitError(
            f"{dive.name}: the dive lasts {dive.duration_s:.0f} s, identification needs at least "
            f"{SHORTEST_DIVE_S:.0f} s; record a longer one"
        )
    built = build_axes(dive, file, configuration)
    shape = file.vehicle.configurations[configuration]
    fits = fit_axes(built.axes, shape, progress)
    hidden = _hidden_feedback(dive, file, fits)
    doubts = {dof: doubts_of(fit, hidden.get(dof)) for dof, fit in fits.items()}
    progress(1.0, "done")
    totals = tuple(
        _one(c.name, c.dof, place, fits, doubts, built.missing)
        for place, group in ((MASS, MASSES), (DAMPING, DAMPINGS))
        for c in group
    )
    names, covariance = _covariance(totals, fits, doubts)
    return Identification(
        "likelihood",
        _outcome(totals, fits, doubts, built.strange),
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
        _nuisance(fits),
        (*dive.notes, *built.notes, *_drag_notes(doubts), *_strange_notes(built.strange)),
        time.perf_counter() - began,
        {DOFS[dof]: _innovations(fit) for dof, fit in fits.items()},
    )


def _innovations(fit: AxisFit) -> Signal:
    """Each reading's innovation over its standard deviation."""
    error, variance = fit.problem.filtered(fit.maximum.theta, np.inf)
    read = np.isfinite(error)
    return Signal(fit.problem.axis.time_s[read], (error[read] / np.sqrt(variance[read]))[:, None])


def _hidden_feedback(dive: Dive, file: VehicleFile, fits: Mapping[int, AxisFit]) -> dict[int, float | None]:
    """The share of the controller's wrench that no reading explains, for surge, sway and heave."""
    depth = dive.depth_by(file.vehicle.water)
    at_control = None
    if depth is not None and dive.tau_pid is not None:
        at_control = depth.held_at(dive.tau_pid.time_s)[:, 0]
    return {dof: unexplained_feedback(dive, dof, at_control) for dof in fits if dof < 3}


def _one(
    name: str,
    dof: int,
    place: int,
    fits: Mapping[int, AxisFit],
    doubts: Mapping[int, Doubts],
    missing: Mapping[int, str],
) -> Estimate:
    """A coefficient with the interval of its logarithm, or the reason why it has none."""
    axis, nan = DOFS[dof], float("nan")
    if dof not in fits:
        return as_estimate(name, nan, nan, nan, nan, missing[dof])
    if place == MASS and doubts[dof].hidden:
        reason = (
            f"the controller steered {axis} by a reading that is not the recorded one ({100 * doubts[dof].hidden:.0f} "
            "% of its wrench follows from nothing recorded), which passes for mass: log what it used"
        )
        return as_estimate(name, nan, nan, nan, nan, reason)
    value = float(np.exp(fits[dof].maximum.theta[place]))
    std = float(np.hypot(np.sqrt(fits[dof].covariance[place, place]), doubts[dof].shift[place]))
    reason = ""
    if std > LARGEST_RELATIVE_STD and abs(doubts[dof].shift[place]) > LARGEST_RELATIVE_STD:
        reason = (
            f"{axis} has a drag that grows as the speed squared, which the model lacks: with it {name} would be "
            f"{value * np.exp(doubts[dof].shift[place]):.3g}"
        )
    elif std > LARGEST_RELATIVE_STD:
        reason = f"the dive says too little of {axis}: the relative standard error is {100 * std:.0f} %"
    low, high = value * np.exp(-Z95 * std), value * np.exp(Z95 * std)
    return as_estimate(name, value, value * std, float(low), float(high), reason)


def _covariance(
    totals: tuple[Estimate, ...], fits: Mapping[int, AxisFit], doubts: Mapping[int, Doubts]
) -> tuple[tuple[str, ...], Array]:
    """Names and covariance of the identifiable coefficients; those of different axes are independent."""
    kept = [(i % 6, i // 6, total) for i, total in enumerate(totals) if total.identifiable]
    out = np.zeros((len(kept), len(kept)))
    for row, (dof, place, total) in enumerate(kept):
        for column, (other_dof, other_place, other) in enumerate(kept):
            if dof == other_dof:
                shifts = doubts[dof].shift[place] * doubts[dof].shift[other_place]
                relative = fits[dof].covariance[place, other_place] + shifts
                out[row, column] = relative * total.value * other.value
    return tuple(total.name for _, _, total in kept), out


def _outcome(
    totals: tuple[Estimate, ...], fits: Mapping[int, AxisFit], doubts: Mapping[int, Doubts], strange: str
) -> Outcome:
    if not any(total.identifiable for total in totals):
        return Outcome.NOT_IDENTIFIABLE
    if strange:
        return Outcome.DISAGREES
    if not all(fits[i % 6].maximum.converged for i, total in enumerate(totals) if total.identifiable):
        return Outcome.UNSETTLED
    if any(doubt.lacks_drag for doubt in doubts.values()):
        return Outcome.DISAGREES
    return Outcome.CONVERGED


def _drag_notes(doubts: Mapping[int, Doubts]) -> tuple[str, ...]:
    return tuple(
        f"In {DOFS[dof]} a force that grows as the speed squared is missing from the model ({doubt.drag_score:+.0f} "
        "standard errors): mass and linear damping hold for the speeds of this dive alone; their intervals are "
        "widened by what such a force would change."
        for dof, doubt in doubts.items()
        if doubt.lacks_drag
    )


def _strange_notes(strange: str) -> tuple[str, ...]:
    if not strange:
        return ()
    return (
        f"These values hardly mean this vehicle: {strange}. Give the vehicle file and configuration of the dive.",
    )


def _nuisance(fits: Mapping[int, AxisFit]) -> dict[str, float]:
    """Noise levels and trims by name, with the unit in the name."""
    out = {}
    for dof, fit in fits.items():
        theta, name, axis = fit.maximum.theta, DOFS[dof], fit.problem.axis
        force, speed, place = ("n", "m_s", "m") if dof < 3 else ("nm", "rad_s", "rad")
        out[f"{name}_disturbance_std_{force}"] = float(np.exp(theta[DISTURBANCE]))
        out[f"{name}_disturbance_time_constant_s"] = float(np.exp(theta[TIME_CONSTANT]))
        out[f"{name}_trim_{force}"] = float(theta[FORCES])
        for i, channel in enumerate(axis.channels):
            unit = place if channel.state_read == POSITION else speed
            out[f"{name}_{channel.name}_noise_std_{unit}"] = float(
                np.exp(theta[FORCES + fit.problem.shapes.shape[1] + i])
            )
    return out
