"""Wrench on the planted vehicle, of water and thrusters, in forms that the library of effects does not use; compiled.

Shaft side (these change the shaft's speed): delay, sticking, play, dead zone, saturation, sag, lag. Propeller side
(the shaft turns as fast but pushes less): curve, reverse, weak, hull, inflow, gain, reaction torque.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from bridge.arrays import Array


class Hull(NamedTuple):
    """Parameters of the effects at the hull, SI units; all zero hides nothing.

    drag (6,): N s^n/m^n in -drag |nu|^drag_power sign(nu). asymmetry: additional linear surge drag astern; astern:
    share by which `drag` is larger astern. lift_y, lift_n: coefficients of -lift |u| v, which stalls at large drift
    according to `stall`. y_r, n_v: coupled damping. munk: additional Munk moment, as a share. grip, slack_m,
    anchor_n, anchor_e: a tether's stiffness near its anchor, the distance at which the stiffness doubles, and the
    anchor; rise: upward pull as a share of the horizontal pull. buoyancy_n, squeeze: additional buoyancy, falling
    with depth. surface, surface_m, bottom, bottom_m, floor_m: added mass near a boundary, on the degrees of freedom
    of near_share (6,). wave_number, wave_ref: how waves fade below a depth. shed_n, shed_k: side force by speed
    squared, and radians of its phase per metre. swirl: drag by turn rate and depth. trail_n: force with a memory of
    the speed (wake). chain_n, chain_m: friction of a chain that drags on the bottom, and the altitude below which it
    acts.
    """

    drag: Array
    near_share: Array
    floor_m: float
    drag_power: float = 1.8
    asymmetry: float = 0.0
    lift_y: float = 0.0
    lift_n: float = 0.0
    y_r: float = 0.0
    n_v: float = 0.0
    munk: float = 0.0
    munk_yaw_kg: float = 0.0
    munk_pitch_kg: float = 0.0
    grip: float = 0.0
    slack_m: float = 5.0
    anchor_n: float = 0.0
    anchor_e: float = 0.0
    buoyancy_n: float = 0.0
    squeeze: float = 0.0
    surface: float = 0.0
    surface_m: float = 0.5
    bottom: float = 0.0
    bottom_m: float = 0.5
    wave_number: float = 0.0
    wave_ref: float = 0.0
    shed_n: float = 0.0
    shed_k: float = 0.0
    swirl: float = 0.0
    trail_n: float = 0.0
    chain_n: float = 0.0
    chain_m: float = 0.0
    astern: float = 0.0
    stall: float = 0.15
    rise: float = 0.15


def bare_hull(floor_m: float) -> Hull:
    """A hull that hides nothing, above a bottom at depth `floor_m`."""
    return Hull(np.zeros(6), np.array([0.3, 1.0, 1.0, 0.0, 0.0, 0.0]), floor_m)


@njit(cache=True, error_model="numpy")
def growth(depth: float, hull: Hull) -> tuple[float, float]:
    """Share by which added masses grow near the surface and the bottom, and its change per metre of depth.

    The share falls exponentially below the surface, and with the cube of the altitude above the bottom.
    """
    more, by_metre = 0.0, 0.0
    if hull.surface != 0.0:
        near = hull.surface * np.exp(-max(depth, 0.0) / hull.surface_m)
        more += near
        if depth > 0.0:
            by_metre -= near / hull.surface_m
    if hull.bottom != 0.0:
        far = max(hull.floor_m - depth, 0.0) / hull.bottom_m
        fall = 1.0 + far**3
        more += hull.bottom / fall
        by_metre += hull.bottom * 3.0 * far * far / (hull.bottom_m * fall * fall)
    return more, by_metre


@njit(cache=True, error_model="numpy")
def hull_wrench(
    state: Array, nu_r: Array, hull: Hull, phase: float, wake: float, out: Array
) -> tuple[float, float, float]:
    """Add the wrench of the planted effects to `out` (6,); return the tether's pull (north, east, down).

    `nu_r` (6,) is the velocity through the water, `phase` that of shed vortices, `wake` the remembered surge
    speed.
    """
    u, v, w, r = nu_r[0], nu_r[1], nu_r[2], nu_r[5]
    for i in range(6):
        if hull.drag[i] != 0.0:
            out[i] -= hull.drag[i] * np.abs(nu_r[i]) ** hull.drag_power * np.sign(nu_r[i])
    if hull.asymmetry != 0.0:
        out[0] -= hull.asymmetry * u * 0.5 * (1.0 - np.tanh(u / 0.04))
    if hull.astern != 0.0:
        more = hull.astern * hull.drag[0] * np.abs(u) ** hull.drag_power * np.sign(u)
        out[0] -= more * 0.5 * (1.0 - np.tanh(u / 0.04))
    if hull.lift_y != 0.0 or hull.lift_n != 0.0:
        drift = np.abs(v) / (np.abs(u) + 0.02)
        lift = np.abs(u) * v / (1.0 + hull.stall * drift * drift)
        out[1] -= hull.lift_y * lift
        out[5] -= hull.lift_n * lift
    if hull.y_r != 0.0 or hull.n_v != 0.0:
        out[1] -= hull.y_r * r * (1.0 + 0.4 * np.abs(r))
        out[5] -= hull.n_v * v * (1.0 + 0.6 * np.abs(v))
    if hull.munk != 0.0:
        stall = 1.0 / (1.0 + 0.5 * (v * v + w * w))
        out[5] -= hull.munk * hull.munk_yaw_kg * u * v * stall
        out[4] -= hull.munk * hull.munk_pitch_kg * u * w * stall
    if hull.shed_n != 0.0:
        out[1] += hull.shed_n * u * np.abs(u) * np.sin(phase)
    if hull.swirl != 0.0:
        out[0] -= hull.swirl * r * state[2]
        out[1] -= 0.6 * hull.swirl * r * np.abs(r) * state[2]
    if hull.trail_n != 0.0:
        out[0] += hull.trail_n * np.tanh((wake - u) / 0.15) * np.abs(wake)
    if hull.chain_n != 0.0 and hull.floor_m - state[2] < hull.chain_m:
        speed = np.sqrt(u * u + v * v) + 0.01
        out[0] -= hull.chain_n * u / speed
        out[1] -= hull.chain_n * v / speed
    if hull.grip == 0.0:
        return 0.0, 0.0, 0.0
    north, east = state[0] - hull.anchor_n, state[1] - hull.anchor_e
    far = np.sqrt(north * north + east * east)
    pull = hull.grip * (1.0 + (far / hull.slack_m) ** 2)
    return -pull * north, -pull * east, -hull.rise * pull * far


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
