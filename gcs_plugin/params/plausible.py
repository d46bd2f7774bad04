"""What speaks against a value: its own interval, the rigid body, what the vehicle can have, what was accepted last, the
half of a model that it would leave, the mode of the feed-forward that it would raise. Pure."""

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from bridge.parameters import LEAST_DAMPING_PER_S, MODE
from bridge.vehicle.coefficients import BY_NAME, DOFS, QUADRATICS, Coefficient
from bridge.vehicle.feedforward import AXES, Mode
from gcs_plugin.ff_words import word
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

NONE_KNOWN: Final[Mapping[str, tuple[float, float]]] = MappingProxyType({})

_CONFIGURATION = re.compile(r"FF\d+")
_OTHER: Final = {a: b for _, mass, damping in AXES for a, b in ((mass, damping), (damping, mass))}
"""The coefficient without which another is no model of its axis."""


def implausible(
    plan: Plan,
    intervals: Mapping[str, Interval],
    accepted: Mapping[str, AcceptedValue],
    rigid: Mapping[str, tuple[float, float]],
    kept: Mapping[str, tuple[float, float]] = NONE_KNOWN,
) -> dict[str, str]:
    """By id, why lines that change, or come into force as they are staged, are not believed.

    `rigid`: mass or inertia of the rigid body and its standard deviation, by the id of the total, and `kept` the least
    and the greatest value that such a vehicle takes, by id, where a vehicle file tells them. An effect of 0 is taken
    back, and needs no belief; a mass or damping of 0 is a value as any other. What leaves the feed-forward of an axis
    with half a model, with what the vehicle holds already, is no value to write, and a mode that leaves more to the
    feed-forward is not raised by the way.
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
            _against_kept(row, kept.get(row.name)),
            _against_accepted(row, interval, last),
            _against_coasting(row, values),
            half_a_model(row.name, row.target, values),
            _against_raising(row),
        )
        if reason := next(filter(None, reasons), ""):
            found[row.name] = reason
    return found


def other_half(name: str) -> str:
    """The id of the value without which this one is no model of its axis for the feed-forward; "" where none is."""
    coefficient, match = coefficient_of(name), _CONFIGURATION.match(name)
    if not isinstance(coefficient, Coefficient) or match is None or coefficient.name not in _OTHER:
        return ""
    return BY_NAME[_OTHER[coefficient.name]].parameter_id(int(match.group(0)[2:]))


def half_a_model(name: str, value: float, values: Mapping[str, float]) -> str:
    """Why a value beside the others that the vehicle then holds is half of a model, "" where it is not."""
    other, coefficient = other_half(name), coefficient_of(name)
    if not isinstance(coefficient, Coefficient) or not other:
        return ""
    mass_is_set, drag_is_set = value != 0.0, values.get(other, 0.0) != 0.0
    if coefficient.kind == "damping":
        mass_is_set, drag_is_set = drag_is_set, mass_is_set
    # A hull may have quadratic damping alone.
    squared = QUADRATICS[coefficient.dof].parameter_id(int(other[2 : other.index("_")]))
    if mass_is_set == (drag_is_set or values.get(squared, 0.0) != 0.0):
        return ""
    stays = f"the feed-forward of {DOFS[coefficient.dof]} stays off"
    return f"0 is not set: {stays}" if value == 0.0 else f"without {other} {stays}"


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


def _against_coasting(row: Row, values: Mapping[str, float]) -> str:
    """Why a damping beside the mass that the vehicle then holds is too small to be meant, "" where it is not."""
    coefficient = coefficient_of(row.name)
    if not isinstance(coefficient, Coefficient) or coefficient.kind != "damping" or row.target == 0.0:
        return ""
    mass = _mass_of(row.name, coefficient)
    if row.target >= LEAST_DAMPING_PER_S * values.get(mass, 0.0):
        return ""
    return f"{value_text(row.target)} is next to no damping beside {mass} {value_text(values[mass])}: half of a model"


def _against_kept(row: Row, kept: tuple[float, float] | None) -> str:
    if kept is None or row.target == 0.0 or kept[0] <= row.target <= kept[1]:
        return ""
    return (
        f"{value_text(row.target)} is outside {kept[0]:g} to {kept[1]:g}, which is all that a vehicle of this mass and "
        "thrust can have"
    )


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


def _against_raising(row: Row) -> str:
    modes = {float(mode) for mode in Mode}
    if row.name != MODE or row.present not in modes or row.target not in modes:
        return ""
    if not Mode(int(row.target)).raises(Mode(int(row.present))):
        return ""
    now, then = word(row.present), word(row.target)
    return f"raises the feed-forward from {now} to {then}, which no file does by the way: seatrial ff {then}"
