"""Runs of Fossen's PythonVehicleSimulator, and the terms whose linear sums are the vehicles' accelerations.

The shapes of the terms are those of its vehicles (Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion
Control, ch. 6 and 8-10): added mass and damping over the velocity through the water, cross-flow drag by strips, lift
and drag of a body of revolution, propellers and fins by the squares of speeds. None of their sizes is taken from
there.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bridge.errors import LogError

Array = NDArray[np.float64]
Columns = dict[str, Array]

STEP_S = 0.1
STATES = ("u", "v", "r")
"""Surge, sway and yaw: the states in which a horizontal gap appears."""

LENGTHS_M = {"otter": 2.0, "remus100": 1.6}
STRIPS = 20
VANISHING_S_M = 3.0
"""The linear damping of the REMUS fades as exp(-3 U)."""

NEEDED = {
    "otter": ("act0", "act1"),
    "remus100": ("act0", "act1", "act2"),
}


@dataclass(frozen=True)
class Water:
    """The water that a model assumes, and the velocity sensor's offset.

    north, east: current, m/s; more_north, more_east: its drift over the whole run, m/s; ahead, aside: excess reading
    of the velocity sensor, m/s.
    """

    north: float = 0.0
    east: float = 0.0
    more_north: float = 0.0
    more_east: float = 0.0
    ahead: float = 0.0
    aside: float = 0.0


def load_run(folder: Path, vehicle: str, run: str) -> Columns:
    """Load the columns of one run. Raises LogError if the file can't be read or lacks a column."""
    path = folder / f"{vehicle}_{run}.csv"
    try:
        table = np.genfromtxt(path, delimiter=",", names=True)
    except (OSError, ValueError):
        raise LogError(f"{path}: can't be read as a table; give the folder that holds it") from None
    names = table.dtype.names or ()
    for name in ("t", "z", "phi", "theta", "psi", *"uvwpqr", *NEEDED[vehicle]):
        if name not in names:
            raise LogError(
                f"{path}: has no column '{name}'; give a run of the {vehicle} as the simulator logs it"
            )
    return {name: np.asarray(table[name], dtype=float) for name in names}


def through_water(run: Columns, water: Water) -> tuple[Array, Array]:
    """Surge and sway velocity through the water, in body axes, m/s."""
    since = run["t"] / 600.0 - 0.5
    north, east = water.north + water.more_north * since, water.east + water.more_east * since
    cosine, sine = np.cos(run["psi"]), np.sin(run["psi"])
    u = run["u"] - water.ahead - (cosine * north + sine * east)
    v = run["v"] - water.aside - (cosine * east - sine * north)
    return u, v


def moving(run: Columns, water: Water) -> tuple[Array, Array, Array]:
    """The states (n,) whose derivatives are the sums of terms: velocity through the water, and yaw rate."""
    return *through_water(run, water), run["r"]


def terms(vehicle: str, run: Columns, water: Water) -> tuple[Array, Array, Array]:
    """The terms (n, k) of each of STATES."""
    return (_otter if vehicle == "otter" else _remus)(run, water)


def _cross_flow(v: Array, r: Array, length_m: float) -> tuple[Array, Array]:
    """Force and moment of cross-flow drag by strips along the hull, with unit coefficient (Fossen 2021, sec. 6.4)."""
    x = (np.arange(STRIPS) + 0.5) / STRIPS * length_m - length_m / 2
    local = v[..., None] + x * r[..., None]
    drag = local * np.abs(local)
    return np.asarray(drag.mean(axis=-1)), np.asarray((x * drag).mean(axis=-1))


def _otter(run: Columns, water: Water) -> tuple[Array, Array, Array]:
    u, v = through_water(run, water)
    r, w, q, p = (run[name] for name in "rwqp")
    force, moment = _cross_flow(v, r, LENGTHS_M["otter"])
    push = [np.square(side(run[name], 0.0)) for name in ("act0", "act1") for side in (np.maximum, np.minimum)]
    ahead = [u, u * np.abs(u), v * r, r * r, w * q, q, run["theta"], run["z"], np.ones_like(u), *push]
    aside = [
        v, u * r, r, r * np.abs(r), u * v, w * p, p, run["phi"], np.ones_like(u), force, moment, *push,
    ]  # fmt: skip
    return np.column_stack(ahead), np.column_stack(aside), np.column_stack(aside)


def _remus(run: Columns, water: Water) -> tuple[Array, Array, Array]:
    u, v = through_water(run, water)
    r, w, q, p = (run[name] for name in "rwqp")
    rudder, plane, n = run["act0"], run["act1"], run["act2"] / 60.0
    force, moment = _cross_flow(v, r, LENGTHS_M["remus100"])
    speed = np.sqrt(u * u + v * v + w * w)
    over_ground = np.sqrt(run["u"] ** 2 + run["v"] ** 2 + w * w)
    flat = u * u + v * v
    fades = np.exp(-VANISHING_S_M * speed)
    weight = np.sin(run["phi"]) * np.cos(run["theta"])
    push = [n * np.abs(n), np.abs(n) * speed, np.abs(n) * over_ground]
    ahead = [
        u * fades, speed * speed, u * speed, w * w, u * w, v * v, v * r, w * q, q * q, r * r, p * r,
        flat * rudder**2, (u * u + w * w) * plane**2, np.sin(run["theta"]), *push, np.ones_like(u),
    ]  # fmt: skip
    aside = [
        v * fades, v, force, moment, u * r, r, u * v, u * p, w * p, p, p * q, w * r, flat * rudder, weight,
        speed * v, *push, np.ones_like(u),
    ]  # fmt: skip
    return np.column_stack(ahead), np.column_stack(aside), np.column_stack(aside)
