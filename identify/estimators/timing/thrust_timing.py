"""When a dive's thrust acts: after a delay beyond the vehicle file's, and with its lag in the thrust or in the shafts.

Thrust goes with the square of a shaft's speed, so that a shaft that lags makes a thrust that starts gently and reverses
late. A lag of the thrust with a delay comes near that in one axis, and nowhere near in several: a heading that is held
reverses its thrusters all the time, a leg hardly ever.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.estimators.axes.axis import Axes
from identify.estimators.axes.forces import axes_with_forces
from identify.estimators.likelihood.fit import JointFit
from identify.estimators.likelihood.scoring import log_posterior
from identify.estimators.timing.thrust_delay import LEAST_GAIN, with_delay
from identify.identification import ThrustDelay
from identify.ingest.commands import holding_variance_s2
from identify.thrust.shafts import wrench_by_shafts
from identify.thrust.wrench import wrench
from identify.thrust.wrench_history import WrenchHistory


@dataclass(frozen=True)
class Timed:
    """A dive's axes and their fit with the likeliest timing of its thrust; delay: beyond the vehicle file's, None for
    none; by_shafts: the lag is that of the shafts' speed."""

    built: Axes
    fit: JointFit
    delay: ThrustDelay | None = None
    by_shafts: bool = False

    @property
    def log_posterior(self) -> float:
        return log_posterior(self.fit.joint, self.fit.theta)


def with_timing(
    dive: Dive,
    file: VehicleFile,
    configuration_name: str,
    plain: Timed,
    refit: Callable[[Axes], JointFit],
    late: bool,
    seems_late: Callable[[JointFit], bool],
) -> Timed:
    """Return the likeliest of the vehicle file's own timing, a delay beyond it, and a lag of the shafts.

    plain: the dive with the file's own timing; late: whether its thrust seems to act at another time. seems_late: the
    same of another fit. Where a delay settles that in several axes, it is taken; a lag of the shafts gets a delay as
    well where it does not settle it.
    """
    delay_s = file.vehicle.thrust_curve.delay_s
    forces = wrench(dive, file, configuration_name)
    delayed = _with_delay(dive, forces, delay_s, plain, refit, late)
    shafts = wrench_by_shafts(dive, file, configuration_name, forces)
    if not late or shafts is None or any(axis.is_coloured for axis in plain.built.axes):
        return delayed
    # A single axis never contradicts its own delay.
    if len(plain.fit.fits) > 1 and not seems_late(delayed.fit):
        return delayed
    built = axes_with_forces(plain.built, forces, shafts)
    try:
        of_shafts = Timed(built, refit(built), by_shafts=True)
    except np.linalg.LinAlgError:
        return delayed
    if seems_late(of_shafts.fit):
        of_shafts = _with_delay(dive, shafts, delay_s, of_shafts, refit, True)
    return of_shafts if of_shafts.log_posterior > delayed.log_posterior + LEAST_GAIN else delayed


def _with_delay(
    dive: Dive,
    forces: WrenchHistory,
    in_file_s: float,
    timed: Timed,
    refit: Callable[[Axes], JointFit],
    near: bool,
) -> Timed:
    """The dive with the delay of its forces, if any."""
    try:
        late = with_delay(forces, in_file_s, timed.built, timed.fit, refit, near)
    except np.linalg.LinAlgError:
        # A delay at which the equations have no solution is rejected; without a delay they have one.
        return timed
    if late is None:
        return timed
    return replace(timed, built=late.built, fit=late.fit, delay=late.delay.widened(holding_variance_s2(dive)))
