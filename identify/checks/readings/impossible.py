"""Removes readings that are none: values and times that no vehicle can have, and copies of velocities.

A likelihood that takes each copy for a reading concludes that the velocity stands still between them.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import LogError
from identify.checks.readings.copies import come_equally_often
from identify.dive import Dive, Signal
from identify.ingest.commands import percent

MOST = {
    "velocity": (20.0, "the velocity", "20 m/s"),
    "gyro": (50.0, "the gyro", "50 rad/s"),
    "fog": (50.0, "the fibre-optic gyro", "50 rad/s"),
    "specific_force": (1e3, "the accelerometer", "100 g"),
    "pressure": (2e8, "the pressure sensor", "200 MPa"),
    "depth": (12e3, "the depth", "12 km"),
    "attitude": (2.0, "the attitude", "a quaternion's 1"),
    "nu_fb": (50.0, "the controller's velocity (NU_FB)", "50 m/s or rad/s"),
    "tau_cmd": (1e6, "the wrench (TAU_CMD)", "1 MN"),
    "tau_pid": (1e6, "the wrench (TAU_PID)", "1 MN"),
}
"""By signal: largest possible size of a value, the sensor in words, and that size in words.

A torpedo reaches some 30 m/s, a vehicle to be identified less than half; the deepest sea is 10.9 km, 110 MPa.
"""

MOST_US = 1e4
"""A servo pulse is 0.5 to 2.5 ms long; 65535 stands for no pulse."""

WHOLE = {"ff_mode": "FF_MODE", "veh_cfg": "VEH_CFG"}
"""Signals that are whole numbers but are sent as floats, and their names."""


def without_impossible(dive: Dive) -> Dive:
    """The dive without impossible readings, with a note for each sensor; an impossible thruster output becomes NaN."""
    kept: dict[str, Any] = {}
    notes = []
    for name, (most, words, limit) in MOST.items():
        signal = dive.signals().get(name)
        if signal is None or not len(signal):
            continue
        beyond = (np.abs(signal.value) > most).any(axis=1)
        if not beyond.any():
            continue
        kept[name] = Signal(signal.time_s[~beyond], signal.value[~beyond]) if not beyond.all() else None
        share = f"({percent(float(beyond.mean()))} %)"
        if np.count_nonzero(beyond) == 1:
            words_beyond = f"1 reading of {words} {share} is beyond {limit}, which no vehicle reaches: it is"
        else:
            words_beyond = (
                f"{np.count_nonzero(beyond)} readings of {words} {share} are beyond {limit}, which no vehicle reaches: "
                "they are"
            )
        notes.append(
            f"{words_beyond} left out; check that sensor, its unit, and what passes its readings on."
        )
    for name, words in WHOLE.items():
        signal = dive.signals().get(name)
        if signal is None or not len(signal):
            continue
        whole = (np.isfinite(signal.value) & (np.rint(signal.value) == signal.value)).all(axis=1)
        if whole.all():
            continue
        kept[name] = Signal(signal.time_s[whole], signal.value[whole]) if whole.any() else None
        share = percent(float((~whole).mean()))
        notes.append(f"{words} is no whole number in {share} % of what tells it: left out, as not said.")
    if dive.pwm is not None and (beyond := np.abs(dive.pwm.value) > MOST_US).any():
        kept["pwm"] = Signal(dive.pwm.time_s, np.where(beyond, np.nan, dive.pwm.value))
    return replace(dive, **kept, notes=dive.notes + tuple(notes)) if kept else dive


LONGEST_DIVE_S: Final = 30 * 86_400.0
"""Later steps allocate by the seconds of a dive, so that an impossible time would fill the memory."""


def refuse_years(span_s: tuple[float, float], path: Path) -> None:
    """Raise LogError for the first and the last time, s, of a recording that lie further apart than any dive lasts."""
    start_s, end_s = span_s
    if not end_s - start_s <= LONGEST_DIVE_S:
        raise LogError(
            f"its times lie {(end_s - start_s) / 86_400:.3g} days apart, and a dive is no longer than "
            f"{LONGEST_DIVE_S / 86_400:.0f}; mend its times, or cut out the dive",
            path,
        )


WILD_S: Final = 60.0
"""A time that differs from those around it by more than this is impossible."""
AROUND: Final = 9


def tame(time_s: Array) -> NDArray[np.bool_]:
    """Which times (n,), in recording order, agree with those around them; a step of all later times is kept."""
    if len(time_s) < 2 or not np.abs(np.diff(time_s)).max() > WILD_S:
        return np.ones(len(time_s), np.bool_)
    padded = np.pad(time_s, AROUND // 2, mode="symmetric")
    usual = np.median(np.lib.stride_tricks.sliding_window_view(padded, AROUND), axis=1)
    return np.asarray(np.abs(time_s - usual) <= WILD_S)


def without_repeated(dive: Dive) -> Dive:
    """If velocities each come equally often, the dive with only the first of each, and a note."""
    if dive.velocity is None:
        return dive
    axes = np.isfinite(dive.velocity.value).any(axis=0)
    known = np.isfinite(dive.velocity.value[:, axes]).all(axis=1)
    read = dive.velocity.value[known][:, axes]
    if len(read) < 2 or not axes.any():
        return dive
    first = np.flatnonzero(np.concatenate([[True], (read[1:] != read[:-1]).any(axis=1)]))
    if not come_equally_often(first, len(read)):
        return dive
    copies = np.flatnonzero(known)[np.setdiff1d(np.arange(len(read)), first)]
    left = Signal(np.delete(dive.velocity.time_s, copies), np.delete(dive.velocity.value, copies, axis=0))
    note = (
        f"Each velocity comes {len(read) / len(first):.2g} times over: they are passed on at "
        f"{dive.velocity.rate_hz:.0f} Hz and measured at a part of that, so only the first of each is taken for a "
        "reading."
    )
    return replace(dive, velocity=left, notes=(*dive.notes, note))
