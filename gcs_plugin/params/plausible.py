"""Plausibility checks of parameter values before an upload. Pure.

A value is checked against its 95 % interval, the rigid body, the range possible for the vehicle, and the value accepted
last; an upload must not leave half a model of an axis, raise the feed-forward's mode, nor make up for a weak thruster
that the vehicle makes up for by itself, nor for drag that another coefficient in force makes up for.
"""

from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import Final

from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, DOFS, MASSES, QUADRATICS, Coefficient, gain_name
from bridge.vehicle.feedforward import AXES
from bridge.vehicle.forecast import TWICE, Credit
from bridge.vehicle.mode import Mode, word_of
from bridge.vehicle.parameters import LEAST_DAMPING_PER_S, MODE
from gcs_plugin.params.last_accepted import AcceptedValue
from gcs_plugin.params.meaning import coefficient_of, part_of_set, value_text
from gcs_plugin.params.plan import TAKES_EFFECT, Plan, Row, Verdict
from gcs_plugin.params.sidecar import Interval

Z95: Final = 1.96
SMALL_DAMPING_PER_S: Final = 0.1
"""A damping with a standard deviation below this share of its mass (1/s) is small, not unknown."""
INTERVALS_APART: Final = 3.0
"""A value may differ from the value accepted last by this multiple of the sum of both half intervals."""
LARGE: Final = 0.3
"""A change below this share of the accepted value is not objected to: payload, water and fouling do as much."""
RATIO: Final = 3.0
"""A value without intervals may be at most this many times the accepted value, and at least its inverse."""

NO_GAINS: Final[Mapping[str, float]] = MappingProxyType({})

_OTHER: Final = {a: b for _, mass, damping in AXES for a, b in ((mass, damping), (damping, mass))}
"""Mass to damping and damping to mass of each axis: the model of an axis needs both."""

_OTHER_DRAG: Final = {
    a.name: b for pair in zip(DAMPINGS, QUADRATICS, strict=True) for a, b in (pair, pair[::-1])
}
"""Linear to quadratic damping of each axis, and back."""


def implausible(
    plan: Plan,
    intervals: Mapping[str, Interval],
    accepted: Mapping[str, AcceptedValue],
    rigid: Mapping[str, tuple[float, float]],
    kept: Mapping[str, tuple[float, float]],
    credits: Collection[Credit] = (),
    gains: Mapping[str, float] = NO_GAINS,
) -> dict[str, str]:
    """Reasons against the lines that change or are put in force, by id; only implausible lines are in it.

    `rigid`: mass or inertia of the rigid body and its standard deviation, by the id of the total. `kept`: least and
    greatest value possible for the vehicle, by id. `gains`: gain that the vehicle file gives a thruster, by the id of
    its accepted gain. All come from the vehicle file, if it gives them. `credits`: of the file's sidecar. An effect of
    0 is a withdrawal and is not checked; a mass or damping of 0 is checked like any value. A value that would leave an
    axis of the feed-forward with half a model, given the values on the vehicle, is objected to, and so are a mode that
    gives the feed-forward more authority, which no file raises in passing, a gain that would act twice, and a fitted
    damping of one kind beside one of the other kind that the fit did not have.
    """
    values = {**plan.present, **{row.name: row.target for row in plan.rows}}
    objections = {}
    for row in plan.rows:
        is_taken_back = row.target == 0.0 and not isinstance(coefficient_of(row.name), Coefficient)
        if row.verdict not in TAKES_EFFECT or is_taken_back:
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
            _against_twice(row, credits, gains, plan.present),
            _against_drag_twice(row, plan) if interval is not None else "",
        )
        if reason := next(filter(None, reasons), ""):
            objections[row.name] = reason
    return objections


def acts_twice(plan: Plan, credits: Collection[Credit], gains: Mapping[str, float]) -> dict[str, str]:
    """Of the accepted gains that the vehicle holds already, as a plan wants them, the reasons against those that act on
    top of its own, by id. `credits` and `gains` as for `implausible`."""
    held = {
        row.name: _against_twice(row, credits, gains, plan.present)
        for row in plan.rows
        if row.verdict is Verdict.SAME and row.target not in (0.0, 1.0)
    }
    return {name: why for name, why in held.items() if why}


def _against_twice(
    row: Row, credits: Collection[Credit], gains: Mapping[str, float], present: Mapping[str, float]
) -> str:
    """Why an accepted gain would act on top of the vehicle's own, "" if it would not.

    The vehicle's own gain is that of its file, or the gain that its allocation used in the diagnosed dive. If accepted
    effects acted then, the gain that it holds now may have been among them, or have come later.
    """
    part = part_of_set(row.name)
    of = {gain_name(credit.thruster): credit for credit in credits}
    credit = of.get(part[1].name) if part is not None else None
    if credit is None:
        return ""
    assumed = credit.assumed

    def beyond(gain: float) -> float:
        return abs(gain / assumed - 1)

    known_gains = [(gains.get(row.name), "the vehicle's file gives it")]
    if credit.allocated is not None:
        held = (present.get(row.name, 0.0) or 1.0) if credit.acting else 1.0
        allocated = min(credit.allocated, credit.allocated / held, key=beyond)
        known_gains.append((allocated, "the vehicle's own allocation went by"))
    for gain, claim in known_gains:
        if gain is not None and beyond(gain) > TWICE:
            return (
                f"thruster {credit.thruster} is made up for already: {claim} {100 * gain:.0f} % of its curve where the "
                f"diagnosis went by {100 * assumed:.0f} %; with this it would be asked as if it gave "
                f"{100 * gain * row.target:.0f} %, and it gives {100 * credit.true:.0f} %"
            )
    return ""


