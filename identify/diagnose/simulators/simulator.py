"""A simulator's model as it is known by a dive of its own, held while a real dive is diagnosed."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import MASSES
from bridge.vehicle.config import Prior
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.filters.nominal import Nominal, hull_indices, refitted
from identify.diagnose.result import Diagnosis, Value
from identify.estimators.likelihood.axis import AxisLikelihood
from identify.statistics import Z95

LEAST = 1e-9
"""A drag that is accepted as zero."""

HELD_STD = 1e-3
"""Relative width of masses and dampings held at the simulator's values, against a refit."""


@dataclass(frozen=True)
class Simulator:
    """A simulator's model.

    values: coefficients of the nominal model by name, as far as its recording determines them; causes: its own
    effects, which hold on any dive.
    """

    values: Mapping[str, Value]
    causes: tuple[Cause, ...]

    def filters_of(self, nominal: Nominal) -> Nominal:
        """A dive's filters with the simulator's parameters and effects alone; trims and noise levels are the dive's
        own.

        Of an interval for a mass or damping, the value nearest to the dive's is held: an undetermined value is no
        error of the simulator.
        """
        joint = nominal.joint
        theta = nominal.theta.copy()
        for problem, of_axis in zip(joint.problems, joint.slices, strict=True):
            for k, log in self._logs(problem, nominal.theta[of_axis]).items():
                theta[of_axis.start + k] = log
        held = tuple(
            self._held(problem, nominal.theta[of_axis])
            for problem, of_axis in zip(joint.problems, joint.slices, strict=True)
        )
        locked = replace(joint, problems=held, apart_prior=self._apart(nominal))
        acts = [cause.act(nominal.course) for cause in self.causes]
        return refitted(replace(nominal, joint=locked, theta=theta), acts)

    def _held(self, problem: AxisLikelihood, theta: Array) -> AxisLikelihood:
        mean, precision = problem.prior_mean.copy(), problem.prior_precision.copy()
        for k, log in self._logs(problem, theta).items():
            mean[k], precision[k] = log, HELD_STD**-2
        return replace(problem, prior_mean=mean, prior_precision=precision)

    def _apart(self, nominal: Nominal) -> Array:
        prior = nominal.joint.apart_prior.copy()
        for k, dof in enumerate(nominal.joint.apart):
            mass = self.values.get(MASSES[dof].name)
            if mass is not None:
                prior[k] = _nearest(mass, float(np.log(nominal.course.mass[dof]))), HELD_STD**-2
        return prior

    def _logs(self, problem: AxisLikelihood, theta: Array) -> dict[int, float]:
        """Logarithms of an axis's mass and drags by their indices in its theta; empty if the simulator lacks the mass
        or the drag, of two drags the linear."""
        indices = hull_indices(problem)
        if not {*list(indices)[:2]} <= self.values.keys():
            return {}
        return {
            k: _nearest(self.values[name], theta[k]) for name, k in indices.items() if name in self.values
        }


def priors_of(simulator: Simulator) -> dict[str, Prior]:
    """Its masses and dampings with their widths, as priors for the real dive."""
    return {
        name: Prior(
            value.value, (value.high95 - value.low95) / (2 * Z95), "the simulator's recording", "thrust"
        )
        for name, value in simulator.values.items()
        if value.high95 > value.low95
    }


def _nearest(value: Value, log_here: float) -> float:
    """The logarithm within the interval that is nearest to `log_here`."""
    low, high = np.log(np.maximum([value.low95, value.high95], LEAST))
    return float(np.clip(log_here, low, high))


def simulator_of(diagnosis: Diagnosis) -> Simulator:
    """Build the simulator's model from the diagnosis of its own recording."""
    causes = tuple(finding.cause for finding in diagnosis.findings if finding.cause.effect.lasting)
    return Simulator(diagnosis.numbers, causes)
