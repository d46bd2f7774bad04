"""Likelihood of all axes together: a mass acts in its own axis and in the Coriolis forces of the others.

The axes' readings are independent given the Coriolis forces, so the likelihood is the product of the axes'
likelihoods. The velocities in those forces are the posterior means from each axis's own model. Their errors are
independent of the means (Berkson 1950), so they widen the disturbance but do not bias the masses, as measured
velocities would.

If a controller used a reading that the recording lacks, the thrust follows the disturbance unseen, and the axis's own
equation takes that for mass. The masses in that equation are then separate parameters that no other axis sees. The
axis's mass in the Coriolis forces of the other axes is another parameter, which those axes alone determine. Their
estimate is passed one way only, into the axis's equation (a cut, Plummer 2015), for the sake of its damping.

In waves the Munk moments that tilt a hull are those of speeds through the water, which nobody knows: they tell no mass.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import PITCH, ROLL
from identify.estimators.axes.forces import coupled
from identify.estimators.axes.motion import Motion
from identify.estimators.likelihood.axis import DAMPING, MASS, AxisLikelihood
from identify.threads import side_by_side

ROUGHLY = 0.5
"""Convergence limit, in nats, of fits that another fit starts from."""


@dataclass(frozen=True)
class JointLikelihood:
    """The `scoring.Problem` of all axes, with their theta concatenated.

    After them, theta holds the log masses of the degrees of freedom `apart`, as determined by the other axes'
    Coriolis forces; the mass in such an axis's own theta is used in its own equation alone. apart_prior (k, 2): mean
    and precision of their prior. in_waves: in roll and pitch the masses of the Coriolis forces stay as they are.
    """

    problems: tuple[AxisLikelihood, ...]
    apart: tuple[int, ...] = ()
    apart_prior: Array = field(default_factory=lambda: np.zeros((0, 2)))
    in_waves: bool = False

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Slice of each axis's own theta within the joint theta."""
        ends = np.cumsum([len(problem.prior_mean) for problem in self.problems])
        starts = [0, *ends][:-1]
        return tuple(slice(int(a), int(b)) for a, b in zip(starts, ends, strict=True))

    @cached_property
    def mass_indices(self) -> tuple[int, ...]:
        """Index in theta of each axis's mass in the Coriolis forces of the others."""
        slices, apart = self.slices, {dof: k for k, dof in enumerate(self.apart)}
        return tuple(
            slices[-1].stop + apart[dof] if (dof := problem.axis.dof) in apart else of_axis.start + MASS
            for problem, of_axis in zip(self.problems, slices, strict=True)
        )

    @cached_property
    def runs_s(self) -> tuple[tuple[float, float], ...]:
        """First and last time that any axis was read in each run."""
        spans = sorted(
            (float(time_s[run][0]), float(time_s[run][-1]))
            for problem in self.problems
            for time_s in (problem.axis.time_s,)
            for run in problem.axis.runs
        )
        if all(len(problem.axis.runs) == 1 for problem in self.problems):
            return ((spans[0][0], max(end_s for _, end_s in spans)),)
        runs = spans[:1]
        for start_s, end_s in spans[1:]:
            if start_s > runs[-1][1]:
                runs.append((start_s, end_s))
            else:
                runs[-1] = runs[-1][0], max(runs[-1][1], end_s)
        return tuple(runs)

    @property
    def prior_mean(self) -> Array:
        return np.concatenate([*(problem.prior_mean for problem in self.problems), self.apart_prior[:, 0]])

    @property
    def prior_precision(self) -> Array:
        precisions = (problem.prior_precision for problem in self.problems)
        return np.concatenate([*precisions, self.apart_prior[:, 1]])

    @property
    def difference(self) -> Array:
        return self.started([problem.difference for problem in self.problems])

    def started(self, thetas: Sequence[Array]) -> Array:
        """Joint theta from those of the axes, each found alone; a separate mass starts at the axis's own value."""
        masses = {p.axis.dof: theta[MASS] for p, theta in zip(self.problems, thetas, strict=True)}
        return np.concatenate([*thetas, [masses[dof] for dof in self.apart]])

    def log_likelihood(self, theta: Array) -> float:
        """Log likelihood of all axes' readings, up to a constant."""
        problems, slices = self.at(theta), self.slices
        every = range(len(slices))
        return sum(
            side_by_side(lambda i: problems[i].log_likelihood(theta[slices[i]]), every, self._readings)
        )

    def score(self, theta: Array) -> tuple[Array, Array]:
        """Gradient (p,) and information (p, p): of each axis by its own theta and by the masses of the others."""
        gradient, information = np.zeros(len(theta)), np.zeros((len(theta), len(theta)))
        parts = side_by_side(lambda i: self.score_of(i, theta), range(len(self.problems)), self._readings)
        for indices, part_gradient, part_information in parts:
            gradient[indices] += part_gradient
            information[np.ix_(indices, indices)] += part_information
        return gradient, information

    def _readings(self, i: int) -> float:
        """Number of readings of axis i, NaN included."""
        return len(self.problems[i].reading)

    def score_of(self, i: int, theta: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Contribution of axis i: the indices (k,) in theta that it depends on, gradient (k,) and information."""
        problem, of_axis = self.at(theta)[i], self.slices[i]
        dofs = [member.axis.dof for member in self.problems]
        coupled = frozenset() if self._untold(problem) else problem.axis.coupled_dofs
        others = [k for k, dof in enumerate(dofs) if dof in coupled]
        gradient, information = problem.score(theta[of_axis], [dofs[k] for k in others])
        masses = [self.mass_indices[k] for k in others]
        return np.array([*range(of_axis.start, of_axis.stop), *masses]), gradient, information

    def at(self, theta: Array) -> tuple[AxisLikelihood, ...]:
        """The axes' own likelihoods with the masses of theta in their Coriolis forces."""
        masses = self.problems[0].masses.copy()
        for problem, index in zip(self.problems, self.mass_indices, strict=True):
            masses[problem.axis.dof] = np.exp(theta[index])
        return tuple(
            problem if self._untold(problem) else replace(problem, masses=masses) for problem in self.problems
        )

    def _untold(self, problem: AxisLikelihood) -> bool:
        """Whether the Coriolis forces of an axis tell no mass."""
        return self.in_waves and problem.axis.dof in (ROLL, PITCH)

    def projected(self, information: Array, kept: NDArray[np.intp]) -> Array:
        """Information (k, k) of the parameters with the indices `kept` (k,), all others and their priors projected
        out."""
        others = np.setdiff1d(np.arange(len(information)), kept)
        nuisance = information[np.ix_(others, others)] + np.diag(self.prior_precision[others])
        cross = information[np.ix_(kept, others)]
        return np.asarray(information[np.ix_(kept, kept)] - cross @ np.linalg.solve(nuisance, cross.T))

    def with_others_word(self, theta: Array, covariance: Array) -> "JointLikelihood":
        """Return the same likelihood with the prior of each own mass in an axis `apart` taken from the other axes'
        Coriolis forces at theta."""
        updated = []
        for problem, index in zip(self.problems, self.mass_indices, strict=True):
            mean, precision = problem.prior_mean.copy(), problem.prior_precision.copy()
            if problem.axis.dof in self.apart:
                mean[MASS], precision[MASS] = theta[index], 1.0 / covariance[index, index]
            updated.append(replace(problem, prior_mean=mean, prior_precision=precision))
        return replace(self, problems=tuple(updated))

    def with_better_forces(self, motion: Motion, theta: Array) -> "JointLikelihood":
        """Return the same likelihood with Coriolis forces from the velocities at theta, and without the readings that
        are spikes there (`AxisLikelihood.without_spikes`).

        `motion` gives the velocities of axes that are not fitted.
        """
        nu = motion.nu.copy()
        problems = self.at(theta)
        parameters = [theta[of_axis] for of_axis in self.slices]
        for problem, speed in zip(
            problems,
            side_by_side(lambda i: problems[i].speed(parameters[i]), range(len(parameters)), self._readings),
            strict=True,
        ):
            nu[:, problem.axis.dof] = motion.interpolated(problem.axis.shown_s, speed)
        better = replace(motion, nu=nu)

        def moved(i: int) -> AxisLikelihood:
            # Move half of the way: the full change overshoots, and the passes would oscillate about their limit.
            axis = problems[i].axis
            speed, before_filter = problems[i].expected_speeds(parameters[i])
            moving = replace(
                coupled(axis, better),
                speed=0.5 * (axis.speed + speed),
                before_filter=0.5 * (axis.before_filter + before_filter),
            )
            reading = problems[i].without_spikes(parameters[i])
            return replace(problems[i].with_axis(moving), reading=reading)

        return replace(self, problems=tuple(side_by_side(moved, range(len(parameters)), self._readings)))


def coefficients(joint: JointLikelihood) -> tuple[list[int], list[int]]:
    """The fitted coefficients, as rows of `OF_HULL`, and their indices in theta."""
    axes = list(zip(joint.problems, joint.slices, strict=True))
    linear = [
        (6 + problem.axis.dof, of_axis.start + DAMPING)
        for problem, of_axis in axes
        if problem.damped != "quadratic"
    ]
    squared = [
        (12 + problem.axis.dof, of_axis.start + problem.quadratic_index)
        for problem, of_axis in axes
        if problem.damped != "linear"
    ]
    masses = zip([problem.axis.dof for problem in joint.problems], joint.mass_indices, strict=True)
    rows, indices = zip(*masses, *linear, *squared, strict=True)
    return list(rows), list(indices)
