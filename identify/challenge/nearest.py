"""How large a planted effect is in the library's words: the parameters by which its form comes nearest to what is
planted, over the motion of the very dive.

A plant has another form than the library, so that none of its own numbers is one of the library's: how large a drag
with the power 1.8 is as one with the square depends on the speeds of the dive. The nearest is that of least squares
over the planted wrench, each degree of freedom over its disturbance; masses and dampings beside it are free, for those
are fitted to the same dive (White 1982: what a fit in another form comes to). A sea is told by the one sine of the same
power, whatever its spectrum. Readings that are wrong are planted in the library's own form.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bridge.effects.course import Course
from bridge.effects.effect import Effect
from bridge.effects.library import library
from bridge.vehicle.thrusters import thrust_curve
from identify.challenge.gap import missing_wrench, nominal_columns
from identify.challenge.simulate import Simulated
from identify.challenge.site import Planted, Site

Array = NDArray[np.float64]
Parameters = dict[str, float]

SEAS = ("waves", "varying_current")

EACH_S = 0.2
"""The wrench is compared so often: a vehicle takes longer to answer."""

FINE_S = 0.02
"""No step of a course is longer: thrust that is late is read between them."""


def nearest(planted: Sequence[Planted], site: Site, simulated: Simulated) -> tuple[Parameters, ...]:
    """The parameters of each plant in the library's words: those of a sea by its power, of readings and of what the
    library lacks as they are planted, of all others by least squares, together."""
    course = course_of(site, simulated)
    forms = [_forms(p, course) for p in planted]
    fitted = [i for i, able in enumerate(forms) if able]
    out = [p.parameters | _of_sea(p, site, course) for p in planted]
    if not fitted:
        return tuple(out)
    to = _regression(site, simulated, course)
    own = [planted[i].parameters for i in fitted]
    fits = [_fit(some, own, to) for some in product(*(forms[i] for i in fitted))]
    _, best = min(fits, key=lambda one: one[0])
    for i, (effect, values) in zip(fitted, best, strict=True):
        out[i] = {name: one for name, (one, _) in effect.told(values).items()}
    return tuple(out)


def _forms(planted: Planted, course: Course) -> list[Effect]:
    """The library's forms of a force that is planted, with the parameters that an answer has."""
    if planted.novel or planted.spoils or planted.name in SEAS:
        return []
    return [
        effect
        for effect in library(course.configuration, course.lag_s)
        if effect.name == planted.name
        and effect.number == planted.number
        and not effect.refit_absorbs
        and effect.parameters
        and effect.told(effect.start()).keys() == planted.parameters.keys()
    ]


