"""What speaks against a value beside its bounds: its own interval, the rigid body, what was accepted last. Pure."""

import re
from collections.abc import Mapping
from typing import Final

from bridge.vehicle.coefficients import Coefficient
from gcs_plugin.params.last_accepted import AcceptedValue
from gcs_plugin.params.plan import TAKES_EFFECT, Plan, Row, coefficient_of, value_text
from gcs_plugin.params.sidecar import Interval

Z95: Final = 1.96
SMALL_DAMPING_PER_S: Final = 0.1
"""A damping known to better than this share of its mass (1/s) is small, not unknown."""
SURE: Final = 3.0
"""How many times both half intervals together a value may be off the one accepted last."""
LARGE: Final = 0.3
"""A change below this share of the accepted value is none to stop for: payload, water and fouling do as much."""
RATIO: Final = 3.0
"""How many times the accepted value, or its inverse, a value without intervals may be."""

_CONFIGURATION = re.compile(r"FF\d+")


def implausible(
    plan: Plan,
    intervals: Mapping[str, Interval],
    accepted: Mapping[str, AcceptedValue],
    rigid: Mapping[str, tuple[float, float]],
) -> dict[str, str]:
    """By id, why lines that change, or come into force as they are staged, are not believed.

    `rigid`: mass or inertia of the rigid body and its standard deviation, by the id of the total, where a vehicle file
    tells it. An effect of 0 is taken back, and needs no belief; a mass or damping of 0 is a value as any other.
    """
    values = {**plan.present, **{row.name: row.target for row in plan.rows}}
    found = {}
    for row in plan.rows:
        if row.verdict not in TAKES_EFFECT or _is_taken_back(row):
            continue
        interval, last = intervals.get(row.name), accepted.get(row.name)
        reasons = (
            _against_interval(row, interval, values),
            _against_rigid_body(row, interval, rigid.get(row.name)),
            _against_accepted(row, interval, last),
        )
        if reason := next(filter(None, reasons), ""):
            found[row.name] = reason
    return found


def _is_taken_back(row: Row) -> bool:
    return row.target == 0.0 and not isinstance(coefficient_of(row.name), Coefficient)


def _half(interval: Interval) -> float:
    return (interval.high95 - interval.low95) / 2


def _against_interval(row: Row, interval: Interval | None, values: Mapping[str, float]) -> str:
    if interval is None or _half(interval) <= 0.0:
        return ""
    low, high, half = interval.low95, interval.high95, _half(interval)
    if not low - half <= row.target <= high + half:
        return f"{value_text(row.target)} is far outside its own 95 % interval, {low:.4g} to {high:.4g}"
    coefficient, std = coefficient_of(row.name), half / Z95
    if not isinstance(coefficient, Coefficient) or row.target == 0.0 or std < abs(row.target):
        return ""  # of 0 no interval around it tells less than it says
    mass = values.get(_mass_of(row.name, coefficient), 0.0)
    if coefficient.kind == "damping" and std < SMALL_DAMPING_PER_S * mass:
        return ""
    return f"its standard deviation, {std:.4g}, is as large as the value: the dive did not tell it"


def _mass_of(name: str, damping: Coefficient) -> str:
    """The id of the mass in the degree of freedom of a coefficient."""
    match = _CONFIGURATION.match(name)
    letter = "M" if damping.dof < 3 else "I"
    return f"{match.group(0) if match else ''}_{letter}_{damping.name[2:].upper()}"


def _against_rigid_body(row: Row, interval: Interval | None, rigid: tuple[float, float] | None) -> str:
    if rigid is None:
        return ""
    mass, std = rigid
    if (row.target if interval is None else interval.high95) >= mass - Z95 * std:
        return ""
    return f"{value_text(row.target)} is below the rigid body's own {mass:g}, which no water takes away"


def _against_accepted(row: Row, interval: Interval | None, last: AcceptedValue | None) -> str:
    if last is None or last.value == 0.0:
        return ""
    change = abs(row.target - last.value)
    before = f"{value_text(last.value)} was accepted last"
    if interval is not None and last.interval is not None:
        allowed = SURE * (_half(interval) + _half(last.interval))
        if change > max(allowed, LARGE * abs(last.value)):
            return f"{before}, and both 95 % intervals together allow a change of {allowed / SURE:.4g}"
        return ""
    if not isinstance(coefficient_of(row.name), Coefficient):
        return ""
    ratio = row.target / last.value
    return "" if 1 / RATIO <= ratio <= RATIO else f"{before}: this is {ratio:.2g} times as much"
