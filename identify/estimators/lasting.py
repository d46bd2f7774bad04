"""Time for which a dive has thruster commands and readings of motion together, as identification needs both."""

import math

import numpy as np

from bridge.errors import FitError
from bridge.vehicle.coefficients import DOFS
from identify.dive import Dive
from identify.estimators.readings import HEAVE, PITCH, ROLL, YAW
from identify.estimators.said import SHORTEST_DIVE_S


def lasting(dive: Dive) -> None:
    """Raise FitError if no axis was read for long enough. A battery's voltage may be logged after all else ended."""
    common = [span_s for dof in range(len(DOFS)) if not math.isnan(span_s := common_s(dive, dof))]
    if common and round(max(common)) < SHORTEST_DIVE_S:
        raise FitError(
            f"thruster commands and readings of motion are both in it for {max(*common, 0):.0f} s of "
            f"{dive.duration_s:.0f} s, but identification needs at least {SHORTEST_DIVE_S:.0f} s; record a longer one",
            of=dive.name,
        )


def too_short(dive: Dive, dof: int) -> str:
    """Why an axis was read for too short a time to be identified; empty if it was read for long enough.

    Rounded to a second, as in the sentence: the last reading of a recording of 20 s is from before its end.
    """
    span_s = common_s(dive, dof)
    if math.isnan(span_s) or round(span_s) >= SHORTEST_DIVE_S:
        return ""
    speed = "velocity" if dof < 3 else "rate of turn"
    return (
        f"thruster commands and the {speed} in {DOFS[dof]} were both recorded for {max(span_s, 0):.0f} s, but at least "
        f"{SHORTEST_DIVE_S:.0f} s are needed"
    )


def common_s(dive: Dive, dof: int) -> float:
    """Time for which a dive has both thruster commands and readings of an axis's velocity (or of its position or
    angle, if no sensor read the velocity); NaN if either is missing."""
    commands = [signal.time_s for signal in (dive.pwm, dive.tau_cmd) if signal is not None and len(signal)]
    columns = (
        [(dive.velocity, dof)]
        if dof < 3
        else [(dive.gyro, dof - 3), *([(dive.fog, 0)] if dof == YAW else [])]
    )
    known = [s.time_s[np.isfinite(s.value[:, column])] for s, column in columns if s is not None]
    if not any(len(read) for read in known):
        places = {
            HEAVE: (dive.depth, dive.pressure),
            ROLL: (dive.attitude,),
            PITCH: (dive.attitude,),
            YAW: (dive.attitude,),
        }
        known = [s.time_s[np.isfinite(s.value[:, 0])] for s in places.get(dof, ()) if s is not None]
    return max(
        (
            float(min(given[-1], read[-1]) - max(given[0], read[0]))
            for given in commands
            for read in known
            if len(read)
        ),
        default=math.nan,
    )
