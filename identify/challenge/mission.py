"""Draws the missions that challenge vehicles dive."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from identify.challenge.vehicles import DrawnVehicle

SHORTEST_S, LONGEST_S = 300.0, 600.0
REST_S = 8.0
SINK_M_S = 0.12
LEVELS = (0.35, 0.55, 0.8, 1.0)
"""Shares of the vehicle's speed at which the legs go."""

HEADING, DEPTH = 12, 13
"""Columns of a reference."""


@dataclass(frozen=True)
class Leg:
    """A leg of `duration_s` at a body velocity that is reached after `ramp_s`; `sink` m/s downwards, `turn` rad/s."""

    duration_s: float
    surge: float = 0.0
    sway: float = 0.0
    sink: float = 0.0
    turn: float = 0.0
    ramp_s: float = 2.0


Block = Callable[[np.random.Generator, DrawnVehicle], list[Leg]]
"""Draws a manoeuvre: a few legs that belong together."""


def _hold_s(rng: np.random.Generator) -> float:
    return float(rng.uniform(8.0, 16.0))


def _rest(rng: np.random.Generator, _: DrawnVehicle) -> list[Leg]:
    return [Leg(rng.uniform(6.0, 14.0))]


def _out_and_back(rng: np.random.Generator, vehicle: DrawnVehicle) -> list[Leg]:
    speed, hold_s, ramp_s = vehicle.speed * rng.choice(LEVELS), _hold_s(rng), rng.uniform(0.8, 4.0)
    still = [Leg(rng.uniform(3.0, 6.0), ramp_s=ramp_s)] if rng.random() < 0.5 else []
    return [
        Leg(hold_s, speed, ramp_s=ramp_s),
        *still,
        Leg(hold_s, -speed, ramp_s=2 * ramp_s),
        Leg(4.0, ramp_s=ramp_s),
    ]


def _turn(rng: np.random.Generator, vehicle: DrawnVehicle) -> list[Leg]:
    rate = vehicle.turn * rng.uniform(0.5, 1.0) * rng.choice([-1.0, 1.0])
    return [Leg(rng.uniform(0.6, 3.0) / abs(rate), turn=rate, ramp_s=1.0), Leg(3.0, ramp_s=1.0)]


def _arc(rng: np.random.Generator, vehicle: DrawnVehicle) -> list[Leg]:
    speed = vehicle.speed * rng.choice(LEVELS) * rng.choice([1.0, 1.0, -1.0])
    rate = vehicle.turn * rng.uniform(0.3, 0.7) * rng.choice([-1.0, 1.0])
    hold_s = _hold_s(rng)
    return [
        Leg(5.0, speed),
        Leg(hold_s, speed, turn=rate, ramp_s=1.5),
        Leg(hold_s, speed, turn=-rate, ramp_s=2.0),
        Leg(5.0),
    ]  # fmt: skip


def _sidle(rng: np.random.Generator, vehicle: DrawnVehicle) -> list[Leg]:
    speed, hold_s = vehicle.sway * rng.choice(LEVELS) * rng.choice([-1.0, 1.0]), _hold_s(rng)
    return [Leg(hold_s, sway=speed), Leg(hold_s, sway=-speed, ramp_s=3.0), Leg(4.0)]


def _crab(rng: np.random.Generator, vehicle: DrawnVehicle) -> list[Leg]:
    ahead, aside = vehicle.speed * rng.choice(LEVELS), vehicle.sway * rng.uniform(-1.0, 1.0)
    hold_s = _hold_s(rng)
    return [Leg(hold_s, ahead, aside), Leg(hold_s, -ahead, -aside, ramp_s=3.0), Leg(3.0)]


def _sink(rng: np.random.Generator, vehicle: DrawnVehicle) -> list[Leg]:
    sink, hold_s = SINK_M_S * rng.uniform(0.5, 1.0), rng.uniform(5.0, 9.0)
    ahead = vehicle.speed * rng.uniform(0.3, 0.8) if rng.random() < 0.5 else 0.0
    return [Leg(hold_s, ahead, sink=sink), Leg(3.0, ahead), Leg(hold_s, -ahead, sink=-sink), Leg(3.0)]


def _spin(rng: np.random.Generator, vehicle: DrawnVehicle) -> list[Leg]:
    rate = vehicle.turn * rng.uniform(0.7, 1.0)
    hold_s = 2 * math.pi / rate * rng.uniform(0.5, 1.0)
    return [Leg(hold_s, turn=rate, ramp_s=1.5), Leg(hold_s, turn=-rate, ramp_s=2.0), Leg(3.0)]


BLOCKS: tuple[Block, ...] = (
    _out_and_back,
    _turn,
    _out_and_back,
    _arc,
    _rest,
    _sidle,
    _turn,
    _crab,
    _sink,
    _spin,
)


def draw_mission(rng: np.random.Generator, vehicle: DrawnVehicle, seconds: float) -> list[Leg]:
    """Draw legs of about `seconds` in total: every block in random order, then all again in another order."""
    legs: list[Leg] = []
    while True:
        for place in rng.permutation(len(BLOCKS)):
            legs += BLOCKS[place](rng, vehicle)
            if sum(leg.duration_s for leg in legs) > seconds - REST_S:
                return legs


def reference_at(legs: list[Leg], time_s: Array, depth_m: float, heading: float) -> Array:
    """Reference (n, 14) of the legs at the ticks (n,): velocity (6), acceleration (6), heading, depth.

    It begins with REST_S at rest, at this depth and heading (rad).
    """
    out = np.zeros((len(time_s), 14))
    begin_s, before = REST_S, np.zeros(4)
    for leg in legs:
        part = (time_s >= begin_s) & (time_s < begin_s + leg.duration_s)
        wanted = np.array([leg.surge, leg.sway, leg.sink, leg.turn])
        x = np.clip((time_s[part] - begin_s) / leg.ramp_s, 0.0, 1.0)
        for column, axis in ((0, 0), (1, 1), (2, 2), (5, 3)):
            change = wanted[axis] - before[axis]
            out[part, column] = before[axis] + change * x * x * (3 - 2 * x)
            out[part, 6 + column] = change * 6 * x * (1 - x) / leg.ramp_s
        begin_s, before = begin_s + leg.duration_s, wanted
    tick_s = time_s[1] - time_s[0]
    out[:, HEADING] = heading + np.cumsum(out[:, 5]) * tick_s
    out[:, DEPTH] = depth_m + np.cumsum(out[:, 2]) * tick_s
    return out
