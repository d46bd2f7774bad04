"""A pilot's drawn use of the sticks: steps, holds, reversals, turns, stops and changes of depth."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.field.vehicle import FieldVehicle
from bridge.arrays import Array
from bridge.vehicle.thrusters import allocation_matrix
from identify.challenge.planted_effects import random_sign
from identify.challenge.scenario import coloured

TICK_S = 0.05
REST_S = 5.0
LEVELS = (0.2, 0.4, 0.65, 1.0)
"""Shares of full stick to which a pilot pushes it."""

MOST = 0.4
"""Largest share of the thrusters' reach that a pilot uses."""


@dataclass(frozen=True)
class Pilot:
    """Full stick: surge and sway N, turn rad/s, sink m/s.

    rough (3,): standard deviation of the jitter of surge and sway force and of yaw moment, with a correlation time of
    `rough_s`; hand_s: time of a stick's travel from neutral to its stop; leash_m: distance at which the vehicle is
    turned back.
    """

    surge_n: float
    sway_n: float
    turn: float
    sink: float
    rough: Array
    rough_s: float
    hand_s: float
    leash_m: float


@dataclass(frozen=True)
class Leg:
    """`duration_s` with the sticks at shares (-1 to 1) of surge, sway, sink and turn."""

    duration_s: float
    surge: float = 0.0
    sway: float = 0.0
    sink: float = 0.0
    turn: float = 0.0


@dataclass(frozen=True)
class Sticks:
    """Sticks at the ticks: asked (n, 5) surge N, sway N, sink m/s, turn rad/s, jitter of the yaw moment N m; leg
    (n,)."""

    asked: Array
    leg: NDArray[np.int64]


def draw_pilot(rng: np.random.Generator, vehicle: FieldVehicle) -> Pilot:
    """Draw a pilot who goes at 0.3 to 0.65 m/s as far as the thrusters allow."""
    reach = (
        np.abs(allocation_matrix(vehicle.configuration)).sum(axis=1) * vehicle.configuration.thruster_limit_n
    )
    surge_n = min(vehicle.drag(0, rng.uniform(0.3, 0.65)), MOST * float(reach[0]))
    sway_n = min(vehicle.drag(1, rng.uniform(0.25, 0.5)), MOST * float(reach[1]))
    turn = rng.uniform(0.3, 0.6)
    yaw_nm = vehicle.drag(5, turn) + float(vehicle.mass[5]) * turn
    share = np.exp(rng.uniform(np.log(0.015), np.log(0.06)))
    return Pilot(
        surge_n,
        sway_n,
        turn,
        rng.uniform(0.08, 0.18),
        share * np.array([surge_n, sway_n, yaw_nm]),
        rng.uniform(0.1, 0.6),
        rng.uniform(0.1, 0.6),
        rng.uniform(10.0, 25.0),
    )


Block = Callable[[np.random.Generator], list[Leg]]


def _level(rng: np.random.Generator) -> float:
    return float(rng.choice(LEVELS) * rng.uniform(0.85, 1.0))


def _hold_s(rng: np.random.Generator) -> float:
    return float(rng.uniform(4.0, 12.0))


def _rest(rng: np.random.Generator) -> list[Leg]:
    return [Leg(rng.uniform(3.0, 9.0))]


def _out_and_back(rng: np.random.Generator) -> list[Leg]:
    way, hold_s = _level(rng) * random_sign(rng), _hold_s(rng)
    still = [Leg(rng.uniform(2.0, 6.0))] if rng.random() < 0.5 else []
    return [Leg(hold_s, way), *still, Leg(hold_s * rng.uniform(0.8, 1.2), -way), Leg(rng.uniform(2.0, 5.0))]


def _stairs(rng: np.random.Generator) -> list[Leg]:
    way, steps = random_sign(rng), rng.choice(LEVELS, 3, replace=False)
    return [*(Leg(rng.uniform(3.0, 6.0), way * float(step)) for step in steps), Leg(4.0)]


def _sidle(rng: np.random.Generator) -> list[Leg]:
    way, hold_s = _level(rng) * random_sign(rng), _hold_s(rng)
    return [Leg(hold_s, sway=way), Leg(hold_s * rng.uniform(0.8, 1.2), sway=-way), Leg(rng.uniform(2.0, 5.0))]


