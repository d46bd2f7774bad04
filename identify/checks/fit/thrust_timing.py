"""Doubts and notes about the time at which thrust acts."""

from collections.abc import Mapping, Sequence

from identify.doubt import Culprit, Doubt, Outcome, coefficients_of
from identify.estimators.axes.axis import Axis
from identify.estimators.missing_forces.drag_and_timing import Multiplier
from identify.identification import ThrustDelay
from identify.ingest.commands import SELDOM_HZ
from identify.words import axes_named

FARTHEST_S = 0.2
"""A single scoring step from zero gives the size of a lateness only up to here, about a long thruster lag."""

LATEST_S = 0.5
"""No thruster's lag and no sensor's clock is off by more: a driver's buffers hold tenths of a second."""


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


def seldom_doubts(axes: Sequence[Axis]) -> tuple[Doubt, ...]:
    """A warning about the axes in which nothing tells what seldom samples of the commands leave out.

    A recording of an ArduSub in ALT_HOLD with its pulses twice a second, and without sticks to reckon them from, gave
    inertias 1.5 times too large, outside their intervals; with pulses at 10 Hz beside them they were right.
    """
    dofs = [axis.dof for axis in axes if min(axis.sampled_s, axis.unknown_s) > 1.0 / SELDOM_HZ]
    if not dofs:
        return ()
    apart_s = max(axis.sampled_s for axis in axes if axis.dof in dofs)
    return (
        Doubt(
            coefficients_of(dofs),
            f"The thruster commands are samples {apart_s:.2g} s apart, and nothing recorded tells what they did "
            f"between in {axes_named(dofs)}",
            "where an autopilot steers there, masses and dampings may be off by half, whatever their intervals say; "
            "record the commands at 10 Hz or more, or the pilot's sticks with them, or put the autopilot's own log "
            "beside this one.",
        ),
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
