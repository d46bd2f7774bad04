"""A rival's answer to a dive: names, and a model of the missing force that can be simulated on another dive."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.align import low_pass
from identify.diagnose.candidates import Cause
from identify.diagnose.nominal import Nominal
from identify.diagnose.shrink import flight_of
from identify.diagnose.simulation import Simulation, simulation_of
from identify.effects.course import Course
from identify.effects.effect import Act, Effect
from identify.estimators.likelihood_axis import DISTURBANCE

RATE_HZ = 5.0
SMOOTH_HZ = 1.0


@dataclass(frozen=True)
class Said:
    """A rival's answer.

    names: effects with the number of the thruster, 0 for all, strongest first; empty if the rival sees no gap or
    can't name any. causes: the missing forces, simulated together with the nominal model `now`.
    """

    names: tuple[tuple[str, int], ...]
    causes: tuple[Cause, ...]
    now: Nominal


@dataclass(frozen=True)
class Missing:
    """The force that the nominal model lacks.

    wrench (m, 6): in standard deviations of the disturbance, at the places `at` (m,) of the course; std (6,): of the
    disturbance, N and N m; dofs: the fitted degrees of freedom.
    """

    wrench: Array
    std: Array
    at: NDArray[np.intp]
    dofs: tuple[int, ...]


def missing(nominal: Nominal) -> Missing:
    """The force that would make the nominal model follow the smoothed velocity, low-passed at SMOOTH_HZ."""
    course = nominal.course
    along = simulation_of(nominal, nominal.theta, nominal.motion.nu)
    rate_hz = 1.0 / along.step_s
    slow = low_pass(along.lacking, rate_hz, SMOOTH_HZ)
    grid = np.arange(0, len(slow), max(round(rate_hz / RATE_HZ), 1))
    std = np.ones(6)
    for problem, of_axis in zip(nominal.joint.problems, nominal.joint.slices, strict=True):
        std[problem.axis.dof] = float(np.exp(nominal.theta[of_axis][DISTURBANCE]))
    at = np.searchsorted(course.time_s, along.time_s[grid] - 1e-9)
    return Missing(slow[grid] / std, std, at, along.dofs)


def pushing(name: str, wrench: Callable[[Course], Array]) -> Cause:
    """A cause that exerts the given wrench (n, 6) along a course, N and N m."""

    def act(course: Course, _: Array) -> Act:
        return Act(wrench=wrench(course))

    return Cause(Effect(name, "", "force", (), act, ""), np.zeros(0))


HORIZON_S = 5.0


def closed(said: Said, nominal: Nominal, check: Nominal) -> tuple[Array, Array]:
    """Rms drifts (6,) after 5 s on the check dive, by the nominal model and with the rival's causes; m/s and rad/s.

    Masses, dampings and causes are those of the first dive; trims are the check dive's own, as for the diagnosis.
    """
    flight = flight_of(said.now, said.causes, nominal, check)
    return _drift(flight.before), _drift(flight.after)


def _drift(model: Simulation) -> Array:
    length = round(HORIZON_S / model.step_s)
    starts = np.arange(0, len(model.time_s) - length - 1, length)
    off = model.off(starts, [length], np.zeros_like(model.nu))[:, 0]
    return np.asarray(np.sqrt(np.mean(off**2, axis=0)))
