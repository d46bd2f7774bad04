"""The effects that a run of Fossen's simulator may hold and another not, expressed by the terms of `runs`."""

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.fossen.fit import Candidate
from bench.fossen.runs import Water

Array = NDArray[np.float64]

M_S = "m/s"
Group = Literal["drag", "coupled_damping", "thrust_gain", "thrust_bias", "all"]
ANYTHING = "anything"
"""A cause without a name: every term has another size."""

ALONE = Candidate("nothing", (), (), (), lambda _: Water())

CURRENT = Candidate(
    "steady_current",
    ("steady_current",),
    (("north", M_S), ("east", M_S)),
    (0.1, 0.1),
    lambda v: Water(north=float(v[0]), east=float(v[1])),
)
DRIFTING = Candidate(
    "current that grows or fades",
    ("steady_current", "varying_current"),
    (("north", M_S), ("east", M_S), ("more north", M_S), ("more east", M_S)),
    (0.1, 0.1, 0.0, 0.0),
    lambda v: Water(*(float(one) for one in v)),
)
BIAS = Candidate(
    "dvl_bias",
    ("dvl_bias",),
    (("x", M_S), ("y", M_S)),
    (0.0, 0.0),
    lambda v: Water(ahead=float(v[0]), aside=float(v[1])),
)
CURRENT_AND_BIAS = Candidate(
    "steady_current and dvl_bias",
    ("steady_current", "dvl_bias"),
    (("north", M_S), ("east", M_S), ("x", M_S), ("y", M_S)),
    (0.1, 0.1, 0.0, 0.0),
    lambda v: Water(float(v[0]), float(v[1]), ahead=float(v[2]), aside=float(v[3])),
)

GROUPS: Mapping[str, Mapping[Group, tuple[tuple[int, ...], ...]]] = {
    "otter": {
        "drag": ((0, 1), (0, 9, 10), (2, 3)),
        "coupled_damping": ((2, 3), (2, 1), (0, 4, 1)),
        "thrust_gain": ((9, 10, 11, 12), (11, 12, 13, 14), (11, 12, 13, 14)),
        "thrust_bias": ((8,), (8,), (8,)),
        "all": (tuple(range(13)), tuple(range(15)), tuple(range(15))),
    },
    "remus100": {
        "drag": ((0, 1), (0, 1, 2), (3, 5)),
        "coupled_damping": ((6, 9), (4, 5, 3), (4, 6, 1)),
        "thrust_gain": ((14, 15), (12, 15), (12, 15)),
        "thrust_bias": ((17,), (18,), (18,)),
        "all": (tuple(range(18)), tuple(range(19)), tuple(range(19))),
    },
}
"""The terms, by their places, that have sizes of their own.

thrust_gain: the terms of the propellers, and of the rudder; thrust_bias: a constant force or moment.
"""

CAUSES: Mapping[Group, str] = {"drag": "fouling", "all": ANYTHING}
"""Names of changes of these terms from one run to the other, if they are not the group's own name."""


def alone(vehicle: str) -> tuple[Candidate, ...]:
    """No effect first, then one cause at a time."""
    return ALONE, BIAS, *_own(vehicle, ALONE), CURRENT


def beside(vehicle: str, one: Candidate) -> tuple[Candidate, ...]:
    """The candidates that add a second cause to `one`.

    A current goes with any other cause; any other cause is joined by a current.
    """
    if one is CURRENT:
        return DRIFTING, CURRENT_AND_BIAS, *_own(vehicle, CURRENT)
    if one is BIAS:
        return (CURRENT_AND_BIAS,)
    return tuple(combined for combined in _own(vehicle, CURRENT) if set(one.causes) <= set(combined.causes))


def _own(vehicle: str, of: Candidate) -> tuple[Candidate, ...]:
    """The candidates of `of` in addition to a group of terms with sizes of their own."""
    return tuple(
        Candidate(
            " and ".join((*of.causes, name)),
            (*of.causes, CAUSES.get(name, name)),
            of.units,
            of.start,
            of.water,
            terms,
        )
        for name, terms in GROUPS[vehicle].items()
    )
