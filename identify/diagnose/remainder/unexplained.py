"""Whether what the causes leave is a force or noise: it is a force if a generic one of no cause predicts it.

Whiteness is no test: noise levels learnt from the same dive make the innovations white enough whatever is missing.
Innovations that some force predicts on held-out pieces are the evidence.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.diagnose.causes.candidates import companions, possible_forms
from identify.diagnose.causes.evidence import Blocks, Candidates, NormalEquations, equations_of, inverse
from identify.diagnose.causes.weighing import Fitted, Weighing, weighing_of
from identify.diagnose.filters.innovations import AxisInnovations
from identify.diagnose.filters.nominal import Nominal, refitted
from identify.diagnose.filters.regression import LEVELLED, Regression, delayed_thrust
from identify.diagnose.remainder.bursts import bursts
from identify.diagnose.remainder.generic_forces import (
    Parity,
    Variable,
    of_other_speeds,
    of_the_past,
    of_unit_spread,
    unit_forces,
)
from identify.diagnose.remainder.lines import clusters
from identify.diagnose.remainder.slow import slow_axes, slow_forces
from identify.effects.course import Course
from identify.effects.effect import Act
from identify.estimators.missing_forces.screening import LEAST_FORCE
from identify.threads import side_by_side

Timing = Literal["steady", "transient", "intermittent", "drifting", "periodic"]


_Unit = tuple[Variable, Parity | None, Array, Timing | None]

LEAST_STEP = 3.0
"""Held-out nats below which selection in an axis ends. Not a significance threshold: the best of so many forces
exceeds it on a dive without any effect."""

MOST = 4

WEIGHED = 12
"""Best forces in sample that are weighed on held-out pieces."""

UNKNOWN_NATS, LEVELLED_NATS = 11.7, 100.0
"""Nats that one force must save for the verdict "unknown".

Under the null, x nats on held-out pieces have probability exp(-x) at most (Markov's inequality for a likelihood
ratio). Some 1200 forces are tried, at one false alarm in a hundred dives: ln(120000). Roll and pitch need far more
nats: a vehicle held level shows little of its inertia there, and much of its levelling.
"""

LEAST_TIMED, LEAST_BURST = 0.01, 0.003
"""Least force with a timing of its own, relative to thrust in that degree of freedom, both as standard deviations; and
of a burst that does not come with the thrust's changes. Pulses come in steps, and somewhat late or early, so that an
exact simulator's starts and stops look like bursts too, of up to half of the former."""

CHANGING = 3.0
"""A burst comes with the thrust's changes if these have so many times more power where it pushes than over the dive.
Blows that nothing of the vehicle causes have 1, an exact simulator's starts and stops 8 and more."""

SURGE_AND_SWAY = (0, 1)


SELECTED: tuple[Timing | None, ...] = (None, "steady", "transient")
"""Timings of forces that are selected one after another; bursts, lines and slow forces are weighed each by itself."""

ZERO_M_S2 = 0.03
"""Usual zero error of an accelerometer, by switching on and by age (Xsens MTi data sheet)."""


@dataclass(frozen=True)
class GenericForce:
    """A force (n,) in one degree of freedom: the variable it depends on, its parity in that variable, and its own
    timing, if any."""

    dof: int
    variable: Variable
    parity: Parity | None
    force: Array
    timing: Timing | None = None


@dataclass(frozen=True)
class Unexplained:
    """The unexplained remainder: generic forces that predict it on held-out pieces, strongest first.

    gains (k,): nats that each adds in its axis to the forces before it. forces (k,): standard deviation, N or N m; 0
    for a reading error. explained: nats that the causes save in the vehicle's motion. instead: nats that generic
    forces save in place of the causes.
    """

    shapes: tuple[GenericForce, ...] = ()
    gains: tuple[float, ...] = ()
    forces: tuple[float, ...] = ()
    explained: float = 0.0
    instead: float = 0.0


def beyond_chance(shape: GenericForce, gain: float) -> bool:
    """Whether a force is significant."""
    return gain > (LEVELLED_NATS if shape.dof in LEVELLED else UNKNOWN_NATS)


