"""Forces of a few general kinds that a fit's model lacks: as of a current, a tether, weak thrusters, waves, a DVL that
sits elsewhere.

Each is a Lagrange-multiplier test (Engle 1984, eq. 13) of an axis with a few forces at once. An innovation's response
to a force is that of the filter with its gains (Gupta and Mehra 1974, eqs 33 to 35). The responses to all that the fit
is free to choose are projected out (Neyman 1959, C(alpha)), as are those to a drag that the model lacks and to thrust
at another time, which have tests in `drag_and_timing`. A force like the sea's disturbance does not stand out, because
the filter weighs innovations by that.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import PITCH, ROLL
from identify.dive import Dive
from identify.estimators.axes.axis import Axes
from identify.estimators.filter.innovations import responses
from identify.estimators.likelihood.axis import DAMPING, MASS, AxisLikelihood
from identify.estimators.likelihood.joint import JointLikelihood, coefficients
from identify.estimators.missing_forces.drag_and_timing import (
    DOUBTFUL_SCORE,
    Admitted,
    Doubts,
    Force,
    lacking_drag,
    with_forces,
)
from identify.estimators.missing_forces.forms import Forms, Kind
from identify.estimators.missing_forces.spectral_peak import Peak, peak_of
from identify.threads import side_by_side

STEP = 1e-4
"""Step of a logarithm for a derivative."""

LEAST_LEFT = 1e-4
"""Share of a response's square that must be left of it without all that the fit chooses: of less, rounding says as much
as the dive."""

TURNING_SCORE = 2.0 * DOUBTFUL_SCORE
"""A DVL's speed is brought to the origin by smoothed rates of turn, so their error looks a little like a lever arm."""

LEAST_FORCE = 0.02
"""Least force that goes with the thrust, relative to thrust in that degree of freedom, both as rms: no thrust curve is
known better."""

TOO_ALIKE = 1e-10
"""Responses count as the same if the eigenvalue of their products is a smaller share of the largest."""


@dataclass(frozen=True)
class Lack:
    """A force that the model of a degree of freedom lacks: its test's `score`, as a number of standard errors, and
    its likeliest form (n,) by event, N or N m. period_s: of a swing, otherwise 0."""

    dof: int
    kind: Kind
    score: float
    shape: Array
    period_s: float = 0.0


@dataclass(frozen=True)
class Screen:
    """Innovations of an axis at theta, ready for tests.

    table, gain (n, 4): of the filter; read (n,): the events with a reading; root (m,): the readings' standard
    deviations; white (m,): their innovations over these.
    """

    problem: AxisLikelihood
    theta: Array
    table: Array
    gain: Array
    read: NDArray[np.bool_]
    root: Array
    white: Array

    def responses(self, shapes: Array) -> Array:
        """Change of the predicted readings, in standard deviations (m, k), by forces (n, k) held over each step."""
        shapes, none = np.ascontiguousarray(shapes), np.zeros((0, shapes.shape[1]))
        answers = responses(
            self.table, self.problem.step, shapes, shapes, none, self.read,
            self.problem.axis.state_read, self.gain, self.root, self.problem.axis.is_coloured,
        )  # fmt: skip
        return np.asarray(answers)

    @cached_property
    def chosen(self) -> Array:
        """Responses (m, p) of length 1 to all that the fit chooses, and to drag and lateness."""
        problem, axis = self.problem, self.problem.axis
        shapes = [problem.shapes, axis.coriolis[:, sorted(axis.coupled_dofs)]]
        shapes.append(axis.by_lateness()[:, None])
        if problem.damped != "both":
            shapes.append(lacking_drag(problem, axis.speed)[:, None])
        indices = [MASS, DAMPING, *([problem.quadratic_index] if problem.damped != "linear" else [])]
        curved = [self._moved(index) for index in indices]
        return _normed(np.column_stack([*curved, self.responses(np.column_stack(shapes))]))[0]

    def _moved(self, index: int) -> Array:
        """Derivative (m,) of the predicted readings by an entry of theta, in standard deviations."""
        theta = self.theta.copy()
        theta[index] += STEP
        error, _ = self.problem.filtered(theta, np.inf)
        return np.asarray((self.white - error[self.read] / self.root) / STEP)

    @cached_property
    def _products(self) -> tuple[Array, Array]:
        """Pseudo-inverse (p, p) of the products of `chosen`, and its products (p,) with the innovations."""
        products: Array = np.asarray(self.chosen.T @ self.chosen)
        return np.asarray(np.linalg.pinv(products, TOO_ALIKE, True)), np.asarray(self.chosen.T @ self.white)

    def tested(self, forms: Mapping[Kind, Array], period_s: float = 0.0) -> list[Lack]:
        """Test the forces (n, k) of each kind together."""
        if not forms:
            return []
        shapes = np.column_stack(list(forms.values()))
        answers, size = _normed(self.responses(shapes))
        inverse, chosen_pull = self._products
        cross = self.chosen.T @ answers
        pull = answers.T @ self.white - cross.T @ (inverse @ chosen_pull)
        left = answers.T @ answers - cross.T @ (inverse @ cross)
        lacks, end = [], 0
        for kind, form in forms.items():
            these = np.arange(end, end := end + form.shape[1])
            statistic, degrees, factors = _joint(pull[these], left[np.ix_(these, these)])
            score = in_standard_errors(statistic, degrees)
            lacks.append(Lack(self.problem.axis.dof, kind, score, form @ (factors / size[these]), period_s))
        return lacks


