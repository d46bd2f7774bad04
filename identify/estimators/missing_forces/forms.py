"""Forms of forces that a fit's model lacks, of a few general kinds, at the events of an axis.

Each kind is a few forces whose sizes are not known. None is of the axis's speed itself: noise in a speed that is read
would count as a force.
"""

from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import ROLL, SURGE, SWAY, YAW
from identify.dive import Dive
from identify.estimators.axes.axis import Axes, Axis
from identify.estimators.likelihood.axis import AxisLikelihood
from identify.ingest.rotation import attitude_at, euler_angles, to_body

SMALL_THRUST = 0.2
"""Share of the usual thrust below which a dead zone shows."""

EVERY = 5
"""Attitudes are computed at one in EVERY of the motion's times: a hull turns little in a tenth of a second."""


class Kind(Enum):
    """Kinds of force."""

    WORLD = "world"
    THRUST = "thrust"
    ACROSS = "across"
    TURNING = "turning"
    SWING = "swing"


@dataclass(frozen=True)
class Forms:
    """The forms of forces that are tested on a dive."""

    built: Axes
    dive: Dive

    def of(self, problem: AxisLikelihood) -> dict[Kind, Array]:
        """Forces (n, k) by kind at the events of an axis, without the kinds that can't be formed there."""
        forms = {
            Kind.WORLD: self._world(problem.axis),
            Kind.THRUST: self._thrust(problem.axis),
            Kind.ACROSS: self._across(problem.axis),
            Kind.TURNING: self._turning(problem.axis),
        }
        known = {kind: np.column_stack(columns) for kind, columns in forms.items() if columns}
        return {kind: columns for kind, columns in known.items() if np.isfinite(columns).all()}

    def swing(self, axis: Axis, period_s: float) -> Array:
        """Forces (n, k) with a period, along the world's axes for surge and sway."""
        angle, level = 2.0 * np.pi / period_s * axis.time_s, [np.ones(len(axis.time_s))]
        if axis.dof in (SURGE, SWAY) and self.dive.attitude is not None:
            level = [self._at_events(axis, way[:, axis.dof]) for way in self._north_east]
        return np.column_stack([wave(angle) * along for along in level for wave in (np.sin, np.cos)])

    def _world(self, axis: Axis) -> list[Array]:
        """A force to the north, to the east, and back to a place; in yaw, moments of the heading and of twice it."""
        if self.dive.attitude is None or axis.dof not in (SURGE, SWAY, YAW):
            return []
        if axis.dof == YAW:
            angles = (self._heading, 2.0 * self._heading)
            return [self._at_events(axis, wave(angle)) for angle in angles for wave in (np.sin, np.cos)]
        return [self._at_events(axis, way[:, axis.dof]) for way in (*self._north_east, self._back)]

    def _thrust(self, axis: Axis) -> list[Array]:
        """Thrust that is missing near zero, differs ahead and astern, or fades; none where only its means are known."""
        if axis.dof not in self.built.pushed or axis.sampled_s or axis.smoothing_s:
            return []
        force = axis.force.mean(axis=1)
        small = SMALL_THRUST * float(np.sqrt(np.mean(force**2)))
        return [np.tanh(force / max(small, 1e-9)), np.abs(force), (axis.time_s - axis.time_s[0]) * force]

    def _across(self, axis: Axis) -> list[Array]:
        """The thrust of each other axis, but of sway in surge and of surge in sway, which have a test in
        `checks.fit.hardly_this_vehicle`; none where only its means are known."""
        if axis.sampled_s or axis.smoothing_s:
            return []
        return [
            other.thrust_over(axis)
            for other in self.built.axes
            if other.dof in self.built.pushed and {axis.dof, other.dof} not in ({axis.dof}, {SURGE, SWAY})
        ]

    def _turning(self, axis: Axis) -> list[Array]:
        """Forces in proportion to the rates of turn and to their change."""
        if axis.dof >= ROLL:
            return []
        nu, time_s = self.built.motion.nu, self.built.motion.time_s
        rates = [nu[:, dof] for dof in range(ROLL, YAW + 1) if nu[:, dof].any()]
        forms = [form[::EVERY] for rate in rates for form in (rate, np.gradient(rate, time_s))]
        return [self._at_events(axis, form) for form in forms]

    def _at_events(self, axis: Axis, form: Array) -> Array:
        """A form at the attitudes' times, in the middle of each step (n,), as the readings show it."""
        return np.asarray(np.interp(axis.shown_s - 0.5 * axis.step_s, self._time_s, form))

    @cached_property
    def _time_s(self) -> Array:
        return self.built.motion.time_s[::EVERY]

    @cached_property
    def _attitude(self) -> Array:
        assert self.dive.attitude is not None
        return attitude_at(self.dive.attitude, self._time_s)

    @cached_property
    def _heading(self) -> Array:
        return euler_angles(self._attitude)[2]

    @cached_property
    def _north_east(self) -> tuple[Array, Array]:
        """North and east in body axes, (t, 3) each."""
        north, east = (
            to_body(self._attitude, np.tile(axis, (len(self._time_s), 1))) for axis in np.eye(3)[:2]
        )
        return north, east

    @cached_property
    def _back(self) -> Array:
        """The way back to where each run began, in body axes (t, 3), by dead reckoning in the horizontal plane."""
        motion = self.built.motion
        nu, cuts = motion.nu[::EVERY, :3], np.searchsorted(self._time_s, motion.breaks_s)

        def way(axis: Array) -> Array:
            runs = np.split(np.sum(axis * nu, axis=1), cuts)
            return axis * (np.concatenate([*map(np.cumsum, runs)]) * self._step_s)[:, None]

        north, east = map(way, self._north_east)
        return np.asarray(-(north + east))

    @property
    def _step_s(self) -> float:
        return float(self._time_s[1] - self._time_s[0])
