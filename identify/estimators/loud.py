"""Readings whose fitted noise is a good part of all that they say: a fit that calls motion noise follows none of it."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES
from identify.estimators.innovations import INCREMENT, POSITION
from identify.estimators.likelihood_axis import AxisLikelihood
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.readings import Channel
from identify.identification import Doubt, Outcome

Array = NDArray[np.float64]

LOUD = 0.2
"""Of a reading's standard deviation: noise above it is told."""

INFLATED = 2.0
"""A fitted noise so many times that which the readings show by themselves is no sensor's, but what the model lacks."""

LEAST = 1e-3
"""m, m/s, rad or rad/s: a noise below that is nobody's concern."""

FEWEST = 20

NAMES = {
    "dvl": "the DVL",
    "filter": "the autopilot's velocity",
    "gyro": "the gyro",
    "fog": "the fibre-optic gyro",
    "attitude": "the attitude",
    "depth": "the depth",
}


@dataclass(frozen=True)
class Loud:
    """A sensor whose fitted noise is more than LOUD of its signal in a degree of freedom, both standard deviations in
    `unit`. inflated: whether its readings by themselves show far less noise; pushed: whether thrust moved the axis."""

    dof: int
    sensor: str
    noise: float
    signal: float
    unit: str
    inflated: bool
    pushed: bool

    @property
    def sentence(self) -> str:
        """Of inflated noise."""
        return (
            f"In {DOFS[self.dof]} the fit takes {self.noise:.3g} {self.unit} of what {self.sensor} reads for noise, of "
            f"{self.signal:.3g} {self.unit} in all, and its readings are far quieter than that: the model does not "
            f"follow them; check the unit and sign of {self.sensor}, and that the vehicle file is this vehicle's."
        )


def loud(joint: JointLikelihood, theta: Array, pushed: Collection[int]) -> tuple[Loud, ...]:
    """The loud sensors at theta: of all axes where their noise is inflated, else of those that thrust `pushed`."""
    every = (
        one
        for problem, place in zip(joint.problems, joint.places, strict=True)
        for one in _of_axis(problem, theta[place], problem.axis.dof in pushed)
    )
    return tuple(one for one in every if one.inflated or one.pushed)


def loud_doubts(found: Sequence[Loud]) -> tuple[Doubt, ...]:
    """A doubt of each axis whose noise is inflated; a warning alone where no thrust moved it."""
    return tuple(
        Doubt(
            (MASSES[one.dof].name, DAMPINGS[one.dof].name),
            one.sentence,
            Outcome.DISAGREES if one.pushed else Outcome.CONVERGED,
        )
        for one in found
        if one.inflated
    )


def loud_note(found: Sequence[Loud]) -> tuple[str, ...]:
    """A sentence on the axes that hardly moved beyond the noise that their readings show by themselves."""
    quiet = [one for one in found if not one.inflated]
    if not quiet:
        return ()
    told = ", ".join(
        f"in {DOFS[one.dof]} ({one.sensor}, {one.noise:.2g} of {one.signal:.2g} {one.unit})" for one in quiet
    )
    return (
        f"Noise is more than a fifth of what was read {told}: little of the motion there stands out of it; push harder "
        "there to tell more.",
    )


def _of_axis(problem: AxisLikelihood, theta: Array, pushed: bool) -> list[Loud]:
    axis = problem.axis
    fitted = np.exp(theta[problem.noise_place : problem.white_place])
    found = []
    for i, channel in enumerate(axis.channels):
        signal, read = _signal(channel), float(fitted[i])
        if i == 0:
            read = float(np.hypot(read, problem.coloured(theta)[0]))
        inflated = read > INFLATED * max(channel.noise, channel.coloured)
        # A place that is held stands still by intention: its own noise is nothing to tell.
        if read > max(LOUD * signal, LEAST) and (inflated or i == 0):
            size, unit = _unit(axis.dof, channel.state_read == POSITION)
            found.append(
                Loud(axis.dof, NAMES[channel.name], size * read, size * signal, unit, inflated, pushed)
            )
    return found


def _signal(channel: Channel) -> float:
    """Standard deviation of what a channel reads, in its noise's unit; inf where it is too short to tell."""
    read = channel.value / channel.scale if channel.state_read == INCREMENT else channel.value
    known = np.isfinite(read)
    return float(np.std(read[known])) if np.count_nonzero(known) >= FEWEST else np.inf


def _unit(dof: int, place: bool) -> tuple[float, str]:
    """What to multiply by, and the unit that results."""
    if dof < 3:
        return 1e3, "mm" if place else "mm/s"
    return float(np.degrees(1.0)), "deg" if place else "deg/s"
