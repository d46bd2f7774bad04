"""Thrusters from the command to the wrench, with the effects planted in them; compiled.

Shaft side (these change the shaft's speed): delay, sticking, play, dead zone, saturation, sag, lag. Propeller side
(the shaft turns as fast but pushes less): curve, reverse, weak, hull, inflow, gain, reaction torque.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Propellers(NamedTuple):
    """Parameters of k thrusters, SI units. Gains of 1 and zeros elsewhere hide nothing.

    way, place (k, 3): true direction and position. each (k,): gain of each. lag_s, second_s: two lags in series.
    delay (n,): s, per control tick. dead_n: half-width of the soft dead zone. limit_n: soft limit, 0 for none. sag:
    share of the voltage lost by the end, over `sag_s`; thrust goes with its power 1.9. load: share of the voltage
    lost at full load. full_n: maximum thrust of a thruster. low_end: share lost at low thrust, falling exponentially
    with thrust; low_line: the same, falling linearly to zero at full_n. reverse: share lost astern, setting in over
    reverse_n. inflow, inflow_2: losses by sqrt(T) ua and by ua |ua|. wash: share lost if the wash meets the hull,
    setting in at about wash_n. torque: m. play_n: backlash. stuck: index of the thruster that sticks, -1 for none;
    stuck_when (steps,) or (1,): 1 while it sticks.
    """

    way: Array
    place: Array
    each: Array
    delay: Array
    stuck_when: Array
    lag_s: float
    full_n: float
    second_s: float = 0.0
    dead_n: float = 0.0
    limit_n: float = 0.0
    sag: float = 0.0
    sag_s: float = 1.0
    load: float = 0.0
    low_end: float = 0.0
    reverse: float = 0.0
    inflow: float = 0.0
    inflow_2: float = 0.0
    wash: float = 0.0
    torque: float = 0.0
    play_n: float = 0.0
    stuck: int = -1
    reverse_n: float = 0.3
    wash_n: float = 1.0
    low_line: float = 0.0


@njit(cache=True, error_model="numpy")
def voltage_share(time_s: float, sag: float, sag_s: float) -> float:
    """Share of its voltage that a discharging battery still has; it falls slowly at first and faster at the end."""
    x = min(time_s / sag_s, 1.0)
    return 1.0 - sag * (0.6 * x + 0.4 * x * x * x)


@njit(cache=True, error_model="numpy")
def shafts_want(
    asked: Array, time_s: float, stuck: bool, prop: Propellers, before: Array, loaded: float, out: Array
) -> float:
    """Thrust that the shafts are driven to, (k,) N, into `out`; returns the load, which is 1 at full thrust of all.

    asked (k,): commanded thrust by the curve. before (2, k): memory of the play and of the stuck thruster. loaded:
    recent load, low-pass filtered.
    """
    share = voltage_share(time_s, prop.sag, prop.sag_s) ** 1.9 if prop.sag != 0.0 else 1.0
    if prop.load != 0.0:
        share *= (1.0 - prop.load * min(loaded, 1.0)) ** 2
    load = 0.0
    for i in range(len(asked)):
        thrust = asked[i]
        if i == prop.stuck:
            if stuck:
                thrust = before[1, i]
            before[1, i] = thrust
        if prop.play_n > 0.0:
            thrust = min(max(before[0, i], thrust - prop.play_n), thrust + prop.play_n)
            before[0, i] = thrust
        if prop.dead_n > 0.0:
            thrust -= prop.dead_n * np.tanh(thrust / prop.dead_n)
        if prop.limit_n > 0.0:
            thrust /= (1.0 + (np.abs(thrust) / prop.limit_n) ** 6) ** (1.0 / 6.0)
        out[i] = thrust * share
        load += (np.abs(thrust) / prop.full_n) ** 1.4
    return load / len(asked)


@njit(cache=True, error_model="numpy")
def turn(wanted: Array, first: Array, second: Array, keep: float, keep_second: float) -> None:
    """Advance the two lags by half a step, in place. first, second (k,): the stages; keep, keep_second: share of the
    old value that each stage keeps.
    """
    for i in range(len(wanted)):
        first[i] = wanted[i] + keep * (first[i] - wanted[i])
        second[i] = first[i] + keep_second * (second[i] - first[i])


@njit(cache=True, error_model="numpy")
def add_wrench(shaft: Array, nu: Array, prop: Propellers, out: Array) -> None:
    """Add the wrench of the shafts' thrusts (k,) to `out` (6,), for a body with velocity `nu` (6,)."""
    for i in range(len(shaft)):
        thrust = shaft[i]
        dx, dy, dz = prop.way[i, 0], prop.way[i, 1], prop.way[i, 2]
        x, y, z = prop.place[i, 0], prop.place[i, 1], prop.place[i, 2]
        if prop.low_end != 0.0:
            thrust *= 1.0 - prop.low_end * np.exp(-np.abs(thrust) / (0.35 * prop.full_n))
        if prop.low_line != 0.0:
            thrust *= 1.0 - prop.low_line * max(1.0 - np.abs(thrust) / prop.full_n, 0.0)
        if prop.reverse != 0.0:
            thrust *= 1.0 - prop.reverse * 0.5 * (1.0 - np.tanh(thrust / prop.reverse_n))
        if prop.wash != 0.0 and x * dx * thrust > 0.0:
            thrust *= 1.0 - prop.wash * (1.0 - np.exp(-np.abs(thrust) / prop.wash_n))
        if prop.inflow != 0.0:
            ax = nu[0] + nu[4] * z - nu[5] * y
            ay = nu[1] + nu[5] * x - nu[3] * z
            az = nu[2] + nu[3] * y - nu[4] * x
            coming = dx * ax + dy * ay + dz * az
            thrust -= prop.inflow * np.sqrt(np.abs(shaft[i])) * coming + prop.inflow_2 * coming * np.abs(
                coming
            )
        gain = prop.each[i]
        thrust *= gain - 0.1 * (1.0 - gain) * np.abs(thrust) / prop.full_n
        out[0] += dx * thrust
        out[1] += dy * thrust
        out[2] += dz * thrust
        out[3] += (y * dz - z * dy) * thrust
        out[4] += (z * dx - x * dz) * thrust
        out[5] += (x * dy - y * dx) * thrust
        if prop.torque != 0.0:
            spin = prop.torque * thrust * np.abs(thrust) ** 0.1
            out[3] += spin * dx
            out[4] += spin * dy
            out[5] += spin * dz
