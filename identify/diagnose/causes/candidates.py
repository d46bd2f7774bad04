"""Candidate causes: effects with parameter values, the settings tried, their other forms and companions.

No form of a library is exact: drag is not quite quadratic, a dead zone has soft edges, a lag is of second order. The
larger an effect, the clearer its remainder, and the first false cause would absorb it. Other forms of a cause are
therefore no evidence for a second cause. Moving water also turns the hull, by moments that no effect of the library
has: other forms of the water's effect, or a misplaced thruster, would absorb them.

Companions are contributions beyond any form, and do not count as an unexplained remainder once the cause is found. A
fast cause leaves a slow remainder in the filters' disturbance. A bias comes and goes. A sea has more lines than its
form. A line that pulls along also pulls down, and thrust drops under load by other laws. A reading error from a
sensor's position is instantaneous and proportional by geometry, and has only changes in time as companions. The
search allows for forms alone, so that a second cause keeps its evidence; only with a sea it allows for companions,
too.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.effects.course import Course, delayed, lagged
from identify.effects.effect import Act, Effect, Parameter
from identify.statistics import Z95
from identify.threads import side_by_side

Change = Callable[[Array], Array]
"""A companion's part (n, ...) of an act along a course, from the act's."""

NEAR = 0.02

LEAST_SIZE = 0.12
"""Least noticeable size, in a parameter's natural scale."""

MOST_LACKED = 0.25
"""Share of the most that was asked of a thruster up to which a dead zone is tried: one that turns at less than half its
speed not at all hardly steers a vehicle."""

OTHER_SIZES = (0.5, 2.0)
POWERS = (0.6, 1.6)
"""Exponents that bend a cause's contribution at large size."""

LATER_S = 0.2

SLOWER_S = (0.5, 1.5)
"""Lags of a cause's contribution, s."""

TURNS = (2, 3)
"""Powers of time by which a cause comes and goes; linear growth is among its forms."""

DRIFTS = (1, 2, 3)
"""Powers of time for each parameter of the water: a current turns as it comes and goes, and a narrow band drifts in
phase against one period."""

BAND, MOST_IN_BAND = 0.2, 8
"""Width of a sea's band, relative to the strongest line's rate, and the most lines looked at on either side. A dive
resolves more lines the longer it is."""


@dataclass(frozen=True)
class Cause:
    """An effect with the values (p,) of its parameters."""

    effect: Effect
    values: Array

    @property
    def key(self) -> tuple[str, int]:
        """Effects with equal keys are forms of one cause."""
        return self.effect.name, self.effect.number

    @property
    def throughout(self) -> "Cause":
        """The cause as it acts in further dives: from their start."""
        return replace(self, effect=self.effect.throughout)

    @property
    def present(self) -> NDArray[np.bool_]:
        """Whether each parameter (p,) differs from absence."""
        return np.asarray(self.values != self.effect.none())

    @property
    def usual(self) -> bool:
        """Whether no parameter is larger than such a cause usually has it."""
        parameters = zip(self.effect.parameters, self.values.tolist(), strict=True)
        return all(value <= parameter.seldom_above for parameter, value in parameters)

    @property
    def shows(self) -> bool:
        """Whether any parameter is large enough to matter."""
        none, size = self.effect.none(), np.array([natural_scale(p) for p in self.effect.parameters])
        return bool(np.any(np.isinf(none) | (np.abs(self.values - none) > LEAST_SIZE * size)))

    @property
    def within_bounds(self) -> bool:
        """Whether each parameter lies within its range."""
        parameters = zip(self.effect.parameters, self.values.tolist(), strict=True)
        return all(parameter.low <= value <= parameter.high for parameter, value in parameters)

    @property
    def at_bound(self) -> bool:
        """Whether a parameter ended at a bound that is a guess: the dive then supports another form."""
        parameters = zip(self.effect.parameters, self.values.tolist(), strict=True)
        return any(parameter.at_guess(value) for parameter, value in parameters)

    @property
    def at_end(self) -> bool:
        """Whether a parameter lies at an end of its range."""
        parameters = zip(self.effect.parameters, self.values.tolist(), strict=True)
        return any(value in (parameter.low, parameter.high) for parameter, value in parameters)

    def within_stamps(self, stamped_s: float) -> bool:
        """Whether the cause is a late thrust that an error of the stamps, of that standard deviation, s, may be."""
        return (
            bool(self.effect.timing)
            and float(np.abs(self.values - self.effect.none()).max()) < Z95 * stamped_s
        )

    def possible(self, course: Course) -> bool:
        """Whether nature allows the cause along a course."""
        return self.effect.possible is None or self.effect.possible(course, self.values)

    def act(self, course: Course) -> Act:
        return self.effect.act(course, self.values)

    def moved(self, p: int, by: float) -> "Cause":
        """The cause with one parameter changed within its bounds; by at most its natural scale, unless the effect is
        linear."""
        parameter, values = self.effect.parameters[p], self.values.copy()
        most = np.inf if self.effect.linear else natural_scale(parameter)
        values[p] = float(np.clip(values[p] + np.clip(by, -most, most), parameter.low, parameter.high))
        return Cause(self.effect, values)

    def slope(self, course: Course, p: int) -> Act:
        """Derivative of the act by its parameter p."""
        if self.effect.linear:
            unit = self.effect.none()
            unit[p] += 1.0
            return self.effect.act(course, unit)
        h = NEAR * natural_scale(self.effect.parameters[p])
        slope = self._slope_within(course, p, h)
        # Thrust of rounded pulses comes in steps, and within one of them a width makes no difference.
        while (
            self.effect.steep and slope.is_none and h < abs(self.values[p] - self.effect.parameters[p].none)
        ):
            h *= 2.0
            slope = self._slope_within(course, p, h)
        return slope

    def _slope_within(self, course: Course, p: int, h: float) -> Act:
        up, down = self.values.copy(), self.values.copy()
        up[p] += h
        down[p] -= h
        high, low = (self.effect.act(course, values) for values in (up, down))
        return high.less(low).times(1.0 / (2 * h))


