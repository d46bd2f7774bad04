"""Thrusters from the command to the wrench, with what is planted in them, compiled.

Shaft side (seen by the shaft's speed): delay, sticking, play, dead zone, saturation, sag, lag. Propeller side (the
shaft turns as fast and pushes less): curve, reverse, weak, hull, inflow, gain, reaction torque.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Propellers(NamedTuple):
    """k thrusters; what hides nothing is zero, and 1 for gains. SI units.

    way, place (k, 3): the true direction and position. each (k,): gain of each. lag_s, second_s: a cascade of two lags.
    delay (n,): s, by control tick. dead_n: half-width of the soft dead zone. limit_n: soft limit, 0 for none. sag:
    share of the voltage lost by the end, over `sag_s`, thrust going as its power 1.9. load: voltage lost by full load.
    full_n: what a thruster can do. low_end: share lost at low thrust, falling exponentially; low_line: in a straight
    line to full_n. reverse: share lost astern, which sets in over reverse_n. inflow, inflow_2: loss by sqrt(T) ua and
    by ua |ua|. wash: share lost where the wash meets the hull, from about wash_n on. torque: m. play_n: backlash.
    stuck: the thruster that sticks, -1 for none; stuck_when (steps,) or (1,), 1 while it does.
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
    """What a discharging battery still has of its voltage: slowly at first, faster at its end."""
    x = min(time_s / sag_s, 1.0)
    return 1.0 - sag * (0.6 * x + 0.4 * x * x * x)


@njit(cache=True, error_model="numpy")
def shafts_want(
    asked: Array, time_s: float, stuck: bool, prop: Propellers, before: Array, loaded: float, out: Array
) -> float:
    """What the shafts are driven to, (k,) N into `out`; answers the load, 1 at full thrust of all.

    asked (k,): what the curve gives; before (2, k): the play's and the stuck thruster's memory; loaded: load of late.
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
    """Half a step of the lags, in place: first and second (k,) of a cascade, what each keeps of its old value."""
    for i in range(len(wanted)):
        first[i] = wanted[i] + keep * (first[i] - wanted[i])
        second[i] = first[i] + keep_second * (second[i] - first[i])


@njit(cache=True, error_model="numpy")
def add_wrench(shaft: Array, nu: Array, prop: Propellers, out: Array) -> None:
    """Add the wrench of the shafts' thrusts (k,) to `out` (6,), for a body that moves by `nu` (6,)."""
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
