"""Effects of moving water: steady and varying currents, waves.

A neutrally buoyant vehicle moves through moving water as it does through water at rest (Fossen 2011, section 8.3;
accelerating water also pushes the volume that it surrounds, Newman 1977, section 4.13). A current is therefore no
force: it is the excess of the velocity over ground over that through the water.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import GRAVITY_M_S2
from identify.effects.course import Course
from identify.effects.effect import Act, Effect, Parameter, Separation, Told

Array = NDArray[np.float64]

WAVE_PERIODS_S = (2.0, 3.0, 4.0, 5.0, 6.5, 8.0)
CURRENT_PERIODS_S = (20.0, 40.0, 80.0, 160.0)


def _steady(course: Course, values: Array) -> Act:
    return Act(water=course.in_body(float(values[0]), float(values[1])))


STEADY_CURRENT = Effect(
    "steady_current",
    "a current that stays as it is",
    "water",
    (Parameter("north", "m/s", 0.05, -3.0, 3.0), Parameter("east", "m/s", 0.05, -3.0, 3.0)),
    _steady,
    Separation(
        manoeuvres=("one leg on three headings or more, or a slow full turn", "a drift without thrust")
    ),
    lasting=False,
)


def varying_current(*periods_s: float) -> Effect:
    """A sine and a cosine of each period in north and in east: four parameters per period. The answer gives the
    amplitude of all together and the period of their mean rate."""
    rates = [2 * np.pi / period_s for period_s in periods_s]

    def act(course: Course, values: Array) -> Act:
        water = np.zeros((2, len(course.since_s)))
        for rate, line in _present(rates, values.reshape(-1, 2, 2)):
            water += line @ np.stack([np.sin(rate * course.since_s), np.cos(rate * course.since_s)])
        return Act(water=course.in_body(*water))

    def telling(values: Array) -> Told:
        lines = np.linalg.norm(values.reshape(-1, 4), axis=1)
        return {
            "amplitude": (float(np.linalg.norm(lines)), "m/s"),
            "period": (_usual_s(periods_s, lines**2), "s"),
        }

    return Effect(
        "varying_current",
        f"a current that comes and goes with a period of about {periods_s[0]:.3g} s",
        "water",
        tuple(
            Parameter(f"{way}_{part}", "m/s", 0.03)
            for _ in periods_s
            for way in ("north", "east")
            for part in ("sin", "cos")
        ),
        act,
        Separation(manoeuvres=("the same leg again",)),
        variant=_variant(periods_s),
        telling=telling,
        sea=True,
        lasting=False,
    )


def waves(*periods_s: float) -> Effect:
    """A force of each period in north, east and down that decays with depth as exp(-k z), with k of deep water: six
    parameters per period. The answer gives the larger of its horizontal and its vertical amplitude, at the median
    depth of the dive, and the period of their mean rate."""
    rates = [2 * np.pi / period_s for period_s in periods_s]

    def act(course: Course, values: Array) -> Act:
        force, below_m = np.zeros((3, len(course.since_s))), _below_the_middle(course.depth_m)
        for rate, line in _present(rates, values.reshape(-1, 3, 2)):
            dying = np.exp(-(rate**2) / GRAVITY_M_S2 * below_m)
            force += dying * (line @ np.stack([np.sin(rate * course.since_s), np.cos(rate * course.since_s)]))
        wrench = np.zeros_like(course.nu)
        wrench[:, :3] = course.in_body(force[0], force[1]) + (course.world[2].T * force[2]).T
        return Act(wrench=wrench)

    def telling(values: Array) -> Told:
        lines = values.reshape(-1, 6)
        amplitude = max(np.linalg.norm(lines[:, :4]), np.linalg.norm(lines[:, 4:]))
        usual_s = _usual_s(periods_s, (lines**2).sum(axis=1))
        return {"force_amplitude": (float(amplitude), "N"), "period": (usual_s, "s")}

    return Effect(
        "waves",
        f"waves with a period of about {periods_s[0]:.3g} s",
        "water",
        tuple(
            Parameter(f"{way}_{part}", "N", 1.0)
            for _ in periods_s
            for way in ("north", "east", "down")
            for part in ("sin", "cos")
        ),
        act,
        Separation(manoeuvres=("the same run deeper",)),
        variant=_variant(periods_s),
        telling=telling,
        sea=True,
        lasting=False,
    )


def _present(rates: Sequence[float], lines: Array) -> Iterator[tuple[float, Array]]:
    """The nonzero lines, with their rates."""
    return ((rate, line) for rate, line in zip(rates, lines, strict=True) if line.any())


def _usual_s(periods_s: tuple[float, ...], power: Array) -> float:
    """The period of the mean rate, weighted by the lines' power."""
    rates = 1.0 / np.array(periods_s)
    return float(power.sum() / (power @ rates)) if power.any() else periods_s[0]


def _variant(periods_s: tuple[float, ...]) -> str:
    texts = [f"{period_s:.3g}" for period_s in periods_s]
    return f"{' and '.join(filter(None, (', '.join(texts[:-1]), texts[-1])))} s"


def _below_the_middle(depth_m: Array) -> Array:
    """Depth below its median, (n,); 0 if unknown."""
    known = np.isfinite(depth_m)
    if not known.any():
        return np.zeros_like(depth_m)
    return np.where(known, depth_m - np.median(depth_m[known]), 0.0)


EFFECTS = (STEADY_CURRENT, *map(varying_current, CURRENT_PERIODS_S), *map(waves, WAVE_PERIODS_S))
