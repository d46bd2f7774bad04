"""The only definition of the nominal dynamics: M nu_dot + C(nu) nu + D nu + g(eta) = tau.

Fossen (2011), eqs 6.1 to 6.3, for a body with three planes of symmetry: M (total) and D diagonal, C from that
diagonal M, restoring forces from the centre of gravity `below` the centre of buoyancy and a net buoyancy. The code
uses plain arithmetic, so that floats, numpy arrays and torch tensors of any shape share the same lines. Body frame
FRD; nu = (u, v, w, p, q, r).
"""

from collections.abc import Sequence
from typing import Any

from bridge.attitude import down_in_body
from bridge.vehicle.config import GRAVITY_M_S2, Configuration

Six = tuple[Any, Any, Any, Any, Any, Any]


def coriolis(mass: Sequence[Any], nu: Sequence[Any]) -> Six:
    """C(nu) nu for a diagonal total mass matrix, N and N m."""
    m_u, m_v, m_w, i_p, i_q, i_r = mass
    u, v, w, p, q, r = nu
    return (
        m_w * w * q - m_v * v * r,
        m_u * u * r - m_w * w * p,
        m_v * v * p - m_u * u * q,
        (m_w - m_v) * v * w + (i_r - i_q) * q * r,
        (m_u - m_w) * u * w + (i_p - i_r) * p * r,
        (m_v - m_u) * u * v + (i_q - i_p) * p * q,
    )


def restoring(configuration: Configuration, attitude: Sequence[Any]) -> Six:
    """g(eta), N and N m, for attitude w x y z; weight is dry mass times standard gravity."""
    weight = configuration.dry_mass_kg * GRAVITY_M_S2
    net_up = configuration.net_buoyancy_n
    arm = configuration.centre_of_gravity_below_buoyancy_m * weight
    down_x, down_y, down_z = down_in_body(attitude)
    zero = 0.0 * down_x
    return (net_up * down_x, net_up * down_y, net_up * down_z, arm * down_y, -arm * down_x, zero)


def acceleration(
    mass: Sequence[Any], damping: Sequence[Any], nu: Sequence[Any], tau: Sequence[Any], g: Sequence[Any]
) -> Six:
    """nu_dot, m/s2 and rad/s2."""
    c = coriolis(mass, nu)
    values = [(tau[i] - c[i] - damping[i] * nu[i] - g[i]) / mass[i] for i in range(6)]
    return (values[0], values[1], values[2], values[3], values[4], values[5])