def unexplained_of(weighing: Weighing, fit: Fitted) -> Unexplained:
    """The generic forces that predict a dive's innovations beyond some causes and their companions.

    Degrees of freedom with an unrecorded controller reading are left out: the unrecorded reading makes thrust follow
    the sea, and every function of thrust predicts something. Degrees of freedom in which an unrecorded reading looks
    like an unknown force are left out, too.
    """
    selectable = _Selectable(weighing)
    left = _unexplained_of(weighing, fit, selectable)
    if _at_sea(fit) and any(map(beyond_chance, left.shapes, left.gains)):
        freed = _without_remainder(weighing, fit)
        left = _unexplained_of(freed, freed.fitted(fit.causes), _Selectable(freed))
    return replace(left, instead=_nats_instead(weighing, selectable)) if fit.causes else left


def _nats_instead(weighing: Weighing, selectable: "_Selectable") -> float:
    """Nats that generic forces save in place of all causes, by the same filters and on the same held-out pieces.

    Only forces that are selected one after another count, and those of the witnesses: the nats of bursts, lines and
    slow forces are not what these add to the others. Behind an autopilot's filter none counts, for many forces take
    some of what its fitted lateness and smoothing leave.
    """
    fit = weighing.fitted(())
    known = _known(weighing, fit)
    axes = [axis for axis in _judged_axes(weighing, fit, known) if axis.dof not in weighing.now.filtered]
    tests: list[_Test] = [
        *(partial(_of_axis, axis, selectable) for axis in axes),
        lambda: [*_of_witnesses(weighing, fit.value, known)],
    ]
    return sum(item.gain for item in _strongest_first(tests) if beyond_chance(item.shape, item.gain))


def _foreseen(now: Nominal) -> Course:
    """The course with accelerations by the Coriolis forces of velocities that earlier readings foretell.

    The filters take those forces from velocities smoothed over the whole dive, so that they know later readings. An
    axis that hardly anything else moves, as heave without a thruster, would seem to predict the turning that moves it.
    """
    course = now.course
    later = course.coriolis_of(course.mass, now.motion.nu) - course.coriolis_of(course.mass, course.nu)
    return replace(course, nu_dot=course.nu_dot + later / np.maximum(course.mass, 1e-9))


def _at_sea(fit: Fitted) -> bool:
    return any(cause.effect.sea for cause in fit.causes)


def _without_remainder(weighing: Weighing, fit: Fitted) -> Weighing:
    """The weighing by filters of a dive without the causes and their companions.

    The remainder of a sea's form raises the fitted noise levels. Such filters follow the disturbance too closely, and
    the thrust that answers it then seems to predict their innovations.
    """
    course, rows = weighing.now.course, weighing.rows
    acts = [cause.slope(course, p) for cause, p in ((fit.causes[k], p) for k, p in fit.at)]
    acts += _accompanying(weighing, fit)
    columns = rows.nuisance.with_columns(rows.blocks(acts, course))
    precision = np.concatenate([rows.nominal_precision, np.zeros(len(acts))])
    size = inverse(columns.square() + np.diag(precision)) @ columns.crossed(fit.value[:, None])[:, 0]
    removed = [
        act.times(factor) for act, factor in zip(acts, size[rows.nuisance.width :].tolist(), strict=True)
    ]
    now = refitted(weighing.now, removed)
    return weighing_of(replace(now, acts=(*weighing.now.acts, *removed)), weighing.library)


def _accompanying(weighing: Weighing, fit: Fitted) -> list[Act]:
    """Possible forms and companions of the causes, and possible forms of the hull's own drag."""
    course = weighing.now.course
    return [
        *(act for drag in weighing.hull_drags for act in possible_forms(course, drag)),
        *(
            act
            for cause in fit.causes
            for acts_of in (possible_forms, companions)
            for act in acts_of(course, cause)
        ),
    ]


def _known(weighing: Weighing, fit: Fitted) -> Blocks:
    """The nominal columns, the slopes of a fit's causes, and their possible forms and companions."""
    rows = weighing.rows
    forms = rows.blocks(_accompanying(weighing, fit), weighing.now.course)
    return rows.nuisance.with_columns(rows.nuisance.blocks_of(fit.slopes)).with_columns(forms)


