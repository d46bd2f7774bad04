"""Leaves out a gyro that stands all but still while the attitude turns: a field that nothing fills, or in another unit.

A fit that takes such rates for readings needs moments of inertia that no thrust turns.
"""

from dataclasses import replace

import numpy as np

from identify.checks.sensors.sensor_pairs import turns_of
from identify.dive import Dive

STILL_RAD_S = 1e-5
"""No gyro is quieter than this: 2 degrees an hour."""
TIMES, LEAST_RAD = 1000.0, 1e-3
"""The attitude turns by so many times more than such a gyro, and by more than this in half a second."""


def stillness(dive: Dive) -> str:
    """A sentence, without its full stop, on a gyro that stands still while the attitude turns; "" for any other."""
    turns = turns_of(dive)
    if turns is None or dive.gyro is None:
        return ""
    seen, said = (float(np.std(each, axis=0).max()) for each in turns)
    known = [rates[np.isfinite(rates)] for rates in dive.gyro.value.T]
    spread = max((float(np.std(rates)) for rates in known if len(rates)), default=np.inf)
    if not (spread < STILL_RAD_S and seen > max(LEAST_RAD, TIMES * said)):
        return ""
    return (
        f"The gyro's rates change by less than {STILL_RAD_S:.5f} rad/s, as no gyro's do, while the attitude turns: "
        "nothing fills them, or they are in another unit"
    )


def without_still_gyro(dive: Dive) -> Dive:
    """The dive without a gyro that stands still while the attitude turns, which then tells the rates; with a note."""
    if not (words := stillness(dive)):
        return dive
    note = f"{words}; they are left out, and the attitude tells how the vehicle turns."
    return replace(dive, gyro=None, notes=(*dive.notes, note))
