"""Causes, their parameters and shares in words: the building blocks of a diagnosis' sentences."""

import math
from collections.abc import Sequence

from bridge.vehicle.coefficients import DOFS
from identify.diagnose.result import AxisShrink, Diagnosis, Disturbance, Finding, Next, Shrink, Value
from identify.diagnose.verdict import MOST_DISTURBED, swallowing
from identify.effects.effect import Effect
from identify.words import capital, fixed, listed, significant, unit, with_interval

DRIFT_S = 5.0
"""Horizon of the drift in sentences."""

CAPITALS = {"dvl": "DVL", "imu": "IMU", "cg": "CG"}

UNITLESS = ("", "1")

SINCE = "since it was accepted"
"""Variant of an effect that is the change of an accepted effect."""


def cause_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """A line per cause: name, probability, description, parameters and ambiguity."""
    return tuple(_cause_line(finding) for finding in diagnosis.findings)


def gain_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """The feed-forward's gain by each cause that it can compensate."""
    return tuple(
        f"{capital(name_of(finding))}: the feed-forward alone would track to {mm_s(finding.feedforward.after_m_s)} "
        f"instead of {mm_s(finding.feedforward.before_m_s)} (typical velocity error)."
        for finding in diagnosis.findings
        if finding.feedforward is not None
    )


def next_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """The next dive or sensor; empty without ambiguity."""
    return () if diagnosis.next is None else _next(diagnosis.next)


def name_of(finding: Finding) -> str:
    """The cause and its ambiguity group: `thruster lag or command delay`."""
    return " or ".join((effect_words(finding.cause.effect), *map(words, finding.also)))


def effect_words(effect: Effect) -> str:
    """An effect's name in words, with its thruster's number if it has one."""
    name = _of_thruster(effect.name, effect.number) if effect.number else words(effect.name)
    return f"a change of {name}" if effect.variant == SINCE else name


def words(name: str) -> str:
    """The name of an effect in words: `dvl_bias` is a DVL bias."""
    return " ".join(CAPITALS.get(part, part) for part in name.split("_"))


def candidate_words(effect: Effect) -> str:
    """Its name in words, with its thruster's number and its variant if it has them."""
    name = _of_thruster(effect.name, effect.number) if effect.number else words(effect.name)
    return f"{name} ({effect.variant})" if effect.variant else name


def _of_thruster(name: str, number: int) -> str:
    """`weak thruster 8`, `thruster misalignment (thruster 8)`."""
    wording = words(name)
    return f"{wording} {number}" if wording.endswith("thruster") else f"{wording} (thruster {number})"


def percents(low: float, high: float) -> str:
    """An interval of shares in per cent; "" if unknown or too narrow to show."""
    ends = percent(low), percent(high)
    return f"{ends[0]} to {ends[1]}" if math.isfinite(high - low) and ends[0] != ends[1] else ""


def value_words(name: str, value: Value) -> str:
    """`X_uu 12.3 N s²/m² (95 %: 10.1 to 14.5)`; with degrees for angles, and rates per minute."""
    number, interval = with_interval(value.value, value.low95, value.high95)
    known = math.isfinite(value.low95) and math.isfinite(value.high95)
    interval_words = f" (95 %: {interval})" if known and value.high95 > value.low95 else ""
    return f"{parameter(name)} {number}{unit_after(value.unit)}{interval_words}{_in_other_units(value)}"


def parameter(name: str) -> str:
    """A parameter's name in words: without underscores; symbols unchanged."""
    return name.replace("_", " ") if name.islower() else name


def told_parameters(finding: Finding) -> dict[str, Value]:
    """A cause's parameters without the thruster's number, which is in its name."""
    return {name: value for name, value in finding.parameters.items() if name != "thruster"}


def cause_sentence(finding: Finding) -> str:
    """A cause, its probability and description."""
    effect = finding.cause.effect
    return (
        f"{capital(effect_words(effect))}, {percent_sure(finding.probability)} probable: {effect.sentence}."
    )


def alike_sentence(finding: Finding) -> str:
    """A cause's ambiguity group, and how to resolve it."""
    alike = " or ".join(
        f"{words(name)} (likeness {fixed(finding.likeness[name], 2)})"
        if name in finding.likeness
        else words(name)
        for name in finding.also
    )
    return f"This dive can't tell it from {alike}; what would: {'; '.join(finding.cause.effect.separation.every)}."


def unit_after(text: str) -> str:
    """A unit after a number; empty for a bare number."""
    return "" if text in UNITLESS else f" {unit(text)}"


def percent(share: float) -> str:
    return f"{fixed(100 * share, 0)} %"


