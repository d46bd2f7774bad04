"""The nominal fit of a dive that is to be diagnosed, and the recordings that have none."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from bridge.errors import FitError
from bridge.vehicle.config import VehicleFile
from identify.diagnose.filters.nominal import Nominal, nominal_of
from identify.diagnose.gap.missing import disturbance_of, drowned
from identify.diagnose.unjudged import seldom
from identify.dive import Dive
from identify.estimators.refusals import refuse_unmoved, refuse_unpushed, solvable
from identify.estimators.timing.thrust_delay import coarse_delay_of_all_s, coarse_delay_s
from identify.thrust.wrench import wrench


def fitted_nominal(
    dive: Dive, file: VehicleFile, configuration_name: str, like: Nominal | None = None
) -> Nominal:
    """The nominal fit of a dive, with the lateness of an autopilot's velocity as in the fit `like`, if given.

    Raises FitError if no thruster pushed, the dive is of another vehicle, or its equations have no solution.
    """
    try:
        refuse_unpushed(dive, file, configuration_name)
        refuse_unmoved(dive)
        with solvable(dive):
            nominal = nominal_of(dive, file, configuration_name, like.timing_s if like else None)
            if like is None and not dive.velocity_is_filtered:
                nominal = _with_late_thrust(nominal, dive, file, configuration_name)
    except FitError as error:
        # The source separates two recordings of one name.
        raise FitError(error.reason, of=dive.source) from None
    if nominal.built.strange:
        raise FitError(
            f"{nominal.built.strange}; give the vehicle file and the configuration that it was dived with",
            of=dive.source,
        )
    return nominal


def _with_late_thrust(nominal: Nominal, dive: Dive, file: VehicleFile, configuration_name: str) -> Nominal:
    """The fit with the delay of the thrust that the likelihood prefers, coarsely, from which the search begins.

    Columns for small delays lead to a large delay only where the likelihood rises all the way.
    """
    if seldom(dive, file.vehicle.configurations[configuration_name]):
        return nominal
    forces = wrench(dive, file, configuration_name)
    # A delay at which the equations have no solution ends the search: without a delay they have one.
    with suppress(np.linalg.LinAlgError):
        delay_of = coarse_delay_of_all_s if drowned(disturbance_of(nominal)) else coarse_delay_s
        delay_s = delay_of(forces, nominal.built, nominal.joint, nominal.theta)
        return replace(nominal, late_thrust_s=(delay_s, 0.0))
    return nominal