def _unexplained_of(weighing: Weighing, fit: Fitted, selectable: "_Selectable") -> Unexplained:
    course, known, at_sea = selectable.course, _known(weighing, fit), _at_sea(fit)
    axes = _judged_axes(weighing, fit, known)
    # An autopilot's filter corrects itself now and then, which looks like a burst.
    unfiltered = [axis for axis in axes if axis.dof not in weighing.now.filtered]

    def slow() -> list[_Weighed]:
        if at_sea or not slow_axes(weighing.now):
            return []
        slow = _slow(_without_remainder(weighing, fit).now if fit.causes else weighing.now)
        # A current that comes and goes is slow, too, and no form of it holds its whole course.
        drifts = SURGE_AND_SWAY if any(cause.act(course).water is not None for cause in fit.causes) else ()
        return [finding for finding in slow if finding.shape.dof not in drifts]

    tests: list[_Test] = [
        slow,
        *(partial(_of_axis, axis, selectable) for axis in axes),
        lambda: _bursts(unfiltered, course),
        *(partial(_lines, axis, course, at_sea) for axis in axes),
        lambda: [*_of_witnesses(weighing, fit.value, known)],
    ]
    kept = [item for item in _strongest_first(tests) if not selectable.is_slight(item)][:MOST]
    return Unexplained(
        tuple(item.shape for item in kept),
        tuple(item.gain for item in kept),
        tuple(item.size for item in kept),
        fit.motion_nats,
    )


def _judged_axes(weighing: Weighing, fit: Fitted, known: Blocks) -> list["_Axis"]:
    """The axes whose controller's readings and forces are known."""
    now, at_sea = weighing.now, _at_sea(fit)
    return [
        _axis_with_causes(weighing, fit.value, known, k, at_sea)
        for k, innovations in enumerate(weighing.rows.axes)
        if innovations.problem.axis.dof not in (*now.feedback_unrecorded, *now.force_undetermined)
    ]


def _strongest_first(tests: Sequence["_Test"]) -> list["_Weighed"]:
    """The forces that tests weigh, strongest first."""
    weighed = [each_item for item in side_by_side(lambda test: test(), tests) for each_item in item]
    return sorted(weighed, key=lambda each: -each.gain)


@dataclass(frozen=True)
class _Weighed:
    """A generic force, its nats, and the standard deviation of its force."""

    shape: GenericForce
    gain: float
    size: float


_Test = Callable[[], list[_Weighed]]


@dataclass(frozen=True)
class _Axis:
    """The rows of one axis: value (rows,), nuisance columns nominal (rows, m) with their precision (m,), and pieces."""

    innovations: AxisInnovations
    value: Array
    nominal: Array
    precision: Array
    piece: NDArray[np.intp]

    @property
    def dof(self) -> int:
        return self.innovations.problem.axis.dof

    def sums(self, candidates: Candidates) -> NormalEquations:
        """Normal equations of candidates."""
        return equations_of(self.value, self.nominal, self.precision, candidates)

    @cached_property
    def left(self) -> Array:
        """Residual (rows,) with the nuisance columns projected out."""
        square = self.nominal.T @ self.nominal + np.diag(self.precision)
        return np.asarray(self.value - self.nominal @ (inverse(square) @ (self.nominal.T @ self.value)))


def _axis_with_causes(weighing: Weighing, value: Array, known: Blocks, k: int, at_sea: bool) -> _Axis:
    """The rows of the k-th axis, with the nuisance columns of the causes, and of a steady push as large as the thrust
    curve's error: a vehicle that holds itself down all the time shows that of its weight.

    At sea, delayed thrust is a nuisance too: the controller answers the remainder of the sea's form, and thrust then
    seems to predict it.
    """
    rows, innovations, course = weighing.rows, weighing.rows.axes[k], weighing.now.course
    mine, nominal = known.slices[k], known.parts[k].values
    if at_sea:
        nominal = np.hstack([nominal, innovations.prewhitened(delayed_thrust(innovations))])
    axis, precision = innovations.problem.axis, _precision(rows, known, k, nominal)
    thrust = course.wrench_of(course.thrust_n)[:, axis.dof]
    off = LEAST_FORCE * float(np.sqrt(np.mean(thrust**2)))
    if off > 0:
        steady = innovations.prewhitened(innovations.by_force(np.full((len(axis.time_s), 1), off)))
        nominal, precision = np.hstack([nominal, steady]), np.append(precision, 1.0)
    return _Axis(innovations, value[mine], nominal, precision, rows.piece[mine])


def _precision(rows: Regression, known: Blocks, k: int, columns: Array) -> Array:
    """Prior precision of the columns of the k-th block, 0 for those after the nominal ones."""
    of = known.parts[k].of
    nominal = of[of < len(rows.nominal_precision)]
    return np.concatenate([rows.nominal_precision[nominal], np.zeros(columns.shape[1] - len(nominal))])