def mm_s(value_m_s: float) -> str:
    return f"{significant(1000 * value_m_s, 2)} mm/s"


def _cause_line(finding: Finding) -> str:
    values = [value_words(name, value) for name, value in told_parameters(finding).items()]
    parameters = f" Fitted: {', '.join(values)}." if values else ""
    doubt = f" {alike_sentence(finding)}" if finding.also else ""
    return f"{cause_sentence(finding)}{parameters}{doubt}"


def percent_sure(probability: float) -> str:
    """A probability in per cent, never 0 or 100."""
    if probability >= 0.995:
        return "over 99 %"
    return "under 1 %" if probability < 0.005 else percent(probability)


def _next(one: Next) -> tuple[str, ...]:
    splits = f" It splits {listed([words(name) for name in one.splits])}." if one.splits else ""
    dive = f"Dive next: {'; '.join(one.manoeuvres)}.{splits}" if one.manoeuvres else ""
    sensor = f"Record as well: {'; '.join(one.sensors)}." if one.sensors else ""
    return tuple(line for line in (dive, sensor) if line)


def _in_other_units(value: Value) -> str:
    if value.unit == "rad":
        return f", {significant(math.degrees(value.value), 2)}°"
    if value.unit == "1/s":
        return f", {significant(6000 * value.value, 2)} % a minute"
    return ""


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


def axis_lines(where: str, shrink: Shrink) -> tuple[str, ...]:
    """A line for each degree of freedom: drift, floor, share closed, error of the velocity, the plain baseline."""
    return tuple(f"{where}, {axis.dof}: {_axis_words(axis)}." for axis in shrink.by_axis)


def _axis_words(axis: AxisShrink) -> str:
    closes = f", {percent(axis.value)} of what can be closed" if math.isfinite(axis.value) else ""
    drift = (
        f"the {DRIFT_S:g} s drift goes from {rate(axis.before, axis.dof)} to {rate(axis.after, axis.dof)} "
        f"(noise alone {rate(axis.floor, axis.dof)}){closes}"
    )
    if not math.isfinite(axis.nrmse_after):
        return drift
    return (
        f"{drift}; NRMSE {fixed(axis.nrmse_before, 2)} to {fixed(axis.nrmse_after, 2)} (R² "
        f"{r_squared(axis.nrmse_before)} to {r_squared(axis.nrmse_after)}), plain least squares "
        f"{fixed(axis.nrmse_baseline, 2)}"
    )


def changes(shrink: Shrink) -> str:
    """`falls from 34 to 16 mm/s in surge and from 2.1 to 1.2 °/s in yaw`, of the degrees of freedom that change most
    in floors; "" if none changes."""
    moved = [axis for axis in shrink.by_axis if math.isfinite(axis.value) and axis.before != axis.after]
    moved.sort(key=lambda axis: -abs(axis.before - axis.after) / axis.floor)
    if not moved:
        return ""
    named = moved[:NAMED]
    goes = "falls" if all(axis.after < axis.before for axis in named) else "goes"
    phrases = [
        f"from {rate(item.before, item.dof)} to {rate(item.after, item.dof)} in {item.dof}" for item in named
    ]
    return f"{goes} {listed(phrases)}"


def disturbance_words(disturbance: Disturbance) -> str:
    """`3.1 N, 62 % of the variance of the thrusters' force`."""
    return f"{force_words(disturbance)}, {percent_sure(disturbance.share)} of the variance of {_whole(disturbance)}"


def force_words(disturbance: Disturbance) -> str:
    """Its standard deviation with the unit."""
    return f"{significant(disturbance.std, 2)} {'N m' if disturbance.dof in TURNING else 'N'}"


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


def _share_words(disturbance: Disturbance) -> str:
    """Share of the variance; marked in a degree of freedom that is only held, where thrust merely answers the
    disturbance."""
    held = not disturbance.driven and disturbance.share > MOST_DISTURBED
    return f"{percent_sure(disturbance.share)}, only held" if held else percent_sure(disturbance.share)


def swallowed_sentence(disturbance: Sequence[Disturbance]) -> str:
    """Sentence that a disturbance takes so much that its model explains too little."""
    told = listed([f"in {axis.dof} it takes {disturbance_words(axis)}" for axis in swallowing(disturbance)])
    return (
        f"No candidate and no force that returns is missing, but the model leaves too much to the disturbance: {told}. "
        f"It may be {MAY_BE}; the model explains too little there to say that there is no gap."
    )


def _whole(disturbance: Disturbance) -> str:
    return "the thrusters' force" if disturbance.pushed else "the force that the motion takes"
