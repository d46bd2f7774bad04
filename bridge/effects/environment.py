"""What the water does: currents that stay or change, waves."""

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect, Parameter, Told
from bridge.vehicle.config import GRAVITY_M_S2

Array = NDArray[np.float64]

WAVE_PERIODS_S = (2.0, 3.0, 4.0, 5.0, 6.5, 8.0)
CURRENT_PERIODS_S = (20.0, 40.0, 80.0, 160.0)


def water_moves(course: Course, water: Array, rising: Array) -> Array:
    """The wrench (n, 6) of water that moves by `water` (n, 3), body axes, and speeds up by `rising` (n, 3) over ground,
    to the first order in both.

    Drag and the added masses' Coriolis forces go by the velocity through the water, and the added masses are carried
    along: d(nu_r)/dt = d(nu)/dt - R^T dVc/dt + omega x Vc (Fossen 2011, section 8.3). The water's own acceleration
    pushes what it displaces as well (Newman 1977, section 4.13).
    """
    added, still = course.added_mass, np.zeros_like(course.nu)
    moving = still.copy()
    moving[:, :3] = water
    # C(nu) nu is quadratic: its change less that of the water alone is what is linear in the water.
    out = (
        course.damping * moving
        + course.coriolis_of(added, course.nu)
        - course.coriolis_of(added, course.nu - moving)
        + course.coriolis_of(added, moving)
    )
    p, q, r = course.nu[:, 3:].T
    x, y, z = water.T
    turning = np.column_stack([q * z - r * y, r * x - p * z, p * y - q * x])
    out[:, :3] += added[:3] * (rising - turning) + course.configuration.dry_mass_kg * rising
    return np.asarray(out)


def _steady(course: Course, values: Array) -> Act:
    """Whole, and not to the first order: with the Munk moment that a current makes of a body at rest."""
    water = course.in_body(float(values[0]), float(values[1]))
    alone = np.zeros_like(course.nu)
    alone[:, :3] = water
    first = water_moves(course, water, np.zeros_like(water))
    return Act(wrench=first - course.coriolis_of(course.added_mass, alone))


STEADY_CURRENT = Effect(
    "steady_current",
    "a current that stays as it is",
    "water",
    (Parameter("north", "m/s", 0.05, -3.0, 3.0), Parameter("east", "m/s", 0.05, -3.0, 3.0)),
    _steady,
    "one leg on three headings or more, or a slow full turn; a drift without thrust",
    linear=False,
)


def varying_current(period_s: float) -> Effect:
    """A sine and a cosine of one period in north and in east: four numbers, told as amplitude and period."""
    rate = 2 * np.pi / period_s

    def act(course: Course, values: Array) -> Act:
        sin, cos = np.sin(rate * course.since_s), np.cos(rate * course.since_s)
        north, east = values[0] * sin + values[1] * cos, values[2] * sin + values[3] * cos
        rising = rate * (values[0] * cos - values[1] * sin), rate * (values[2] * cos - values[3] * sin)
        return Act(wrench=water_moves(course, course.in_body(north, east), course.in_body(*rising)))

    def telling(values: Array) -> Told:
        return {"amplitude": (float(np.linalg.norm(values)), "m/s"), "period": (period_s, "s")}

    return Effect(
        "varying_current",
        f"a current that comes and goes with a period of about {period_s:g} s",
        "water",
        tuple(
            Parameter(f"{way}_{part}", "m/s", 0.03) for way in ("north", "east") for part in ("sin", "cos")
        ),
        act,
        "the same leg again; its spectrum",
        variant=f"{period_s:g} s",
        telling=telling,
    )


def waves(period_s: float) -> Effect:
    """A force of one period in north, east and down that dies with depth as exp(-k z) does, k of deep water; six
    numbers, told as the larger of its level and its upright amplitude, at the depth that half the dive was above."""
    rate = 2 * np.pi / period_s

    def act(course: Course, values: Array) -> Act:
        sin, cos = np.sin(rate * course.since_s), np.cos(rate * course.since_s)
        dying = np.exp(-(rate**2) / GRAVITY_M_S2 * _below_the_middle(course.depth_m))
        north, east, down = (dying * (values[k] * sin + values[k + 1] * cos) for k in (0, 2, 4))
        wrench = np.zeros_like(course.nu)
        wrench[:, :3] = course.in_body(north, east) + course.world[2] * down[:, None]
        return Act(wrench=wrench)

    def telling(values: Array) -> Told:
        amplitude = max(np.linalg.norm(values[:4]), np.linalg.norm(values[4:]))
        return {"force_amplitude": (float(amplitude), "N"), "period": (period_s, "s")}

    return Effect(
        "waves",
        f"waves with a period of about {period_s:g} s",
        "water",
        tuple(
            Parameter(f"{way}_{part}", "N", 1.0)
            for way in ("north", "east", "down")
            for part in ("sin", "cos")
        ),
        act,
        "its spectrum, and the same run deeper",
        variant=f"{period_s:g} s",
        telling=telling,
    )


def _below_the_middle(depth_m: Array) -> Array:
    """Depth below its median, (n,), 0 where nothing tells of it."""
    known = np.isfinite(depth_m)
    if not known.any():
        return np.zeros_like(depth_m)
    return np.where(known, depth_m - np.median(depth_m[known]), 0.0)


EFFECTS = (STEADY_CURRENT, *map(varying_current, CURRENT_PERIODS_S), *map(waves, WAVE_PERIODS_S))
