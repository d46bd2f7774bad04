"""Sentences on each degree of freedom in absolute terms: drifts, errors, disturbance."""

import math
from collections.abc import Sequence

from bridge.vehicle.coefficients import DOFS
from identify.diagnose.result import AxisShrink, Disturbance, Shrink
from identify.diagnose.verdict import MOST_DISTURBED, swallowing
from identify.diagnose.wording import DRIFT_S, listed, percent, percent_sure
from identify.report.text import fixed, significant

NAMED = 2
"""Number of degrees of freedom named in the verdict, those that change most."""

TURNING = DOFS[3:]

MAY_BE = "a sea or a current that comes and goes, a tether, or thrust that the vehicle file or the recording has wrong"


def rate(value: float, dof: str) -> str:
    """A velocity in mm/s, or a rate of turn in °/s, from m/s or rad/s."""
    scaled = math.degrees(value) if dof in TURNING else 1e3 * value
    return f"{significant(scaled, 2)} {'°/s' if dof in TURNING else 'mm/s'}"


def r_squared(nrmse: float) -> str:
    """R², 1 less the square of the error over the spread."""
    return fixed(1.0 - nrmse**2, 3)


def axis_lines(where: str, one: Shrink) -> tuple[str, ...]:
    """A line for each degree of freedom: drift, floor, share closed, error of the velocity, the plain baseline."""
    return tuple(f"{where}, {axis.dof}: {_axis_words(axis)}." for axis in one.by_axis)


def _axis_words(one: AxisShrink) -> str:
    closes = f", {percent(one.value)} of what can be closed" if math.isfinite(one.value) else ""
    drift = (
        f"the {DRIFT_S:g} s drift goes from {rate(one.before, one.dof)} to {rate(one.after, one.dof)} "
        f"(noise alone {rate(one.floor, one.dof)}){closes}"
    )
    if not math.isfinite(one.nrmse_after):
        return drift
    return (
        f"{drift}; NRMSE {fixed(one.nrmse_before, 2)} to {fixed(one.nrmse_after, 2)} (R² "
        f"{r_squared(one.nrmse_before)} to {r_squared(one.nrmse_after)}), plain least squares "
        f"{fixed(one.nrmse_baseline, 2)}"
    )


def changes(one: Shrink) -> str:
    """`falls from 34 to 16 mm/s in surge and from 2.1 to 1.2 °/s in yaw`, of the degrees of freedom that change most
    in floors; "" if none changes."""
    moved = [axis for axis in one.by_axis if math.isfinite(axis.value) and axis.before != axis.after]
    moved.sort(key=lambda axis: -abs(axis.before - axis.after) / axis.floor)
    if not moved:
        return ""
    named = moved[:NAMED]
    goes = "falls" if all(axis.after < axis.before for axis in named) else "goes"
    phrases = [
        f"from {rate(one.before, one.dof)} to {rate(one.after, one.dof)} in {one.dof}" for one in named
    ]
    return f"{goes} {listed(phrases)}"


def disturbance_words(one: Disturbance) -> str:
    """`3.1 N, 62 % of the variance of the thrusters' force`."""
    return f"{force_words(one)}, {percent_sure(one.share)} of the variance of {_whole(one)}"


def force_words(one: Disturbance) -> str:
    """Its standard deviation with the unit."""
    return f"{significant(one.std, 2)} {'N m' if one.dof in TURNING else 'N'}"


def disturbance_line(disturbance: Sequence[Disturbance]) -> tuple[str, ...]:
    """A line on the fitted disturbance in each pushed degree of freedom."""
    pushed = [axis for axis in disturbance if axis.pushed]
    if not pushed:
        return ()
    phrases = listed([f"in {axis.dof} {force_words(axis)} ({_share_words(axis)})" for axis in pushed])
    line = f"The fitted disturbance takes {phrases}; in brackets the share of the variance of the thrusters' force."
    if swallowing(pushed):
        line += f" More than a third is much: {MAY_BE}."
    return (line,)


def _share_words(one: Disturbance) -> str:
    """Share of the variance; marked in a degree of freedom that is only held, where thrust merely answers the
    disturbance."""
    held = not one.driven and one.share > MOST_DISTURBED
    return f"{percent_sure(one.share)}, only held" if held else percent_sure(one.share)


def swallowed_sentence(disturbance: Sequence[Disturbance]) -> str:
    """Sentence that a disturbance takes so much that its model explains too little."""
    told = listed([f"in {axis.dof} it takes {disturbance_words(axis)}" for axis in swallowing(disturbance)])
    return (
        f"No candidate and no force that returns is missing, but the model leaves too much to the disturbance: {told}. "
        f"It may be {MAY_BE}; the model explains too little there to say that there is no gap."
    )


def _whole(one: Disturbance) -> str:
    return "the thrusters' force" if one.pushed else "the force that the motion takes"
