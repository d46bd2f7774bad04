"""One mission dived under feedback, compiled: the body, its thrusters, its sensors and its controller.

M nu_dot + C(nu) nu + D nu + g(eta) = tau + trim + d with diagonal M and D (Fossen 2011, eqs 6.1 to 6.3), by
fourth-order Runge-Kutta. Each step has the exact mean of the disturbance d, a first-order Gauss-Markov process. The
thrusters' wrench follows the commanded wrench with the exact response of a first-order lag. This code shares no line
with the estimators, nor with the simulator that is flown over bytes.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from bridge.arrays import Array
from identify.challenge.dive import LOWEST_US, NEUTRAL, pulse
from identify.challenge.equations_of_motion import assign

STATES = 14
"""North, east, down; attitude w x y z; nu (6); the integral of yaw rate."""


class Body(NamedTuple):
    """SI units. `thrust_at` (801,) N at each microsecond; `matrix` (6, k) wrench by thrust, `inverse` (k, 6)."""

    mass: Array
    damping: Array
    trim: Array
    righting_nm: float
    net_up_n: float
    matrix: Array
    inverse: Array
    low_n: float
    high_n: float
    thrust_at: Array
    lag_s: float


class Gains(NamedTuple):
    """Gains (6,) each, N and N m per unit of each axis; `bound` limits the integral's share of the wrench."""

    kp: Array
    ki: Array
    kd: Array
    bound: Array


class Clockwork(NamedTuple):
    """Periods in steps of `step_s`; a period of 0 means that the sensor is missing."""

    step_s: float
    tick: int
    dvl: int
    dvl_first: int
    dvl_latency: int
    gyro: int
    fog: int
    attitude: int
    depth: int


class Readings(NamedTuple):
    """Rows in time order, filled with noise beforehand; the dive adds the measured values.

    dvl (a, 3), gyro (b, 3), fog (c, 1), attitude (e, 3) roll pitch yaw, depth (f, 1). A NaN stays a NaN.
    """

    dvl: Array
    gyro: Array
    fog: Array
    attitude: Array
    depth: Array


class Ticks(NamedTuple):
    """A row per control tick, filled by the dive.

    True state (STATES) and disturbance (6) before the tick's command acts; pulses (k), feedback wrench and commanded
    wrench (6), velocity that was fed back (6).
    """

    state: Array
    disturbance: Array
    pwm: Array
    tau_pid: Array
    tau_cmd: Array
    nu_fb: Array


@njit(cache=True, error_model="numpy")
def rates(state: Array, tau: Array, body: Body, out: Array) -> None:
    """The time derivative of the state under the wrench tau, which includes trim and disturbance."""
    qw, qx, qy, qz = state[3], state[4], state[5], state[6]
    u, v, w, p, q, r = state[7], state[8], state[9], state[10], state[11], state[12]
    down_x, down_y = 2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx)
    down_z = 1 - 2 * (qx * qx + qy * qy)
    out[0] = (1 - 2 * (qy * qy + qz * qz)) * u + 2 * (qx * qy - qw * qz) * v + 2 * (qx * qz + qw * qy) * w
    out[1] = 2 * (qx * qy + qw * qz) * u + (1 - 2 * (qx * qx + qz * qz)) * v + 2 * (qy * qz - qw * qx) * w
    out[2] = down_x * u + down_y * v + down_z * w
    out[3] = -0.5 * (qx * p + qy * q + qz * r)
    out[4] = 0.5 * (qw * p - qz * q + qy * r)
    out[5] = 0.5 * (qz * p + qw * q - qx * r)
    out[6] = 0.5 * (-qy * p + qx * q + qw * r)
    mu, mv, mw, ip, iq, ir = (
        body.mass[0],
        body.mass[1],
        body.mass[2],
        body.mass[3],
        body.mass[4],
        body.mass[5],
    )
    dm, up, arm = body.damping, body.net_up_n, body.righting_nm
    out[7] = (tau[0] - mw * w * q + mv * v * r - dm[0] * u - up * down_x) / mu
    out[8] = (tau[1] - mu * u * r + mw * w * p - dm[1] * v - up * down_y) / mv
    out[9] = (tau[2] - mv * v * p + mu * u * q - dm[2] * w - up * down_z) / mw
    out[10] = (tau[3] - (mw - mv) * v * w - (ir - iq) * q * r - dm[3] * p - arm * down_y) / ip
    out[11] = (tau[4] - (mu - mw) * u * w - (ip - ir) * p * r - dm[4] * q + arm * down_x) / iq
    out[12] = (tau[5] - (mv - mu) * u * v - (iq - ip) * p * q - dm[5] * r) / ir
    out[13] = r


@njit(cache=True, error_model="numpy")
def _turn(angle: float) -> float:
    return float(angle - 2 * np.pi * np.round(angle / (2 * np.pi)))


