"""Coefficients with the forces included whose absence makes a fit doubtful, and the coefficients' dependence on
timing."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import OF_HULL
from identify.estimators.doubts import Doubts, Force, Wider, coefficients, lacking_drag, with_forces
from identify.estimators.lateness import LATER_S, by_lateness
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.scoring import climb
from identify.identification import Z95

Array = NDArray[np.float64]

STAMPED_S = 0.5e-3
"""Standard error of the time at which forces act relative to readings: many stamps are whole milliseconds, and a
computer's tasks wait for each other. If masses are known to a tenth of a per cent, this is most of the uncertainty."""

TURNS, SETTLED = 6, 0.1
"""The forces are computed from the speeds and the lateness of the latest fit, at most TURNS times, or until no
coefficient moves by more than SETTLED of its standard error."""


@dataclass(frozen=True)
class Admitted:
    """Effect of the included forces on the coefficients, (18,) in the order of `OF_HULL`: `shift` of their
    logarithms, 0 if nothing is included, and `looser`, a factor on their standard errors. timing (k, 18): effect of
    one standard error of each degree of freedom's timing."""

    shift: Array
    looser: Array
    timing: Array

    @property
    def covariance(self) -> Array:
        """Covariance of the logarithms (18, 18), to be added to the fit's covariance."""
        return np.asarray(np.outer(self.shift, self.shift) + self.timing.T @ self.timing)

    def std(self, row: int, std: float) -> float:
        """Standard error of a logarithm, including timing and the error of the model without those forces."""
        return float(np.hypot(self._timed(row, std), self.shift[row]))

    def reach(self, row: int, std: float, stretch: Array) -> tuple[float, float]:
        """Distances of the ends of a logarithm's 95 % interval, below and above; `stretch` (2,): see `JointFit`.

        The shift counts as one more error, because the form of those forces is a guess. The interval also covers that
        of the model with those forces, in case the guess is right.
        """
        shift, timed = self.shift[row], self._timed(row, std)
        whole, loose = float(np.hypot(timed, shift)), timed * self.looser[row]
        below, above = Z95 * stretch
        return float(max(whole * below, loose * below - shift)), float(
            max(whole * above, loose * above + shift)
        )

    def _timed(self, row: int, std: float) -> float:
        return float(np.hypot(std, np.linalg.norm(self.timing[:, row])))


NOTHING = Admitted(np.zeros(len(OF_HULL)), np.ones(len(OF_HULL)), np.zeros((0, len(OF_HULL))))


def timing_of(doubts: Mapping[int, Doubts]) -> Array:
    """Effect of one standard error of force timing on the logarithms, (k, 18), each degree of freedom separately."""
    return STAMPED_S * np.array([doubt.late.leaning for doubt in doubts.values()]).reshape(-1, len(OF_HULL))


def admitted(
    joint: JointLikelihood, theta: Array, lacking: Collection[int], late: Collection[int], timing: Array
) -> Admitted:
    """Fit all axes again from theta with the missing forces: a drag in the degrees of freedom `lacking` it, thrust at
    another time in those that are `late`.

    All axes are fitted together, because a mass also acts in the Coriolis forces of other axes, and with their own
    noise levels. Drag is computed from the posterior mean of the speeds, as Coriolis forces are: the error of that
    mean is independent of it (Berkson 1950).
    """
    if not lacking and not late:
        return replace(NOTHING, timing=timing)
    without = climb(joint, theta, score=JointLikelihood.score)
    rows, places = coefficients(joint)
    axes = {problem.axis.dof: problem.axis for problem in joint.problems}
    wider, at = Wider(joint, without.theta, ()), without.theta
    coefficient, size = at[places], dict.fromkeys(late, 0.0)
    for _ in range(TURNS):
        before = coefficient
        lateness = [
            Force(dof, by_lateness(axes[dof].force, 0.5 * axes[dof].step_s, LATER_S + max(by_s, 0.0)))
            for dof, by_s in size.items()
        ]
        wider = with_forces(joint, without.theta, [*lateness, *_drag(wider.problem, at, lacking)])
        maximum = climb(wider.problem, wider.start, score=JointLikelihood.score)
        at, kept = maximum.theta, wider.kept
        size = dict(zip(size, at[list(wider.places)].tolist(), strict=False))
        coefficient, variance = at[kept][places], np.diag(np.linalg.inv(maximum.precision))[kept][places]
        if np.max(np.abs(coefficient - before) / np.sqrt(variance)) < SETTLED:
            break
    narrow = np.diag(np.linalg.inv(without.precision))[places]
    shift, looser = NOTHING.shift.copy(), NOTHING.looser.copy()
    shift[rows] = coefficient - without.theta[places]
    looser[rows] = np.maximum(np.sqrt(variance / narrow), 1.0)
    return Admitted(shift, looser, timing)


def _drag(joint: JointLikelihood, theta: Array, lacking: Collection[int]) -> list[Force]:
    """The missing drags at theta's speeds."""
    pairs = zip(joint.at(theta), joint.places, strict=True)
    return [
        Force(problem.axis.dof, lacking_drag(problem, problem.speed(theta[place])))
        for problem, place in pairs
        if problem.axis.dof in lacking
    ]