def natural_scale(parameter: Parameter) -> float:
    """Distance from absence to a noticeable value; for a limit, the limit itself."""
    return abs(parameter.start - parameter.none) if np.isfinite(parameter.none) else abs(parameter.start)


@dataclass(frozen=True)
class Setting:
    """A trial of an effect: a column for each of `steps` (k, p) from absence."""

    effect: Effect
    columns: tuple[int, ...]
    steps: Array

    def cause(self, size: Array) -> Cause:
        """The cause by sizes (k,) of the columns, within its bounds."""
        low = np.array([p.low for p in self.effect.parameters])
        high = np.array([p.high for p in self.effect.parameters])
        none = self.effect.none()
        if self.effect.steep or not np.isfinite(none).all():
            return Cause(self.effect, np.clip(_at(self.effect, self.steps[0]), low, high))
        return Cause(self.effect, np.clip(none + size @ self.steps, low, high))


def settings_of(effects: tuple[Effect, ...], course: Course) -> tuple[tuple[Setting, ...], list[Cause]]:
    """All settings of some effects, with the cause that each column is of."""
    columns: list[Cause] = []
    settings = []
    for effect in effects:
        for size in sizes_of(effect, course):
            steps = _steps(effect, size, course)
            settings.append(Setting(effect, tuple(range(len(columns), len(columns) + len(steps))), steps))
            columns += [Cause(effect, _at(effect, step)) for step in steps]
    return tuple(settings), columns


def sizes_of(effect: Effect, course: Course) -> tuple[float, ...]:
    """Sizes at which an effect is tried along a course: those of the effect and, of a thrust that each thruster lacks,
    as many more at the same ratio as lead to MOST_LACKED of the most that was asked.

    A dead zone grows with the thruster: one of 100 N may give nothing below 6 N.
    """
    (*_, parameter), sizes = effect.parameters, effect.sizes
    if len(sizes) < 2 or effect.acts_on != "thruster" or parameter.unit != "N" or np.isinf(parameter.none):
        return sizes
    most = MOST_LACKED * float(np.abs(course.asked_n).max()) / abs(parameter.start - parameter.none)
    ratio = sizes[-1] / sizes[-2]
    more = max(math.floor(math.log(max(most / sizes[-1], 1.0), ratio)), 0)
    return (*sizes, *(sizes[-1] * ratio ** (k + 1) for k in range(more)))


def _steps(effect: Effect, size: float, course: Course) -> Array:
    """Steps (k, p) of one parameter each from absence, `size` times its start; from infinity, to a share of the most
    that was asked."""
    none, start = effect.none(), effect.start()
    if not np.isfinite(none).all():
        return np.full((1, len(none)), np.abs(course.asked_n).max() / (1.0 + size))
    return np.diag(size * (start - none))


def _at(effect: Effect, step: Array) -> Array:
    none = effect.none()
    return np.where(np.isfinite(none), none + step, step)


def other_forms(course: Course, cause: Cause) -> Iterator[Act]:
    """Acts of the cause at other sizes, bent, late, and growing over the dive.

    Moving water adds its moments. A cause that depends on accelerations adds its act at the accelerations due to
    thrust.
    """
    act = cause.act(course)
    yield from _possible(course, cause)
    yield from _by_thrust(course, cause, act)
    if cause.effect.acts_on == "water":
        pushed = act.wrench if act.water is None else course.pushed_by(act.water)
        if pushed is not None:
            yield from _moments(course, pushed[:, :3])
    for power in POWERS:
        yield act.each(partial(_bent, power=power))
    yield act.each(lambda part: delayed(part, course.step_s, LATER_S) - part)


