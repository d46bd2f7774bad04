"""Finds the effect that moved the marks of new runs away from those of the accepted runs.

The mean of n new runs has the accepted runs' variance over n, and the accepted mean that variance over their number.
Each effect is weighed by its evidence: the likelihood of the mean shift, averaged over the effect's sizes and over the
directions that the vehicle file leaves open, against that of no shift (Bayes factor).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import HEAVE
from bridge.vehicle.config import Configuration, Water
from identify.diagnose.causes import candidates
from identify.diagnose.result import Finding, Value, Verdict
from identify.effects.actuators import weak
from identify.effects.course import Course
from identify.effects.effect import Effect
from identify.effects.rigid_body import NET_BUOYANCY
from identify.effects.sensors import DEPTH_SCALE
from identify.repeats.marks import DEPTH, FORCE, MARKS, PITCH, ROLL, YAW, Usual

ROUGH: Final = 0.5
"""Relative standard deviation of a thruster's moments about x and y: arms and righting moment are seldom known."""

ROUGH_THRUST: Final = 0.2
"""The same of its thrust as a share of all."""

REACTION_M: Final = 0.1
"""Standard deviation of a propeller's own torque per thrust, m, which vehicle files do not have."""

OFF_CENTRE_M: Final = 0.05
"""Standard deviation of where a weight hangs."""

SIZES: Final = np.geomspace(0.02, 1.0, 120)
GAINS: Final = np.geomspace(1e-3, 1e-1, 120)


@dataclass(frozen=True)
class Cause:
    """An effect of some size. shift (5,): of the marks; rough (5,): standard deviation of that shift, as far as the
    vehicle file does not tell it. also: names of effects that move no mark otherwise."""

    effect: Effect
    values: Array
    shift: Array
    rough: Array
    also: tuple[str, ...] = ()


def causes_of(usual: Usual, shape: Configuration, water: Water) -> dict[str, tuple[Cause, ...]]:
    """By the effects' labels, each in a range of sizes."""
    course = _course(usual, shape)
    total_n = float(np.abs(course.wrench_of(course.thrust_n)[0, HEAVE]))
    weights = [_weight(course, way * size * total_n) for size in SIZES for way in (1.0, -1.0)]
    gains = [_depth_gain(1.0 + way * size, water) for size in GAINS for way in (1.0, -1.0)]
    thrusters = [
        [_weak(course, number, float(1.0 - size)) for size in SIZES]
        for number in range(1, len(shape.thrusters) + 1)
    ]
    return {each[0].effect.label: tuple(each) for each in (weights, gains, *thrusters)}


def _weight(course: Course, force_n: float) -> Cause:
    shift = _pushed(NET_BUOYANCY, course, [force_n])
    leans = OFF_CENTRE_M * abs(force_n)
    heavier = ("added_payload",) if force_n < 0 else ()
    return Cause(NET_BUOYANCY, np.array([force_n]), shift, np.array([0.0, 0.0, leans, leans, 0.0]), heavier)


def _depth_gain(scale: float, water: Water) -> Cause:
    """A depth sensor reads absolute pressure, and its gain acts on that of the air too: at the surface it reads
    (k - 1) p / (rho g), which shows long before k z does."""
    air_m = -water.depth_m(0.0)
    effect = replace(DEPTH_SCALE, variant="of the absolute pressure")
    shift = np.zeros(5)
    shift[DEPTH] = (scale - 1.0) * air_m
    return Cause(effect, np.array([scale]), shift, np.zeros(5))


def _weak(course: Course, number: int, gain: float) -> Cause:
    effect = weak(number)
    shift = _pushed(effect, course, [gain])
    rough = np.zeros(5)
    rough[FORCE] = ROUGH_THRUST * abs(shift[FORCE])
    rough[[ROLL, PITCH]] = ROUGH * np.abs(shift[[ROLL, PITCH]])
    rough[YAW] = REACTION_M * (1.0 - gain) * abs(course.thrust_n[0, number - 1])
    return Cause(effect, np.array([gain]), shift, rough)


def _pushed(effect: Effect, course: Course, values: Sequence[float]) -> Array:
    wrench = effect.act(course, np.array(values)).wrench
    assert wrench is not None
    return np.concatenate([[0.0], wrench[0, 2:]])


def _course(usual: Usual, shape: Configuration) -> Course:
    """The steady push of the accepted runs, level and at rest."""
    still, none = np.zeros((2, 6)), np.full(2, np.nan)
    asked = np.tile(usual.thrust_n, (2, 1))
    return Course(
        shape, np.arange(2.0), still, still, np.zeros((2, 3)), none, none, np.zeros((2, 2)), asked,
        np.full(asked.shape, np.nan), none, 0.0, np.ones(6), np.ones(6),
    )  # fmt: skip


LEAST_NATS: Final = 3.0
"""Evidence below which nothing is named."""

ALIKE_NATS: Final = 2.0
"""Effects whose evidence is closer to the best than this are ambiguous with it."""