def _large(weigheds: Sequence[_Weighed], shares: Array, least: float) -> Iterator[_Weighed]:
    """The forces before the first small force, as later forces may be its remainder; a force with a timing of its own
    may be small, because no thrust curve causes it. shares (k,): of each that masses and dampings do not take up."""
    for weighed, share in zip(weigheds, shares.tolist(), strict=True):
        if weighed.size * share < least and weighed.shape.timing is None:
            return
        yield weighed


class _Selectable:
    """The forces that are selected one after another in the axes of a weighing, and their responses there: the same
    with any causes, and computed once for each axis."""

    def __init__(self, weighing: Weighing) -> None:
        self.course = _foreseen(weighing.now)
        self._dofs = [innovations.problem.axis.dof for innovations in weighing.rows.axes]
        self._thrust = self.course.wrench_of(self.course.thrust_n).std(axis=0)
        self._units: list[_Unit] = [(*unit, None) for unit in unit_forces(self.course, self._dofs)]
        self._units.append(("time", None, np.ones(len(self.course.nu)), "steady"))
        self._of: dict[int, tuple[list[_Unit], Candidates]] = {}

    def least_force(self, dof: int) -> float:
        """Force that a thrust curve's error may make up, N or N m."""
        return LEAST_FORCE * float(self._thrust[dof])

    def is_slight(self, item: _Weighed) -> bool:
        """Whether bursts, a line or a slow force are next to nothing beside the thrust; a reading error has no
        force."""
        shape = item.shape
        if shape.timing in SELECTED or item.size == 0:
            return False
        of_its_own = shape.timing == "intermittent" and self._changes(shape) < CHANGING
        return item.size < (LEAST_BURST if of_its_own else LEAST_TIMED) * float(self._thrust[shape.dof])

    def _changes(self, shape: GenericForce) -> float:
        """Power of the thrust's changes where a force pushes, over that of the dive; 0 where the thrust never
        changes."""
        thrust = self.course.wrench_of(self.course.thrust_n)[:, shape.dof]
        power, weight = np.diff(thrust, prepend=thrust[:1]) ** 2, shape.force**2
        usual = float(np.mean(weight)) * float(np.mean(power))
        return float(np.mean(weight * power)) / max(usual, 1e-300)

    def of(self, axis: _Axis) -> tuple[list[_Unit], Candidates]:
        """The forces of one axis, those of its own past included, and its responses to them."""
        if axis.dof not in self._of:
            others = [k for k in self._dofs if k != axis.dof]
            units = [
                *self._units,
                *((*unit, None) for unit in of_unit_spread(of_other_speeds(self.course, others))),
                *((*unit, "transient") for unit in of_unit_spread(of_the_past(self.course, axis.dof))),
            ]
            columns = axis.innovations.by_course(self.course, [force for _, _, force, _ in units])
            self._of[axis.dof] = units, Candidates(columns, axis.piece)
        return self._of[axis.dof]


def _of_axis(axis: _Axis, selectable: _Selectable) -> list[_Weighed]:
    """Forward selection of the forces that predict one axis."""
    shapes, candidates = selectable.of(axis)
    sums = axis.sums(candidates)
    kept, gains = _one_after_another(sums, len(shapes))
    sizes = np.abs(sums.evidence(kept).size) if kept else np.zeros(0)
    weigheds = [
        _Weighed(GenericForce(axis.dof, *shapes[k]), gain, float(size))
        for k, gain, size in zip(kept, gains, sizes, strict=True)
    ]
    return [*_large(weigheds, _shares_beyond(sums, candidates, kept), selectable.least_force(axis.dof))]


def _shares_beyond(sums: NormalEquations, candidates: Candidates, kept: Sequence[int]) -> Array:
    """Share of each force, in what the filters see of it, that no mass, damping or form of a cause takes up.

    Thrust, drag and inertia nearly cancel, so that a thrust of any size, with masses and dampings as much larger, may
    stand for next to nothing.
    """
    columns = candidates.columns[:, [*kept]]
    squares = sums.square[[*kept], [*kept]]
    return np.asarray(np.sqrt(squares / np.maximum((columns**2).sum(axis=0), 1e-300)))


def _one_after_another(sums: NormalEquations, count: int) -> tuple[list[int], list[float]]:
    """Forward selection among `count` columns, with the nats that each adds to the columns before it."""
    kept: list[int] = []
    gains: list[float] = []
    while len(kept) < MOST:
        open_columns = [k for k in range(count) if k not in kept and sums.telling[k]]
        nats = sums.fitted([(*kept, k) for k in open_columns])
        best_in_sample = np.argsort(-nats, kind="stable")[:WEIGHED].tolist()
        tried = [(sums.evidence([*kept, open_columns[i]]).gain, open_columns[i]) for i in best_in_sample]
        gain, best = max(tried, default=(-np.inf, -1))
        if gain - sum(gains) < LEAST_STEP:
            break
        kept.append(best)
        gains.append(gain - sum(gains))
    return kept, gains