def _against_drag_twice(row: Row, plan: Plan) -> str:
    """Why a fitted linear (quadratic) damping would act beside a quadratic (linear) one of the same axis that the
    vehicle holds and the file doesn't name, "" if it would not: each makes up for the axis's whole drag."""
    part = part_of_set(row.name)
    pair = None if part is None else _OTHER_DRAG.get(part[1].name)
    if part is None or pair is None:
        return ""
    other = pair.parameter_id(part[0])
    held = plan.present.get(other, 0.0)
    if held == 0.0 or any(each.name == other for each in plan.rows):
        return ""
    return (
        f"drag is made up for already: {other} {value_text(held)} would stay in force beside it, and was not fitted "
        f"with it; send {other} too, 0 for none"
    )


def other_half(name: str) -> str:
    """Id of the parameter that completes the model of an axis (damping for a mass, mass for a damping), "" if none."""
    part = part_of_set(name)
    other = _OTHER.get(part[1].name) if part is not None else None
    return "" if part is None or other is None else BY_NAME[other].parameter_id(part[0])


def half_a_model(name: str, value: float, values: Mapping[str, float]) -> str:
    """Why a value leaves half a model of its axis, given the `values` that the vehicle then holds; "" if it does not.

    A model needs a mass and a damping, linear or quadratic; 0 means not set.
    """
    counterpart, part = other_half(name), part_of_set(name)
    if part is None or not counterpart:
        return ""
    veh_cfg, coefficient = part
    if not isinstance(coefficient, Coefficient):
        return ""
    mass_is_set, drag_is_set = value != 0.0, values.get(counterpart, 0.0) != 0.0
    if coefficient.kind == "damping":
        mass_is_set, drag_is_set = drag_is_set, mass_is_set
    # A hull may have quadratic damping alone.
    squared = QUADRATICS[coefficient.dof].parameter_id(veh_cfg)
    if mass_is_set == (drag_is_set or values.get(squared, 0.0) != 0.0):
        return ""
    stays = f"the feed-forward of {DOFS[coefficient.dof]} stays off"
    return f"0 is not set: {stays}" if value == 0.0 else f"without {counterpart} {stays}"


def _half(interval: Interval) -> float:
    return (interval.high95 - interval.low95) / 2


def _against_interval(row: Row, interval: Interval | None, values: Mapping[str, float]) -> str:
    if interval is None or _half(interval) <= 0.0:
        return ""
    low, high, half = interval.low95, interval.high95, _half(interval)
    if not low - half <= row.target <= high + half:
        return f"{value_text(row.target)} is far outside its own 95 % interval, {low:.4g} to {high:.4g}"
    part, std = part_of_set(row.name), half / Z95
    if part is None or not isinstance(part[1], Coefficient) or row.target == 0.0 or std < abs(row.target):
        return ""  # a value of 0 claims nothing that its interval could contradict
    mass = MASSES[part[1].dof].parameter_id(part[0])
    if part[1].kind == "damping" and std < SMALL_DAMPING_PER_S * values.get(mass, 0.0):
        return ""
    return f"its standard deviation, {std:.4g}, is as large as the value: the dive did not tell it"


def _against_rigid_body(row: Row, interval: Interval | None, rigid: tuple[float, float] | None) -> str:
    if rigid is None:
        return ""
    mass, std = rigid
    if (row.target if interval is None else interval.high95) >= mass - Z95 * std:
        return ""
    return f"{value_text(row.target)} is below the rigid body's own {mass:g}, which no water takes away"


def _against_coasting(row: Row, values: Mapping[str, float]) -> str:
    """Why a damping is too small for the mass that the vehicle then holds, "" if it is not."""
    part = part_of_set(row.name)
    if part is None or not isinstance(part[1], Coefficient) or part[1].kind != "damping" or row.target == 0.0:
        return ""
    mass = MASSES[part[1].dof].parameter_id(part[0])
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
        allowed = INTERVALS_APART * (_half(interval) + _half(last.interval))
        if change > max(allowed, LARGE * abs(last.value)):
            return f"{before}, and both 95 % intervals together allow a change of {allowed / INTERVALS_APART:.4g}"
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
    now, then = word_of(row.present), word_of(row.target)
    return f"raises the feed-forward from {now} to {then}, which no file does by the way: seatrial ff {then}"
