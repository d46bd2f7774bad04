"""Doubts about a fit: thrust of another axis, loud noise, velocities not recorded, missing drag, timing and forces."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, DOFS, MASSES, QUADRATICS, SURGE, SWAY
from bridge.vehicle.config import Damping
from identify.doubt import Culprit, Doubt, Outcome, coefficients_of
from identify.estimators.axes.axis import Axes, Axis
from identify.estimators.axes.readings import Channel
from identify.estimators.filter.state import INCREMENT, POSITION
from identify.estimators.likelihood.axis import AxisLikelihood
from identify.estimators.likelihood.joint import JointLikelihood
from identify.estimators.missing_forces.drag_and_timing import DOUBTFUL_SCORE, Force, Multiplier, with_forces
from identify.estimators.missing_forces.forms import Kind
from identify.estimators.missing_forces.screening import Lack
from identify.identification import ThrustDelay
from identify.words import axes_named

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
    forces = [Force(dof, events[other].thrust_over(events[dof])) for dof, other in pairs]
    return dict(zip(pairs, with_forces(joint, theta, forces).tested(), strict=True))


def crossed_doubts(tests: Mapping[tuple[int, int], Multiplier]) -> tuple[Doubt, ...]:
    """A doubt about the axes that another axis's thrust moves, by more than LARGEST_SHARE of it and beyond chance."""
    moved = {
        pair: tested
        for pair, tested in tests.items()
        if abs(tested.score) > DOUBTFUL_SCORE and abs(tested.size) > LARGEST_SHARE
    }
    if not moved:
        return ()
    worst = max(moved, key=lambda pair: abs(moved[pair].score))
    axis, other = (DOFS[dof] for dof in worst)
    dofs = sorted(dof for dof, _ in moved)
    return (
        Doubt(
            coefficients_of(dofs),
            f"The velocity in {axis} answers to the thrust in {other} ({moved[worst].size:+.2g} of it, beside its own; "
            f"{abs(moved[worst].score):.0f} standard errors)",
            f"the DVL's axes or the thrusters are not as the vehicle file has them, and what is said of "
            f"{axes_named(dofs)} can hardly be this vehicle's; check the DVL's mounting and the order of the "
            "thrusters: seatrial doctor --wet tells of both.",
            Outcome.DISAGREES,
        ),
    )


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
        f"in {DOFS[entry.dof]} ({entry.sensor}, {entry.noise:.2g} of {entry.signal:.2g} {entry.unit})"
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
    about = coefficients_of(pushed)
    return (
        Doubt(
            about,
            f"No rate of turn was recorded in {axes_named(never)}",
            f"the forces that turning at speed makes in {axes_named(pushed)} (Coriolis) are left out, so "
            f"{', '.join(about)} may be off by more than their intervals; record a gyro, or dive without turning.",
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
        about = coefficients_of(worked_on)
        remedy = (
            f"what speed there does to the vehicle's {axes_named(worked_on)} is guessed, so {', '.join(about)} may be "
            "off by more than their intervals; dive with the DVL's bottom lock, or without speed while it turns."
        )
        if about:
            doubts.append(Doubt(about, words, remedy, _outcome(never if dofs is never else (), worked_on)))
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
    silent_s = lasting_s = 0.0
    for run in axis.runs:
        time_s = axis.time_s[run]
        read = time_s[np.isfinite(axis.reading[run])]
        gaps_s = np.diff(np.concatenate([time_s[:1], read, time_s[-1:]]))
        silent_s += float(gaps_s[gaps_s > LONGEST_GAP_S].sum())
        lasting_s += float(time_s[-1] - time_s[0])
    return silent_s / max(lasting_s, 1e-9)


FARTHEST_S = 0.2
"""A single scoring step from zero gives the size of a lateness only up to here, about a long thruster lag."""

LATEST_S = 0.5
"""No thruster's lag and no sensor's clock is off by more: a driver's buffers hold tenths of a second."""


def drag_doubts(lacking: Mapping[int, Multiplier], damping: Damping = "linear") -> tuple[Doubt, ...]:
    """Doubts that a drag is missing in each of these axes, for a hull with this damping in its vehicle file."""
    if damping == "quadratic":
        return tuple(_linear_doubt(dof, tested) for dof, tested in lacking.items())
    return tuple(
        Doubt(
            (MASSES[dof].name, DAMPINGS[dof].name),
            f"In {DOFS[dof]} a force that grows as the speed squared is missing from the model "
            f"({tested.score:+.0f} standard errors)",
            "mass and linear damping hold for the speeds of this dive alone; the intervals of all that it bears on are "
            "widened by what such a force would change. Where another axis moved at one speed alone, its damping holds "
            "for that.",
            Outcome.DISAGREES,
            Culprit.MODEL,
        )
        for dof, tested in lacking.items()
    )


def _linear_doubt(dof: int, test: Multiplier) -> Doubt:
    return Doubt(
        (MASSES[dof].name, QUADRATICS[dof].name),
        f"In {DOFS[dof]} a force that grows as the speed itself is missing from the model ({test.score:+.0f} standard "
        "errors), for the vehicle file's damping is quadratic",
        "the intervals of all that it bears on are widened by what such a force would change; write damping: both into "
        "it.",
        Outcome.DISAGREES,
        Culprit.MODEL,
    )


def delay_doubt(delay: ThrustDelay, pushed: Sequence[int]) -> Doubt:
    """Doubt that all thrust acts later than the vehicle file says; the values are those with that delay."""
    beyond = f" and its delay of {delay.in_file_s:g} s" if delay.in_file_s else ""
    return Doubt(
        coefficients_of(pushed),
        f"Thrust acts {delay.later_s:.3f} s ({delay.low95_s:.3f} to {delay.high95_s:.3f}) after its command, beyond "
        f"the vehicle file's lag{beyond}, or readings are stamped so late",
        f"the values are those with that delay; write delay_s: {delay.delay_s:.3g} into the vehicle file's "
        "thrust_curve, where the feed-forward finds it.",
        culprit=Culprit.MODEL,
    )


def late_doubts(late: Mapping[int, Multiplier], pushed: Sequence[int]) -> tuple[Doubt, ...]:
    """Doubts that forces act later or earlier than assumed in these axes: one for "later", one for "earlier".

    If several axes are off in the same direction, a wrong clock is more likely than so many lags. The doubt then
    covers all axes that thrust pushed, because the clock affects even those that show it less. Another doubt covers
    axes that would have to be off by more than any lag or clock, unless another axis is off in the same direction.
    """
    ways = {tested.size > 0 for tested in late.values() if abs(tested.size) <= LATEST_S}
    absurd = {
        dof: tested
        for dof, tested in late.items()
        if abs(tested.size) > LATEST_S and (tested.size > 0) not in ways
    }
    later = {dof: tested for dof, tested in late.items() if dof not in absurd and tested.size > 0}
    earlier = {dof: tested for dof, tested in late.items() if dof not in absurd and tested.size <= 0}
    directions = (("later", later), ("earlier", earlier))
    by_timing = tuple(_late_doubt(way, axes, pushed) for way, axes in directions if axes)
    return (*by_timing, *((_unexplained_doubt(absurd),) if absurd else ()))


def _unexplained_doubt(tests: Mapping[int, Multiplier]) -> Doubt:
    sigma = max(abs(tested.score) for tested in tests.values())
    return Doubt(
        coefficients_of(tests),
        f"In {axes_named(list(tests))} the motion does not follow from the thrust, and timing does not explain it",
        f"thrust would have to act more than {LATEST_S:g} s off its time ({sigma:.0f} standard errors); check that the "
        "vehicle file is this vehicle's, and the velocity's axes, signs and unit.",
        Outcome.DISAGREES,
    )


def _late_doubt(way: str, tests: Mapping[int, Multiplier], pushed: Sequence[int]) -> Doubt:
    by_ms = [1000 * abs(tested.size) for tested in tests.values()]
    least, most = min(by_ms), max(by_ms)
    size = f"by about {most:.0f} ms" if most - least < 10 else f"by about {least:.0f} to {most:.0f} ms"
    unsized = most > 1000 * FARTHEST_S
    if unsized:
        size = "by how much can't be told from this fit"
    sigma = max(abs(tested.score) for tested in tests.values())
    others = [dof for dof in pushed if dof not in tests] if len(tests) > 1 else []
    scope = (
        "there" if not others else f"there and in {axes_named(others)}, where the same clock is likely off,"
    )
    dofs = (*tests, *others)
    return Doubt(
        coefficients_of(dofs),
        f"In {axes_named(list(tests))} thrust acts at another time than the vehicle file's lag and the sensors' "
        f"stamps say ({way}, {size}; {sigma:.0f} standard errors)",
        f"masses and dampings {scope} are off"
        f"{'' if unsized else ' by that'}, and the intervals of all that it bears on are widened by it; mend the lag "
        "in the vehicle file, or the sensors' clocks: seatrial doctor --wet tells how late each sensor is.",
        Outcome.DISAGREES,
        Culprit.MODEL,
    )


def lateness_note(moved: Mapping[str, float], late_s: float) -> str:
    """A note on the time at which thrust acts: the relative change of each coefficient if thrust came `late_s`
    later."""
    first, *others = [(name, f"by {100 * share:+.1f} %") for name, share in moved.items()]
    shares = [f"{first[0]} would change {first[1]}", *(f"{name} {by}" for name, by in others)]
    return (
        f"The intervals hold given the vehicle file's thruster lag and the sensors' stamps: were thrust "
        f"{1000 * late_s:.0f} ms later, {', '.join(shares)}."
    )


def unsettled_doubt(names: tuple[str, ...], where: str, bound: str) -> Doubt:
    """Doubt that the search for these coefficients settled: it stopped at its bound of steps."""
    return Doubt(
        names,
        f"In {where} the search stopped at its bound of {bound} before it settled",
        f"don't rely on what it says of {where}; dive longer, with more changes of thrust.",
        Outcome.AT_BOUND,
    )


def strange_doubts(strange: str) -> tuple[Doubt, ...]:
    """Doubt that the recording is of this vehicle, for the reason in `strange`; none if that is empty."""
    if not strange:
        return ()
    remedy = f"{strange}. Give the vehicle file and configuration of the dive."
    return (Doubt(tuple(BY_NAME), "These values can hardly be this vehicle's", remedy, Outcome.DISAGREES),)


def missing_forces(lacking: Sequence[int], late: Sequence[int], damping: Damping = "linear") -> str:
    """The forces that the model of a hull with this damping lacks in these axes, as part of a sentence; empty if
    none."""
    parts = []
    if lacking:
        power = "itself" if damping == "quadratic" else "squared"
        parts.append(f"a drag that grows as the speed {power} in {axes_named(lacking)}")
    if late:
        parts.append(f"thrust at another time in {axes_named(late)}")
    return " and ".join(parts)


def too_little(name: str, axis: str, std: float, shift: float, value: float, missing: str) -> str:
    """Why a coefficient of relative standard error `std` is not identifiable; `shift` is the change of its logarithm
    if the `missing` forces were included."""
    if abs(shift) > 0.5 * std:
        return f"the model lacks {missing}: with that {name} would be {value * math.exp(shift):.3g}"
    return f"the dive says too little of {axis}: the relative standard error is {100 * std:.0f} %"


LIKE: Mapping[Kind, str] = {
    Kind.WORLD: "which goes with the heading or the place, as a current's or a tether's does",
    Kind.THRUST: "which goes with the thrust, as where thrusters are weak near zero, astern or later in the dive",
    Kind.ACROSS: "which goes with other axes' thrust, as where a thruster that drives both is weak or sits elsewhere",
    Kind.TURNING: "which goes with the turning, as where the DVL sits elsewhere than the vehicle file says",
    Kind.SWING: "which swings, as that of waves does",
}

OF_THE_VEHICLE = (Kind.THRUST, Kind.ACROSS, Kind.TURNING)
"""Kinds that the next dive has as well."""


def lacking_doubts(lacks: Sequence[Lack], damping: Damping) -> tuple[Doubt, ...]:
    """A doubt for each kind of force that the model lacks, of a hull with this damping in its vehicle file."""
    kinds = dict.fromkeys(lack.kind for lack in lacks)
    return tuple(_doubt([lack for lack in lacks if lack.kind is kind], damping) for kind in kinds)


def _doubt(lacks: Sequence[Lack], damping: Damping) -> Doubt:
    """The doubt of forces of the same kind, the clearest first."""
    clearest, dofs = lacks[0], sorted(lack.dof for lack in lacks)
    period = f", every {clearest.period_s:.2g} s" if clearest.period_s else ""
    groups = {"linear": (MASSES, DAMPINGS), "quadratic": (MASSES, QUADRATICS)}
    where = "there and in those axes" if clearest.kind is Kind.ACROSS else "there"
    return Doubt(
        tuple(
            group[dof].name for group in groups.get(damping, (MASSES, DAMPINGS, QUADRATICS)) for dof in dofs
        ),
        f"In {axes_named(dofs)} the recording holds a force that the model lacks, {LIKE[clearest.kind]}{period} "
        f"({clearest.score:.0f} standard errors)",
        f"masses and dampings {where} are off by what it does, and the intervals of all that it bears on are widened "
        "by an estimate of that, and may still be too narrow; seatrial diagnose looks for its cause.",
        Outcome.DISAGREES,
        Culprit.MODEL if clearest.kind in OF_THE_VEHICLE else Culprit.RECORDING,
    )
