"""What a run of Fossen's simulator may hold beyond another, told by the terms of `runs`."""

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.fossen.fit import Candidate
from bench.fossen.runs import Water

Array = NDArray[np.float64]

M_S = "m/s"
Group = Literal["drag", "coupled_damping", "thrust_gain", "all"]
ALONE = Candidate("nothing", (), (), lambda _: Water())

CURRENT = Candidate(
    "steady_current",
    (("north", M_S), ("east", M_S)),
    (0.1, 0.1),
    lambda v: Water(north=float(v[0]), east=float(v[1])),
)
DRIFTING = Candidate(
    "current that grows or fades",
    (("north", M_S), ("east", M_S), ("more north", M_S), ("more east", M_S)),
    (0.1, 0.1, 0.0, 0.0),
    lambda v: Water(*(float(one) for one in v)),
)
BIAS = Candidate(
    "dvl_bias",
    (("x", M_S), ("y", M_S)),
    (0.0, 0.0),
    lambda v: Water(ahead=float(v[0]), aside=float(v[1])),
)
CURRENT_AND_BIAS = Candidate(
    "steady_current and dvl_bias",
    (("north", M_S), ("east", M_S), ("x", M_S), ("y", M_S)),
    (0.1, 0.1, 0.0, 0.0),
    lambda v: Water(float(v[0]), float(v[1]), ahead=float(v[2]), aside=float(v[3])),
)

GROUPS: Mapping[str, Mapping[Group, tuple[tuple[int, ...], ...]]] = {
    "otter": {
        "drag": ((0, 1), (0, 9, 10), (2, 3)),
        "coupled_damping": ((2, 3), (2, 1), (0, 4, 1)),
        "thrust_gain": ((9, 10, 11, 12), (11, 12, 13, 14), (11, 12, 13, 14)),
        "all": (tuple(range(13)), tuple(range(15)), tuple(range(15))),
    },
    "remus100": {
        "drag": ((0, 1), (0, 1, 2), (3, 5)),
        "coupled_damping": ((6, 9), (4, 5, 3), (4, 6, 1)),
        "thrust_gain": ((14, 15), (12, 15), (12, 15)),
        "all": (tuple(range(17)), tuple(range(18)), tuple(range(18))),
    },
}
"""Which terms, by their places, have sizes of their own: thrust_gain is the propellers', and the rudder's."""


def candidates(vehicle: str) -> tuple[Candidate, ...]:
    """Nothing first, then one cause at a time, then a current with one more cause beside it."""
    own = tuple(Candidate(name, (), (), ALONE.water, terms) for name, terms in GROUPS[vehicle].items())
    beside = tuple(
        Candidate(f"steady_current and {name}", CURRENT.units, CURRENT.start, CURRENT.water, terms)
        for name, terms in GROUPS[vehicle].items()
    )
    return ALONE, BIAS, *own, CURRENT, DRIFTING, CURRENT_AND_BIAS, *beside