def other_variants(course: Course, cause: Cause, library: Sequence[Effect]) -> Iterator[Act]:
    """Acts of the cause in its other variants with the same parameters.

    A variant of a body, for example, is off balance in more degrees of freedom. Variants of water are its periods,
    and are left out.
    """
    names = [parameter.name for parameter in cause.effect.parameters]
    for effect in library:
        variant = Cause(effect, cause.values)
        same = variant.key == cause.key and [parameter.name for parameter in effect.parameters] == names
        if same and effect.label != cause.effect.label and effect.acts_on != "water":
            act = variant.act(course)
            yield act
            yield from _by_thrust(course, variant, act)


def possible_forms(course: Course, cause: Cause) -> Iterator[Act]:
    """Forms that a cause may truly have: a reading error by geometry is instantaneous and proportional, never bent or
    late."""
    return _possible(course, cause) if cause.effect.acts_on == "reading" else other_forms(course, cause)


def _possible(course: Course, cause: Cause) -> Iterator[Act]:
    effect, act = cause.effect, cause.act(course)
    if not effect.linear:
        none = effect.none()
        # A limit is absent at infinity; its other sizes scale the limit itself.
        origin = np.where(np.isfinite(none), none, 0.0)
        for size in OTHER_SIZES:
            yield effect.act(course, origin + size * (cause.values - origin))
    if effect.growth_is_apart:
        return
    growing = course.since_s[:, None] / course.since_s[-1] - 0.5
    yield act.each(lambda part: growing * part)


def _by_thrust(course: Course, cause: Cause, act: Act) -> Iterator[Act]:
    """The cause's act at the accelerations due to each axis's thrust alone.

    A closed loop biases a mass there, and a misplaced thruster would absorb the error.
    """
    if act.wrench is None:
        return
    still = cause.act(replace(course, nu_dot=np.zeros_like(course.nu_dot))).wrench
    if still is None or not np.any(act.wrench - still):
        return
    pushed = course.wrench_of(course.thrust_n) / np.maximum(course.mass, 1e-9)
    for dof in range(3):
        accelerations = np.zeros_like(course.nu_dot)
        accelerations[:, dof] = pushed[:, dof]
        by_axis = cause.act(replace(course, nu_dot=accelerations)).wrench
        if by_axis is not None and np.any(by_axis - still):
            yield Act(wrench=by_axis - still)


def _bent(part: Array, power: float) -> Array:
    size = np.maximum(np.sqrt(np.mean(part**2, axis=0)), 1e-12)
    return np.asarray(np.sign(part) * np.abs(part / size) ** power * size)


def companions(course: Course, cause: Cause) -> list[Act]:
    """Acts of a cause's companions, of any size."""
    act, changes = cause.act(course), list[tuple[Act, Change]]()
    if cause.effect.acts_on != "reading":
        changes += [(act, partial(lagged, step_s=course.step_s, lag_s=lag_s)) for lag_s in SLOWER_S]
    middle = (2.0 * course.since_s / course.since_s[-1] - 1.0)[:, None]
    changes += [(act, partial(np.multiply, middle**power)) for power in TURNS]
    if cause.effect.acts_on == "water":
        parts = side_by_side(lambda p: cause.slope(course, p), np.flatnonzero(cause.present).tolist())
        changes += [(part, partial(np.multiply, middle**power)) for part in parts for power in DRIFTS]
        changes += _band(course, cause)
    of_effect = () if cause.effect.companions is None else cause.effect.companions(course, act)
    return [*side_by_side(lambda each: each[0].each(each[1]), changes), *of_effect]


def _band(course: Course, cause: Cause) -> Iterator[tuple[Act, Change]]:
    """The strongest line of a sea, and its changes to neighbouring rates that the dive resolves."""
    parameters = cause.effect.answer_parameters(cause.values)
    if "period" not in parameters:
        return
    duration_s = float(course.since_s[-1])
    neighbours = min(int(np.ceil(BAND * duration_s / parameters["period"][0])), MOST_IN_BAND)
    each = len({parameter.name for parameter in cause.effect.parameters})
    strongest = int(np.argmax(np.linalg.norm(cause.values.reshape(-1, each), axis=1)))
    angle = (2 * np.pi / duration_s * course.since_s)[:, None]
    waves = [wave(k * angle) for k in range(1, neighbours + 1) for wave in (np.sin, np.cos)]
    for p in range(strongest * each, (strongest + 1) * each):
        part = cause.slope(course, p)
        yield from ((part, partial(np.multiply, wave)) for wave in waves)


def _moments(course: Course, force: Array) -> Iterator[Act]:
    """Moments of water that pushes by `force` (n, 3).

    They arise by a lever, and by its drift along the hull (Munk 1924), each in phase with the force and a quarter of
    a period off.
    """
    u, v, w = course.nu[:, :3].T
    for push in (force, np.gradient(force, course.step_s, axis=0)):
        x, y, z = push.T
        for moment in ((y, x, y), (z, z, x), (v * z, u * z, u * y), (w * y, w * x, v * x)):
            yield Act(wrench=np.column_stack([np.zeros((len(u), 3)), *moment]))
