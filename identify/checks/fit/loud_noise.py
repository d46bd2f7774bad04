"""Sensors whose fitted noise is a large share of their readings: doubts, or notes that little stands out of it."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES
from identify.doubt import Doubt, Outcome
from identify.estimators.axes.readings import Channel
from identify.estimators.filter.state import INCREMENT, POSITION
from identify.estimators.likelihood.axis import AxisLikelihood
from identify.estimators.likelihood.joint import JointLikelihood
from identify.words import significant

LOUD = 0.2
"""Noise above this share of a reading's standard deviation is reported."""

INFLATED = 2.0
"""If the fitted noise exceeds the readings' own noise by this factor, it is not the sensor's but a fault of the
model."""

LEAST = 1e-3
"""m, m/s, rad or rad/s: smaller noise is never reported."""

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
    def doubt(self) -> Doubt:
        """The doubt that inflated noise casts on its axis; only a warning if no thrust moved it."""
        return Doubt(
            (MASSES[self.dof].name, DAMPINGS[self.dof].name),
            f"In {DOFS[self.dof]} the fit takes {significant(self.noise)} {self.unit} of what {self.sensor} reads for "
            f"noise, of {significant(self.signal)} {self.unit} in all, and its readings are far quieter than that",
            f"the model does not follow them; check the unit and sign of {self.sensor}, and that the vehicle file is "
            "this vehicle's.",
            Outcome.DISAGREES if self.pushed else Outcome.CONVERGED,
        )


def loud(joint: JointLikelihood, theta: Array, pushed: Collection[int]) -> tuple[Loud, ...]:
    """The loud sensors at theta: in all axes if their noise is inflated, otherwise only in those that thrust
    `pushed`."""
    every = (
        entry
        for problem, of_axis in zip(joint.problems, joint.slices, strict=True)
        for entry in _of_axis(problem, theta[of_axis], problem.axis.dof in pushed)
    )
    return tuple(entry for entry in every if entry.inflated or entry.pushed)


def loud_doubts(noisy: Sequence[Loud]) -> tuple[Doubt, ...]:
    """A doubt about each axis whose noise is inflated."""
    return tuple(entry.doubt for entry in noisy if entry.inflated)


def loud_note(noisy: Sequence[Loud]) -> tuple[str, ...]:
    """A sentence on the axes that hardly moved beyond the noise that their readings show by themselves."""
    quiet = [entry for entry in noisy if not entry.inflated]
    if not quiet:
        return ()
    text = ", ".join(
        f"in {DOFS[entry.dof]} ({entry.sensor}, {significant(entry.noise, 2)} of {significant(entry.signal, 2)} "
        f"{entry.unit})"
        for entry in quiet
    )
    return (
        f"Noise is more than a fifth of what was read {text}: little of the motion there stands out of it; push harder "
        "there to tell more.",
    )


def _of_axis(problem: AxisLikelihood, theta: Array, pushed: bool) -> list[Loud]:
    axis = problem.axis
    fitted = np.exp(theta[problem.noise_index : problem.white_index])
    sensors = []
    for i, channel in enumerate(axis.channels):
        signal, read = _signal(channel), float(fitted[i])
        if i == 0:
            read = float(np.hypot(read, problem.coloured(theta)[0]))
        inflated = read > INFLATED * max(channel.noise, channel.coloured)
        # A position or angle that is held is still on purpose: its noise is not worth a report.
        if read > max(LOUD * signal, LEAST) and (inflated or i == 0):
            size, unit = _unit(axis.dof, channel.state_read == POSITION)
            sensors.append(
                Loud(axis.dof, NAMES[channel.name], size * read, size * signal, unit, inflated, pushed)
            )
    return sensors


def _signal(channel: Channel) -> float:
    """Standard deviation of a channel's readings, in its noise's unit; inf if there are too few."""
    read = channel.value / channel.scale if channel.state_read == INCREMENT else channel.value
    known = np.isfinite(read)
    return float(np.std(read[known])) if np.count_nonzero(known) >= FEWEST else np.inf


def _unit(dof: int, of_pose: bool) -> tuple[float, str]:
    """A conversion factor, and the unit that results."""
    if dof < 3:
        return 1e3, "mm" if of_pose else "mm/s"
    return float(np.degrees(1.0)), "deg" if of_pose else "deg/s"
