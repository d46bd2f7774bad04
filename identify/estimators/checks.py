"""Checks of a fit against its recording: thrust of another axis, speeds that were not recorded, noise that eats the
signal.

Tests whether the thrust of another axis moves an axis, as it does if the DVL's axes or the thrusters differ from the
vehicle file.

Finds readings whose fitted noise is a large part of their signal: a fit that takes motion for noise does not follow
it.

Warns about speeds and rates of turn that were not recorded: they push and turn the vehicle all the same, and their
effect can't be told from mass.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES
from identify.estimators.axes import Axes, Axis
from identify.estimators.doubts import DOUBTFUL_SCORE, Force, Multiplier, with_forces
from identify.estimators.innovations import INCREMENT, POSITION
from identify.estimators.likelihood_axis import AxisLikelihood
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.readings import Channel
from identify.estimators.said import axes_named
from identify.identification import Doubt, Outcome

Array = NDArray[np.float64]

SURGE, SWAY = 0, 1

LARGEST_SHARE = 0.1
"""Share of another axis's thrust: a DVL mounted about 4 degrees off its axes causes as much."""


def crossed(joint: JointLikelihood, theta: Array) -> dict[tuple[int, int], Multiplier]:
    """For each (axis, other) of surge and sway: the share of the other's thrust that moves the axis in addition to
    its own.

    The share is zero if readings and thrust have the same axes. If the DVL is rotated, it is about the tangent of the
    angle.
    """
    events = {problem.axis.dof: problem.axis for problem in joint.problems}
    if not {SURGE, SWAY} <= set(events):
        return {}
    pairs = ((SURGE, SWAY), (SWAY, SURGE))
    forces = [Force(dof, _thrust_over(events[other], events[dof])) for dof, other in pairs]
    return dict(zip(pairs, with_forces(joint, theta, forces).tested(), strict=True))


def crossed_doubts(found: Mapping[tuple[int, int], Multiplier]) -> tuple[Doubt, ...]:
    """A doubt about the axes that another axis's thrust moves, by more than LARGEST_SHARE of it and beyond chance."""
    moved = {
        pair: tested
        for pair, tested in found.items()
        if abs(tested.score) > DOUBTFUL_SCORE and abs(tested.size) > LARGEST_SHARE
    }
    if not moved:
        return ()
    worst = max(moved, key=lambda pair: abs(moved[pair].score))
    axis, other = (DOFS[dof] for dof in worst)
    dofs = sorted(dof for dof, _ in moved)
    problem, remedy = (
        f"The velocity in {axis} answers to the thrust in {other} ({moved[worst].size:+.2g} of it, beside its own; "
        f"{abs(moved[worst].score):.0f} standard errors)",
        f"the DVL's axes or the thrusters are not as the vehicle file "
        f"has them, and what is said of {axes_named(dofs)} can hardly be this vehicle's; check the DVL's mounting and "
        "the order of the thrusters: seatrial doctor --wet tells of both.",
    )
    about = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in dofs)
    return (Doubt(about, problem, remedy, Outcome.DISAGREES),)


def _thrust_over(other: Axis, axis: Axis) -> Array:
    """Mean force (n,) of the other axis over each step of `axis`."""
    impulse = np.cumsum(other.force.mean(axis=1) * other.step_s)
    gained = np.diff(np.interp(axis.time_s, other.time_s, impulse), prepend=0.0)
    some = axis.step_s > 0
    return np.asarray(np.where(some, gained / np.where(some, axis.step_s, 1.0), 0.0))


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
            f"In {DOFS[self.dof]} the fit takes {self.noise:.3g} {self.unit} of what {self.sensor} reads for noise, of "
            f"{self.signal:.3g} {self.unit} in all, and its readings are far quieter than that",
            f"the model does not follow them; check the unit and sign of {self.sensor}, and that the vehicle file is "
            "this vehicle's.",
            Outcome.DISAGREES if self.pushed else Outcome.CONVERGED,
        )


def loud(joint: JointLikelihood, theta: Array, pushed: Collection[int]) -> tuple[Loud, ...]:
    """The loud sensors at theta: in all axes if their noise is inflated, otherwise only in those that thrust
    `pushed`."""
    every = (
        entry
        for problem, place in zip(joint.problems, joint.places, strict=True)
        for entry in _of_axis(problem, theta[place], problem.axis.dof in pushed)
    )
    return tuple(entry for entry in every if entry.inflated or entry.pushed)


def loud_doubts(found: Sequence[Loud]) -> tuple[Doubt, ...]:
    """A doubt about each axis whose noise is inflated."""
    return tuple(entry.doubt for entry in found if entry.inflated)


