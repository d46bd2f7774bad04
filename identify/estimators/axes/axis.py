"""An axis as its filter sees it: the events of one degree of freedom, and the forces in the steps between them."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import COEFFICIENTS, PITCH, ROLL
from identify.dive import STAMPED_S
from identify.estimators.axes.events import Events
from identify.estimators.axes.motion import Motion
from identify.estimators.timing.lateness import (
    LATER_S,
    Timing,
    by_lateness,
    means_behind_filter,
)

BRACKETS, SMALLEST_SPEED = 12, 1e-3
"""Number of speed brackets, and smallest width of all together, m/s or rad/s. Within a bracket the slope of quadratic
drag counts as constant."""


@dataclass(frozen=True)
class Brackets:
    """Brackets of an axis's speed, within which the slope of its square counts as constant.

    slopes (k,): derivative of speed times its magnitude, in the middle of each bracket. slope (n,): the slope of each
    event's bracket. step (n,): the row for this event in a table of all distinct steps in all brackets; without a step
    as in the axis. about (2, n): force of a unit of quadratic damping at the events in addition to a linear damping of
    that slope, first without the drag of the axis's own speed, then with it.
    """

    slopes: Array
    slope: Array
    step: NDArray[np.int64]
    about: Array


@dataclass(frozen=True)
class Axis(Events):
    """One degree of freedom: its events, and the forces in the steps between them.

    force (n, 2): thrust less restoring force in the first and the second half of the step before the event.
    coriolis (n, 6): force per unit of each total mass.
    stiffness: restoring moment per angle, for roll and pitch.
    speed (n,): the axis's own speed over each step; before_filter (n,): the same before an autopilot's smoothing, whose
    square gives the quadratic drag. quadratic: quadratic damping that is known beforehand.
    misread (k,), like different_s, or (1,): standard deviation of the moment that drift's misread velocities make over
    such a step, per inertia, rad/s2, as part of the disturbance.
    white_force: force that the log hides of the commands, N (N m) per root of 1/s; 0 if it hides nothing.
    timing: timing errors of the readings of an autopilot's own filter, of slow samples of the commands, and of stamps.
    trim_of_run: number of the trim force of each run, from 0; each has its own, unless all have one in common.
    smoothing_s: time constant of that filter. sampled_s: interval of the command samples, 0 if the commands are known
    at all times. unknown_s: the interval between which this axis's thrust may answer unseen (`WrenchHistory`).
    stepped (n,): change of the force if slow samples step halfway to the next instead of going straight
    to it; None without such samples.
    """

    force: Array
    coriolis: Array
    stiffness: float
    speed: Array
    before_filter: Array
    quadratic: float = 0.0
    misread: Array = field(default_factory=lambda: np.zeros(1))
    white_force: float = 0.0
    timing: tuple[Timing, ...] = ()
    smoothing_s: float = 0.0
    sampled_s: float = 0.0
    unknown_s: float = 0.0
    stepped: Array | None = None
    trim_of_run: tuple[int, ...] = (0,)

    @cached_property
    def coupled_dofs(self) -> frozenset[int]:
        """Degrees of freedom whose masses act here by Coriolis forces."""
        return frozenset(np.flatnonzero(self.coriolis.any(axis=0)).tolist())

    @cached_property
    def brackets(self) -> Brackets:
        return self._bracketed(BRACKETS, 2.0)

    @cached_property
    def one_bracket(self) -> Brackets:
        """A single bracket with slope zero, for linear damping."""
        return self._bracketed(1, 0.0)

    def thrust_over(self, other: "Axis") -> Array:
        """Mean force (n,) of this axis over each step of another."""
        impulse = np.cumsum(self.force.mean(axis=1) * self.step_s)
        gained = np.diff(np.interp(other.time_s, self.time_s, impulse), prepend=0.0)
        some = other.step_s > 0
        return np.asarray(np.where(some, gained / np.where(some, other.step_s, 1.0), 0.0))

    def _bracketed(self, count: int, slope_by_speed: float) -> Brackets:
        size = np.abs(self.speed)
        width = max(float(np.max(size)), SMALLEST_SPEED) / count
        slopes = np.asarray(slope_by_speed * width * (np.arange(count) + 0.5), dtype=np.float64)
        bracket = np.minimum(size / width, count - 1).astype(np.int64)
        slope = np.asarray(slopes[bracket], dtype=np.float64)
        step = np.where(self.step < 0, self.step, self.step * count + bracket)
        braked = slope * self.speed
        return Brackets(slopes, slope, step, np.stack([braked, braked - self.squared]))

    @cached_property
    def squared(self) -> Array:
        """Speed times its magnitude (n,) over each step, as the readings show it: a fast hull's drag is over before an
        autopilot's filter shows the speed that made it."""
        values = np.asarray(self.before_filter * np.abs(self.before_filter))
        if self.smoothing_s <= 0:
            return values
        return np.concatenate(
            [means_behind_filter(values[run], self.step_s[run], self.smoothing_s) for run in self.runs]
        )

    @property
    def stamped_s(self) -> float:
        """Standard error of the time at which thrust acts, as far as stamps tell it."""
        return self.timing[0].spread if self.timing and not self.is_coloured else STAMPED_S

    @property
    def trims(self) -> int:
        """Number of trim forces."""
        return max(self.trim_of_run) + 1

    def by_lateness(self, lag_s: float = LATER_S) -> Array:
        """Change of the force of each step (n,), per second that it comes later (`lateness.by_lateness`)."""
        return np.concatenate(
            [by_lateness(self.force[run], 0.5 * self.step_s[run], lag_s) for run in self.runs]
        )

    @property
    def shown_s(self) -> Array:
        """Times (n,) of the motion that an autopilot's filter shows at the events, on average."""
        return np.asarray(self.time_s - self.smoothing_s)


@dataclass(frozen=True)
class Axes:
    """The axes that a dive has information on, the reasons why other axes are missing, and notes on the forces.

    motion: the velocities that the Coriolis forces were made of. restoring: restoring force by degree of freedom,
    (m,) at the times of the motion, without the part that the stiffness makes of an axis's own integral. strange: why
    the recording can hardly be of this vehicle in this configuration; empty if it can. unpushed: the axes that no
    thruster pushed, each with a sentence; only the other axes' forces and the righting moment moved them, if anything
    did.
    """

    axes: tuple[Axis, ...]
    missing: dict[int, str]
    notes: tuple[str, ...]
    strange: str
    motion: Motion
    restoring: dict[int, Array]
    unpushed: dict[int, str]

    @property
    def pushed(self) -> tuple[int, ...]:
        """The axes that thrust moved."""
        return tuple(axis.dof for axis in self.axes if axis.dof not in self.unpushed)

    def with_common_trims(self) -> "Axes":
        """The same axes, with a trim force that all runs have in common."""
        common = (replace(axis, trim_of_run=(0,) * len(axis.runs)) for axis in self.axes)
        return replace(self, axes=tuple(common))

    @property
    def rest_on_righting(self) -> tuple[str, ...]:
        """The coefficients of roll and pitch if no thruster pushed there: the righting moment sets their scale."""
        return tuple(c.name for c in COEFFICIENTS if c.dof in (ROLL, PITCH) and c.dof in self.unpushed)
