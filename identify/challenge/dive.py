"""Simulates a dive of the planted vehicle, compiled: body, thrusters, sensors and controller in lock-step.

The controller is PI on velocity with feed-forward, and holds heading and depth.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from bridge.arrays import Array
from identify.challenge.equations_of_motion import STATES, WORK, Body, assign, state_derivative
from identify.challenge.hull import Hull, Propellers, add_wrench, shafts_want, turn
from identify.challenge.scenario import DrawnForce, remembered, shape_of
from identify.challenge.sensors import STEP_S, Faults, Periods, Readings


class Control(NamedTuple):
    """The controller of a planted dive.

    kp, ki, kd, bound (6,): N and N m per unit of each axis; bound limits the integral term. ahead_mass,
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


LOWEST_US = 1100
NEUTRAL = 400
"""Index of 1500 us in a table of thrust by whole microseconds that begins at LOWEST_US."""

LOAD_S = 0.4
WAKE_S = 4.0


class Ticks(NamedTuple):
    """One row per control tick, filled by `dive`.

    state (STATES,), nu_dot (6,), push (6,): the truth when the command is given. nominal (k,): thrust by the vehicle
    file's curve and lag. shaft (k,): thrust after both true lags, which sets the shaft's speed. load (1,); pwm (k,);
    tau_pid, tau_ff, tau_cmd, nu_fb (6,).
    """

    state: Array
    nu_dot: Array
    push: Array
    nominal: Array
    shaft: Array
    load: Array
    pwm: Array
    tau_pid: Array
    tau_ff: Array
    tau_cmd: Array
    nu_fb: Array


class Scene(NamedTuple):
    """Inputs of a dive in addition to its reference.

    push (steps + 1, 6): wrench of the disturbance and of planted forces that depend on time alone. water (steps + 1,
    12) or (1, 12): see `state_derivative`. fouled: share by which damping has grown at the end of `fouled_s`.
    thrust_at (801,): N at each microsecond. matrix (6, k), inverse (k, 6): the crew's allocation. lag_s: that of the
    vehicle file. crew_arm (3,): DVL position assumed by the crew.
    """

    push: Array
    water: Array
    fouled: float
    fouled_s: float
    thrust_at: Array
    matrix: Array
    inverse: Array
    lag_s: float
    crew_arm: Array


