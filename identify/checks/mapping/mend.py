"""A likely mend of a signal that contradicts physics, and the dive with it."""

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
    """A likely mend of a signal: its columns in `order` (empty for as they are), then times `factors`.

    signal: a field of Dive. factors: one per column; for the attitude, those of roll, pitch and yaw after its
    quaternion was put in `order`. problem: the contradiction with its evidence, a sentence without its end. remedy: the
    edit of the column map, likewise. offset: added to each column after that, in SI. frame: NED for a velocity that is
    in these axes after all that.
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


def scaled(
    signal: str,
    factors: Sequence[float],
    problem: str,
    order: tuple[int, ...] = (),
    *,
    offset: float = 0.0,
    frame: str = "",
) -> Mend:
    """A mend whose remedy is an order of the columns, a scale, an offset or a frame."""
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