def _of_witnesses(weighing: Weighing, value: Array, known: Blocks) -> Iterator[_Weighed]:
    """Constant or drifting errors of heading and accelerometer: reading errors, so of no force.

    Shafts are left out: they show how a thruster answers its pulse, and functions of thrust cover that.
    """
    rows, course = weighing.rows, weighing.now.course
    units: tuple[tuple[Array, Timing], ...] = (
        (np.ones(len(course.nu)), "steady"),
        (2.0 * course.since_s / course.since_s[-1] - 1.0, "drifting"),
    )
    for block, weighed in enumerate(rows.witnesses, len(rows.axes)):
        mine, nominal = known.slices[block], known.parts[block].values
        if weighed.witness.kind == "shaft":
            continue
        columns = weighed.whitened(np.column_stack([weighed.witness.bins.along(unit) for unit, _ in units]))
        precision = _precision(rows, known, block, nominal)
        sums = equations_of(value[mine], nominal, precision, Candidates(columns, rows.piece[mine]))
        kept, gains = _one_after_another(sums, len(units))
        is_accelerometer = weighed.witness.kind == "specific_force"
        dof = weighed.witness.number if is_accelerometer else 5
        sizes = sums.evidence(kept).size if kept else np.zeros(0)
        for k, gain, size in zip(kept, gains, sizes.tolist(), strict=True):
            # Evidence for an accelerometer's error is limited by its usual zero error.
            most_nats = 0.5 * (size / ZERO_M_S2) ** 2 if is_accelerometer else np.inf
            yield _Weighed(
                GenericForce(dof, "time", None, units[k][0], units[k][1]), min(gain, most_nats), 0.0
            )


def _lines(axis: _Axis, course: Course, at_sea: bool) -> list[_Weighed]:
    """The likeliest spectral line, as others may be its sidebands; in time none at sea, because a sea has more lines
    than its form."""
    if axis.dof in LEVELLED:
        return []
    lines = clusters(axis.innovations, axis.left, course)
    clusters_left = [line for line in lines if not (at_sea and line.clock.by == "time")]
    if not clusters_left:
        return []
    forces = [cluster_forces.forces() for cluster_forces in clusters_left]
    columns = axis.innovations.by_course(course, [*np.vstack(forces)])
    sums = axis.sums(Candidates(columns, axis.piece))
    ends = np.cumsum([len(cluster_forces) for cluster_forces in forces]).tolist()
    weighed = [
        sums.evidence(range(end - len(of_line), end)) for of_line, end in zip(forces, ends, strict=True)
    ]
    gains = [
        cluster_forces.gain - cluster.price_nats
        for cluster_forces, cluster in zip(weighed, clusters_left, strict=True)
    ]
    best = int(np.argmax(gains))
    force = weighed[best].size @ forces[best]
    size = float(np.std(force))
    if gains[best] < LEAST_STEP or size == 0:
        return []
    by: Variable = "time" if clusters_left[best].clock.by == "time" else "speed"
    return [_Weighed(GenericForce(axis.dof, by, None, force / size, "periodic"), gains[best], size)]


def _bursts(axes: list[_Axis], course: Course) -> list[_Weighed]:
    """The likeliest burst, as many lengths fit the same burst."""
    able = {axis.dof: (axis.innovations, axis.left) for axis in axes if axis.dof not in LEVELLED}
    best = max(bursts(able, course.time_s, course.runs_s), key=lambda each: each.gain, default=None)
    if best is None or best.gain < LEAST_STEP:
        return []
    force = best.force(course.time_s)
    size = float(np.std(force))
    if size == 0:
        return []
    return [_Weighed(GenericForce(best.dof, "time", None, force / size, "intermittent"), best.gain, size)]


def _slow(now: Nominal) -> Iterator[_Weighed]:
    """The slow part of an axis's disturbance, whose correlation time exceeds a sea's."""
    for burst in slow_forces(now):
        size = float(np.std(burst.force))
        if burst.gain > LEAST_STEP and size > 0:
            force = burst.force / size
            yield _Weighed(GenericForce(burst.dof, "time", None, force, "drifting"), burst.gain, size)
