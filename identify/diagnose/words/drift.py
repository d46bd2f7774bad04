"""The drift of a model in words, in mm/s and deg/s, with the causes and without."""

import math
from collections.abc import Sequence

from bridge.vehicle.coefficients import DOFS
from identify.diagnose.gap.drift import Drift
from identify.diagnose.result import Gap
from identify.diagnose.shrink.shrink import closed
from identify.diagnose.shrink.shrunk import AxisShrink
from identify.diagnose.words.causes import percent
from identify.words import listed, speed

DRIFT_S = 5.0
"""Horizon of the drift in sentences."""

NAMED = 2
"""Number of degrees of freedom named in the verdict."""

BARELY = 0.1
"""Share of the largest change of a drift, both in floors, below which a change is not named."""

TURNING = DOFS[3:]


def rate(value: float, dof: str) -> str:
    """A velocity in mm/s, or a rate of turn in deg/s, from m/s or rad/s."""
    return speed(value, "rad/s" if dof in TURNING else "m/s")


def closes(share: float) -> str:
    """`closes 86 %`: the share of a drift beyond noise that goes with the causes."""
    return f"closes {percent(share)}"


def axis_words(axis: AxisShrink) -> str:
    gone = f"; {closes(axis.value)} of what is beyond noise" if math.isfinite(axis.value) else ""
    return (
        f"the {DRIFT_S:g} s drift goes from {rate(axis.before, axis.dof)} to {rate(axis.after, axis.dof)} "
        f"(noise alone {rate(axis.floor, axis.dof)}){gone}"
    )


def of_dive(gap: Gap) -> tuple[AxisShrink, ...]:
    """The drift of the whole dive by fitted degree of freedom, without and with the causes; equal if the causes were
    not simulated."""
    before = _at_horizon(gap.drifts)
    if before is None or not len(before.off):
        return ()
    after = _at_horizon(gap.after) or before
    return tuple(
        AxisShrink(
            DOFS[dof],
            float(before.rms[dof]),
            float(after.rms[dof]),
            float(before.floor[dof]),
            closed(float(before.by_axis[dof]), float(after.by_axis[dof])),
            *(math.nan,) * 3,
        )
        for dof in range(len(DOFS))
        if math.isfinite(before.floor[dof])
    )


def _at_horizon(drifts: Sequence[Drift]) -> Drift | None:
    return next((drift for drift in drifts if drift.horizon_s == DRIFT_S), None)


def level(axes: Sequence[AxisShrink], *, before: bool = True) -> str:
    """`16 mm/s in surge (noise alone 9.0 mm/s)`, before the causes or with them, of the degrees of freedom that drift
    furthest in floors."""
    drifts = [(axis, axis.before if before else axis.after) for axis in axes]
    drifts.sort(key=lambda item: -item[1] / item[0].floor)
    named = (
        f"{rate(drift, axis.dof)} in {axis.dof} (noise alone {rate(axis.floor, axis.dof)})"
        for axis, drift in drifts[:NAMED]
    )
    return listed(list(named)) or "unknown"


def changes(axes: Sequence[AxisShrink]) -> str:
    """`falls from 34 to 16 mm/s in surge and from 2.1 to 1.2 deg/s in yaw`: the translation and the rotation that
    change most, or two of a kind where the other does not change by much in floors; "" if none changes."""
    moved = [axis for axis in axes if math.isfinite(axis.value) and axis.before != axis.after]
    if not moved:
        return ""
    least = BARELY * max(_in_floors(axis) for axis in moved)
    moved = sorted((axis for axis in moved if _in_floors(axis) >= least), key=_change, reverse=True)
    of_each_kind = {axis.dof in TURNING: axis for axis in reversed(moved)}
    named = list(of_each_kind.values()) if len(of_each_kind) == NAMED else moved[:NAMED]
    named.sort(key=lambda axis: (-_in_floors(axis), axis.dof in TURNING))
    goes = "falls" if all(axis.after < axis.before for axis in named) else "goes"
    phrases = [
        f"from {rate(item.before, item.dof)} to {rate(item.after, item.dof)} in {item.dof}" for item in named
    ]
    return f"{goes} {listed(phrases)}"


def _change(axis: AxisShrink) -> float:
    return abs(axis.before - axis.after)


def _in_floors(axis: AxisShrink) -> float:
    return _change(axis) / axis.floor
