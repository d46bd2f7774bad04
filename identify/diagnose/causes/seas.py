"""The periods of a sea or of a varying current, read off the spectrum of the missing force."""

from collections.abc import Sequence

import numpy as np

from bridge.arrays import Array
from identify.diagnose.filters.nominal import Nominal, quadratic_of
from identify.effects.effect import Effect
from identify.effects.environment import varying_current, waves

WAVES_S, CURRENTS_S = (1.5, 12.0), (15.0, 200.0)

MOST_LINES = 4

NEAR, WIDE = 0.2, 3.0
"""A sea's lines lie within a share NEAR of the strongest line's rate; the background is a median within a factor
WIDE."""

CORNER_HZ = 0.1
"""A usual disturbance falls off as the square of the rate above this."""

LEAST_OVER = 4.0
"""Power of a further line over the background."""


def seas_of(now: Nominal) -> tuple[Effect, ...]:
    """The waves and varying currents that a dive may hold: each with the strongest line of its band, and with all
    significant lines of the band."""
    spectrum = _disturbance_spectrum(now)
    out: list[Effect] = []
    for sea, band_s in ((varying_current, CURRENTS_S), (waves, WAVES_S)):
        lines = _lines(spectrum, band_s)
        out += [sea(*lines[:count]) for count in sorted({1, len(lines)}) if lines]
    return tuple(out)


def period_interval(period_s: float, duration_s: float) -> tuple[float, float]:
    """Interval of a period read off a dive of that length.

    The spectrum's rates are whole numbers of cycles per dive, so a line is at most half a cycle off.
    """
    half = 0.5 / duration_s
    return 1.0 / (1.0 / period_s + half), 1.0 / max(1.0 / period_s - half, half)


def _disturbance_spectrum(now: Nominal) -> tuple[Array, Array]:
    """Rates (f,), Hz, and the power of the missing force, north, east and down together."""
    course = now.course
    missing = _missing(now)
    north, east, down = course.world
    world = np.column_stack([(missing * way).sum(axis=1) for way in (north, east, down)])
    every = max(round(0.2 / course.step_s), 1)
    whole = len(world) // every
    slow = world[: whole * every].reshape(whole, every, 3).mean(axis=1)
    slow = (slow - slow.mean(axis=0)) * np.hanning(whole)[:, None]
    power = (np.abs(np.fft.rfft(slow, axis=0)) ** 2).sum(axis=1)
    return np.asarray(np.fft.rfftfreq(whole, every * course.step_s), np.float64), np.asarray(
        power, np.float64
    )


def _missing(now: Nominal) -> Array:
    """The missing force (n, 3) of the smoothed motion, beyond thrust, drag, Coriolis forces and the causes so far."""
    course, nu = now.course, now.motion.nu
    drag = (course.damping + quadratic_of(now.joint, now.theta) * np.abs(nu)) * nu
    moving = course.mass * np.gradient(nu, course.step_s, axis=0) + drag
    given = course.wrench_of(course.thrust_n) - course.coriolis_of(course.mass, nu)
    for act in (*now.acts, *(cause.act(course) for cause in now.accepted)):
        if act.wrench is not None:
            given = given + act.wrench
    fitted = [problem.axis.dof for problem in now.joint.problems]
    out = np.where(np.isin(np.arange(6), fitted), moving - given, 0.0)[:, :3]
    return np.asarray(np.where(course.recorded[:, None], out, 0.0))


def _lines(spectrum: tuple[Array, Array], band_s: tuple[float, float]) -> Sequence[float]:
    """Periods, s, of the lines that stand out most over the background, strongest first."""
    rate, power = spectrum
    power = power * (1.0 + (rate / CORNER_HZ) ** 2)
    inside = np.flatnonzero((rate > 1.0 / band_s[1]) & (rate < 1.0 / band_s[0]))
    if len(inside) < 2 * MOST_LINES:
        return ()
    around = np.array([np.median(power[(rate > rate[i] / WIDE) & (rate < WIDE * rate[i])]) for i in inside])
    over = power[inside] / np.maximum(around, 1e-300)
    order = np.argsort(-over)
    first = inside[order[0]]
    lines = [first]
    for k in order[1:].tolist():
        i = inside[k]
        apart = min(abs(i - line) for line in lines) > 1
        if apart and over[k] > LEAST_OVER and abs(rate[i] - rate[first]) < NEAR * rate[first]:
            lines.append(i)
        if len(lines) == MOST_LINES:
            break
    return [float(1.0 / _peak(rate, power, i)) for i in lines]


def _peak(rate: Array, power: Array, i: int) -> float:
    """A line's rate between grid points, by a parabola through three log powers."""
    if not 0 < i < len(rate) - 1:
        return float(rate[i])
    low, middle, high = np.log(np.maximum(power[i - 1 : i + 2], 1e-300))
    bend = low - 2 * middle + high
    shift = 0.5 * (low - high) / bend if bend < 0 else 0.0
    return float(rate[i] + np.clip(shift, -0.5, 0.5) * (rate[1] - rate[0]))
