"""A simulator's model, as diagnosed from its own recording, for comparison with a real dive."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import Prior
from identify.diagnose.candidates import Cause
from identify.diagnose.nominal import Nominal, refitted
from identify.diagnose.result import Diagnosis, Value
from identify.estimators.likelihood_axis import DAMPING, MASS, AxisLikelihood
from identify.identification import Z95

Array = NDArray[np.float64]

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

    def beside(self, nominal: Nominal) -> Nominal:
        """A dive's filters with the simulator's parameters and effects alone; trims and noise levels are the dive's
        own.

        Of an interval for a mass or damping, the value nearest to the dive's is held: an undetermined value is no
        error of the simulator.
        """
        joint = nominal.joint
        theta = nominal.theta.copy()
        for problem, place in zip(joint.problems, joint.places, strict=True):
            logs = self._logs(problem.axis.dof, nominal)
            if logs is not None:
                theta[place.start + MASS], theta[place.start + DAMPING] = logs
        held = tuple(self._held(problem, nominal) for problem in joint.problems)
        locked = replace(joint, problems=held, apart_prior=self._apart(nominal))
        acts = [cause.act(nominal.course) for cause in self.causes]
        return refitted(replace(nominal, joint=locked, theta=theta), acts)

    def _held(self, problem: AxisLikelihood, nominal: Nominal) -> AxisLikelihood:
        logs = self._logs(problem.axis.dof, nominal)
        if logs is None:
            return problem
        mean, precision = problem.prior_mean.copy(), problem.prior_precision.copy()
        mean[MASS], mean[DAMPING] = logs
        precision[[MASS, DAMPING]] = HELD_STD**-2
        return replace(problem, prior_mean=mean, prior_precision=precision)

    def _apart(self, nominal: Nominal) -> Array:
        prior = nominal.joint.apart_prior.copy()
        for k, dof in enumerate(nominal.joint.apart):
            logs = self._logs(dof, nominal)
            if logs is not None:
                prior[k] = logs[0], HELD_STD**-2
        return prior

    def _logs(self, dof: int, nominal: Nominal) -> tuple[float, float] | None:
        """Logarithms of a degree of freedom's mass and damping; None if the simulator lacks either."""
        mass, damping = (self.values.get(coefficient.name) for coefficient in (MASSES[dof], DAMPINGS[dof]))
        if mass is None or damping is None:
            return None
        return _nearest(mass, nominal.course.mass[dof]), _nearest(damping, nominal.course.damping[dof])


def priors_of(simulator: Simulator) -> dict[str, Prior]:
    """Its masses and dampings with their widths, as priors for the real dive."""
    return {
        name: Prior(
            value.value, (value.high95 - value.low95) / (2 * Z95), "the simulator's recording", "thrust"
        )
        for name, value in simulator.values.items()
        if value.high95 > value.low95
    }


def _nearest(value: Value, own: float) -> float:
    """The logarithm of the value nearest to `own` within the interval."""
    return float(np.log(np.clip(own, value.low95, value.high95)))


def simulator_of(diagnosis: Diagnosis) -> Simulator:
    """Build the simulator's model from the diagnosis of its own recording."""
    causes = tuple(finding.cause for finding in diagnosis.findings if finding.cause.effect.lasting)
    return Simulator(diagnosis.numbers, causes)
