"""The compiled inner loop of the simulated vehicle; a test checks that it equals `bridge.vehicle.dynamics`.

State (13,): north-east-down position (m), attitude w x y z (body to NED), body velocity u v w p q r.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def derivative(
    state: Array,
    tau: Array,
    mass: Array,
    damping: Array,
    quadratic: Array,
    weight_arm: float,
    net_up: float,
    surface_stiffness: float,
    out: Array,
) -> None:
    """Write the time derivative of the state under the wrench `tau` (6,) into `out` (13,).

    Fossen (2011), eqs 2.72 and 6.1 to 6.3. Above the surface (depth < 0) buoyancy falls by `surface_stiffness` N/m.
    """
    qw, qx, qy, qz = state[3], state[4], state[5], state[6]
    u, v, w, p, q, r = state[7], state[8], state[9], state[10], state[11], state[12]
    down_x, down_y = 2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx)
    down_z = 1 - 2 * (qx * qx + qy * qy)
    up = net_up
    if state[2] < 0.0:
        up += surface_stiffness * state[2]

    out[0] = (1 - 2 * (qy * qy + qz * qz)) * u + 2 * (qx * qy - qw * qz) * v + 2 * (qx * qz + qw * qy) * w
    out[1] = 2 * (qx * qy + qw * qz) * u + (1 - 2 * (qx * qx + qz * qz)) * v + 2 * (qy * qz - qw * qx) * w
    out[2] = down_x * u + down_y * v + down_z * w
    out[3] = 0.5 * (-qx * p - qy * q - qz * r)
    out[4] = 0.5 * (qw * p - qz * q + qy * r)
    out[5] = 0.5 * (qz * p + qw * q - qx * r)
    out[6] = 0.5 * (-qy * p + qx * q + qw * r)

    m_u, m_v, m_w, i_p, i_q, i_r = mass[0], mass[1], mass[2], mass[3], mass[4], mass[5]
    c_x = m_w * w * q - m_v * v * r
    c_y = m_u * u * r - m_w * w * p
    c_z = m_v * v * p - m_u * u * q
    c_k = (m_w - m_v) * v * w + (i_r - i_q) * q * r
    c_m = (m_u - m_w) * u * w + (i_p - i_r) * p * r
    c_n = (m_v - m_u) * u * v + (i_q - i_p) * p * q
    out[7] = (tau[0] - c_x - (damping[0] + quadratic[0] * abs(u)) * u - up * down_x) / m_u
    out[8] = (tau[1] - c_y - (damping[1] + quadratic[1] * abs(v)) * v - up * down_y) / m_v
    out[9] = (tau[2] - c_z - (damping[2] + quadratic[2] * abs(w)) * w - up * down_z) / m_w
    out[10] = (tau[3] - c_k - (damping[3] + quadratic[3] * abs(p)) * p - weight_arm * down_y) / i_p
    out[11] = (tau[4] - c_m - (damping[4] + quadratic[4] * abs(q)) * q + weight_arm * down_x) / i_q
    out[12] = (tau[5] - c_n - (damping[5] + quadratic[5] * abs(r)) * r) / i_r


@njit(cache=True, error_model="numpy")
def advance(
    state: Array,
    thrust: Array,
    disturbance: Array,
    target: Array,
    matrix: Array,
    noise: Array,
    keep: float,
    mass: Array,
    damping: Array,
    quadratic: Array,
    weight_arm: float,
    net_up: float,
    surface_stiffness: float,
    lag_s: float,
    dt_s: float,
    states: Array,
    rates: Array,
) -> None:
    """Take as many RK4 steps as `noise` (steps, 6) has rows; updates `state`, `thrust` and `disturbance` in place.

    The disturbance (6,) is held over a step and is then replaced by `keep` times itself plus the noise. Each thrust
    (n,) follows its target by the exact solution of a first-order lag. Step i fills row i + 1 of `states` (steps + 1,
    13) and of `rates` (steps + 1, 6: nu_dot); row 0 holds the start.
    """
    k1, k2, k3, k4 = np.empty(13), np.empty(13), np.empty(13), np.empty(13)
    trial = np.empty(13)
    half = np.exp(-0.5 * dt_s / lag_s) if lag_s > 0.0 else 0.0
    states[0] = state
    for i in range(noise.shape[0]):
        if lag_s <= 0.0:
            thrust[:] = target
        middle = target + (thrust - target) * half
        end = target + (middle - target) * half
        tau_start = matrix @ thrust + disturbance
        tau_middle = matrix @ middle + disturbance
        tau_end = matrix @ end + disturbance
        derivative(state, tau_start, mass, damping, quadratic, weight_arm, net_up, surface_stiffness, k1)
        rates[i] = k1[7:]
        trial[:] = state + 0.5 * dt_s * k1
        derivative(trial, tau_middle, mass, damping, quadratic, weight_arm, net_up, surface_stiffness, k2)
        trial[:] = state + 0.5 * dt_s * k2
        derivative(trial, tau_middle, mass, damping, quadratic, weight_arm, net_up, surface_stiffness, k3)
        trial[:] = state + dt_s * k3
        derivative(trial, tau_end, mass, damping, quadratic, weight_arm, net_up, surface_stiffness, k4)
        state += dt_s / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        norm = np.sqrt(state[3] ** 2 + state[4] ** 2 + state[5] ** 2 + state[6] ** 2)
        state[3:7] /= norm
        thrust[:] = end
        disturbance[:] = keep * disturbance + noise[i]
        states[i + 1] = state
    derivative(
        state,
        matrix @ thrust + disturbance,
        mass,
        damping,
        quadratic,
        weight_arm,
        net_up,
        surface_stiffness,
        k1,
    )
    rates[noise.shape[0]] = k1[7:]
