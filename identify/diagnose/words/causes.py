"""Causes and their sizes in words: names, probabilities, values with their units and intervals."""

import math
from collections.abc import Iterable

from bridge.vehicle.coefficients import AcceptedEffect
from identify.diagnose.result import Finding, Value
from identify.effects.effect import Effect
from identify.words import capital, fixed, listed, significant, unit_after, with_interval

CAPITALS = {"dvl": "DVL", "imu": "IMU", "cg": "CG"}

SINCE = "since it was accepted"
"""Variant of an effect that is the change of an accepted effect."""


def name_of(finding: Finding) -> str:
    """The cause and its ambiguity group: `thruster lag or command delay`."""
    return " or ".join((effect_words(finding.cause.effect), *alike_words(finding)))


def alike_words(finding: Finding) -> tuple[str, ...]:
    """The causes that a dive can't tell from a cause: the same of other thrusters, then others."""
    others = (of_thruster(finding.name, number) for number in finding.other_thrusters)
    return (*others, *map(words, finding.also))


def effect_words(effect: Effect) -> str:
    """An effect's name in words, with its thruster's number if it has one, and its beginning and end within a
    dive."""
    name = of_thruster(effect.name, effect.number) if effect.number else words(effect.name)
    name = f"a change of {name}" if effect.variant == SINCE else name
    name = f"less {name}" if effect.is_less else name
    if effect.has_ended:
        return f"{name} from about {effect.since_s:.0f} to {effect.until_s:.0f} s"
    return f"{name} from about {effect.since_s:.0f} s on" if effect.since_s else name


def words(name: str) -> str:
    """The name of an effect in words: `dvl_bias` is a DVL bias."""
    return " ".join(CAPITALS.get(part, part) for part in name.split("_"))


def candidate_words(effect: Effect) -> str:
    """Its name in words, with its thruster's number and its variant if it has them."""
    name = of_thruster(effect.name, effect.number) if effect.number else words(effect.name)
    return f"{name} ({effect.variant})" if effect.variant else name


def of_thruster(name: str, number: int) -> str:
    """`weak thruster 8`, `thruster misalignment (thruster 8)`."""
    wording = words(name)
    return f"{wording} {number}" if wording.endswith("thruster") else f"{wording} (thruster {number})"


def effects_words(effects: Iterable[AcceptedEffect]) -> str:
    """Accepted effects: `weak thruster 1 and quadratic drag`."""
    return listed(
        [of_thruster(each.name, each.number) if each.number else words(each.name) for each in effects]
    )


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


def shown_parameters(finding: Finding) -> dict[str, Value]:
    """A cause's parameters by their printed names, without the thruster's number, which is in the cause's name.

    Those of a change since an effect was accepted are by how much, and called so.
    """
    since = "change of " if finding.cause.effect.variant == SINCE else ""
    return {
        f"{since}{parameter(name)}": value for name, value in finding.parameters.items() if name != "thruster"
    }


def cause_sentence(finding: Finding) -> str:
    """A cause, its probability and description."""
    effect = finding.cause.effect
    return f"{capital(effect_words(effect))}, {percent_bounded(finding.probability)} probable: {effect.sentence}."


def alike_sentence(finding: Finding) -> str:
    """A cause's ambiguity group, and how to resolve it."""
    likeness = {words(name): f" (likeness {fixed(value, 2)})" for name, value in finding.likeness.items()}
    alike = " or ".join(f"{name}{likeness.get(name, '')}" for name in alike_words(finding))
    return f"This dive can't tell it from {alike}; what would: {'; '.join(finding.cause.effect.separation.every)}."


def percent(share: float) -> str:
    return f"{fixed(100 * share, 0)} %"


def cause_line(finding: Finding) -> str:
    values = [value_words(name, value) for name, value in shown_parameters(finding).items()]
    values = values or _untold(finding)
    parameters = f" Fitted: {', '.join(values)}{_towards(finding)}." if values else ""
    doubt = f" {alike_sentence(finding)}" if finding.is_ambiguous else ""
    return f"{cause_sentence(finding)}{parameters}{doubt}"


def _towards(finding: Finding) -> str:
    """`; that is 0.21 m/s towards 120°`, the size and the bearing of a level vector; "" for a cause without one."""
    north, east = (finding.parameters.get(way) for way in ("north", "east"))
    if north is None or east is None:
        return ""
    size = significant(math.hypot(north.value, east.value), 2)
    bearing = round(math.degrees(math.atan2(east.value, north.value))) % 360
    return f"; that is {size}{unit_after(north.unit)} towards {fixed(bearing, 0)}°"


def _untold(finding: Finding) -> list[str]:
    """The size of a form of a cause whose answers have no parameter for it."""
    cause = finding.cause
    return [
        f"{parameter(each.name)} {significant(value, 4)}{unit_after(each.unit)}"
        for each, value in zip(cause.effect.parameters, cause.values.tolist(), strict=True)
    ]


def percent_bounded(probability: float) -> str:
    """A probability in per cent, never 0 or 100."""
    if probability >= 0.995:
        return "over 99 %"
    return "under 1 %" if probability < 0.005 else percent(probability)


def _in_other_units(value: Value) -> str:
    if value.unit == "rad":
        return f", {significant(math.degrees(value.value), 2)}°"
    if value.unit == "1/s":
        return f", {significant(6000 * value.value, 2)} % a minute"
    return ""