def loud_note(found: Sequence[Loud]) -> tuple[str, ...]:
    """A sentence on the axes that hardly moved beyond the noise that their readings show by themselves."""
    quiet = [entry for entry in found if not entry.inflated]
    if not quiet:
        return ()
    text = ", ".join(
        f"in {DOFS[entry.dof]} ({entry.sensor}, {entry.noise:.2g} of {entry.signal:.2g} {entry.unit})"
        for entry in quiet
    )
    return (
        f"Noise is more than a fifth of what was read {text}: little of the motion there stands out of it; push harder "
        "there to tell more.",
    )


def _of_axis(problem: AxisLikelihood, theta: Array, pushed: bool) -> list[Loud]:
    axis = problem.axis
    fitted = np.exp(theta[problem.noise_place : problem.white_place])
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


def _unit(dof: int, place: bool) -> tuple[float, str]:
    """A conversion factor, and the unit that results."""
    if dof < 3:
        return 1e3, "mm" if place else "mm/s"
    return float(np.degrees(1.0)), "deg" if place else "deg/s"


LONGEST_GAP_S = 5.0
"""Over a shorter gap the vehicle's speed follows from its earlier speed and from its thrust."""

TELLING_SHARE = 0.1
"""Share of the dive in longer gaps above which a warning is given."""


def unseen_doubts(built: Axes) -> tuple[Doubt, ...]:
    """Warnings about turning axes if speeds were not read, or not for a good part of the dive, and the other way
    round."""
    return (*_unseen_speeds(built), *_unseen_turning(built))


def _unseen_turning(built: Axes) -> tuple[Doubt, ...]:
    """A warning about surge, sway and heave if rates of turn that cause forces there were not read."""
    nu = built.motion.nu
    never = [dof for dof in range(3, 6) if not nu[:, dof].any()]
    # Turning about one axis with speed along a second pushes along the third.
    along_third = {
        3 - (turn - 3) - along
        for turn in never
        for along in range(3)
        if along != turn - 3 and nu[:, along].any()
    }
    pushed = sorted(along_third & {axis.dof for axis in built.axes})
    if not pushed:
        return ()
    about = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in pushed)
    return (
        Doubt(
            about,
            f"No rate of turn was recorded in {axes_named(never)}",
            f"the forces that turning at speed makes in "
            f"{axes_named(pushed)} (Coriolis) are left out, so {', '.join(about)} may be off by more than their "
            "intervals; record a gyro, or dive without turning.",
            _outcome(never, pushed),
        ),
    )


def _unseen_speeds(built: Axes) -> tuple[Doubt, ...]:
    """A warning about the axes affected by a speed that was not read, or not for a good part of the dive: all
    rotations, and other translations if the vehicle turns."""
    moving = {axis.dof: axis for axis in built.axes if axis.dof < 3}
    never = [dof for dof in range(3) if dof not in moving]
    gaps = {dof: silent_share(axis) for dof, axis in moving.items()}
    seldom = [dof for dof, share in gaps.items() if share > TELLING_SHARE]
    cases = []
    if never:
        cases.append((never, f"No velocity was recorded in {axes_named(never)}"))
    if seldom:
        worst = f"For {100 * max(gaps[dof] for dof in seldom):.0f} % of the dive"
        cases.append((seldom, f"{worst} no velocity was read in {axes_named(seldom)}"))
    doubts = []
    for dofs, words in cases:
        worked_on = [axis.dof for axis in built.axes if axis.dof >= 3 or _turned_into(axis.dof, dofs, built)]
        about = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in worked_on)
        problem, remedy = (
            f"{words}",
            f"what speed there does to the vehicle's {axes_named(worked_on)} is guessed, so "
            f"{', '.join(about)} may be off by more than their intervals; dive with the DVL's bottom lock, or without "
            "speed while it turns.",
        )
        if about:
            doubts.append(Doubt(about, problem, remedy, _outcome(never if dofs is never else (), worked_on)))
    return tuple(doubts)


def _turned_into(dof: int, unread: Sequence[int], built: Axes) -> bool:
    """Whether turning causes a force along this axis from an unread speed along another."""
    return any(dof != along and built.motion.nu[:, 6 - dof - along].any() for along in unread)


def _outcome(never: Sequence[int], worked_on: Sequence[int]) -> Outcome:
    """Outcome of a fit without these velocities, in these axes. Vehicles turn mostly in the horizontal plane, and the
    resulting force in surge and sway is not small."""
    return Outcome.DISAGREES if {0, 1, 5} & set(never) and {0, 1} & set(worked_on) else Outcome.CONVERGED


def silent_share(axis: Axis) -> float:
    """Share of an axis's time in gaps of its readings longer than LONGEST_GAP_S."""
    read = axis.time_s[np.isfinite(axis.reading)]
    start_s, end_s = axis.time_s[0], axis.time_s[-1]
    gaps_s = np.diff(np.concatenate([[start_s], read, [end_s]]))
    return float(gaps_s[gaps_s > LONGEST_GAP_S].sum() / max(end_s - start_s, 1e-9))
