"""What the water and what is in it do: currents, waves, surface and bottom, a tether."""

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect, Parameter

Array = NDArray[np.float64]

WAVE_PERIODS_S = (2.0, 3.0, 4.0, 5.0, 6.5, 8.0)


def water_moves(course: Course, water: Array, rising: Array) -> Array:
    """The wrench (n, 6) of water that moves by `water` (n, 3), body axes, and speeds up by `rising` (n, 3) over ground.

    Drag and the added masses' Coriolis forces go by the velocity through the water, and the added masses are carried
    along (Fossen 2011, section 8.3; the fluid's own acceleration: Newman 1977, section 4.13).
    """
    rigid = np.array([course.configuration.dry_mass_kg] * 3 + list(course.configuration.inertia_kgm2))
    added = course.mass - rigid
    through = course.nu.copy()
    through[:, :3] -= water
    turned = np.zeros_like(course.nu)
    turned[:, :3] = rising - np.cross(course.nu[:, 3:], water)
    displaced = np.array([course.configuration.dry_mass_kg] * 3 + [0.0] * 3)
    pushed = np.zeros_like(course.nu)
    pushed[:, :3] = rising
    return np.asarray(
        course.damping * (course.nu - through)
        + course.coriolis_of(added, course.nu)
        - course.coriolis_of(added, through)
        + added * turned
        + displaced * pushed
    )


def _steady(course: Course, values: Array) -> Act:
    water = course.in_body(float(values[0]), float(values[1]))
    return Act(wrench=water_moves(course, water, np.zeros_like(water)))


STEADY_CURRENT = Effect(
    "steady_current",
    "a current that stays as it is",
    "water",
    (Parameter("north", "m/s", 0.05), Parameter("east", "m/s", 0.05)),
    _steady,
    "one leg on three headings or more, or a slow full turn; a drift without thrust",
)


def _varying(period_s: float) -> Effect:
    def act(course: Course, values: Array) -> Act:
        """A sine and a cosine in north and east: four numbers, told as amplitude and period."""
        phase = 2 * np.pi * (course.time_s - course.time_s[0]) / period_s
        rate = 2 * np.pi / period_s
        north = values[0] * np.sin(phase) + values[1] * np.cos(phase)
        east = values[2] * np.sin(phase) + values[3] * np.cos(phase)
        north_rate = rate * (values[0] * np.cos(phase) - values[1] * np.sin(phase))
        east_rate = rate * (values[2] * np.cos(phase) - values[3] * np.sin(phase))
        water = _turned(course, north, east)
        return Act(wrench=water_moves(course, water, _turned(course, north_rate, east_rate)))

    return Effect(
        "varying_current",
        f"a current that comes and goes with a period of about {period_s:g} s",
        "water",
        tuple(
            Parameter(f"{way}_{part}", "m/s", 0.03) for way in ("north", "east") for part in ("sin", "cos")
        ),
        act,
        "the same leg again; its spectrum",
    )


def _turned(course: Course, north: Array, east: Array) -> Array:
    """A level world-fixed vector that changes, north and east (n,), in body axes (n, 3)."""
    unit_north, unit_east = course.in_body(1.0, 0.0), course.in_body(0.0, 1.0)
    return np.asarray(north[:, None] * unit_north + east[:, None] * unit_east)


VARYING_CURRENTS = tuple(map(_varying, (20.0, 40.0, 80.0, 160.0)))


def _waves(period_s: float) -> Effect:
    def act(course: Course, values: Array) -> Act:
        phase = 2 * np.pi * course.time_s / period_s
        wave = np.sin(phase), np.cos(phase)
        wrench = np.zeros_like(course.nu)
        for dof in range(3):
            wrench[:, dof] = values[2 * dof] * wave[0] + values[2 * dof + 1] * wave[1]
        return Act(wrench=wrench)

    return Effect(
        "waves",
        f"waves with a period of about {period_s:g} s",
        "water",
        tuple(Parameter(f"{way}_{part}", "N", 1.0) for way in "XYZ" for part in ("sin", "cos")),
        act,
        "its spectrum, and the same run deeper",
    )


WAVES = tuple(map(_waves, WAVE_PERIODS_S))


def _near(course: Course, values: Array, far_m: Array) -> Act:
    """Masses larger by `values[0]` at half a metre from the boundary, falling as its distance squared (Lamb 1932)."""
    more = values[0] / (1.0 + (far_m / 0.5) ** 2)
    wrench = np.zeros_like(course.nu)
    for dof in (1, 2):
        wrench[:, dof] = -more * course.mass[dof] * course.nu_dot[:, dof]
    return Act(wrench=wrench)


FREE_SURFACE = Effect(
    "free_surface",
    "the surface so near that masses change with depth",
    "water",
    (Parameter("mass_change", "1", 0.2),),
    lambda course, values: _near(course, values, np.maximum(np.nan_to_num(course.depth_m, nan=1e9), 0.0)),
    "the same manoeuvres at two depths",
    needs=("depth",),
)

BOTTOM_OR_WALL = Effect(
    "bottom_or_wall",
    "the bottom or a wall so near that masses change with altitude",
    "water",
    (Parameter("mass_change", "1", 0.2),),
    lambda course, values: _near(course, values, np.maximum(np.nan_to_num(course.altitude_m, nan=1e9), 0.0)),
    "the same manoeuvres at two altitudes",
    needs=("altitude",),
)


def _tether(course: Course, values: Array) -> Act:
    """A spring to a place: -k (x - x0) in the world, level."""
    stiffness, north, east = values.tolist()
    pull_north = north - stiffness * course.position_m[:, 0]
    pull_east = east - stiffness * course.position_m[:, 1]
    wrench = np.zeros_like(course.nu)
    wrench[:, :3] = _turned(course, pull_north, pull_east)
    return Act(wrench=wrench)


TETHER = Effect(
    "tether",
    "a tether that pulls to one place",
    "force",
    (Parameter("stiffness", "N/m", 0.1, low=0.0), Parameter("north", "N", 0.5), Parameter("east", "N", 0.5)),
    _tether,
    "out and back; one speed at two distances; a loose loop",
)

EFFECTS = (STEADY_CURRENT, *VARYING_CURRENTS, *WAVES, FREE_SURFACE, BOTTOM_OR_WALL, TETHER)
