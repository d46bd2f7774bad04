"""A mend: the likely correction of a signal whose columns contradict physics, and the dive with that correction."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identify.dive import Dive, Signal
from identify.ingest.rotation import euler_angles, in_body, quaternions_from_euler

FLU = (1.0, -1.0, -1.0)
"""From forward, left, up, the axes of ROS, to forward, right, down."""


@dataclass(frozen=True)
class Mend:
    """A likely correction of a signal: its columns put in `order`, times `factors`, plus `offset`, turned from `frame`.

    signal: a field of Dive. order: places of the columns, from 0; empty to leave them. factors: one per column; for the
    attitude, those of roll, pitch and yaw after its quaternion was put in `order`. offset: added to each column, SI.
    frame: NED if the velocity is then in these axes. problem: the contradiction with its evidence, a sentence without
    its full stop. remedy: the edit of the column map, likewise.
    """

    signal: str
    factors: tuple[float, ...]
    problem: str = ""
    remedy: str = ""
    order: tuple[int, ...] = ()
    offset: float = 0.0
    frame: str = ""

    @property
    def sentence(self) -> str:
        return f"{self.problem}; {self.remedy}."


def mended(dive: Dive, mend: Mend) -> Dive:
    """The dive with the signal of `mend` corrected."""
    signal: Signal = getattr(dive, mend.signal)
    factors = np.array(mend.factors)
    if mend.signal == "attitude":
        attitude = signal.value[:, list(mend.order)] if mend.order else signal.value
        angles = np.column_stack(euler_angles(attitude)) * factors
        value = quaternions_from_euler(*angles.T)
    else:
        value = signal.value[:, list(mend.order)] if mend.order else signal.value
        value = value * factors + mend.offset
    right = Signal(signal.time_s, value)
    if mend.frame and dive.attitude is not None:
        right = in_body(right, dive.attitude)
    changed: dict[str, Any] = {mend.signal: right}
    return replace(dive, **changed)


def column_mend(
    signal: str,
    factors: Sequence[float],
    problem: str,
    order: tuple[int, ...] = (),
    *,
    offset: float = 0.0,
    frame: str = "",
) -> Mend:
    """The mend of these numbers, with a remedy that says how to write them into the column map."""
    steps = []
    if order:
        steps.append(f"give the columns of `{signal}` in the order {', '.join(str(k + 1) for k in order)}")
    if any(factor != 1.0 for factor in factors):
        listed = ", ".join(f"{factor:.5g}" for factor in factors)
        steps.append(f"multiply `scale` of `{signal}` by [{listed}]")
    if offset:
        steps.append(f"add {offset:.6g} Pa, in the column's unit, to `offset` of `{signal}`")
    if frame:
        steps.append(f"add `frame: {frame}` to `{signal}`")
    return Mend(signal, tuple(factors), problem, " and ".join(steps), order, offset, frame)
