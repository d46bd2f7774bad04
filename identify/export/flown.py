"""The velocities of a vehicle's model along a dive, beside those that were measured."""

from collections.abc import Sequence

import numpy as np

from bridge.vehicle.config import VehicleFile
from identify.diagnose.nominal import nominal_of
from identify.diagnose.shrink import HORIZON_S, differences, with_coefficients
from identify.diagnose.simulation import simulation_of
from identify.dive import Dive
from identify.export.signals import Topic, of_axes

MODEL, MEASURED = "/model/velocity", "/model/measured"


def flown(dive: Dive, file: VehicleFile, configuration: str) -> Sequence[Topic]:
    """Two topics: the velocities of the model fitted to the dive, and the measured ones, smoothed, at the same times.

    Both are of the vehicle's origin, in the degrees of freedom that could be fitted. The model flies open loop by the
    recorded thrust and attitude, begun anew from the measured velocity every 5 s. None for a dive shorter than that.

    Raises FitError if the dive has no axis that a model can be fitted to.
    """
    fit = nominal_of(dive, file, configuration)
    model = simulation_of(fit, with_coefficients(fit, fit), fit.motion.nu)
    length = round(HORIZON_S / model.step_s)
    starts = np.arange(0, len(model.time_s) - length, length)
    if not len(starts):
        return ()
    at = (starts[:, None] + np.arange(1, length + 1)).ravel()
    measured = model.nu[at]
    simulated = measured + differences(model, starts).reshape(-1, 6)
    return (
        of_axes(MODEL, "model", model.time_s[at], simulated, model.dofs),
        of_axes(MEASURED, "measured", model.time_s[at], measured, model.dofs),
    )