@njit(cache=True, error_model="numpy", nogil=True)
def dive(
    body: Body, hull: Hull, prop: Propellers, control: Control, periods: Periods, faults: Faults, scene: Scene,
    reference: Array, start: Array, readings: Readings, ticks: Ticks, drawn: DrawnForce, past: Array,
) -> None:  # fmt: skip
    """Follow a reference (n, 14) and fill `readings` and `ticks`: fourth-order Runge-Kutta at STEP_S.

    drawn: a force that depends on the vehicle's motion, held constant over each step; past: the memory of that force.
    """
    h = STEP_S
    count, k = len(reference) * periods.tick, scene.matrix.shape[1]
    state, trial = start.copy(), np.empty(STATES)
    k1, k2, k3, k4 = np.zeros(STATES), np.empty(STATES), np.empty(STATES), np.empty(STATES)
    work, tau = np.empty(WORK), np.zeros(6)
    asked, plain, wanted = np.zeros((len(reference), k)), np.zeros(k), np.zeros(k)
    first, second, middle, nothing = np.zeros(k), np.zeros(k), np.zeros(k), np.zeros(k)
    before = np.zeros((2, k))
    integral, fed, velocity, rate = np.zeros(6), np.zeros(6), np.zeros(3), np.zeros(3)
    seen_nu = np.zeros((count, 6))
    heading, depth, turned, phase, wake, loaded = 0.0, start[2], 0.0, 0.0, 0.0, 0.0
    keep = np.exp(-0.5 * h / prop.lag_s) if prop.lag_s > 0 else 0.0
    keep_second = np.exp(-0.5 * h / prop.second_s) if prop.second_s > 0 else 0.0
    keep_plain = np.exp(-h / scene.lag_s) if scene.lag_s > 0 else 0.0
    gain = 1.0 - np.exp(-periods.tick * h / control.memory_s) if control.memory_s > 0 else 1.0
    full = False
    strange, thrown, pushes = np.zeros(6), np.zeros(6), bool(np.any(drawn.size))
    tick, given = 0, -1
    for step in range(count):
        time_s = step * h
        breath = 1.0 + faults.bias_wander * np.sin(0.011 * time_s)
        assign(seen_nu[step], state[7:13])
        if step % periods.dvl == 0:
            row, was = readings.dvl[step // periods.dvl], seen_nu[max(step - faults.dvl_late_steps, 0)]
            x = was[0] + was[4] * faults.dvl_arm[2] - was[5] * faults.dvl_arm[1]
            y = was[1] + was[5] * faults.dvl_arm[0] - was[3] * faults.dvl_arm[2]
            z = was[2] + was[3] * faults.dvl_arm[1] - was[4] * faults.dvl_arm[0]
            for i in range(3):
                row[i] += (
                    faults.dvl_matrix[i, 0] * x + faults.dvl_matrix[i, 1] * y + faults.dvl_matrix[i, 2] * z
                )
                row[i] += breath * faults.dvl_bias[i]
        if step % periods.imu == 0:
            row = readings.gyro[step // periods.imu]
            for i in range(3):
                row[i] += state[10 + i]
                if i == 2:
                    row[i] += breath * faults.gyro_bias
                if i < 2 or periods.fog == 0:
                    rate[i] = row[i]
        if periods.fog > 0 and step % periods.fog == 0:
            row = readings.fog[step // periods.fog]
            if step > 0:
                row[0] += (state[13] - turned) / (periods.fog * h) + breath * faults.gyro_bias
            turned = state[13]
            rate[2] = row[0]
        if step % periods.attitude == 0:
            row = readings.attitude[step // periods.attitude]
            qw, qx, qy, qz = state[3], state[4], state[5], state[6]
            row[0] += np.arctan2(2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy))
            row[1] += np.arcsin(2 * (qw * qy - qx * qz))
            row[2] += np.arctan2(2 * (qx * qy + qw * qz), 1 - 2 * (qy * qy + qz * qz))
            heading = row[2]
        if step % periods.depth == 0:
            row = readings.depth[step // periods.depth]
            row[0] += faults.depth_gain * state[2]
            depth = row[0]
        if step % periods.dvl == 0 and not np.isnan(readings.dvl[step // periods.dvl, 0]):
            row = readings.dvl[step // periods.dvl]
            velocity[0] = row[0] - rate[1] * scene.crew_arm[2] + rate[2] * scene.crew_arm[1]
            velocity[1] = row[1] - rate[2] * scene.crew_arm[0] + rate[0] * scene.crew_arm[2]
            velocity[2] = row[2] - rate[0] * scene.crew_arm[1] + rate[1] * scene.crew_arm[0]
        if step % periods.tick == 0:
            for i in range(6):
                measured = velocity[i] if i < 3 else rate[i - 3]
                ticks.nu_fb[tick, i] = measured
                if faults.feedback_unlogged == 1:
                    measured = state[7 + i]
                fed[i] += gain * (measured - fed[i])
                if faults.feedback_unlogged == 0:
                    ticks.nu_fb[tick, i] = fed[i]
            wrench(reference[tick], fed, heading, depth, full, periods.tick * h, integral, control,
                   ticks.tau_pid[tick], ticks.tau_ff[tick])  # fmt: skip
            thrust = scene.inverse @ (ticks.tau_pid[tick] + control.ahead * ticks.tau_ff[tick])
            worst = max(1.0, thrust.max() / control.high_n, thrust.min() / control.low_n)
            full = worst > 1.0
            thrust /= worst
            assign(ticks.tau_cmd[tick], scene.matrix @ thrust)
            for i in range(k):
                place = pulse(thrust[i], scene.thrust_at, NEUTRAL)
                ticks.pwm[tick, i] = LOWEST_US + place
                asked[tick, i] = scene.thrust_at[place]
            tick += 1
        while given + 1 < tick and (given + 1) * periods.tick * h + prop.delay[given + 1] <= time_s + 1e-9:
            given += 1
        stuck = prop.stuck >= 0 and prop.stuck_when[min(step, len(prop.stuck_when) - 1)] > 0
        now = asked[given] if given >= 0 else nothing
        load = shafts_want(now, time_s, stuck, prop, before, loaded, wanted)
        loaded += h / LOAD_S * (load - loaded)
        water = scene.water[min(step, len(scene.water) - 1)]
        ahead = scene.water[min(step + 1, len(scene.water) - 1)]
        x = min(time_s / scene.fouled_s, 1.0)
        grown = scene.fouled * (1.0 - np.exp(-2.0 * x)) / (1.0 - np.exp(-2.0))
        if pushes:
            # k1 still holds the derivative of the previous step.
            thrown[:] = 0.0
            add_wrench(second, state[7:13], prop, thrown)
            shape = shape_of(drawn, state, k1[7:13], thrown, now)
            shape = remembered(drawn, shape, step, h, past) * drawn.when[min(step, len(drawn.when) - 1)]
            for i in range(6):
                strange[i] = shape * drawn.size[i]
        for i in range(6):
            tau[i] = scene.push[step, i] + strange[i]
        add_wrench(second, state[7:13], prop, tau)
        state_derivative(state, tau, water, grown, body, hull, phase, wake, k1, work)
        if step % periods.tick == 0:
            assign(ticks.state[tick - 1], state)
            assign(ticks.nu_dot[tick - 1], k1[7:13])
            assign(ticks.push[tick - 1], scene.push[step])
            assign(ticks.nominal[tick - 1], plain)
            assign(ticks.shaft[tick - 1], second)
            ticks.load[tick - 1, 0] = loaded
        if step % periods.imu == 0:
            row, nu, tilt = readings.force[step // periods.imu], state[7:13], faults.accelerometer_tilt
            qw, qx, qy, qz = state[3], state[4], state[5], state[6]
            fx = k1[7] + nu[4] * nu[2] - nu[5] * nu[1] - 9.80665 * 2 * (qx * qz - qw * qy)
            fy = k1[8] + nu[5] * nu[0] - nu[3] * nu[2] - 9.80665 * 2 * (qy * qz + qw * qx)
            fz = k1[9] + nu[3] * nu[1] - nu[4] * nu[0] - 9.80665 * (1 - 2 * (qx * qx + qy * qy))
            for i in range(3):
                row[i] += tilt[i, 0] * fx + tilt[i, 1] * fy + tilt[i, 2] * fz
        turn(wanted, first, second, keep, keep_second)
        assign(middle, second)
        turn(wanted, first, second, keep, keep_second)
        for i in range(k):
            plain[i] = asked[tick - 1, i] + keep_plain * (plain[i] - asked[tick - 1, i])
        assign(trial, state + 0.5 * h * k1)
        for i in range(6):
            tau[i] = 0.5 * (scene.push[step, i] + scene.push[step + 1, i]) + strange[i]
        add_wrench(middle, trial[7:13], prop, tau)
        state_derivative(trial, tau, water, grown, body, hull, phase, wake, k2, work)
        assign(trial, state + 0.5 * h * k2)
        for i in range(6):
            tau[i] = 0.5 * (scene.push[step, i] + scene.push[step + 1, i]) + strange[i]
        add_wrench(middle, trial[7:13], prop, tau)
        state_derivative(trial, tau, water, grown, body, hull, phase, wake, k3, work)
        assign(trial, state + h * k3)
        for i in range(6):
            tau[i] = scene.push[step + 1, i] + strange[i]
        add_wrench(second, trial[7:13], prop, tau)
        state_derivative(trial, tau, ahead, grown, body, hull, phase, wake, k4, work)
        state += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        norm = np.sqrt(np.sum(state[3:7] ** 2))
        for i in range(3, 7):
            state[i] /= norm
        phase += h * hull.shed_k * np.abs(state[7])
        wake += h / WAKE_S * (state[7] - wake)
