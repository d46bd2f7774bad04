"""The thrust that a thruster gave in a dive, over its curve, by how the vehicle moved.

In each axis of the feed-forward the wrench moves the vehicle's mass, its drag and a constant force, and of thruster i,
whose gain is g rather than the file's G, only the share g/G has acted:

    tau - (1 - g/G) tau_i = M nu_dot + D nu + c

tau is the wrench of all thrusters by the file, tau_i that of thruster i (N, N m). M, D and c of the axes and the shares
of the thrusters are solved for together. A controller answers the sea, so that tau and tau_i hold the sea's force, and
least squares would take it for a weak thruster. Therefore the equations are weighed with instruments that the sea does
not move: the reference's velocity and acceleration, and the share of TAU_FF that falls to the thruster (instrumental
variables; Söderström and Stoica 1983, "Instrumental Variable Methods for System Identification"). The standard errors
allow for correlated residuals (Newey and West 1987).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.errors import SeatrialError
from bridge.vehicle.config import Configuration, VehicleFile
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS
from bridge.vehicle.thrusters import Allocator, allocation_matrix, thrust_curve
from identify.align import AlignedDive, aligned, low_pass
from identify.dive import Dive, Signal
from identify.statistics import Z95, covariance_of_sum
from identify.thrust.wrench import asked_thrusts, tells_thrusters
from identify.thrust.wrench_history import history_of

RATE_HZ: Final = 10.0
CUTOFF_HZ: Final = 0.5
MEMORY_S: Final = 4.0
"""Longest time over which the residuals are taken as correlated."""
LEAST_SAMPLES: Final = 300
MOST_UNSURE: Final = 0.1
"""Largest half width of the 95 % interval, relative to the gain, with which a dive counts as showing a gain."""
NO_REACH: Final = 1e-6


@dataclass(frozen=True)
class Given:
    """Thrust over a thruster's curve that it gave, with half of its 95 % interval."""

    gain: float
    half95: float


def pushes(shape: Configuration, thruster: int) -> bool:
    """Whether a thruster, numbered from 1, pushes an axis of the feed-forward."""
    column = allocation_matrix(shape)[list(FEEDFORWARD_DOFS), thruster - 1 : thruster]
    return bool(np.abs(column).max(initial=0.0) > NO_REACH)


def given_thrust(
    dive: Dive, file: VehicleFile, configuration: str, thrusters: Sequence[int]
) -> dict[int, Given]:
    """The gains of some thrusters (numbered from 1), of those that the dive tells to MOST_UNSURE.

    None of them without pulses for every thruster, a reference, TAU_FF, velocity and rates.
    """
    shape = file.vehicle.configurations[configuration]
    asked = [i for i in dict.fromkeys(thrusters) if pushes(shape, i)]
    if not asked or dive.nu_ref is None or dive.tau_ff is None or dive.velocity is None:
        return {}
    if not (len(dive.nu_ref) and len(dive.tau_ff)) or not tells_thrusters(dive, shape):
        return {}
    try:
        motion = aligned(dive, file, configuration, RATE_HZ, CUTOFF_HZ)
        reach = Allocator(shape, thrust_curve(file.vehicle.thrust_curve, file.path.parent)).reach()
        of_each = _of_each(dive, file, configuration, motion, asked)
    except SeatrialError:
        return {}
    known = motion.valid
    if np.count_nonzero(known) < LEAST_SAMPLES:
        return {}
    fed = _of_fed(dive, shape, motion, asked)
    reference = low_pass(np.nan_to_num(dive.nu_ref.at(motion.time_s)), RATE_HZ, CUTOFF_HZ)
    axes = [dof for dof in FEEDFORWARD_DOFS if reach[dof] > NO_REACH and np.ptp(motion.nu[known, dof]) > 0]
    regressors, instruments, wrenches = [], [], []
    for place, dof in enumerate(axes):
        columns = slice(3 * place, 3 * place + 3)
        moved, wanted = (np.zeros((np.count_nonzero(known), 3 * len(axes))) for _ in range(2))
        ones = np.ones(len(motion.time_s))
        moved[:, columns] = np.column_stack([motion.nu_dot[:, dof], motion.nu[:, dof], ones])[known]
        wanted[:, columns] = np.column_stack([reference[:, 6 + dof], reference[:, dof], ones])[known]
        regressors.append(np.hstack([moved, of_each[known, dof]]) / reach[dof])
        instruments.append(np.hstack([wanted, fed[known, dof]]) / reach[dof])
        wrenches.append(motion.tau[known, dof] / reach[dof])
    lacking, error = _solved(np.array(regressors), np.array(instruments), np.array(wrenches))
    clear = {}
    for i, less, std in zip(asked, lacking[-len(asked) :], error[-len(asked) :], strict=True):
        by_file = shape.thrusters[i - 1].gain
        given = Given(by_file * float(1.0 - less), by_file * Z95 * float(std))
        if 0.0 < given.half95 <= MOST_UNSURE * given.gain:
            clear[i] = given
    return clear


