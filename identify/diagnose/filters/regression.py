"""A dive as one linear regression of the filters' normalised innovations on candidate causes.

The filters are linear in force and readings at given gains. An unmodelled force or a reading error therefore adds its
own filter response to the innovations (Kalman 1960; Mehra and Peschon 1971 on innovations for fault detection).
Innovations of a true model are white and need no other weights. The nominal model's own parameters are nuisance
columns: a residual that a refit would absorb is no evidence.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import YAW
from identify.diagnose.causes.evidence import FOLDS, Block, Blocks
from identify.diagnose.filters.deviation import deviations
from identify.diagnose.filters.innovations import AxisInnovations, autoregressions_of, push_of
from identify.diagnose.filters.witnesses import WeighedWitness, Witness, weighed_witness
from identify.effects.course import Course
from identify.effects.effect import Act
from identify.estimators.likelihood.axis import DAMPING, FORCES, MASS, AxisLikelihood
from identify.estimators.likelihood.joint import JointLikelihood
from identify.estimators.likelihood.misread_drift import DRIFT_MOMENTS
from identify.threads import side_by_side

PIECE_S, LEAST_PIECE_S = 20.0, 6.0
"""Length of a held-out piece: longer than the disturbance's memory, shorter than most legs; and its least length in a
short dive: longer than a drift of 5 s."""


def piece_s(lasting_s: float) -> float:
    """Length of the pieces of a dive: two for each fold, if the dive is too short for pieces of 20 s."""
    return float(np.clip(lasting_s / (2 * FOLDS), LEAST_PIECE_S, PIECE_S))


def pieces_of(time_s: Array, runs_s: Sequence[tuple[float, float]]) -> NDArray[np.intp]:
    """Piece (n,) of each time; none spans two runs. A time outside all runs has the piece of the nearest before it."""
    each_s = piece_s(sum(end_s - start_s for start_s, end_s in runs_s))
    if len(runs_s) == 1:
        return np.maximum((time_s - runs_s[0][0]) / each_s, 0.0).astype(np.intp)
    out, first = np.zeros(len(time_s), dtype=np.intp), 0
    for start_s, end_s in runs_s:
        count = max(int((end_s - start_s) / each_s), 1)
        since = np.clip((time_s - start_s) / max(end_s - start_s, 1e-9) * count, 0, count - 1)
        out = np.where(time_s >= start_s, first + since.astype(np.intp), out)
        first += count
    return out


LEVELLED = (3, 4)
"""Roll and pitch."""

MASS_OFF = 0.02
"""Relative error of a mass that was fitted to the velocity of an autopilot's filter.

The velocity's lateness and smoothing leave that much, and moments of drift come from small differences of masses.
"""

SCALE_SPREAD = 1.5
"""Prior spread of the logarithm of a thrust's scale: that of a mass."""

THRUST_DELAYS_S = (0.0, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2)
"""Delays allowed for thrust that answers an unrecorded disturbance, s."""


