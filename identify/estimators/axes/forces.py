"""Forces of an axis in the steps between its events: thrust less restoring, Coriolis, and their errors of timing.

Coriolis forces couple the axes through products of velocities. They are formed from smoothed velocities, so that six
filters of one axis each replace a filter with twelve states. `coupled` forms them again from better velocities.
"""

from dataclasses import replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import HEAVE
from identify.estimators.axes.axis import Axes, Axis
from identify.estimators.axes.events import Events
from identify.estimators.axes.motion import Motion
from identify.estimators.timing.lateness import (
    FilteredForce,
    Timing,
    behind_filter,
    timing_of,
)
from identify.thrust.wrench_history import WrenchHistory

LATE_SHARE = 0.3
"""Standard deviation of the time at which slowly sampled commands act, as a share of the sample interval."""


def step_forces(events: Events, forces: WrenchHistory, motion: Motion, restoring_n: Array) -> Array:
    """Thrust less restoring force in the halves of each step, (n, 2)."""
    before = events.before_s
    force = forces.along(events.dof).halves_between(before, events.time_s)[:, :, 0]
    held = motion.mean_between(restoring_n, before, events.time_s)
    return np.asarray(force - held[:, None])


def step_forces_behind_filter(
    events: Events, forces: WrenchHistory, grid: Array, restoring_n: Array, smoothing_s: float
) -> tuple[Array, tuple[Timing, ...]]:
    """The force (n, 2) filtered like the readings of an autopilot's own filter, and their timing errors."""
    push = FilteredForce(grid, forces.along(events.dof).at(grid)[:, 0] - restoring_n)
    return _filtered(events, push, smoothing_s)


def _filtered(events: Events, push: FilteredForce, smoothing_s: float) -> tuple[Array, tuple[Timing, ...]]:
    before = events.before_s
    force = push.behind(smoothing_s).mean_between(before, events.time_s)
    timing = timing_of(push, smoothing_s, before, events.time_s, events.dof == HEAVE)
    return np.column_stack([force, force]), timing


def change_if_stepped(events: Events, forces: WrenchHistory, grid: Array, smoothing_s: float) -> Array | None:
    """Change of the force of each step (n,), as the readings show it, if slow samples step halfway to the next."""
    if forces.stepped is None:
        return None
    straight, stepped = (history.along(events.dof) for history in (forces, forces.stepped))
    before = events.before_s
    if smoothing_s > 0:
        push = FilteredForce(grid, (stepped.at(grid) - straight.at(grid))[:, 0])
        return push.behind(smoothing_s).mean_between(before, events.time_s)
    both = (history.mean_between(before, events.time_s)[:, 0] for history in (stepped, straight))
    return np.subtract(*both)


def with_uncertain_timing(axis: Axis, forces: WrenchHistory, spread_s: float) -> Axis:
    """Return the axis with a timing error of its commands of that standard deviation, in addition to any other."""
    before, apart_s = axis.before_s, 0.5 * spread_s / LATE_SHARE
    push = forces.along(axis.dof)
    early, late = (push.mean_between(before + by_s, axis.time_s + by_s)[:, 0] for by_s in (apart_s, -apart_s))
    timing: tuple[Timing, ...] = (Timing((late - early) / (2.0 * apart_s), spread_s),)
    if axis.timing:
        first, *others = axis.timing
        timing = (replace(first, spread=float(np.hypot(first.spread, spread_s))), *others)
    return replace(axis, timing=timing)


def with_uncertain_stamps(axis: Axis, forces: WrenchHistory, spread_s: float) -> Axis:
    """Return the axis with an error of that standard deviation in the time at which its known commands act.

    Its force is made of earlier thrust alone, as that of `lateness.by_lateness`: thrust that came sooner would know,
    through the controller, the noise of later readings.
    """
    before, apart_s = axis.before_s, 0.5 * spread_s / LATE_SHARE
    push = forces.along(axis.dof)
    now, late = (push.mean_between(before - by_s, axis.time_s - by_s)[:, 0] for by_s in (0.0, apart_s))
    return replace(axis, timing=(Timing((late - now) / apart_s, spread_s),))


def axes_with_delay(built: Axes, forces: WrenchHistory, by_s: float) -> Axes:
    """Return the axes, which were built with these forces, for forces that act `by_s` later."""
    return replace(built, axes=tuple(axis_with_delay(axis, built, forces, by_s) for axis in built.axes))


def axes_with_forces(built: Axes, forces: WrenchHistory, other: WrenchHistory) -> Axes:
    """Return the axes, which were built with these forces, for other forces; none is read through an autopilot's
    filter."""

    def moved(axis: Axis) -> Axis:
        halves = [
            history.along(axis.dof).halves_between(axis.before_s, axis.time_s)[:, :, 0]
            for history in (other, forces)
        ]
        return replace(axis, force=axis.force + halves[0] - halves[1])

    return replace(built, axes=tuple(moved(axis) for axis in built.axes))


def axis_with_delay(axis: Axis, built: Axes, forces: WrenchHistory, by_s: float) -> Axis:
    """Return an axis of `built`, which was built with these forces, for forces that act `by_s` later."""
    before, grid = axis.before_s, built.motion.time_s
    forces = forces.along(axis.dof)
    if not axis.is_coloured:
        moved = forces.halves_between(before - by_s, axis.time_s - by_s) - forces.halves_between(
            before, axis.time_s
        )
        return replace(axis, force=axis.force + moved[:, :, 0])
    push = FilteredForce(grid, forces.at(grid - by_s)[:, 0] - built.restoring[axis.dof])
    force, timing = _filtered(axis, push, axis.smoothing_s)
    return replace(axis, force=force, timing=(*timing, *axis.timing[len(timing) :]))


def coupled(axis: Axis, motion: Motion) -> Axis:
    """Return the axis with the Coriolis forces and its own speed from a motion: means over each step, filtered like
    its readings."""
    coriolis, speed, before_filter = coupling(axis, motion, axis.smoothing_s)
    return replace(axis, coriolis=coriolis, speed=speed, before_filter=before_filter)


def coupling(events: Events, motion: Motion, smoothing_s: float) -> tuple[Array, Array, Array]:
    """Coriolis forces (n, 6), own speed (n,) and the speed before an autopilot's smoothing (n,), by a motion."""
    before = events.before_s

    def shown(values: Array) -> Array:
        step_s = float(motion.time_s[1] - motion.time_s[0])
        smooth = behind_filter(values[:, None], step_s, smoothing_s)[:, 0]
        return motion.mean_between(smooth, before, events.time_s)

    columns = [
        -shown(force) if force.any() else np.zeros(len(before)) for force in motion.coriolis[events.dof]
    ]
    nu = motion.nu[:, events.dof]
    return np.column_stack(columns), shown(nu), motion.mean_between(nu, before, events.time_s)
