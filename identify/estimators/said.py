"""Sentences about a fit that the estimators share, and the minimum duration of a dive."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from bridge.errors import FitError
from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, DOFS, MASSES, QUADRATICS
from identify.dive import Dive
from identify.identification import Culprit, Doubt, Outcome, ThrustDelay

if TYPE_CHECKING:
    from bridge.vehicle.config import Damping
    from identify.estimators.doubts import Multiplier

SHORTEST_DIVE_S = 20.0

FARTHEST_S = 0.2
"""A single scoring step from zero gives the size of a lateness only up to here, about a long thruster lag."""

LATEST_S = 0.5
"""No thruster's lag and no sensor's clock is off by more: a driver's buffers hold tenths of a second."""


def long_enough(dive: Dive) -> None:
    """Raise FitError if a dive is too short to identify anything from it."""
    if round(dive.duration_s) < SHORTEST_DIVE_S:
        raise FitError(
            f"the dive lasts {dive.duration_s:.0f} s, but identification needs at least "
            f"{SHORTEST_DIVE_S:.0f} s; record a longer one",
            of=dive.name,
        )


def axes_named(dofs: Sequence[int]) -> str:
    """Axes in words: surge, sway and yaw."""
    names = [DOFS[dof] for dof in dofs]
    return " and ".join(", ".join(part) for part in (names[:-1], names[-1:]) if part)


def drag_doubts(lacking: "Mapping[int, Multiplier]", damping: "Damping" = "linear") -> tuple[Doubt, ...]:
    """Doubts that a drag is missing in each of these axes, for a hull with this damping in its vehicle file."""
    if damping == "quadratic":
        return tuple(_linear_doubt(dof, tested) for dof, tested in lacking.items())
    return tuple(
        Doubt(
            (MASSES[dof].name, DAMPINGS[dof].name),
            f"In {DOFS[dof]} a force that grows as the speed squared is missing from the model "
            f"({tested.score:+.0f} standard errors)",
            "mass and linear damping hold for the speeds of this dive "
            "alone; the intervals of all that it bears on are widened by what such a force would change. Where another "
            "axis moved at one speed alone, its damping holds for that.",
            Outcome.DISAGREES,
            Culprit.MODEL,
        )
        for dof, tested in lacking.items()
    )


def _linear_doubt(dof: int, one: "Multiplier") -> Doubt:
    return Doubt(
        (MASSES[dof].name, QUADRATICS[dof].name),
        f"In {DOFS[dof]} a force that grows as the speed itself is missing from the model ({one.score:+.0f} standard "
        "errors), for the vehicle file's damping is quadratic",
        "the intervals of all that it bears on are widened by "
        "what such a force would change; write damping: both into it.",
        Outcome.DISAGREES,
        Culprit.MODEL,
    )


def delay_doubt(delay: ThrustDelay, pushed: Sequence[int]) -> Doubt:
    """Doubt that all thrust acts later than the vehicle file says; the values are those with that delay."""
    beyond = f" and its delay of {delay.in_file_s:g} s" if delay.in_file_s else ""
    return Doubt(
        tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in pushed),
        f"Thrust acts {delay.later_s:.3f} s ({delay.low95_s:.3f} to {delay.high95_s:.3f}) after its command, beyond "
        f"the vehicle file's lag{beyond}, or readings are stamped so late",
        f"the values are those with that delay; write "
        f"delay_s: {delay.delay_s:.3g} into the vehicle file's thrust_curve, where the feed-forward finds it.",
        culprit=Culprit.MODEL,
    )


def late_doubts(late: "Mapping[int, Multiplier]", pushed: Sequence[int]) -> tuple[Doubt, ...]:
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


def _unexplained_doubt(found: "Mapping[int, Multiplier]") -> Doubt:
    sigma = max(abs(tested.score) for tested in found.values())
    return Doubt(
        tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in found),
        f"In {axes_named(list(found))} the motion does not follow from the thrust, and timing does not explain it",
        f""
        f"thrust would have to act more than {LATEST_S:g} s off its time ({sigma:.0f} standard errors); check that the "
        "vehicle file is this vehicle's, and the velocity's axes, signs and unit.",
        Outcome.DISAGREES,
    )


def _late_doubt(way: str, found: "Mapping[int, Multiplier]", pushed: Sequence[int]) -> Doubt:
    by_ms = [1000 * abs(tested.size) for tested in found.values()]
    least, most = min(by_ms), max(by_ms)
    size = f"by about {most:.0f} ms" if most - least < 10 else f"by about {least:.0f} to {most:.0f} ms"
    unsized = most > 1000 * FARTHEST_S
    if unsized:
        size = "by how much can't be told from this fit"
    sigma = max(abs(tested.score) for tested in found.values())
    others = [dof for dof in pushed if dof not in found] if len(found) > 1 else []
    scope = (
        "there" if not others else f"there and in {axes_named(others)}, where the same clock is likely off,"
    )
    dofs = (*found, *others)
    return Doubt(
        tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in dofs),
        f"In {axes_named(list(found))} thrust acts at another time than the vehicle file's lag and the sensors' "
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
    problem, remedy = (
        "These values can hardly be this vehicle's",
        f"{strange}. Give the vehicle file and configuration of the dive.",
    )
    return (Doubt(tuple(BY_NAME), problem, remedy, Outcome.DISAGREES),)


def missing_forces(lacking: Sequence[int], late: Sequence[int], damping: "Damping" = "linear") -> str:
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
