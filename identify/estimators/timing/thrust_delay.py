"""Delay of a dive's thrust beyond that in the vehicle file.

The delay is fitted where a score test at the file's own timing rejects it: all axes are fitted again at each delay,
coarsely over a grid, then closer to the best. The 95 % interval ends where the likelihood, maximised over all else,
has fallen by 1.96^2 / 2.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from bridge.arrays import Array
from identify.estimators.axes.axis import Axes
from identify.estimators.axes.forces import axes_with_delay, axis_with_delay
from identify.estimators.likelihood.fit import JointFit
from identify.estimators.likelihood.joint import JointLikelihood
from identify.estimators.likelihood.scoring import climb, log_posterior
from identify.estimators.missing_forces.drag_and_timing import DOUBTFUL_SCORE
from identify.identification import ThrustDelay
from identify.statistics import Z95
from identify.thrust.wrench_history import WrenchHistory

GRID_S = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1.0)
COARSELY, NEARLY = 1.0, 0.02
"""Convergence limits, in nats, of the climbs of all axes: on the grid, and near the best."""

LEAST_GAIN = 0.5 * DOUBTFUL_SCORE**2
"""A delay must gain this many nats over the vehicle file's own timing to be accepted."""

LEAST_S = 0.005
"""A shorter delay counts as zero: pulses last longer, and stamps are whole milliseconds."""

LOST, FALLS = 30.0, 3
"""The grid ends after FALLS delays in succession that are each more than LOST nats below the best."""

CLOSER = 12
SETTLED = 0.2
"""Share of half an interval: a fit at a delay closer to the best than this is good enough."""

FALL = 0.5 * Z95**2
FLAT = 0.5, 8.0
"""If the fall, in nats, is between these, the parabola is trusted to say where the likelihood has fallen by FALL."""

DELAYS_S = (0.0, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
"""Delays of a coarse search, of all axes, or of yaw alone beside an autopilot's velocity."""

EVERYWHERE_S = tuple(round(0.1 * k, 1) for k in range(1, 11))


@dataclass
class _Profile:
    """The log posterior at each delay, maximised over all else, and theta there."""

    at: Callable[[float], JointLikelihood]
    thetas: dict[float, Array]
    tops: dict[float, float] = field(default_factory=dict)

    def top(self, by_s: float, enough: float, least: float = -np.inf) -> float:
        """The maximum at a delay; a lower value if that stays below `least`."""
        nearest = min(self.thetas, key=lambda known: abs(known - by_s))
        maximum = climb(self.at(by_s), self.thetas[nearest], enough, least)
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
    profile = _profile(forces, built, fit.joint, fit.theta)
    falls = 0
    for by_s in GRID_S:
        below = profile.top(by_s, COARSELY) < profile.tops[profile.best] - LOST
        falls = falls + 1 if below else 0
        if falls == FALLS:
            break
    if not near and profile.best == 0.0:
        return None
    known = sorted(profile.tops)
    index = known.index(profile.best)
    apart_s = 0.5 * (known[min(index + 1, len(known) - 1)] - known[max(index - 1, 0)])
    first_s, half_s = _near(profile, profile.best, apart_s)
    if first_s < LEAST_S or profile.tops[first_s] - profile.tops[0.0] < LEAST_GAIN:
        return None
    built = axes_with_delay(built, forces, first_s)
    fit, forces = refit(built), replace(forces, time_s=forces.time_s + first_s)
    more_s, half_s = _near(_profile(forces, built, fit.joint, fit.theta), 0.0, half_s)
    if abs(more_s) > SETTLED * half_s:
        built = axes_with_delay(built, forces, more_s)
        fit = refit(built)
    by_s = first_s + more_s
    return Delayed(ThrustDelay(by_s, by_s - half_s, by_s + half_s, in_file_s), built, fit)


def coarse_delay_s(forces: WrenchHistory, built: Axes, joint: JointLikelihood, theta: Array) -> float:
    """The delay of DELAYS_S after which the likelihood, maximised over all else at each delay, falls."""
    profile = _profile(forces, built, joint, theta)
    undelayed = log_posterior(profile.at(0.0), theta)
    if profile.top(DELAYS_S[1], COARSELY, undelayed) < undelayed:
        return 0.0
    profile.top(0.0, COARSELY)
    for by_s in DELAYS_S[1:]:
        if profile.top(by_s, COARSELY) < profile.tops[profile.best]:
            break
    return profile.best


def coarse_delay_of_all_s(forces: WrenchHistory, built: Axes, joint: JointLikelihood, theta: Array) -> float:
    """The likeliest of the delays EVERYWHERE_S and none.

    A fit whose disturbance takes all of the thrust is as poor at a wrong delay as at the next, and its likelihood
    rises within a step of the right delay alone.
    """
    profile = _profile(forces, built, joint, theta)
    undelayed = profile.tops[0.0] = log_posterior(profile.at(0.0), theta)
    for by_s in EVERYWHERE_S:
        profile.top(by_s, COARSELY, undelayed)
    return profile.best


def likeliest_delay(
    forces: WrenchHistory, built: Axes, joint: JointLikelihood, theta: Array, near_s: float
) -> tuple[float, float]:
    """The likeliest delay in s, beyond the delay that the forces include, near a coarse one, and its log posterior.

    Raises LinAlgError if the equations have no solution.
    """
    profile = _profile(forces, built, joint, theta)
    by_s, _ = _near(profile, near_s, DELAYS_S[1])
    return by_s, profile.tops[by_s]


def _profile(forces: WrenchHistory, built: Axes, joint: JointLikelihood, theta: Array) -> _Profile:
    def at(by_s: float) -> JointLikelihood:
        moved = (
            problem.with_axis(axis_with_delay(problem.axis, built, forces, by_s))
            for problem in joint.problems
        )
        return replace(joint, problems=tuple(moved))

    return _Profile(at, {0.0: theta})


def _near(profile: _Profile, about_s: float, apart_s: float) -> tuple[float, float]:
    """Return the best delay, from an approximate value, and half of its 95 % interval."""
    best, apart, half = about_s, apart_s, apart_s
    for _ in range(CLOSER):
        sides = np.array([best - apart, best, best + apart])
        tops = np.array([profile.top(by_s, NEARLY) for by_s in sides.tolist()])
        vertex, half = _parabola(sides, tops)
        fallen, moved = float(np.ptp(tops)), abs(vertex - best)
        best = float(np.clip(vertex, sides[0], sides[2]))
        if FLAT[0] < fallen < FLAT[1] and moved < 0.5 * apart:
            break
        # On a slope the best lies beyond the sides, and closer points would not reach it.
        if moved <= apart:
            apart = min(half, apart)
    else:
        half = max(half, apart)
    profile.top(best, NEARLY)
    return best, half


def _parabola(at: Array, tops: Array) -> tuple[float, float]:
    """Vertex of the parabola through three points, and the distance from it to a fall of FALL. If the parabola has no
    top, the best of the points and half of their spacing."""
    bend, slope, _ = np.polyfit(at - at[1], tops, 2)
    if bend >= 0.0:
        return float(at[int(np.argmax(tops))]), 0.25 * float(at[2] - at[0])
    return float(at[1] - 0.5 * slope / bend), float(np.sqrt(-FALL / bend))
