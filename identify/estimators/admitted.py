"""What coefficients would be, were the forces let in that a fit is doubted for, and how far they hang on its timing."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import OF_HULL
from identify.estimators.doubts import Doubts, coefficients, lacking_drag
from identify.estimators.lateness import LATER_S, by_lateness
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.multiplier import Force, Wider, with_forces
from identify.estimators.scoring import climb
from identify.identification import Z95

Array = NDArray[np.float64]

STAMPED_S = 0.5e-3
"""Standard error of when forces act beside readings: many stamps are whole milliseconds, and a computer's tasks wait
for each other. Where masses are known to a tenth of a per cent, that is most of what is not known."""

TURNS, SETTLED = 6, 0.1
"""Forces are made of the speeds and the lateness that the fit with them came to, so often at most, or until no
coefficient moves by more than this share of its standard error."""


@dataclass(frozen=True)
class Admitted:
    """What letting forces in changes of the coefficients, (18,) in the order of `OF_HULL`: `shift` of their logarithms,
    0 where nothing is let in, and `looser`, what their standard errors are multiplied by. timing (k, 18): one standard
    error of each degree of freedom's timing in them."""

    shift: Array
    looser: Array
    timing: Array

    @property
    def covariance(self) -> Array:
        """Of the logarithms (18, 18): what comes to that of the fit."""
        return np.asarray(np.outer(self.shift, self.shift) + self.timing.T @ self.timing)

    def std(self, row: int, std: float) -> float:
        """The standard error of a logarithm with its timing's, and with what the model without those forces is off
        by."""
        return float(np.hypot(self._timed(row, std), self.shift[row]))

    def reach(self, row: int, std: float, stretch: Array) -> tuple[float, float]:
        """How far the 95 % interval of a logarithm reaches below and above; `stretch` (2,): see `JointFit`.

        As far as the shift as one more error takes it, for the form of those forces is a guess; and no less than the
        interval of the model with them reaches, should the guess be right.
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
    """What one standard error of when forces act does to the logarithms, (k, 18): each degree of freedom by itself."""
    return STAMPED_S * np.array([one.late.leaning for one in doubts.values()]).reshape(-1, len(OF_HULL))


def admitted(
    joint: JointLikelihood, theta: Array, lacking: Collection[int], late: Collection[int], timing: Array
) -> Admitted:
    """All axes fitted again from theta with the forces that are missing: a drag in the degrees of freedom
    that are `lacking` it, thrust at another time in those that are `late`.

    All together, because a mass also weighs in the Coriolis forces of other axes, and with noise levels of their own.
    Drag is made of the posterior mean of the speeds, as Coriolis forces are: what is unknown of that does not depend on
    what is known (Berkson 1950).
    """
    if not lacking and not late:
        return replace(NOTHING, timing=timing)
    without = climb(joint, theta, score=JointLikelihood.score)
    rows, where = coefficients(joint)
    axes = {problem.axis.dof: problem.axis for problem in joint.problems}
    wider, at = Wider(joint, without.theta, ()), without.theta
    coefficient, size = at[where], dict.fromkeys(late, 0.0)
    for _ in range(TURNS):
        before = coefficient
        lateness = [
            Force(dof, by_lateness(axes[dof].force, 0.5 * axes[dof].step_s, LATER_S + max(by_s, 0.0)))
            for dof, by_s in size.items()
        ]
        wider = with_forces(joint, without.theta, [*lateness, *_drag(wider.problem, at, lacking)])
        found = climb(wider.problem, wider.start, score=JointLikelihood.score)
        at, kept = found.theta, wider.kept
        size = dict(zip(size, at[list(wider.places)].tolist(), strict=False))
        coefficient, variance = at[kept][where], np.diag(np.linalg.inv(found.precision))[kept][where]
        if np.max(np.abs(coefficient - before) / np.sqrt(variance)) < SETTLED:
            break
    narrow = np.diag(np.linalg.inv(without.precision))[where]
    shift, looser = NOTHING.shift.copy(), NOTHING.looser.copy()
    shift[rows] = coefficient - without.theta[where]
    looser[rows] = np.maximum(np.sqrt(variance / narrow), 1.0)
    return Admitted(shift, looser, timing)


def _drag(joint: JointLikelihood, theta: Array, lacking: Collection[int]) -> list[Force]:
    """The drags at theta's speeds."""
    own = zip(joint.at(theta), joint.places, strict=True)
    return [
        Force(problem.axis.dof, lacking_drag(problem, problem.speed(theta[place])))
        for problem, place in own
        if problem.axis.dof in lacking
    ]