def _of_each(
    dive: Dive, file: VehicleFile, configuration: str, motion: AlignedDive, thrusters: Sequence[int]
) -> Array:
    """Wrench (n, 6, k) of each thruster by the file, on the grid of `motion`."""
    thrust = asked_thrusts(dive, file, configuration)
    columns = allocation_matrix(file.vehicle.configurations[configuration])
    half_s = 0.5 / RATE_HZ
    wrenches = []
    for i in thrusters:
        asked = Signal(thrust.time_s, thrust.value[:, i - 1 : i] * columns[:, i - 1])
        history = history_of(asked, file.vehicle.thrust_curve, "pwm", (), dive.breaks_s)
        wrenches.append(
            low_pass(history.mean_between(motion.time_s - half_s, motion.time_s + half_s), RATE_HZ, CUTOFF_HZ)
        )
    return np.stack(wrenches, axis=2)


def _of_fed(dive: Dive, shape: Configuration, motion: AlignedDive, thrusters: Sequence[int]) -> Array:
    """Wrench (n, 6, k) that TAU_FF, shared among all thrusters, would ask of each."""
    assert dive.tau_ff is not None
    columns = allocation_matrix(shape)
    thrust = np.nan_to_num(dive.tau_ff.at(motion.time_s)) @ np.linalg.pinv(columns).T
    wrenches = [low_pass(thrust[:, i - 1 : i] * columns[:, i - 1], RATE_HZ, CUTOFF_HZ) for i in thrusters]
    return np.stack(wrenches, axis=2)


def _solved(regressors: Array, instruments: Array, wrenches: Array) -> tuple[Array, Array]:
    """Factors (p,) and their standard errors, infinite for a factor that the instruments don't tell.

    regressors, instruments (axes, n, p) and wrenches (axes, n) of the same instants.
    """
    x, z, y = (
        regressors.reshape(-1, regressors.shape[2]),
        instruments.reshape(-1, instruments.shape[2]),
        wrenches.ravel(),
    )
    shown = (np.abs(x).max(axis=0) > 0) & (np.abs(z).max(axis=0) > NO_REACH)
    inverse = np.linalg.pinv(z[:, shown].T @ x[:, shown])
    factors = inverse @ (z[:, shown].T @ y)
    left = wrenches - regressors[:, :, shown] @ factors
    pull = np.einsum("anp,an->np", instruments[:, :, shown], left)
    spread = covariance_of_sum(pull, round(MEMORY_S * RATE_HZ))
    value, error = np.zeros(len(shown)), np.full(len(shown), np.inf)
    value[shown] = factors
    error[shown] = np.sqrt(np.maximum(np.diag(inverse @ spread @ inverse.T), 0.0))
    return value, error