@njit(cache=True, error_model="numpy", nogil=True)
def dive(
    body: Body,
    gains: Gains,
    clock: Clockwork,
    arm: Array,
    reference: Array,
    keep: Array,
    share: Array,
    kicks: Array,
    start: Array,
    readings: Readings,
    ticks: Ticks,
) -> None:
    """Dive a mission, filling `readings` and `ticks`.

    arm (3,): m from the origin to the DVL; reference (n, 16): as `manoeuvres.sampled` makes it; keep, share (6,):
    factors on the disturbance for its end of step and its mean; kicks (steps + 1, 2, 6): noise added to each, row 0
    its start; start (STATES,). The controller is a PID on the readings that have arrived: velocity in surge and sway,
    depth, heading, rates of roll and pitch. A wanted roll or pitch is added as an open-loop moment.
    """
    h = clock.step_s
    state, trial = start.copy(), np.empty(STATES)
    k1, k2, k3, k4 = np.empty(STATES), np.empty(STATES), np.empty(STATES), np.empty(STATES)
    disturbance = kicks[0, 0].copy()
    wrench, asked, integral = np.zeros(6), np.zeros(6), np.zeros(6)
    half, full = np.exp(-0.5 * h / body.lag_s), np.exp(-h / body.lag_s)
    velocity, nu = np.zeros(3), np.zeros(6)
    heading, depth, turned = 0.0, start[2], 0.0
    seen, said = 0, 0
    saturated = False
    count = len(kicks) - 1
    tick = 0
    for step in range(count):
        if step >= clock.dvl_first and (step - clock.dvl_first) % clock.dvl == 0:
            row, p, q, r = readings.dvl[seen], state[10], state[11], state[12]
            row[0] += state[7] + q * arm[2] - r * arm[1]
            row[1] += state[8] + r * arm[0] - p * arm[2]
            row[2] += state[9] + p * arm[1] - q * arm[0]
            seen += 1
        if step % clock.gyro == 0:
            row = readings.gyro[step // clock.gyro]
            for i in range(3):
                row[i] += state[10 + i]
                if i < 2 or clock.fog == 0:
                    nu[3 + i] = row[i]
        if clock.fog > 0 and step > 0 and step % clock.fog == 0:
            row = readings.fog[step // clock.fog - 1]
            row[0] += (state[13] - turned) / (clock.fog * h)
            turned = state[13]
            nu[5] = row[0]
        if step % clock.attitude == 0:
            row = readings.attitude[step // clock.attitude]
            qw, qx, qy, qz = state[3], state[4], state[5], state[6]
            row[0] += np.arctan2(2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy))
            row[1] += np.arcsin(2 * (qw * qy - qx * qz))
            row[2] += np.arctan2(2 * (qx * qy + qw * qz), 1 - 2 * (qy * qy + qz * qz))
            heading = row[2]
        if step % clock.depth == 0:
            row = readings.depth[step // clock.depth]
            row[0] += state[2]
            depth = row[0]
        while said < seen and clock.dvl_first + said * clock.dvl + clock.dvl_latency <= step:
            row = readings.dvl[said]
            if not np.isnan(row[0]):
                velocity[0] = row[0] - nu[4] * arm[2] + nu[5] * arm[1]
                velocity[1] = row[1] - nu[5] * arm[0] + nu[3] * arm[2]
                velocity[2] = row[2] - nu[3] * arm[1] + nu[4] * arm[0]
            said += 1
        if step % clock.tick == 0:
            assign(nu[:3], velocity)
            want = reference[tick]
            assign(ticks.state[tick], state)
            assign(ticks.disturbance[tick], disturbance)
            assign(ticks.nu_fb[tick], nu)
            for i in range(6):
                slope = want[i] - nu[i]
                if i < 2:
                    error, slope = slope, 0.0
                elif i == 2:
                    error = want[13] - depth
                elif i == 5:
                    error = _turn(want[12] - heading)
                else:
                    error, slope = 0.0, -nu[i]
                grown = integral[i] + gains.ki[i] * error * clock.tick * h
                grown = min(max(grown, -gains.bound[i]), gains.bound[i])
                if not saturated or abs(grown) < abs(integral[i]):
                    integral[i] = grown
                ticks.tau_pid[tick, i] = gains.kp[i] * error + integral[i] + gains.kd[i] * slope
            tau = ticks.tau_pid[tick].copy()
            tau[3] += body.righting_nm * want[14]
            tau[4] += body.righting_nm * want[15]
            thrust = body.inverse @ tau
            worst = max(1.0, thrust.max() / body.high_n, thrust.min() / body.low_n)
            saturated = worst > 1.0
            thrust /= worst
            assign(ticks.tau_cmd[tick], body.matrix @ thrust)
            for i in range(len(thrust)):
                place = pulse(thrust[i], body.thrust_at, NEUTRAL)
                ticks.pwm[tick, i] = LOWEST_US + place
                thrust[i] = body.thrust_at[place]
            asked = body.matrix @ thrust
            tick += 1
        middle, end = asked + (wrench - asked) * half, asked + (wrench - asked) * full
        between = share * disturbance + kicks[step + 1, 1] + body.trim
        rates(state, wrench + between, body, k1)
        assign(trial, state + 0.5 * h * k1)
        rates(trial, middle + between, body, k2)
        assign(trial, state + 0.5 * h * k2)
        rates(trial, middle + between, body, k3)
        assign(trial, state + h * k3)
        rates(trial, end + between, body, k4)
        state += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        norm = np.sqrt(np.sum(state[3:7] ** 2))
        for i in range(3, 7):
            state[i] /= norm
        assign(wrench, end)
        assign(disturbance, keep * disturbance + kicks[step + 1, 0])
