"""How much later than the vehicle file says thrust acts: by the likelihood of all axes at one delay after another.

A score at the file's own timing tells that this is off, and by how much only where that is little beside a thruster's
lag. Here all axes are fitted anew at each delay, from the fit at the one before: coarsely over a grid, then nearer and
nearer to the best. The 95 % interval is where the likelihood, all else at its best, has fallen by 1.96^2 / 2.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from identify.estimators.axes import Axes, delayed, later
from identify.estimators.doubts import DOUBTFUL_SCORE
from identify.estimators.likelihood_fit import JointFit
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.scoring import climb
from identify.forces import WrenchHistory
from identify.identification import Z95, ThrustDelay

Array = NDArray[np.float64]

GRID_S = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1.0)
COARSELY, NEARLY = 1.0, 0.02
"""Nats: as far as all axes are climbed on the grid, and near the best."""

LEAST_GAIN = 0.5 * DOUBTFUL_SCORE**2
"""Nats over the vehicle file's own timing, below which this is not mended."""

LEAST_S = 0.005
"""A shorter delay is none: pulses last for more, and stamps are whole milliseconds."""

LOST, FALLS = 30.0, 3
"""The grid ends after so many delays in succession that are each so many nats below the best."""

TURNS = 5
SETTLED = 0.2
"""Of half an interval: nearer to it a delay is fitted with well enough."""

FALL = 0.5 * Z95**2
FLAT = 0.5, 8.0
"""Between these falls, in nats, a parabola is trusted to say where the likelihood has fallen by FALL."""


@dataclass
class _Profile:
    """The log posterior at each delay, all else at its best, and theta there."""

    at: Callable[[float], JointLikelihood]
    thetas: dict[float, Array]
    tops: dict[float, float] = field(default_factory=dict)

    def top(self, by_s: float, enough: float) -> float:
        nearest = min(self.thetas, key=lambda known: abs(known - by_s))
        found = climb(self.at(by_s), self.thetas[nearest], enough, JointLikelihood.score)
        self.thetas[by_s], self.tops[by_s] = found.theta, found.log_likelihood
        return found.log_likelihood

    @property
    def best(self) -> float:
        return max(self.tops, key=lambda by_s: self.tops[by_s])


@dataclass(frozen=True)
class Delayed:
    """What a dive says of its thrust's delay, and its axes and their fit with that."""

    delay: ThrustDelay
    built: Axes
    fit: JointFit


def with_delay(
    forces: WrenchHistory,
    in_file_s: float,
    built: Axes,
    fit: JointFit,
    refit: Callable[[Axes], JointFit],
    near: bool,
) -> Delayed | None:
    """The delay beyond that of the vehicle file, `in_file_s`, which is in the forces; None where there may as well be
    none. `near`: whether it is looked for between none and the first of the grid as well.

    Looked for twice: what the speeds of a fit at another delay make of drag and Coriolis forces draws the first answer
    towards that.
    """
    profile = _profile(forces, built, fit)
    falls = 0
    for by_s in GRID_S:
        below = profile.top(by_s, COARSELY) < profile.tops[profile.best] - LOST
        falls = falls + 1 if below else 0
        if falls == FALLS:
            break
    if not near and profile.best == 0.0:
        return None
    known = sorted(profile.tops)
    place = known.index(profile.best)
    apart_s = 0.5 * (known[min(place + 1, len(known) - 1)] - known[max(place - 1, 0)])
    first_s, half_s = _near(profile, profile.best, apart_s)
    if first_s < LEAST_S or profile.tops[first_s] - profile.tops[0.0] < LEAST_GAIN:
        return None
    built = delayed(built, forces, first_s)
    fit, forces = refit(built), replace(forces, time_s=forces.time_s + first_s)
    more_s, half_s = _near(_profile(forces, built, fit), 0.0, half_s)
    if abs(more_s) > SETTLED * half_s:
        built = delayed(built, forces, more_s)
        fit = refit(built)
    by_s = first_s + more_s
    return Delayed(ThrustDelay(by_s, by_s - half_s, by_s + half_s, in_file_s), built, fit)


def _profile(forces: WrenchHistory, built: Axes, fit: JointFit) -> _Profile:
    def at(by_s: float) -> JointLikelihood:
        moved = (replace(one, axis=later(one.axis, built, forces, by_s)) for one in fit.joint.problems)
        return replace(fit.joint, problems=tuple(one.reshaped() for one in moved))

    return _Profile(at, {0.0: fit.theta})


def _near(profile: _Profile, about_s: float, apart_s: float) -> tuple[float, float]:
    """The best delay, from about where it is, and half of its 95 % interval."""
    best, apart, half = about_s, apart_s, apart_s
    for _ in range(TURNS):
        sides = np.array([best - apart, best, best + apart])
        tops = np.array([profile.top(by_s, NEARLY) for by_s in sides.tolist()])
        vertex, half = _parabola(sides, tops)
        fallen, moved = float(np.ptp(tops)), abs(vertex - best)
        best = float(np.clip(vertex, sides[0], sides[2]))
        if FLAT[0] < fallen < FLAT[1] and moved < 0.5 * apart:
            break
        apart = min(half, apart)
    profile.top(best, NEARLY)
    return best, half


def _parabola(at: Array, tops: Array) -> tuple[float, float]:
    """The vertex of the parabola through three points, and how far from it it has fallen by FALL; the best of them and
    half of what is between them where it has no top."""
    bend, slope, _ = np.polyfit(at - at[1], tops, 2)
    if bend >= 0.0:
        return float(at[int(np.argmax(tops))]), 0.25 * float(at[2] - at[0])
    return float(at[1] - 0.5 * slope / bend), float(np.sqrt(-FALL / bend))