def _normed(columns: Array) -> tuple[Array, Array]:
    """Columns (m, k) of length 1, and their lengths (k,); a column of zeros stays so."""
    size = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    size = np.where(size > 0, size, 1.0)
    return columns / size, size


def _joint(pull: Array, left: Array) -> tuple[float, int, Array]:
    """The statistic of forces with a pull (k,) of information `left` (k, k), its degrees of freedom, and the forces'
    factors (k,), without what the dive can't tell."""
    information, ways = np.linalg.eigh(left)
    clear = information > LEAST_LEFT
    ways, information = ways[:, clear], information[clear]
    along = ways.T @ pull
    return float(np.sum(along**2 / information)), len(along), np.asarray(ways @ (along / information))


def in_standard_errors(statistic: float, degrees: int) -> float:
    """A chi-squared statistic as a number of standard errors z, such that its chance is at most exp(-z^2 / 2)
    (Chernoff 1952)."""
    if statistic <= degrees or not degrees:
        return 0.0
    return float(np.sqrt(statistic - degrees - degrees * np.log(statistic / degrees)))


def screen_of(problem: AxisLikelihood, theta: Array) -> Screen:
    """Run the filter of an axis at its part of theta."""
    table = problem.transition_table(theta)
    error, variance, gain = problem.run_filter(theta, table, problem.mean_force(theta), np.inf)
    read = np.isfinite(error)
    root = np.sqrt(variance[read])
    return Screen(problem, theta, table, gain, read, root, error[read] / root)


def lacks_of(
    joint: JointLikelihood,
    theta: Array,
    built: Axes,
    dive: Dive,
    spoilt: Collection[int],
    doubts: Mapping[int, Doubts],
) -> tuple[Lack, ...]:
    """The forces that the model lacks beyond chance, the clearest of each axis in order of score; none where drag or
    lateness is clearer (`doubts` by degree of freedom).

    Not tested are roll and pitch, in which the righting moment of an angle that is read acts, and the axes whose
    controller used an unrecorded reading (`spoilt`), in which the thrust follows the disturbance. Nor is a recording
    that is hardly of this vehicle. A force that goes with the thrust counts from LEAST_FORCE of it on.
    """
    if built.strange or not joint.problems:
        return ()
    pairs = [
        (problem, theta[part])
        for problem, part in zip(joint.at(theta), joint.slices, strict=True)
        if problem.axis.dof not in (ROLL, PITCH, *spoilt)
    ]
    forms = Forms(built, dive)
    thrust = {problem.axis.dof: float(np.sqrt(np.mean(problem.axis.force**2))) for problem, _ in pairs}

    def tests_of(i: int) -> tuple[Screen, list[Lack], Peak]:
        screen = screen_of(*pairs[i])
        return screen, screen.tested(forms.of(screen.problem)), _peak(screen)

    results = side_by_side(tests_of, range(len(pairs)), lambda i: len(pairs[i][0].reading))
    tests = [test for _, of_axis, _ in results for test in of_axis]
    clearest = max((peak for *_, peak in results), key=lambda peak: peak.score, default=None)
    if clearest is not None and clearest.score > DOUBTFUL_SCORE:
        # Waves have a period in all axes, so the other axes are tested at that alone.
        for screen, *_ in results:
            swing = forms.swing(screen.problem.axis, clearest.period_s)
            tests += screen.tested({Kind.SWING: swing}, clearest.period_s)
    clear: dict[int, Lack] = {}
    for test in sorted(tests, key=lambda test: -test.score):
        doubtful = TURNING_SCORE if test.kind is Kind.TURNING else DOUBTFUL_SCORE
        if test.score > max(doubtful, doubts[test.dof].clearest) and not _of_the_curve(
            test, thrust[test.dof]
        ):
            # A force resembles others a little: the clearest of an axis explains those.
            clear.setdefault(test.dof, test)
    return tuple(clear.values())


def _of_the_curve(lack: Lack, thrust_rms: float) -> bool:
    """Whether a force is no more than the error of a thrust curve."""
    return lack.kind is Kind.THRUST and float(np.sqrt(np.mean(lack.shape**2))) < LEAST_FORCE * thrust_rms


def _peak(screen: Screen) -> Peak:
    """The clearest peak in the spectrum of the axis's first sensor."""
    axis = screen.problem.axis
    first = axis.channel[screen.read] == 0
    return peak_of(axis.time_s[screen.read][first], screen.white[first])


def widened(let_in: Admitted, joint: JointLikelihood, theta: Array, lacks: Sequence[Lack]) -> Admitted:
    """Return the effect of the included forces together with that of those that the model lacks, if that is larger:
    the change of all axes' coefficients by a step of scoring with these forces."""
    if not lacks:
        return let_in
    rows, indices = coefficients(joint)
    moved, looser = with_forces(joint, theta, [Force(lack.dof, lack.shape) for lack in lacks]).included()
    shift, factor = let_in.shift.copy(), let_in.looser.copy()
    shift[rows] = np.where(np.abs(moved[indices]) > np.abs(shift[rows]), moved[indices], shift[rows])
    factor[rows] = np.maximum(looser[indices], factor[rows])
    return replace(let_in, shift=shift, looser=factor)
