"""The feed-forward term: tau_ff = M nu_dot_d + D nu_d in surge, sway and yaw (paper eqs 14 to 16, M total).

The yaw term includes the inertia, which the paper left out. Accepted effects of the hull are added. All that comes
with the feed-forward fades in, so that raising FF_MODE makes no thruster jump.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import BY_NAME, DOFS, QUADRATICS, fault_of
from bridge.vehicle.references import ZERO6, Reference, Six
from bridge.wire.status_codes import Topic, coded

AXES = ((0, "M_u", "D_u"), (1, "M_v", "D_v"), (5, "I_r", "D_r"))
FEEDFORWARD_DOFS = tuple(dof for dof, _, _ in AXES)
LEAD_SHARE = 0.1
SLOPE_PER_S = 2.0
LONGEST_TICK_S = 0.1
NO_EFFECTS: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class FeedForward:
    """The wrench, N and N m; a text for the crew on the reason for each axis that has to stay at zero; and these
    axes."""

    tau: Six
    faults: tuple[str, ...]
    off: tuple[int, ...] = ()


def feedforward(
    coefficients: Mapping[str, float],
    reference: Reference,
    reach: Sequence[float],
    hull: Mapping[str, float] = NO_EFFECTS,
) -> FeedForward:
    """Return the wrench that the reference needs, within +-`reach` (6,) N and N m; `hull` holds accepted effects by
    name.

    An axis gets zero if its coefficients are missing, not finite or out of bounds, or if its reference is not finite;
    nothing raises.
    """
    tau = [0.0] * 6
    faults, off = [], []
    more = hull_wrench(hull, reference) if hull else ZERO6
    for dof, mass_name, damping_name in AXES:
        # A hull may have quadratic damping alone.
        damped = damping_name in coefficients or QUADRATICS[dof].name not in hull
        fault = _fault(coefficients, mass_name) or (damped and _fault(coefficients, damping_name)) or ""
        if fault:
            faults.append(coded(Topic.SET_FAULT, f"FF {DOFS[dof]} off: {fault}"))
            off.append(dof)
        else:
            force = coefficients[mass_name] * reference.nu_dot[dof]
            if damped:
                force += coefficients[damping_name] * reference.nu[dof]
            if hull:
                force += more[dof]
            if math.isfinite(force):
                tau[dof] = min(max(force, -reach[dof]), reach[dof])
            else:
                faults.append(f"FF {DOFS[dof]} off: its reference is not finite")
                off.append(dof)
    return FeedForward((tau[0], tau[1], tau[2], tau[3], tau[4], tau[5]), tuple(faults), tuple(off))


def silent(why: str) -> FeedForward:
    """Return a zero feed-forward in all axes, for the reason `why`."""
    return FeedForward(ZERO6, (f"FF off: {why}",), FEEDFORWARD_DOFS)


def hull_wrench(effects: Mapping[str, float], reference: Reference) -> Six:
    """Wrench that compensates effects of the hull in surge, sway and yaw, N and N m (Fossen 2011, section 6.4:
    quadratic drag, linear coupling of sway and yaw, lift and Munk moment of a drifting hull; eq. 3.57: a centre of
    mass, or added mass, off the origin)."""
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
    """Shifts a wrench ahead in time by `lead_s`, to cancel the lag of the propellers and of the held command.

    A first-order lag is undone by adding a multiple of the derivative, here the difference between two ticks. The
    addition is limited to `LEAD_SHARE` of the `reach` (6,), so that a jump in the reference does not cause a kick.
    """

    def __init__(self, lead_s: float, reach: Sequence[float]) -> None:
        self._lead_s = lead_s
        self._most = tuple(LEAD_SHARE * limit for limit in reach)
        self._before: Six | None = None

    def step(self, tau: Six, dt_s: float) -> Six:
        """Return the wrench to ask for now, N and N m; the first tick's wrench is returned unchanged."""
        before, self._before = self._before or tau, tau
        if not dt_s > 0:
            return tau
        x, y, z, k, m, n = (
            now + min(max(self._lead_s / dt_s * (now - then), -most), most)
            for now, then, most in zip(tau, before, self._most, strict=True)
        )
        return x, y, z, k, m, n

    def reset(self) -> None:
        """Forget the previous tick."""
        self._before = None


class Slope:
    """Limits the applied wrench to the `reach` (6,) and its rate of change to `SLOPE_PER_S` times the reach per
    second, whatever the parameters and the reference: half a second from zero to full, twelve times the steepest
    slope of the shipped missions. It starts at zero. An axis that is off drops to zero at once.

    A late tick counts for at most `LONGEST_TICK_S`.
    """

    def __init__(self, reach: Sequence[float]) -> None:
        self._reach = tuple(reach)
        self._applied: Six = ZERO6

    def step(self, wanted: Six, off: Collection[int], dt_s: float) -> Six:
        """Return the wrench to apply now, N and N m; `off` lists the axes that must be zero."""
        share = SLOPE_PER_S * min(max(dt_s, 0.0), LONGEST_TICK_S)
        x, y, z, k, m, n = (
            0.0 if dof in off else _towards(wanted[dof], self._applied[dof], reach, share * reach)
            for dof, reach in enumerate(self._reach)
        )
        self._applied = (x, y, z, k, m, n)
        return self._applied

    def reset(self) -> None:
        """Start from zero again."""
        self._applied = ZERO6


def _towards(wanted: float, before: float, bound: float, most: float) -> float:
    within = min(max(wanted, -bound), bound)
    return min(max(within, before - most), before + most)


def _fault(coefficients: Mapping[str, float], name: str) -> str:
    value, bounds = coefficients.get(name), BY_NAME[name]
    return f"{name} is missing" if value is None else fault_of(name, value, bounds.low, bounds.high)


Blended = TypeVar("Blended", float, NDArray[np.float64])


class Onset:
    """A share that rises from 0 to 1 as fast as `Slope` lets the feed-forward grow, and drops to 0 at once when it is
    off.

    It fades in the changes that accompany the feed-forward's wrench: thrusts that compensate losses or jump over the
    dead zone, and a stiffer PID.
    """

    def __init__(self) -> None:
        self.share = 0.0

    def step(self, is_applied: bool, dt_s: float) -> None:
        """Advance by a tick that comes `dt_s` after the previous one; a late tick counts for no more than `Slope`
        allows."""
        grown = self.share + SLOPE_PER_S * min(max(dt_s, 0.0), LONGEST_TICK_S)
        self.share = min(grown, 1.0) if is_applied else 0.0

    def between(self, without: Blended, with_it: Blended) -> Blended:
        """Blend the two values by the current share; exact to the last bit at 0 and 1."""
        return (1.0 - self.share) * without + self.share * with_it
