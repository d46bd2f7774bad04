"""The feed-forward term: tau_ff = M nu_dot_d + D nu_d in surge, sway and yaw (paper eqs 14 to 16, M total).

In yaw the inertia is in it, which the paper left out. Accepted effects of the hull add to it.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType

from bridge.vehicle.coefficients import BY_NAME, DOFS, QUADRATICS
from bridge.vehicle.references import ZERO6, Reference, Six

AXES = ((0, "M_u", "D_u"), (1, "M_v", "D_v"), (5, "I_r", "D_r"))
FEEDFORWARD_DOFS = tuple(dof for dof, _, _ in AXES)
LEAD_SHARE = 0.1
SLOPE_PER_S = 2.0
LONGEST_TICK_S = 0.1
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

    def raises(self, before: "Mode") -> bool:
        """Whether it leaves more to the feed-forward than `before` did: it acts, or acts without the PID now."""
        return _LEFT_TO_IT[self] > _LEFT_TO_IT[before]


_LEFT_TO_IT = {Mode.OFF: 0, Mode.SHADOW: 0, Mode.BOTH: 1, Mode.ALONE: 2}


@dataclass(frozen=True, slots=True)
class FeedForward:
    """The wrench, N and N m; for each axis that has to stay at zero a sentence that says why, and which they are."""

    tau: Six
    faults: tuple[str, ...]
    off: tuple[int, ...] = ()


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
    faults, off = [], []
    more = hull_wrench(hull, reference) if hull else ZERO6
    for dof, mass_name, damping_name in AXES:
        # A hull may have quadratic damping alone.
        damped = damping_name in coefficients or QUADRATICS[dof].name not in hull
        fault = _fault(coefficients, mass_name) or (damped and _fault(coefficients, damping_name)) or ""
        if not fault:
            force = coefficients[mass_name] * reference.nu_dot[dof]
            if damped:
                force += coefficients[damping_name] * reference.nu[dof]
            if hull:
                force += more[dof]
            tau[dof] = min(max(force, -reach[dof]), reach[dof]) if math.isfinite(force) else 0.0
            fault = "" if math.isfinite(force) else "its reference is not finite"
        if fault:
            faults.append(f"FF {DOFS[dof]} off: {fault}")
            off.append(dof)
    return FeedForward((tau[0], tau[1], tau[2], tau[3], tau[4], tau[5]), tuple(faults), tuple(off))


def silent(why: str) -> FeedForward:
    """No feed-forward in any axis."""
    return FeedForward(ZERO6, (f"FF off: {why}",), FEEDFORWARD_DOFS)


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


class Slope:
    """Holds the wrench that is applied within the `reach` (6,) and its slope within `SLOPE_PER_S` of it a second,
    whatever the parameters and the reference: half a second from nothing to all, twelve times the steepest slope of
    the missions that are shipped. It begins at zero. An axis that is off is at zero at once.

    A tick that comes late is worth no more than `LONGEST_TICK_S`.
    """

    def __init__(self, reach: Sequence[float]) -> None:
        self._reach = tuple(reach)
        self._applied: Six = ZERO6

    def step(self, wanted: Six, off: Collection[int], dt_s: float) -> Six:
        """The wrench to apply now, N and N m; `off` are the axes that have to have none."""
        share = SLOPE_PER_S * min(max(dt_s, 0.0), LONGEST_TICK_S)
        x, y, z, k, m, n = (
            0.0 if dof in off else _towards(wanted[dof], self._applied[dof], reach, share * reach)
            for dof, reach in enumerate(self._reach)
        )
        self._applied = (x, y, z, k, m, n)
        return self._applied

    def reset(self) -> None:
        """Begin at zero again."""
        self._applied = ZERO6


def _towards(wanted: float, before: float, bound: float, most: float) -> float:
    within = min(max(wanted, -bound), bound)
    return min(max(within, before - most), before + most)


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
