"""Equations of motion of the simulated body: six degrees of freedom, full mass matrices, moving water; compiled.

(M_RB + M_A) nu_dot + C(M_RB, nu) nu + C(M_A, nu_r) nu_r + D nu_r + g = tau, with C from the 6 x 6 matrix by Fossen
(2011), theorem 3.2 (eq. 3.46). Accelerating water carries the added masses along (section 8.3). Added masses that
grow by a share kappa near a boundary push by d(kappa M_A)/dz nu_r^2 / 2 downwards, minus d(kappa M_A)/dt nu_r
(Lagrange's equations; Lamb 1932, article 137), so that without a wrench the energy of body and water is conserved.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from bridge.arrays import Array
from identify.challenge.hull import Hull, growth, hull_wrench

STATES = 14
"""North, east, down; attitude w x y z; nu (6); the integral of yaw rate."""

WORK = (8, 6)
"""Shape of the scratch array that `state_derivative` needs."""


class Body(NamedTuple):
    """Rigid body and added mass, SI units, about the origin, FRD.

    rigid, added, damping (6, 6); inverse of rigid + added; centre (3,) of gravity, where `weight_n` acts; net_up_n:
    net buoyancy at the origin; displaced_kg: mass of the displaced water.
    """

    rigid: Array
    added: Array
    inverse: Array
    damping: Array
    centre: Array
    weight_n: float
    net_up_n: float
    displaced_kg: float


def body(
    rigid: Array,
    added: Array,
    damping: Array,
    centre: Array,
    weight_n: float,
    net_up_n: float,
    displaced_kg: float,
) -> Body:
    inverse = np.ascontiguousarray(np.linalg.inv(rigid + added))
    return Body(rigid, added, inverse, damping, centre, weight_n, net_up_n, displaced_kg)


@njit(cache=True, error_model="numpy")
def assign(out: Array, values: Array) -> None:
    """Copy values (n,) to `out` (n,). Assigning to a slice would check shapes, which takes 2 s longer to compile."""
    for i in range(len(values)):
        out[i] = values[i]


@njit(cache=True, error_model="numpy")
def subtract_coriolis(mass: Array, nu: Array, out: Array) -> None:
    """Subtract C(nu) nu of a 6 x 6 mass matrix from `out` (6,).

    C(nu) nu is -a x w for the forces and -a x v - b x w for the moments, with the momenta a and b.
    """
    a0 = a1 = a2 = b0 = b1 = b2 = 0.0
    for j in range(6):
        a0 += mass[0, j] * nu[j]
        a1 += mass[1, j] * nu[j]
        a2 += mass[2, j] * nu[j]
        b0 += mass[3, j] * nu[j]
        b1 += mass[4, j] * nu[j]
        b2 += mass[5, j] * nu[j]
    u, v, w, p, q, r = nu[0], nu[1], nu[2], nu[3], nu[4], nu[5]
    out[0] += a1 * r - a2 * q
    out[1] += a2 * p - a0 * r
    out[2] += a0 * q - a1 * p
    out[3] += a1 * w - a2 * v + b1 * r - b2 * q
    out[4] += a2 * u - a0 * w + b2 * p - b0 * r
    out[5] += a0 * v - a1 * u + b0 * q - b1 * p


@njit(cache=True, error_model="numpy")
def solve6(matrix: Array, right: Array) -> None:
    """Solve a symmetric positive definite 6 x 6 system in place: `right` becomes the solution, `matrix` is lost."""
    for k in range(6):
        for i in range(k + 1, 6):
            share = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, 6):
                matrix[i, j] -= share * matrix[k, j]
            right[i] -= share * right[k]
    for k in range(5, -1, -1):
        for j in range(k + 1, 6):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]


@njit(cache=True, error_model="numpy")
def state_derivative(
    state: Array, tau: Array, water: Array, grown: float, body: Body, hull: Hull, phase: float, wake: float,
    out: Array, work: Array,
) -> None:  # fmt: skip
    """Fill `out` (STATES,) with the time derivative of the state (STATES,) under the wrench `tau` (6,).

    water (12,): velocity and acceleration (north, east, down) of a current, then of waves at the depth
    `hull.wave_ref`. grown: share by which damping has grown. phase, wake: of the hull's
    own memory, as in `hull_wrench`. work: scratch (WORK).
    """
    qw, qx, qy, qz = state[3], state[4], state[5], state[6]
    r00, r01, r02 = 1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qw * qz), 2 * (qx * qz + qw * qy)
    r10, r11, r12 = 2 * (qx * qy + qw * qz), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qw * qx)
    r20, r21, r22 = 2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy)
    # water_accel: acceleration of the water, as seen in the turning body axes.
    nu, nu_r, force, water_accel = work[0], work[1], work[2], work[3]
    for i in range(6):
        nu[i] = state[7 + i]
    p, q, r = nu[3], nu[4], nu[5]
    fade = np.exp(-hull.wave_number * (state[2] - hull.wave_ref)) if hull.wave_number > 0 else 0.0
    vn, ve, vd = water[0] + fade * water[6], water[1] + fade * water[7], water[2] + fade * water[8]
    an, ae, ad = water[3] + fade * water[9], water[4] + fade * water[10], water[5] + fade * water[11]
    vx, vy, vz = (
        r00 * vn + r10 * ve + r20 * vd,
        r01 * vn + r11 * ve + r21 * vd,
        r02 * vn + r12 * ve + r22 * vd,
    )
    ax, ay, az = (
        r00 * an + r10 * ae + r20 * ad,
        r01 * an + r11 * ae + r21 * ad,
        r02 * an + r12 * ae + r22 * ad,
    )
    nu_r[0], nu_r[1], nu_r[2] = nu[0] - vx, nu[1] - vy, nu[2] - vz
    nu_r[3], nu_r[4], nu_r[5] = p, q, r
    water_accel[0] = ax - (q * vz - r * vy)
    water_accel[1] = ay - (r * vx - p * vz)
    water_accel[2] = az - (p * vy - q * vx)
    for i in range(6):
        total = tau[i]
        for j in range(6):
            total -= (1.0 + grown) * body.damping[i, j] * nu_r[j]
        for j in range(3):
            total += body.added[i, j] * water_accel[j]
        force[i] = total
    force[0] += body.displaced_kg * ax
    force[1] += body.displaced_kg * ay
    force[2] += body.displaced_kg * az
    subtract_coriolis(body.rigid, nu, force)
    subtract_coriolis(body.added, nu_r, force)
    up = body.net_up_n + hull.buoyancy_n * (1.0 - hull.squeeze * (state[2] - hull.wave_ref))
    force[0] -= up * r20
    force[1] -= up * r21
    force[2] -= up * r22
    cx, cy, cz = body.centre[0], body.centre[1], body.centre[2]
    force[3] += body.weight_n * (cy * r22 - cz * r21)
    force[4] += body.weight_n * (cz * r20 - cx * r22)
    force[5] += body.weight_n * (cx * r21 - cy * r20)
    pull_n, pull_e, pull_d = hull_wrench(state, nu_r, hull, phase, wake, force)
    force[0] += r00 * pull_n + r10 * pull_e + r20 * pull_d
    force[1] += r01 * pull_n + r11 * pull_e + r21 * pull_d
    force[2] += r02 * pull_n + r12 * pull_e + r22 * pull_d
    grown_share, share_by_metre = growth(state[2], hull)
    if grown_share == 0.0:
        for i in range(6):
            total = 0.0
            for j in range(6):
                total += body.inverse[i, j] * force[j]
            out[7 + i] = total
    else:
        grown_mass, sinking, twice_push = np.zeros((6, 6)), r20 * nu[0] + r21 * nu[1] + r22 * nu[2], 0.0
        for i in range(6):
            added_mass = hull.near_share[i] * body.added[i, i]
            grown_mass[i, i] = grown_share * added_mass
            force[i] -= share_by_metre * sinking * added_mass * nu_r[i]
            if i < 3:
                force[i] += grown_share * added_mass * water_accel[i]
            twice_push += share_by_metre * added_mass * nu_r[i] * nu_r[i]
        force[0] += 0.5 * twice_push * r20
        force[1] += 0.5 * twice_push * r21
        force[2] += 0.5 * twice_push * r22
        subtract_coriolis(grown_mass, nu_r, force)
        total_mass = grown_mass + (body.rigid + body.added)
        solve6(total_mass, force)
        for i in range(6):
            out[7 + i] = force[i]
    out[0] = r00 * nu[0] + r01 * nu[1] + r02 * nu[2]
    out[1] = r10 * nu[0] + r11 * nu[1] + r12 * nu[2]
    out[2] = r20 * nu[0] + r21 * nu[1] + r22 * nu[2]
    out[3] = 0.5 * (-qx * p - qy * q - qz * r)
    out[4] = 0.5 * (qw * p - qz * q + qy * r)
    out[5] = 0.5 * (qz * p + qw * q - qx * r)
    out[6] = 0.5 * (-qy * p + qx * q + qw * r)
    out[13] = r
