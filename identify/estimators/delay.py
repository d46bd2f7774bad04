"""Delay of the thrust beyond the vehicle file, from the likelihood of all axes at one delay after another.

A score test at the file's own timing shows that this is off, but gives the size only if it is small compared with a
thruster's lag. Here all axes are fitted again at each delay, starting from the fit at the nearest delay: first
coarsely over a grid, then closer and closer to the best. The 95 % interval ends where the likelihood, maximised over
all else, has fallen by 1.96^2 / 2.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from identify.estimators.axes import Axes, delayed, later
from identify.estimators.likelihood_fit import JointFit
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.misfit import DOUBTFUL_SCORE
from identify.estimators.scoring import climb
from identify.forces import WrenchHistory
from identify.identification import Z95, ThrustDelay

Array = NDArray[np.float64]

GRID_S = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1.0)
COARSELY, NEARLY = 1.0, 0.02
"""Convergence limits, in nats, of the climbs of all axes: on the grid, and near the best."""

LEAST_GAIN = 0.5 * DOUBTFUL_SCORE**2
"""A delay must gain this many nats over the vehicle file's own timing to be accepted."""

LEAST_S = 0.005
"""A shorter delay counts as zero: pulses last longer, and stamps are whole milliseconds."""

LOST, FALLS = 30.0, 3
"""The grid ends after FALLS delays in succession that are each more than LOST nats below the best."""

TURNS = 5
SETTLED = 0.2
"""Share of half an interval: a fit at a delay closer to the best than this is good enough."""

FALL = 0.5 * Z95**2
FLAT = 0.5, 8.0
"""If the fall, in nats, is between these, the parabola is trusted to say where the likelihood has fallen by FALL."""


@dataclass
class _Profile:
    """The log posterior at each delay, maximised over all else, and theta there."""

    at: Callable[[float], JointLikelihood]
    thetas: dict[float, Array]
    tops: dict[float, float] = field(default_factory=dict)

    def top(self, by_s: float, enough: float) -> float:
        nearest = min(self.thetas, key=lambda known: abs(known - by_s))
        maximum = climb(self.at(by_s), self.thetas[nearest], enough, JointLikelihood.score)
        self.thetas[by_s], self.tops[by_s] = maximum.theta, maximum.log_likelihood
        return maximum.log_likelihood

    @property
    def best(self) -> float:
        return max(self.tops, key=lambda by_s: self.tops[by_s])


@dataclass(frozen=True)
class Delayed:
    """The delay of a dive's thrust, and the dive's axes and their fit with that delay."""

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
    """Return the delay beyond that of the vehicle file, `in_file_s`, which the forces include; None if zero delay
    does as well. `near`: whether to search between zero and the first point of the grid too.

    The search runs twice, because drag and Coriolis forces come from the speeds of a fit at another delay, and draw
    the first result towards that delay.
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
        moved = (
            replace(problem, axis=later(problem.axis, built, forces, by_s)) for problem in fit.joint.problems
        )
        return replace(fit.joint, problems=tuple(problem.reshaped() for problem in moved))

    return _Profile(at, {0.0: fit.theta})


def _near(profile: _Profile, about_s: float, apart_s: float) -> tuple[float, float]:
    """Return the best delay, from an approximate value, and half of its 95 % interval."""
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
    """Vertex of the parabola through three points, and the distance from it to a fall of FALL. If the parabola has no
    top, the best of the points and half of their spacing."""
    bend, slope, _ = np.polyfit(at - at[1], tops, 2)
    if bend >= 0.0:
        return float(at[int(np.argmax(tops))]), 0.25 * float(at[2] - at[0])
    return float(at[1] - 0.5 * slope / bend), float(np.sqrt(-FALL / bend))
