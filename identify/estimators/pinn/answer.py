"""`estimate`: the result of the trained network for a dive, as an Identification."""

import time
from dataclasses import replace

import numpy as np

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES, OF_HULL
from bridge.vehicle.config import VehicleFile
from identify import nuisance
from identify.checks.actuation.controller import unrecorded
from identify.checks.sensors.descent_timing import with_depth_of_the_dvl
from identify.dive import Dive
from identify.doubt import Doubt
from identify.estimators.answer import Fitted, answer_of, unsettled_doubt
from identify.estimators.filter.state import POSITION
from identify.estimators.likelihood.joint import JointLikelihood
from identify.estimators.missing_forces.drag_and_timing import doubts_of
from identify.estimators.pinn.training import MOST_PASSES, Fit, fit_network
from identify.estimators.timing.autopilot_velocity import shared_axes
from identify.identification import Identification, Information
from identify.nuisance import Nuisance
from identify.progress import Progress


def estimate(dive: Dive, file: VehicleFile, configuration_name: str, progress: Progress) -> Identification:
    """Return total masses and linear dampings of all axes that the dive drives, with 95 % intervals.

    Raises FitError if the recording is too short, or holds no thruster command at all.
    """
    began_s = time.perf_counter()
    axes = shared_axes(with_depth_of_the_dvl(dive, file.vehicle.water), file, configuration_name)
    built = axes.value
    fit = fit_network(dive, file, configuration_name, built, progress) if built.axes else None
    fitted = _fitted(fit)
    tests = doubts_of(fitted.joint, fitted.theta)
    late = any(test.is_late for test in tests.values())
    spoilt = {each.dof: each for each in unrecorded(dive, file.vehicle.water)} if late else {}
    answer = answer_of(
        fitted, tests, built, dive, file, configuration_name, spoilt, weighs_others=False, began_s=began_s
    )
    return replace(answer, information=None if fit is None else _information(fit))


def _fitted(fit: Fit | None) -> Fitted:
    value, covariance, stretch = (
        np.full(len(OF_HULL), np.nan),
        np.full((len(OF_HULL), len(OF_HULL)), np.nan),
        np.ones((len(OF_HULL), 2)),
    )
    if fit is None:
        return Fitted("pinn", value, covariance, stretch, JointLikelihood(()), np.zeros(0))
    dofs = fit.layout.dofs
    rows = [*dofs, *(6 + dof for dof in dofs)]
    indices = [*dofs, *range(6, 6 + len(dofs))]
    value[rows] = fit.values[indices]
    covariance[np.ix_(rows, rows)] = fit.covariance[np.ix_(indices, indices)]
    stretch[rows] = fit.stretch
    joint, theta = fit.filters.joint, fit.filters.theta
    return Fitted("pinn", value, covariance, stretch, joint, theta, _nuisance(fit), _unsettled(fit))


def _information(fit: Fit) -> Information:
    """Information of the dive on mass, damping and trim of all axes, all other parameters projected out; trims in
    shares of the force that drove their axis."""
    names, indices, scale = [], [], []
    n = len(fit.layout.dofs)
    for axis, dof in enumerate(fit.layout.dofs):
        names += [MASSES[dof].name, DAMPINGS[dof].name, f"{DOFS[dof]}_trim"]
        indices += [dof, 6 + axis, 6 + n + axis]
        scale += [1.0, 1.0, float(np.sqrt(np.mean(fit.layout.push[:, axis] ** 2)))]
    return Information(tuple(names), fit.information_of(indices) * np.outer(scale, scale))


def _unsettled(fit: Fit) -> tuple[Doubt, ...]:
    if fit.settled:
        return ()
    return (unsettled_doubt(fit.layout.dofs, "the network", f"{MOST_PASSES} passes"),)


def _nuisance(fit: Fit) -> dict[Nuisance, float]:
    """Noise levels and trims."""
    out: dict[Nuisance, float] = {}
    n = len(fit.layout.dofs)
    for axis, dof in enumerate(fit.layout.dofs):
        out[nuisance.disturbance(dof)] = float(fit.disturbance[axis])
        out[nuisance.time_constant(dof)] = float(fit.time_constant_s[axis])
        out[nuisance.trim(dof)] = float(fit.values[6 + n + axis])
    for channel, name in enumerate(fit.layout.channel_name):
        dof = fit.layout.dofs[fit.layout.channel_axis[channel]]
        of_pose = fit.layout.channel_reads[channel] == POSITION
        out[nuisance.noise(dof, name, of_pose)] = float(fit.sensor[channel])
    return out