@dataclass(frozen=True)
class Regression:
    """The regression of a fit: the rows of all its axes, one axis after another.

    value (rows,): normalised innovations. nuisance: m columns of the nominal parameters, a block for each axis and each
    witness, with prior precision nominal_precision (m,); scales: columns of a thrust of unknown scale. piece (rows,):
    piece of the dive. dof (rows,): degree of freedom, -1 for rows of `witnesses`, which come last. runs_s: first and
    last time of each run.
    """

    axes: tuple[AxisInnovations, ...]
    value: Array
    nuisance: Blocks
    nominal_precision: Array
    piece: NDArray[np.intp]
    dof: NDArray[np.intp]
    runs_s: tuple[tuple[float, float], ...]
    witnesses: tuple[WeighedWitness, ...] = ()
    scales: tuple[int, ...] = ()

    def blocks(self, acts: Sequence[Act], course: Course) -> Blocks:
        """Response to each act: a block for each axis and each witness."""
        pushes = side_by_side(lambda act: push_of(act, course), acts)
        rows: list[AxisInnovations | WeighedWitness] = [*self.axes, *self.witnesses]

        def block(axis_innovations: AxisInnovations | WeighedWitness) -> Block:
            if isinstance(axis_innovations, AxisInnovations):
                return axis_innovations.block(acts, pushes, course)
            return _witness_block(axis_innovations, acts)

        return Blocks(tuple(side_by_side(block, rows)), len(acts))

    def columns(self, acts: Sequence[Act], course: Course) -> Array:
        """Response to each act as a dense matrix (rows, acts)."""
        return self.blocks(acts, course).dense()

    def with_thrust_scale(self) -> "Regression":
        """Add a nuisance column for the thrust in yaw.

        If a controller holds a heading against a disturbance, the inertia and that disturbance scale together, and
        the column of the inertia leaves the disturbance as it is.
        """
        scaled, first = self, self.nuisance.width
        for k, axis in enumerate(self.axes):
            if axis.problem.axis.dof == YAW:
                force = axis.problem.axis.force
                column = axis.prewhitened(axis.by_force(force.mean(axis=1)[:, None], force[:, :1]))
                scaled = scaled._with_nuisances(_of_axis_alone(self.axes, k, column), SCALE_SPREAD)
        return replace(scaled, scales=tuple(range(first, scaled.nuisance.width)))

    def with_drift_moments(self, course: Course) -> "Regression":
        """Add nuisance columns for moments of drift, as large as the error of masses through an autopilot's filter."""
        acts = []
        for dof, (first, second) in DRIFT_MOMENTS.items():
            wrench = np.zeros_like(course.nu)
            size = np.hypot(course.mass[first], course.mass[second])
            wrench[:, dof] = size * course.drifting[:, first] * course.drifting[:, second]
            acts.append(Act(wrench=wrench))
        return self._with_nuisances(self.blocks(acts, course), MASS_OFF)

    def with_deviation(self, course: Course) -> "Regression":
        """Add nuisance columns for a compass' deviation, where a heading is among the readings."""
        acts = []
        for deviation in deviations(course.euler[:, 2]).T:
            attitude = np.zeros((len(deviation), 3))
            attitude[:, 2] = deviation
            acts.append(Act(attitude=attitude))
        columns = self.blocks(acts, course)
        return self._with_nuisances(columns, 1.0) if columns.square().any() else self

    def _with_nuisances(self, columns: Blocks, spread: float) -> "Regression":
        return replace(
            self,
            nuisance=self.nuisance.with_columns(columns),
            nominal_precision=np.append(self.nominal_precision, np.full(columns.width, spread**-2.0)),
        )

    def with_witnesses(
        self, witnesses: Sequence[Witness], acts: Sequence[Act], course: Course
    ) -> "Regression":
        """Add the rows of witnesses, weighted by their residuals less the acts."""
        weighed = tuple(weighed_witness(witness_rows, acts, course) for witness_rows in witnesses)
        if not weighed:
            return self
        width = self.nuisance.width
        known = []
        for witness_rows in weighed:
            columns = witness_rows.whitened(witness_rows.witness.known)
            known.append(Block(width + np.arange(columns.shape[1]), columns))
            width += columns.shape[1]
        late = [
            np.minimum(pieces_of(witness_rows.witness.time_s, self.runs_s), self.piece.max())
            for witness_rows in weighed
        ]
        piece = np.concatenate([self.piece, *late])
        # Less the acts, like all other rows: `rows_of` adds them again.
        left = [
            witness_rows.whitened(witness_rows.witness.left(acts)[:, None])[:, 0] for witness_rows in weighed
        ]
        return replace(
            self,
            value=np.concatenate([self.value, *left]),
            nuisance=Blocks((*self.nuisance.parts, *known), width),
            nominal_precision=np.concatenate(
                [self.nominal_precision, *(witness_rows.witness.precision for witness_rows in weighed)]
            ),
            piece=piece,
            dof=np.concatenate([self.dof, np.full(len(piece) - len(self.piece), -1, dtype=np.intp)]),
            witnesses=weighed,
        )


def _witness_block(weighed: WeighedWitness, acts: Sequence[Act]) -> Block:
    seen = {k: part for k, act in enumerate(acts) if (part := weighed.witness.of(act)) is not None}
    values = np.array([*seen.values()]).reshape(len(seen), len(weighed.std)).T
    return Block(np.array([*seen], dtype=np.intp), weighed.whitened(values))


def regression_of(joint: JointLikelihood, theta: Array, feedback_unrecorded: Sequence[int]) -> Regression:
    """The regression at the maximum `theta` of a joint fit.

    In a degree of freedom of `feedback_unrecorded` the controller used an unrecorded reading. Its thrust follows the
    disturbance without a recorded cause, so delayed thrust is a nuisance there.
    """
    problems = joint.at(theta)
    kept = np.array(sorted({*joint.mass_indices, *mean_indices(joint)}))
    rows = side_by_side(
        lambda k: _rows_of(joint, problems[k], theta, k, kept),
        range(len(problems)),
        lambda k: len(problems[k].reading),
    )
    axes = [axis_rows.innovations for axis_rows in rows]
    nuisance = Blocks(tuple(axis_rows.nominal for axis_rows in rows), len(kept))
    for k, axis in enumerate(axes):
        if axis.problem.axis.dof in feedback_unrecorded:
            # Its thrust at each delay.
            nuisance = nuisance.with_columns(_of_axis_alone(axes, k, axis.prewhitened(delayed_thrust(axis))))
    read_s = np.concatenate([axis.problem.axis.time_s[axis.read] for axis in axes])
    return Regression(
        tuple(axes),
        np.concatenate([axis_rows.value for axis_rows in rows]),
        nuisance,
        np.concatenate([joint.prior_precision[kept], np.zeros(nuisance.width - len(kept))]),
        pieces_of(read_s, joint.runs_s),
        np.concatenate([np.full(len(axis.std), axis.problem.axis.dof, dtype=np.intp) for axis in axes]),
        joint.runs_s,
    )


