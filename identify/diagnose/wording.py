"""Causes, their parameters and shares in words: the building blocks of a diagnosis' sentences."""

import math
from collections.abc import Sequence

from identify.diagnose.result import Diagnosis, Found, Next, Value
from identify.effects.effect import Effect
from identify.report.text import fixed, significant, unit, with_interval

DRIFT_S = 5.0
"""Horizon of the drift in sentences."""

CAPITALS = {"dvl": "DVL", "imu": "IMU", "cg": "CG"}

UNITLESS = ("", "1")

SINCE = "since it was accepted"
"""Variant of an effect that is the change of an accepted effect."""


def cause_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """A line per cause: name, probability, description, parameters and ambiguity."""
    return tuple(_cause_line(found) for found in diagnosis.found)


def gain_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """The feed-forward's gain by each cause that it can compensate."""
    return tuple(
        f"{capital(name_of(found))}: the feed-forward alone would track to {mm_s(found.feedforward.after_m_s)} "
        f"instead of {mm_s(found.feedforward.before_m_s)} (typical velocity error)."
        for found in diagnosis.found
        if found.feedforward is not None
    )


def next_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """The next dive or sensor; empty without ambiguity."""
    return () if diagnosis.next is None else _next(diagnosis.next)


def name_of(found: Found) -> str:
    """The cause and its ambiguity group: `thruster lag or command delay`."""
    return " or ".join((effect_words(found.cause.effect), *map(words, found.also)))


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


def told_parameters(found: Found) -> dict[str, Value]:
    """A cause's parameters without the thruster's number, which is in its name."""
    return {name: value for name, value in found.parameters.items() if name != "thruster"}


def cause_sentence(found: Found) -> str:
    """A cause, its probability and description."""
    effect = found.cause.effect
    return f"{capital(effect_words(effect))}, {percent_sure(found.probability)} probable: {effect.sentence}."


def alike_sentence(found: Found) -> str:
    """A cause's ambiguity group, and how to resolve it."""
    alike = " or ".join(
        f"{words(name)} (likeness {fixed(found.likeness[name], 2)})"
        if name in found.likeness
        else words(name)
        for name in found.also
    )
    return (
        f"This dive can't tell it from {alike}; what would: {'; '.join(found.cause.effect.separation.every)}."
    )


def unit_after(text: str) -> str:
    """A unit after a number; empty for a bare number."""
    return "" if text in UNITLESS else f" {unit(text)}"


def percent(share: float) -> str:
    return f"{fixed(100 * share, 0)} %"


def mm_s(value_m_s: float) -> str:
    return f"{significant(1000 * value_m_s, 2)} mm/s"


def _cause_line(found: Found) -> str:
    values = [value_words(name, value) for name, value in told_parameters(found).items()]
    parameters = f" Fitted: {', '.join(values)}." if values else ""
    doubt = f" {alike_sentence(found)}" if found.also else ""
    return f"{cause_sentence(found)}{parameters}{doubt}"


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


def listed(names: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def _in_other_units(value: Value) -> str:
    if value.unit == "rad":
        return f", {significant(math.degrees(value.value), 2)}°"
    if value.unit == "1/s":
        return f", {significant(6000 * value.value, 2)} % a minute"
    return ""


def capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"
