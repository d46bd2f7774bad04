"""Tables of a report, each from a type of the chain to a `Table`: parameters, signals, noise levels, time constants,
trims.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from bridge.vehicle.coefficients import ADDED_MASS_NAMES, DOFS, OF_HULL
from identify.dive import Dive, Signal
from identify.identification import NEGLIGIBLE_CORRELATION, Estimate
from identify.nuisance import WRITTEN, Nuisance, Quantity
from identify.report import cells
from identify.report.cells import Cell
from identify.report.page import Table
from identify.words import MISSING, decimals_for, fixed, significant, speed_unit, unit

SIGNAL_WORDS = {
    "velocity": "velocity over the bottom",
    "gyro": "rate of turn (IMU)",
    "fog": "rate of turn (fibre-optic gyro)",
    "specific_force": "specific force (IMU)",
    "pwm": "thruster commands",
    "rpm": "thruster speeds",
    "voltage": "battery voltage",
    "tau_pid": "wrench of the PID (TAU_PID)",
    "tau_ff": "wrench of the feed-forward (TAU_FF)",
    "tau_cmd": "wrench applied (TAU_CMD)",
    "nu_fb": "velocity fed back (NU_FB)",
    "nu_ref": "reference (NU_REF)",
    "ff_mode": "feed-forward mode (FF_MODE)",
    "veh_cfg": "configuration (VEH_CFG)",
    "gnss": "surface fixes (GNSS)",
}


def parameters(estimates: Sequence[Estimate], truth: Mapping[str, float] | None) -> Table:
    """Value, interval and unit of each parameter, the truth if known, and why a parameter can't be identified.

    Where the thrust is not known exactly, the interval holds what it may be off by, and another column the interval
    given the vehicle file's thrust; digits, standard error and truth are by that one. Further columns: standard
    error, the parameter that it is most correlated with, and, if the vehicle file has priors, the share of the
    answer that comes from them.
    """
    against = () if truth is None else ("Truth", "Truth is")
    priors = ("From prior",) if any(e.share_from_prior for e in estimates) else ()
    given = ("Given the thrust",) if any(e.scale_std > 0 for e in estimates) else ()
    rows = []
    for e in estimates:
        known = e.identifiable or e.share_from_prior > 0
        value, narrow = cells.with_interval(e.value, e.low95, e.high95) if known else (MISSING, MISSING)
        interval = cells.with_interval(e.value, *e.with_thrust)[1] if known else MISSING
        truth_cells = () if truth is None else _against(e, truth.get(e.name))
        words = [meaning(e.name), f"Not identifiable: {e.reason}" if not e.identifiable else e.reason]
        share = cells.percent(e.share_from_prior) if e.share_from_prior else MISSING
        error = _percent(e.wider_std) if known else MISSING
        error_cells = (error, _partner(e), *((share,) if priors else ()))
        rows.append(
            (
                e.symbol,
                value,
                interval,
                *((narrow,) if given else ()),
                unit(e.unit),
                *truth_cells,
                *error_cells,
                ". ".join(filter(None, words)),
            )
        )
    columns = (
        "Parameter", "Value", "95 % interval", *given, "Unit", *against, "Standard error", "Partner", *priors, "Meaning"
    )  # fmt: skip
    by_thrust = (
        " The 95 % interval holds what the vehicle file's thrust may be off by. Given that thrust, by which dives are "
        "compared and by which the simulator's truth holds, it is the narrower one; the standard error is of that."
    )
    return Table(
        columns,
        tuple(rows),
        f"Identified parameters, digits as their intervals allow.{by_thrust if given else ''} Partner: what each is "
        f"most correlated with, where by more than {NEGLIGIBLE_CORRELATION:g}.",
    )


def _percent(share: float) -> Cell:
    return cells.significant(100 * share, 2, "%")


def _partner(e: Estimate) -> str:
    """The strongest partner and the correlation with it; a dash if negligible."""
    if e.partner is None or not e.partner.is_close:
        return MISSING
    return f"{e.partner.name} {fixed(e.partner.correlation, 2)}"


def meaning(name: str) -> str:
    """Meaning of a coefficient in words; empty for an unknown name."""
    if name in OF_HULL:
        return OF_HULL[name].sentence
    if name in ADDED_MASS_NAMES:
        dof = ADDED_MASS_NAMES.index(name)
        return f"added {'mass' if dof < 3 else 'inertia'} in {DOFS[dof]}: total less rigid body"
    return ""


def _against(e: Estimate, truth: float | None) -> tuple[Cell, Cell]:
    if truth is None:
        return MISSING, MISSING
    half = (e.high95 - e.low95) / 2
    if not e.identifiable or not np.isfinite(half):
        return cells.significant(truth, 4), MISSING
    value = cells.fixed(truth, decimals_for(half)) if half > 0 else cells.significant(truth, 4)
    return value, "inside" if e.low95 <= truth <= e.high95 else "OUTSIDE"


def signals(dive: Dive) -> Table:
    rows = tuple(
        (
            SIGNAL_WORDS.get(name, name),
            cells.count(len(signal)),
            cells.significant(signal.counted_hz, unit="Hz") if len(signal) > 1 else MISSING,
            _longest_gap(signal, dive),
            _unknown_share(signal),
        )
        for name, signal in dive.signals().items()
    )
    columns = ("Signal", "Samples", "Rate", "Longest gap", "Unknown")
    return Table(
        columns, rows, "Signals as recorded. Unknown: samples in which the vehicle said that it did not know."
    )


def _longest_gap(signal: Signal, dive: Dive) -> Cell:
    """The longest time between two samples, within each run of a dive made of several."""
    runs_s = np.split(signal.time_s, np.searchsorted(signal.time_s, dive.breaks_s))
    gaps_s = np.concatenate([np.diff(run_s) for run_s in runs_s])
    return cells.duration(float(gaps_s.max())) if len(gaps_s) else MISSING


def _unknown_share(signal: Signal) -> Cell:
    if not len(signal):
        return MISSING
    unknown = int((~np.isfinite(signal.value)).any(axis=1).sum())
    return _percent(unknown / len(signal))


CHANNELS = {
    "dvl": "DVL",
    "gyro": "IMU gyro",
    "fog": "fibre-optic gyro",
    "filter": "autopilot's filter",
    "depth": "depth sensor",
}

SMALL = {
    "m/s": speed_unit("m/s"),
    "rad/s": speed_unit("rad/s"),
    "m": (1e3, "mm"),
    "rad": (math.degrees(1.0), "deg"),
}
"""Factor and unit in which a reader gets the noise of a sensor."""

HEADINGS = {
    Quantity.DISTURBANCE: "Disturbance",
    Quantity.TIME_CONSTANT: "Its time constant",
    Quantity.TRIM: "Trim",
    Quantity.NOISE: "Sensor noise",
}


def nuisance_tables(nuisance: Mapping[Nuisance, float], settings: Mapping[str, float]) -> tuple[Table, ...]:
    by_axis: dict[str, dict[Quantity, list[tuple[Nuisance, float]]]] = {}
    for fitted, value in nuisance.items():
        by_axis.setdefault(fitted.axis, {}).setdefault(fitted.quantity, []).append((fitted, value))
    tables = []
    if by_axis:
        rows = tuple(
            (axis, *(_nuisance(row.get(quantity, [])) for quantity in HEADINGS))
            for axis, row in by_axis.items()
        )
        caption = (
            "Fitted beside the coefficients. Disturbance and noise are standard deviations; trim is a "
            "constant force or moment."
        )
        tables.append(Table(("Axis", *HEADINGS.values()), rows, caption))
    if settings:
        caption = "Other numbers of this method, by their own names."
        tables.append(
            Table(
                ("Name", "Value"),
                tuple((name, cells.significant(value)) for name, value in settings.items()),
                caption,
            )
        )
    return tuple(tables)


def _nuisance(values: Sequence[tuple[Nuisance, float]]) -> Cell:
    """Values of an axis: a quantity, or those of several sensors in words."""
    match values:
        case []:
            return MISSING
        case [(fitted, value)] if not fitted.channel:
            return cells.significant(value, unit=WRITTEN[fitted.unit])
    return ", ".join(_words(fitted, value) for fitted, value in values)


def _words(fitted: Nuisance, value: float) -> str:
    sensor = CHANNELS.get(fitted.channel, fitted.channel)
    unit = WRITTEN[fitted.unit]
    scale, small = SMALL.get(unit, (1.0, unit))
    return f"{sensor} {significant(scale * value, 2)} {small}".strip()