@dataclass(frozen=True)
class _AxisRows:
    """An axis of the regression: its normalised innovations (rows,), and its block of nominal columns."""

    innovations: AxisInnovations
    value: Array
    nominal: Block


def _rows_of(
    joint: JointLikelihood, problem: AxisLikelihood, theta: Array, k: int, kept: NDArray[np.intp]
) -> _AxisRows:
    """The rows of the k-th axis at the maximum `theta`, with columns for the parameters `kept`."""
    axis, of_axis = problem.axis, joint.slices[k]
    table = problem.transition_table(theta[of_axis])
    error, variance, gain = problem.run_filter(
        theta[of_axis], table, problem.mean_force(theta[of_axis]), np.inf
    )
    read = np.isfinite(problem.reading)
    std, channel = np.sqrt(variance[read]), axis.channel[read]
    run_of = np.repeat(np.arange(len(axis.runs)), [run.stop - run.start for run in axis.runs])[read]
    autoregressions = tuple(
        autoregression
        for i in range(len(axis.channels))
        for autoregression in autoregressions_of(
            [np.flatnonzero((channel == i) & (run_of == k)) for k in range(len(axis.runs))], error[read] / std
        )
    )
    innovations = AxisInnovations(problem, theta[of_axis], table, gain, error[read], std, autoregressions)
    dofs = [problem.axis.dof for problem in joint.problems]
    forces = np.column_stack(
        [problem.by_theta(theta[of_axis]), axis.coriolis[:, dofs] * problem.masses[dofs]]
    )
    # A force in the model subtracts its response from the innovations.
    mass, damping, *quadratic = innovations.by_motion().T
    slopes = np.column_stack([mass, damping, -innovations.by_force(forces)])
    for slope in quadratic:
        slopes[:, 2 + problem.quadratic_index - FORCES] += slope
    by_theta = innovations.prewhitened(slopes)
    targets = [of_axis.start + at for at in (MASS, DAMPING, *range(FORCES, problem.noise_index))]
    columns = np.zeros((len(std), len(kept)))
    for at, column in zip((*targets, *joint.mass_indices), by_theta.T, strict=True):
        columns[:, kept == at] += column[:, None]
    value = innovations.prewhitened((innovations.error / innovations.std)[:, None])[:, 0]
    return _AxisRows(innovations, value, Block.of_columns(columns))


def mean_indices(joint: JointLikelihood) -> list[int]:
    """Places in theta of all parameters that move the innovations' mean: masses, dampings, masses of one axis alone,
    and nuisance trims."""
    pushes = steady_trims(joint)
    return [
        at
        for problem, of_axis in zip(joint.problems, joint.slices, strict=True)
        for at in (of_axis.start + k for k in (MASS, DAMPING, *range(FORCES, problem.noise_index)))
        if at not in pushes
    ]


def steady_trims(joint: JointLikelihood) -> list[int]:
    """Places in theta of trims that the nominal model lacks.

    The model has the vehicle file's net buoyancy, and any other steady push is a cause. In roll and pitch a tilted
    sensor causes a trim, so trims there are nuisances.
    """
    return [
        of_axis.start + FORCES + trim
        for problem, of_axis in zip(joint.problems, joint.slices, strict=True)
        if problem.axis.dof not in LEVELLED
        for trim in range(problem.axis.trims)
    ]


def _of_axis_alone(axes: Sequence[AxisInnovations], k: int, columns: Array) -> Blocks:
    """Columns (own rows, c) of the k-th axis, zero on the rows of the others."""
    blocks = [Block(np.zeros(0, dtype=np.intp), np.zeros((len(axis.std), 0))) for axis in axes]
    blocks[k] = Block(np.arange(columns.shape[1]), columns)
    return Blocks(tuple(blocks), columns.shape[1])


def delayed_thrust(innovations: AxisInnovations) -> Array:
    """Response (own rows, k) of an axis to its own thrust at each delay, less its mean: a steady response answers a
    steady force, which a column of it would take up whole, however plain that is."""
    axis = innovations.problem.axis
    force = axis.force.mean(axis=1)
    force = force - np.average(force, weights=axis.step_s)
    late = []
    for late_s in THRUST_DELAYS_S:
        shifted = [np.interp(axis.time_s[run] - late_s, axis.time_s[run], force[run]) for run in axis.runs]
        late.append(np.concatenate(shifted))
    return innovations.by_force(np.column_stack(late))
