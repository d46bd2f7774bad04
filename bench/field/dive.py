"""One dive under the autopilot, compiled: the challenge's body, hull and thrusters, with 20 pulses a second."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.field.autopilot import NEUTRAL, Autopilot, Memory, pulses, wrench
from bridge.arrays import Array
from identify.challenge.equations_of_motion import STATES, WORK, Body, assign, state_derivative
from identify.challenge.hull import Hull, Propellers, add_wrench, shafts_want, turn

STEP_S = 0.005
EACH = 10
"""Simulation steps per tick of the autopilot."""

CURRENT_S = 0.05
AHEAD_A_N15, ASTERN_A_N15, HOTEL_A = 0.062, 0.095, 1.2
"""Current of a T200 over |thrust|^1.5, and of everything except the thrusters."""


class Water(NamedTuple):
    """moved (steps + 1, 12) or (1, 12): motion of the water as `state_derivative` takes it; push (steps + 1, 6): wrench
    that depends on time alone; grown: share by which all drag grows per second."""

    moved: Array
    push: Array
    grown: float


class Supply(NamedTuple):
    """volts, ohm: of the battery; fall: share of the squared voltage lost per second; felt_ohm, felt_fall: the parts
    of these that act on the thrusters."""

    volts: float
    ohm: float
    fall: float
    felt_ohm: float
    felt_fall: float


class Ticks(NamedTuple):
    """Rows that the dive fills in.

    Per tick: state (STATES,), nu_dot (6,), push (6,) when the pulse (k,) is given; nominal (k,): thrust by the file's
    curve and lag; supply (2,): V and A; asked (5,): the sticks, the way home included. Per step:
    moving (3,), velocity over ground, NED, m/s.
    """

    state: Array
    nu_dot: Array
    push: Array
    pwm: Array
    nominal: Array
    supply: Array
    asked: Array
    moving: Array


@njit(cache=True, error_model="numpy", nogil=True)
def dive(
    body: Body, hull: Hull, prop: Propellers, pilot: Autopilot, memory: Memory, water: Water, supply: Supply,
    asked: Array, leg: NDArray[np.int64], leash_m: float, noise: Array, lag_s: float, start: Array, ticks: Ticks,
) -> None:  # fmt: skip
    """Dive the sticks (n, 5) of the legs (n,), filling `ticks`: fourth-order Runge-Kutta at STEP_S.

    noise (n, 8): error of the autopilot's readings. prop.delay (n,): delay of each tick's pulses. lag_s: the file's.
    """
    h = STEP_S
    count, k = len(asked) * EACH, pilot.matrix.shape[1]
    state, trial, work, tau = start.copy(), np.empty(STATES), np.empty(WORK), np.zeros(6)
    k1, k2, k3, k4 = np.empty(STATES), np.empty(STATES), np.empty(STATES), np.empty(STATES)
    given, wanted, plain, nothing = np.zeros((len(asked), k)), np.zeros(k), np.zeros(k), np.zeros(k)
    first, second, middle, before = np.zeros(k), np.zeros(k), np.zeros(k), np.zeros((2, k))
    seen, want, places, now_asked = np.zeros(9), np.zeros(6), np.zeros(k), np.zeros(5)
    clean = hull.drag.copy()
    keep = np.exp(-0.5 * h / prop.lag_s) if prop.lag_s > 0 else 0.0
    keep_second = np.exp(-0.5 * h / prop.second_s) if prop.second_s > 0 else 0.0
    keep_plain = np.exp(-h / lag_s) if lag_s > 0 else 0.0
    amps, way, tick, late = HOTEL_A, 1.0, 0, -1
    for step in range(count):
        time_s = step * h
        grown = water.grown * time_s
        assign(hull.drag, (1.0 + grown) * clean)
        if step % EACH == 0:
            look(state, noise[tick], seen)
            assign(now_asked, asked[tick])
            if tick == 0 or leg[tick] != leg[tick - 1]:
                way = homewards(state, seen[2], asked, tick, leash_m)
            now_asked[0] *= way
            now_asked[1] *= way
            assign(ticks.asked[tick], now_asked)
            wrench(now_asked, seen, pilot, memory, want)
            pulses(want, pilot, places)
            for i in range(k):
                ticks.pwm[tick, i] = 1500.0 + places[i] - NEUTRAL
                given[tick, i] = pilot.thrust_at[int(places[i])]
            tick += 1
        while late + 1 < tick and (late + 1) * EACH * h + prop.delay[late + 1] <= time_s + 1e-9:
            late += 1
        acting = given[late] if late >= 0 else nothing
        shafts_want(acting, time_s, False, prop, before, 0.0, wanted)
        drawn = HOTEL_A
        for i in range(k):
            drawn += (AHEAD_A_N15 if wanted[i] > 0 else ASTERN_A_N15) * np.abs(wanted[i]) ** 1.5
        amps += h / CURRENT_S * (drawn - amps)
        left = 1.0 - supply.felt_fall * time_s
        left *= max(1.0 - supply.felt_ohm * (amps - HOTEL_A) / supply.volts, 0.3) ** 2
        for i in range(k):
            wanted[i] *= left
        here = water.moved[min(step, len(water.moved) - 1)]
        ahead = water.moved[min(step + 1, len(water.moved) - 1)]
        assign(tau, water.push[step])
        add_wrench(second, state[7:13], prop, tau)
        state_derivative(state, tau, here, grown, body, hull, 0.0, 0.0, k1, work)
        assign(ticks.moving[step], k1[0:3])
        if step % EACH == 0:
            assign(ticks.state[tick - 1], state)
            assign(ticks.nu_dot[tick - 1], k1[7:13])
            assign(ticks.push[tick - 1], water.push[step])
            assign(ticks.nominal[tick - 1], plain)
            volts = supply.volts * np.sqrt(1.0 - supply.fall * time_s) - supply.ohm * amps
            ticks.supply[tick - 1, 0] = max(volts, 0.3 * supply.volts)
            ticks.supply[tick - 1, 1] = amps
        turn(wanted, first, second, keep, keep_second)
        assign(middle, second)
        turn(wanted, first, second, keep, keep_second)
        for i in range(k):
            plain[i] = given[tick - 1, i] + keep_plain * (plain[i] - given[tick - 1, i])
        assign(trial, state + 0.5 * h * k1)
        assign(tau, 0.5 * (water.push[step] + water.push[step + 1]))
        add_wrench(middle, trial[7:13], prop, tau)
        state_derivative(trial, tau, here, grown, body, hull, 0.0, 0.0, k2, work)
        assign(trial, state + 0.5 * h * k2)
        assign(tau, 0.5 * (water.push[step] + water.push[step + 1]))
        add_wrench(middle, trial[7:13], prop, tau)
        state_derivative(trial, tau, here, grown, body, hull, 0.0, 0.0, k3, work)
        assign(trial, state + h * k3)
        assign(tau, water.push[step + 1])
        add_wrench(second, trial[7:13], prop, tau)
        state_derivative(trial, tau, ahead, grown, body, hull, 0.0, 0.0, k4, work)
        state += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        norm = np.sqrt(np.sum(state[3:7] ** 2))
        for i in range(3, 7):
            state[i] /= norm
    assign(hull.drag, clean)


@njit(cache=True, error_model="numpy")
def look(state: Array, noise: Array, out: Array) -> None:
    """Fill the autopilot's readings (9,): roll, pitch, heading, p, q, r, depth, sinking, each with its noise (8,)."""
    qw, qx, qy, qz = state[3], state[4], state[5], state[6]
    out[0] = np.arctan2(2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy))
    out[1] = np.arcsin(min(max(2 * (qw * qy - qx * qz), -1.0), 1.0))
    out[2] = np.arctan2(2 * (qx * qy + qw * qz), 1 - 2 * (qy * qy + qz * qz))
    assign(out[3:6], state[10:13])
    out[6] = state[2]
    u, v, w = state[7], state[8], state[9]
    down = 2 * (qx * qz - qw * qy) * u + 2 * (qy * qz + qw * qx) * v
    out[7] = down + (1 - 2 * (qx * qx + qy * qy)) * w
    for i in range(8):
        out[i] += noise[i]


@njit(cache=True, error_model="numpy")
def homewards(state: Array, heading: float, asked: Array, tick: int, leash_m: float) -> float:
    """-1 if this leg leads farther away from the start of the dive, beyond the leash; otherwise 1."""
    soon = asked[min(tick + 20, len(asked) - 1)]
    north = np.cos(heading) * soon[0] - np.sin(heading) * soon[1]
    east = np.sin(heading) * soon[0] + np.cos(heading) * soon[1]
    far = np.sqrt(state[0] ** 2 + state[1] ** 2)
    return -1.0 if far > leash_m and state[0] * north + state[1] * east > 0.0 else 1.0