LEAST_CLOSED: Final = 1 / 3
"""Share of the squared shift that a cause has to explain where it leaves something; else the answer is `unknown`."""

FAR: Final = 3.0
"""Standard deviations from which a single mark is reported as odd."""

LEAST: Final = 1e-9
ODD_SQUARE: Final = 25.7
"""Square of the five marks' shift that chance exceeds once in ten thousand (chi-squared)."""


@dataclass(frozen=True)
class Judged:
    """The answer for several runs together.

    verdict: as in a diagnosis. finding: the cause, None for none. evidence: nats by label of each candidate. shift
    (5,): of each mark, in its unit; off (5,): in standard deviations of a mean of so many runs. unexplained: share of
    the squared shift that is left, 0 if chance would leave as much. left: the marks in which something is left that
    the cause does not explain.
    """

    runs: int
    verdict: Verdict
    finding: Finding | None
    evidence: dict[str, float]
    shift: Array
    off: Array
    unexplained: float
    left: tuple[str, ...]


def judge(marks: Array, usual: Usual, causes: Mapping[str, Sequence[Cause]]) -> Judged:
    """Judge the marks (n, 5) of further runs."""
    shift = marks.mean(axis=0) - usual.mean
    scatter = usual.scatter * (1.0 / len(marks) + 1.0 / usual.count)
    none = _log_likelihood(shift, scatter)
    each = {
        label: np.array(
            [_log_likelihood(shift - c.shift, scatter + np.diag(c.rough**2)) - none for c in sizes]
        )
        for label, sizes in causes.items()
    }
    nats = {label: float(np.logaddexp.reduce(of) - np.log(len(of))) for label, of in each.items()}
    best = max(nats, key=lambda label: nats[label])
    cause = causes[best][int(np.argmax(each[best]))]
    odd = _odd(shift - cause.shift, scatter + np.diag(cause.rough**2))
    # A direction that is left open may fit a cause to another's shift: here it does not count.
    unexplained = min(_square(shift - cause.shift, scatter) / max(_square(shift, scatter), LEAST), 1.0)
    off = shift / np.sqrt(np.diag(scatter))
    if nats[best] < LEAST_NATS or (odd and unexplained > 1.0 - LEAST_CLOSED):
        odd = _odd(shift, scatter)
        return Judged(
            len(marks), "unknown" if odd else "no_gap", None, nats, shift, off, float(bool(odd)), odd
        )
    effects = {label: causes[label][0].effect for label in nats}
    near = [effects[label] for label in nats if label != best and nats[best] - nats[label] < ALIKE_NATS]
    others = tuple(effect.number for effect in near if effect.name == cause.effect.name)
    names = (*cause.also, *(effect.name for effect in near))
    also = tuple(dict.fromkeys(name for name in names if name != cause.effect.name))
    named = [
        nats[label]
        for label, effect in effects.items()
        if label == best or effect in near or effect.name in also
    ]
    finding = Finding(
        candidates.Cause(cause.effect, cause.values),
        also,
        dict.fromkeys(cause.also, 1.0),
        float(np.exp(np.logaddexp.reduce(named) - np.logaddexp.reduce([0.0, *nats.values()]))),
        _parameters(causes[best], each[best]),
        nats[best],
        other_thrusters=others,
    )
    verdict: Verdict = "ambiguous" if finding.is_ambiguous else "partly" if odd else "explained"
    return Judged(len(marks), verdict, finding, nats, shift, off, unexplained if odd else 0.0, odd)


def _log_likelihood(off: Array, covariance: Array) -> float:
    _, log_volume = np.linalg.slogdet(covariance)
    return -0.5 * (_square(off, covariance) + float(log_volume))


def _square(off: Array, covariance: Array) -> float:
    return float(off @ np.linalg.solve(covariance, off))


def _odd(left: Array, covariance: Array) -> tuple[str, ...]:
    """The marks that are off by more than chance, if all together are."""
    if _square(left, covariance) < ODD_SQUARE:
        return ()
    far = np.abs(left) > FAR * np.sqrt(np.diag(covariance))
    return tuple(name for name, is_far in zip(MARKS, far, strict=True) if is_far) or MARKS


def _parameters(sizes: Sequence[Cause], nats: Array) -> dict[str, Value]:
    """The effect's parameters in the middle of its evidence, with 95 % of it between the ends."""
    effect = sizes[0].effect
    value = np.array([cause.values[0] for cause in sizes])
    order = np.argsort(value)
    share = np.cumsum(np.exp(nats[order] - np.logaddexp.reduce(nats)))
    low, middle, high = (
        np.array([value[order][min(int(np.searchsorted(share, at)), len(value) - 1)]])
        for at in (0.025, 0.5, 0.975)
    )
    ends = effect.answer_parameters(low), effect.answer_parameters(high)
    return {
        name: Value(size, unit, ends[0][name][0], ends[1][name][0])
        for name, (size, unit) in effect.answer_parameters(middle).items()
    }
