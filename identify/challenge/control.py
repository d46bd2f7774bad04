"""Controller of the planted vehicle, compiled: PI on velocity with feed-forward, and hold of heading and depth."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Control(NamedTuple):
    """kp, ki, kd, bound (6,): N and N m per unit of each axis; bound limits the integral term. ahead_mass,
    ahead_damping (6,): the crew's model of the vehicle; `ahead` is 1 if its feed-forward is applied, 0 if it is only
    logged. memory_s: time constant of the low-pass on the feedback. low_n, high_n: limits of a thruster.
    """

    kp: Array
    ki: Array
    kd: Array
    bound: Array
    ahead_mass: Array
    ahead_damping: Array
    ahead: float
    memory_s: float
    low_n: float
    high_n: float


@njit(cache=True, error_model="numpy")
def wrench(
    want: Array, fed: Array, heading: float, depth: float, full: bool, tick_s: float, integral: Array, control: Control,
    tau_pid: Array, tau_ff: Array,
) -> None:  # fmt: skip
    """Fill tau_pid and tau_ff (6,) for the reference `want` (14,) and the fed-back velocity `fed` (6,).

    Surge and sway are controlled by velocity, heave by depth and velocity, yaw by heading and rate, roll and pitch by
    their rates. While the thrusters are at their limit (`full`), the integrals do not grow.
    """
    for i in range(6):
        slope = want[i] - fed[i]
        error = slope
        if i == 2:
            error = want[13] - depth
        elif i == 5:
            error = want[12] - heading
            error -= 2 * np.pi * np.round(error / (2 * np.pi))
        elif i > 2:
            error = 0.0
        grown = integral[i] + control.ki[i] * error * tick_s
        grown = min(max(grown, -control.bound[i]), control.bound[i])
        if not full or np.abs(grown) < np.abs(integral[i]):
            integral[i] = grown
        tau_pid[i] = control.kp[i] * error + integral[i] + control.kd[i] * slope
        tau_ff[i] = control.ahead_mass[i] * want[6 + i] + control.ahead_damping[i] * want[i]


@njit(cache=True, error_model="numpy")
def pulse(thrust_n: float, thrust_at: Array, neutral: int) -> int:
    """Index of the pulse whose thrust is nearest; the neutral pulse if that thrust is zero."""
    above = int(np.searchsorted(thrust_at, thrust_n))
    if above >= len(thrust_at):
        return len(thrust_at) - 1
    if above > 0 and thrust_n - thrust_at[above - 1] < thrust_at[above] - thrust_n:
        above -= 1
    return neutral if thrust_at[above] == 0.0 else above
