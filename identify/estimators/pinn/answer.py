"""`estimate`: the result of the trained network for a dive, as an Identification."""

import time
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, DOFS, MASSES, Coefficient
from bridge.vehicle.config import VehicleFile
from identify import identification
from identify.checks.controller import unrecorded
from identify.checks.fit import (
    crossed,
    crossed_doubts,
    drag_doubts,
    late_doubts,
    loud,
    loud_doubts,
    loud_note,
    missing_forces,
    strange_doubts,
    too_little,
    unseen_doubts,
    unsettled_doubt,
)
from identify.dive import Dive
from identify.estimators.autopilot_velocity import shared_axes
from identify.estimators.innovations import POSITION
from identify.estimators.misfit import NOTHING, Admitted, Doubts, Multiplier, admitted, doubts_of, timing_of
from identify.estimators.pinn.fit import Fit, fit_network
from identify.estimators.pinn.training import MOST_PASSES
from identify.estimators.refusals import long_enough
from identify.identification import (
    LARGEST_RELATIVE_STD,
    Z95,
    Doubt,
    Estimate,
    Identification,
    Information,
    Nuisance,
    added_mass,
    outcome_of,
)
from identify.identification import estimate as as_estimate
from identify.progress import Progress

Array = NDArray[np.float64]


def estimate(dive: Dive, file: VehicleFile, configuration: str, progress: Progress) -> Identification:
    """Return total masses and linear dampings of all axes that the dive drives, with 95 % intervals.

    Raises FitError if the recording is too short, or holds no thruster command at all.
    """
    began = time.perf_counter()
    long_enough(dive)
    axes = shared_axes(dive, file, configuration)
    built = axes.value
    shape = file.vehicle.configurations[configuration]
    fit = fit_network(dive, file, configuration, built, progress) if built.axes else None
    doubted = {} if fit is None else doubts_of(fit.filters.joint, fit.filters.theta)
    lacking, late = _missing(doubted, dive, file)
    let_in = NOTHING
    if fit is not None:
        let_in = admitted(fit.filters.joint, fit.filters.theta, lacking, late, timing_of(doubted))
    missing = missing_forces(tuple(lacking), tuple(late))
    totals = tuple(
        _one(row, c, fit, let_in, missing, built.missing) for row, c in enumerate((*MASSES, *DAMPINGS))
    )
    noisy = () if fit is None else loud(fit.filters.joint, fit.filters.theta, built.pushed)
    doubts = (
        *strange_doubts(built.strange),
        *(() if fit is None else crossed_doubts(crossed(fit.filters.joint, fit.filters.theta))),
        *loud_doubts(noisy),
        *unseen_doubts(built),
        *late_doubts(late, built.pushed),
        *drag_doubts(lacking),
        *(() if fit is None else _unsettled(fit)),
    )
    names, covariance = ((), np.zeros((0, 0))) if fit is None else _covariance(fit, totals, let_in)
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
        (*dive.notes, *built.notes, *loud_note(noisy)),
        time.perf_counter() - began,
        information=None if fit is None else _information(fit),
        doubts=doubts,
        rest_on_righting=built.rest_on_righting,
    )


def _place(fit: Fit, name: str) -> int:
    """Index of a coefficient among the fit's values."""
    coefficient = BY_NAME[name]
    axis = fit.layout.dofs.index(coefficient.dof)
    return coefficient.dof if coefficient.kind == "mass" else 6 + axis


def _missing(
    doubts: Mapping[int, Doubts], dive: Dive, file: VehicleFile
) -> tuple[dict[int, Multiplier], dict[int, Multiplier]]:
    """The axes that lack a quadratic drag, and those in which thrust acts at another time."""
    lacking = {dof: doubt.drag for dof, doubt in doubts.items() if doubt.lacks_drag}
    late = {dof: doubt.late for dof, doubt in doubts.items() if doubt.is_late}
    # Thrust that follows the disturbance through an unrecorded reading seems to come late, so such axes don't count.
    spoilt = {doubt.dof for doubt in unrecorded(dive, file.vehicle.water)} if late else set()
    return lacking, {dof: doubt for dof, doubt in late.items() if dof not in spoilt}


def _one(
    row: int, of: Coefficient, fit: Fit | None, let_in: Admitted, missing: str, unfitted: Mapping[int, str]
) -> Estimate:
    """Return a coefficient with the interval of its logarithm, or with the reason why it has none."""
    name, dof = of.name, of.dof
    if fit is None or dof not in fit.layout.dofs:
        nan = float("nan")
        return as_estimate(name, nan, nan, nan, nan, unfitted[dof])
    place = _place(fit, name)
    value, own_std = float(fit.values[place]), float(np.sqrt(fit.covariance[place, place]))
    axis = fit.layout.dofs.index(dof)
    stretch = fit.stretch[axis if place == dof else len(fit.layout.dofs) + axis]
    std, (below, above) = let_in.std(row, own_std), let_in.reach(row, own_std, stretch)
    reason, widest = "", max(below, above) / Z95
    if widest > LARGEST_RELATIVE_STD:
        reason = too_little(name, DOFS[dof], widest, float(let_in.shift[row]), value, missing)
    low, high = value * np.exp(-below), value * np.exp(above)
    return as_estimate(name, value, value * std, float(low), float(high), reason)


def _covariance(fit: Fit, totals: tuple[Estimate, ...], let_in: Admitted) -> tuple[tuple[str, ...], Array]:
    """Names and covariance of the fitted coefficients."""
    rows = [row for row, total in enumerate(totals) if BY_NAME[total.name].dof in fit.layout.dofs]
    names = tuple(totals[row].name for row in rows)
    places = [_place(fit, name) for name in names]
    relative = fit.covariance[np.ix_(places, places)] + let_in.covariance[np.ix_(rows, rows)]
    values = np.array([totals[row].value for row in rows])
    return names, relative * np.outer(values, values)


def _information(fit: Fit) -> Information:
    """Information of the dive on mass, damping and trim of all axes, all other parameters projected out; trims in
    shares of the force that drove their axis."""
    names, places, scale = [], [], []
    n = len(fit.layout.dofs)
    for axis, dof in enumerate(fit.layout.dofs):
        names += [MASSES[dof].name, DAMPINGS[dof].name, f"{DOFS[dof]}_trim"]
        places += [dof, 6 + axis, 6 + n + axis]
        scale += [1.0, 1.0, float(np.sqrt(np.mean(fit.layout.push[:, axis] ** 2)))]
    return Information(tuple(names), fit.information_of(places) * np.outer(scale, scale))


def _unsettled(fit: Fit) -> tuple[Doubt, ...]:
    if fit.settled:
        return ()
    names = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in fit.layout.dofs)
    return (unsettled_doubt(names, "the network", f"{MOST_PASSES} passes"),)


def _nuisance(fit: Fit) -> dict[Nuisance, float]:
    """Noise levels and trims."""
    out: dict[Nuisance, float] = {}
    n = len(fit.layout.dofs)
    for axis, dof in enumerate(fit.layout.dofs):
        out[identification.disturbance(dof)] = float(fit.disturbance[axis])
        out[identification.time_constant(dof)] = float(fit.time_constant_s[axis])
        out[identification.trim(dof)] = float(fit.values[6 + n + axis])
    for channel, name in enumerate(fit.layout.channel_name):
        dof = fit.layout.dofs[fit.layout.channel_axis[channel]]
        of_place = fit.layout.channel_reads[channel] == POSITION
        out[identification.noise(dof, name, of_place)] = float(fit.sensor[channel])
    return out
