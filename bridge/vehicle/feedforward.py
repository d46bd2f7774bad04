"""The feed-forward term: tau_ff = M nu_dot_d + D nu_d in surge, sway and yaw (paper eqs 14 to 16, M total).

In yaw the inertia is in it, which the paper left out. Accepted effects of the hull add to it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType

from bridge.vehicle.coefficients import BY_NAME, DOFS
from bridge.vehicle.references import ZERO6, Reference, Six

AXES = ((0, "M_u", "D_u"), (1, "M_v", "D_v"), (5, "I_r", "D_r"))
FEEDFORWARD_DOFS = tuple(dof for dof, _, _ in AXES)
LEAD_SHARE = 0.1
NO_EFFECTS: Mapping[str, float] = MappingProxyType({})


class Mode(IntEnum):
    """FF_MODE: whether the feed-forward is applied, and whether the PID of its axes is."""

    OFF = 0
    SHADOW = 1
    ALONE = 2
    BOTH = 3

    @property
    def applies_feedforward(self) -> bool:
        return self in (Mode.ALONE, Mode.BOTH)

    @property
    def applies_pid(self) -> bool:
        """In surge, sway and yaw; the PID of heave, roll and pitch always works."""
        return self is not Mode.ALONE


@dataclass(frozen=True, slots=True)
class FeedForward:
    """The wrench, N and N m, and for each axis that stays at zero a sentence that says why."""

    tau: Six
    faults: tuple[str, ...]


def feedforward(
    coefficients: Mapping[str, float],
    reference: Reference,
    reach: Sequence[float],
    hull: Mapping[str, float] = NO_EFFECTS,
) -> FeedForward:
    """The wrench that the reference needs, within +-`reach` (6,) N and N m; `hull` holds accepted effects by name.

    An axis whose coefficients are missing, not finite or out of bounds, or whose reference is not finite,
    gets zero; nothing raises.
    """
    tau = [0.0] * 6
    faults = []
    more = hull_wrench(hull, reference) if hull else ZERO6
    for dof, mass_name, damping_name in AXES:
        fault = _fault(coefficients, mass_name) or _fault(coefficients, damping_name)
        if not fault:
            force = (
                coefficients[mass_name] * reference.nu_dot[dof]
                + coefficients[damping_name] * reference.nu[dof]
            )
            if hull:
                force += more[dof]
            tau[dof] = min(max(force, -reach[dof]), reach[dof]) if math.isfinite(force) else 0.0
            fault = "" if math.isfinite(force) else "its reference is not finite"
        if fault:
            faults.append(f"FF {DOFS[dof]} off: {fault}")
    return FeedForward((tau[0], tau[1], tau[2], tau[3], tau[4], tau[5]), tuple(faults))


def hull_wrench(effects: Mapping[str, float], reference: Reference) -> Six:
    """What makes up for effects of the hull, in surge, sway and yaw, N and N m (Fossen 2011, section 6.4: quadratic
    drag, linear coupling of sway and yaw, lift and Munk moment of a hull that drifts; eq. 3.57: a centre of mass, or
    added mass, off the origin)."""
    (u, v, _, _, _, r), (du, dv, _, _, _, dr) = reference.nu, reference.nu_dot
    give = effects.get
    ahead, aside = give("S_x", 0.0), give("S_y", 0.0)
    x = give("X_uu", 0.0) * abs(u) * u - ahead * r * r - aside * dr
    y = give("Y_vv", 0.0) * abs(v) * v + give("Y_r", 0.0) * r + give("Y_uv", 0.0) * abs(u) * v
    y += ahead * dr - aside * r * r
    n = give("N_rr", 0.0) * abs(r) * r + give("N_v", 0.0) * v
    n += give("N_uv", 0.0) * abs(u) * v + give("N_munk", 0.0) * u * v
    n += ahead * (dv + u * r) - aside * (du - v * r)
    return x, y, 0.0, 0.0, 0.0, n


class Lead:
    """Runs a wrench ahead of itself by `lead_s`, for what the propellers and the held command lag.

    A first-order lag is undone by a share of the derivative, here from one tick to the next. It adds no more
    than `LEAD_SHARE` of the `reach` (6,): a reference that jumps is no reason for a kick.
    """

    def __init__(self, lead_s: float, reach: Sequence[float]) -> None:
        self._lead_s = lead_s
        self._most = tuple(LEAD_SHARE * limit for limit in reach)
        self._before: Six | None = None

    def step(self, tau: Six, dt_s: float) -> Six:
        """The wrench to ask for now, N and N m; that of the first tick as it is."""
        before, self._before = self._before or tau, tau
        if not dt_s > 0:
            return tau
        x, y, z, k, m, n = (
            now + min(max(self._lead_s / dt_s * (now - then), -most), most)
            for now, then, most in zip(tau, before, self._most, strict=True)
        )
        return x, y, z, k, m, n

    def reset(self) -> None:
        """Forget the tick before."""
        self._before = None


def _fault(coefficients: Mapping[str, float], name: str) -> str:
    """Why a coefficient can't be used, "" where it can. Short enough for a STATUSTEXT of 50 characters."""
    value, bounds = coefficients.get(name), BY_NAME[name]
    if value is None:
        return f"{name} is missing"
    if not math.isfinite(value):
        return f"{name} is {value}"
    if not bounds.low <= value <= bounds.high:
        return f"{name} {value:g} out of bounds"
    return ""