def _crab(rng: np.random.Generator) -> list[Leg]:
    ahead, aside, hold_s = _level(rng) * random_sign(rng), _level(rng) * random_sign(rng), _hold_s(rng)
    return [Leg(hold_s, ahead, aside), Leg(hold_s, -ahead, -aside), Leg(rng.uniform(1.0, 4.0))]


def _turn(rng: np.random.Generator) -> list[Leg]:
    return [
        Leg(rng.uniform(1.5, 6.0), turn=random_sign(rng) * rng.uniform(0.4, 1.0)),
        Leg(rng.uniform(1.0, 4.0)),
    ]


def _arc(rng: np.random.Generator) -> list[Leg]:
    ahead, turn, hold_s = _level(rng), random_sign(rng) * rng.uniform(0.2, 0.7), _hold_s(rng)
    return [Leg(3.0, ahead), Leg(hold_s, ahead, turn=turn), Leg(hold_s, ahead, turn=-turn), Leg(3.0)]


def _spin(rng: np.random.Generator) -> list[Leg]:
    turn, hold_s = rng.uniform(0.6, 1.0), rng.uniform(5.0, 10.0)
    return [Leg(hold_s, turn=turn), Leg(hold_s, turn=-turn), Leg(2.0)]


def _sink(rng: np.random.Generator) -> list[Leg]:
    sink, hold_s = rng.uniform(0.5, 1.0) * random_sign(rng), rng.uniform(3.0, 8.0)
    ahead = _level(rng) if rng.random() < 0.5 else 0.0
    return [Leg(hold_s, ahead, sink=sink), Leg(3.0, ahead), Leg(hold_s, -ahead, sink=-sink), Leg(3.0)]


def _kicks(rng: np.random.Generator) -> list[Leg]:
    """Short pushes, on one or two axes."""
    out: list[Leg] = []
    for _ in range(4):
        push = Leg(
            rng.uniform(0.6, 2.0),
            _level(rng) * random_sign(rng),
            _level(rng) * random_sign(rng) * rng.integers(2),
        )
        out += [push, Leg(rng.uniform(0.5, 2.0))]
    return out


BLOCKS: tuple[Block, ...] = (
    _out_and_back, _sidle, _turn, _out_and_back, _arc, _rest, _crab, _turn, _stairs, _sink, _sidle, _spin, _kicks,
)  # fmt: skip


def draw_mission(rng: np.random.Generator, seconds: float) -> list[Leg]:
    """Legs of about `seconds` in total: every block in a drawn order, then all again in another order."""
    legs: list[Leg] = []
    while True:
        for place in rng.permutation(len(BLOCKS)):
            legs += BLOCKS[place](rng)
            if sum(leg.duration_s for leg in legs) > seconds - REST_S:
                return legs


def sticks_of(rng: np.random.Generator, legs: list[Leg], pilot: Pilot, ticks: int) -> Sticks:
    """The sticks at the ticks: REST_S at rest, then the legs, with the hand's limited rate and jitter."""
    wanted, leg = np.zeros((ticks, 4)), np.zeros(ticks, dtype=np.int64)
    begin_s = REST_S
    for number, each in enumerate(legs, start=1):
        part = slice(round(begin_s / TICK_S), round((begin_s + each.duration_s) / TICK_S))
        wanted[part] = each.surge, each.sway, each.sink, each.turn
        leg[part] = number
        begin_s += each.duration_s
    most, moved = TICK_S / pilot.hand_s, np.zeros((ticks, 4))
    for tick in range(1, ticks):
        moved[tick] = moved[tick - 1] + np.clip(wanted[tick] - moved[tick - 1], -most, most)
    asked = np.zeros((ticks, 5))
    asked[:, :4] = moved * np.array([pilot.surge_n, pilot.sway_n, pilot.sink, pilot.turn])
    rough = coloured(rng, ticks, TICK_S, pilot.rough_s, 1, pilot.rough)
    asked[:, 0] += rough[:, 0]
    asked[:, 1] += rough[:, 1]
    asked[:, 4] = rough[:, 2]
    return Sticks(asked, leg)