def course_of(site: Site, simulated: Simulated) -> Course:
    """The true course of a dive, in so many steps to a tick, with thrust as its crew takes it to be."""
    vehicle, ticks, dive = site.vehicle, simulated.ticks, simulated.dive
    assert dive.pwm is not None
    at_s = dive.pwm.time_s
    within = int(np.ceil((at_s[1] - at_s[0]) / FINE_S))
    time_s = np.interp(np.arange(within * (len(at_s) - 1) + 1) / within, np.arange(len(at_s)), at_s)
    w, x, y, z = ticks.state[:, 3:7].T
    euler = np.column_stack(
        [
            np.arctan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
            np.arcsin(2 * (w * y - x * z)),
            np.unwrap(np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))),
        ]
    )

    def fine(values: Array) -> Array:
        return np.column_stack([np.interp(time_s, at_s, column) for column in values.T])

    curve = thrust_curve(vehicle.file.vehicle.thrust_curve, vehicle.file.path.parent)
    asked = curve.thrust(ticks.pwm)[np.arange(len(time_s)) // within]
    depth_m = fine(ticks.state[:, 2:3])[:, 0]
    nothing = np.full(len(time_s), np.nan)
    return Course(
        vehicle.configuration,
        time_s,
        fine(ticks.state[:, 7:13]),
        fine(ticks.nu_dot),
        fine(euler),
        depth_m,
        site.hull.floor_m - depth_m,
        fine(ticks.state[:, :2]),
        asked,
        np.full(asked.shape, np.nan),
        nothing if dive.voltage is None else dive.voltage.at(time_s)[:, 0],
        vehicle.file.vehicle.thrust_curve.lag_s,
        vehicle.mass,
        vehicle.damping,
    )


@dataclass(frozen=True)
class _Planted:
    """The planted wrench over the disturbance's spread, `value` (rows,), at every so many steps of a course; nominal
    (rows, 12): a base of what a refit takes up."""

    course: Course
    every: int
    std: Array
    value: Array
    nominal: Array

    def of(self, wrench: Array) -> Array:
        """A wrench (n, 6) along the course as rows."""
        return np.asarray((wrench[:: self.every] / self.std).reshape(-1))


def _regression(site: Site, simulated: Simulated, course: Course) -> _Planted:
    missing, std = missing_wrench(site, simulated), site.vehicle.disturbance
    within = round((len(course.time_s) - 1) / (len(missing) - 1))
    ticks = max(round(EACH_S / (within * course.step_s)), 1)
    every = ticks * within
    columns = nominal_columns(course.nu[::every], course.nu_dot[::every]) / std[None, :, None]
    base = np.linalg.svd(columns.reshape(-1, 12), full_matrices=False)[0]
    return _Planted(course, every, std, (missing[::ticks] / std).reshape(-1), base)


def _fit(
    effects: Sequence[Effect], own: Sequence[Parameters], to: _Planted
) -> tuple[float, tuple[tuple[Effect, Array], ...]]:
    """What some forms leave of what is planted together, and their best values."""
    ends = np.cumsum([0, *(len(effect.parameters) for effect in effects)])

    def split(values: Array) -> list[tuple[Effect, Array]]:
        return [(effect, values[a:b]) for effect, a, b in zip(effects, ends[:-1], ends[1:], strict=True)]

    def left(values: Array) -> Array:
        rest = to.value.copy()
        for effect, mine in split(values):
            act = effect.act(to.course, mine)
            wrench = act.wrench if act.water is None else to.course.pushed_by(act.water)
            assert wrench is not None
            rest -= to.of(wrench)
        return np.asarray(rest - to.nominal @ (to.nominal.T @ rest))

    of = [p for effect in effects for p in effect.parameters]
    low, high = np.array([p.low for p in of]), np.array([p.high for p in of])
    drawn = [
        mine.get(p.name, p.start)
        for effect, mine in zip(effects, own, strict=True)
        for p in effect.parameters
    ]
    starts = np.array([drawn, [p.start for p in of]])
    scale = np.maximum(np.abs(starts[1]), 1e-3)
    tried = [least_squares(left, np.clip(s, low, high), bounds=(low, high), x_scale=scale) for s in starts]
    best = min(tried, key=lambda one: float(one.cost))
    return float(best.cost), tuple(split(best.x))


def _of_sea(planted: Planted, site: Site, course: Course) -> Parameters:
    """The amplitude of one sine that has the power of the water's movement, or of the force by which it pushes a body
    at rest in the depth that half of the dive is above."""
    if planted.name == "varying_current":
        water = site.moving_water()[:, :2]
        return {"amplitude": _amplitude(water - water.mean(axis=0))}
    if planted.name != "waves":
        return {}
    ticks = site.moving_water()[:: round(course.step_s / (site.time_s[1] - site.time_s[0]))][
        : len(course.time_s)
    ]
    fade = np.exp(-site.hull.wave_number * (float(np.median(course.depth_m)) - site.hull.wave_ref))
    speed, rate = (
        course.in_body(*part[:, :2].T) + part[:, 2:] * course.world[2]
        for part in (ticks[:, 6:9], ticks[:, 9:12])
    )
    force = fade * (course.damping[:3] * speed + course.mass[:3] * rate)
    return {"force_amplitude": max(_amplitude(force[:, :2]), _amplitude(force[:, 2:]))}


def _amplitude(values: Array) -> float:
    return float(np.sqrt(2 * np.mean((values**2).sum(axis=1))))
