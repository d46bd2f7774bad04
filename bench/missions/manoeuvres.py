"""Reference of a mission: legs of body velocity, joined by jerk-limited ramps, sampled at the controller's ticks."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bench.missions.vehicles import DrawnVehicle
from bridge.arrays import Array

SHORTEST_S, LONGEST_S = 60.0, 300.0
REST_S = 2.0
COLUMNS = 16
"""Velocity (6), acceleration (6), heading, depth, roll, pitch."""


@dataclass(frozen=True)
class Leg:
    """`duration_s` at `velocity` (surge, sway, heave in m/s, yaw in rad/s), reached after `ramp_s`; tilt in rad."""

    duration_s: float
    velocity: tuple[float, float, float, float]
    ramp_s: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0


@dataclass(frozen=True)
class Paces:
    """Speeds that suit a vehicle: well within its thrust, and such as a crew would dive."""

    surge: float
    sway: float
    heave: float
    yaw: float
    tilts: bool


Manoeuvre = Callable[[np.random.Generator, Paces, float], list[Leg]]


def paces(rng: np.random.Generator, vehicle: DrawnVehicle) -> Paces:
    """A share of the steady speed at full thrust, by axis; 0 in an axis that the thrusters can't reach."""
    most = vehicle.reach / vehicle.damping
    fastest = 0.8 * vehicle.steady_to_m_s
    pace = np.clip(rng.uniform(0.12, 0.35, 6) * most, 0.0, [fastest, 0.6 * fastest, 0.3, 0.0, 0.0, 0.5])
    u, v, w, r = (float(pace[dof]) if dof in vehicle.driven else 0.0 for dof in (0, 1, 2, 5))
    return Paces(u, v, w, r, 3 in vehicle.driven and 4 in vehicle.driven)


def lawnmower(rng: np.random.Generator, pace: Paces, seconds: float) -> list[Leg]:
    """Straight runs with a half turn at each end."""
    run_s, ramp_s = rng.uniform(10.0, 30.0), rng.uniform(2.0, 5.0)
    speed = pace.surge * rng.uniform(0.7, 1.0)
    rate = max(pace.yaw, 0.1)
    side = 1.0
    legs: list[Leg] = []
    while _length(legs) < seconds:
        legs += [Leg(run_s, (speed, 0.0, 0.0, 0.0), ramp_s), Leg(ramp_s + 1.0, (0.0, 0.0, 0.0, 0.0), ramp_s)]
        legs += [Leg(math.pi / rate, (0.0, 0.0, 0.0, side * rate), 1.0), Leg(2.0, (0.0, 0.0, 0.0, 0.0), 1.0)]
        side = -side
    return legs


def double_s(rng: np.random.Generator, pace: Paces, seconds: float) -> list[Leg]:
    """Double-S profiles to several speeds ahead and, if the thrusters can, to the side, with rest between."""
    ramp_s, hold_s = rng.uniform(2.0, 5.0), rng.uniform(5.0, 12.0)
    legs: list[Leg] = []
    while _length(legs) < seconds:
        level = rng.uniform(0.25, 1.0)
        sideways = pace.sway > 0 and rng.random() < 0.4
        velocity = (0.0, level * pace.sway, 0.0, 0.0) if sideways else (level * pace.surge, 0.0, 0.0, 0.0)
        legs += [Leg(ramp_s + hold_s, velocity, ramp_s), Leg(ramp_s + 2.0, (0.0, 0.0, 0.0, 0.0), ramp_s)]
        legs.append(Leg(4.0, (0.0, 0.0, 0.0, rng.uniform(-1, 1) * pace.yaw), 1.0))
    return legs


def square(rng: np.random.Generator, pace: Paces, seconds: float) -> list[Leg]:
    """Square waves of speed forward and back, one axis after another."""
    half_s = rng.uniform(2.0, 10.0)
    shares = np.diag([pace.surge, pace.sway, 0.0, pace.yaw])[[0, 1, 3]]
    shares = shares[shares.any(axis=1)]
    legs: list[Leg] = []
    while _length(legs) < seconds:
        for share in shares:
            for _ in range(3):
                ahead, back = (tuple((sign * 0.8 * share).tolist()) for sign in (1.0, -1.0))
                legs += [Leg(half_s, ahead), Leg(half_s, back)]
    return legs


def together(rng: np.random.Generator, pace: Paces, seconds: float) -> list[Leg]:
    """Surge, sway, heave and yaw at once, each to its own speed, redrawn every few seconds, around one depth."""
    legs: list[Leg] = []
    sunk_m = 0.0
    while _length(legs) < seconds:
        u, v, w, r = rng.uniform(-1.0, 1.0, 4) * [pace.surge, pace.sway, 0.5 * pace.heave, pace.yaw]
        if sunk_m * w > 0:
            w = -w
        ramp_s = rng.uniform(1.0, 3.0)
        leg = Leg(ramp_s + rng.uniform(2.0, 8.0), (float(u), float(v), float(w), float(r)), ramp_s)
        sunk_m += leg.duration_s * w
        legs.append(leg)
    return legs


def spin(rng: np.random.Generator, pace: Paces, seconds: float) -> list[Leg]:
    """Turning in place in both directions, then a straight run."""
    legs: list[Leg] = []
    while _length(legs) < seconds:
        for sign in (1.0, -1.0):
            rate = sign * pace.yaw * rng.uniform(0.5, 1.0)
            legs += [
                Leg(rng.uniform(6.0, 15.0), (0.0, 0.0, 0.0, rate), 1.5),
                Leg(3.0, (0.0, 0.0, 0.0, 0.0), 1.5),
            ]
        legs += [
            Leg(12.0, (pace.surge * rng.uniform(0.5, 1.0), 0.0, 0.0, 0.0), 3.0),
            Leg(4.0, (0.0,) * 4, 3.0),
        ]
    return legs


def steps_down(rng: np.random.Generator, pace: Paces, seconds: float) -> list[Leg]:
    """Steps of depth, down and up, at slow speed ahead."""
    half_s = rng.uniform(3.0, 8.0)
    legs: list[Leg] = []
    while _length(legs) < seconds:
        u, w = pace.surge * rng.uniform(0.0, 0.6), pace.heave * rng.uniform(0.5, 1.0)
        for sink in (w, 0.0, -w, 0.0):
            legs.append(Leg(half_s, (u, 0.0, sink, 0.0), rng.uniform(0.5, 1.5)))
    return legs


def rocking(rng: np.random.Generator, pace: Paces, seconds: float) -> list[Leg]:
    """All axes at once, and steps of roll and pitch if the thrusters reach both."""
    legs: list[Leg] = []
    for leg in together(rng, pace, seconds):
        tilt = rng.uniform(-0.15, 0.15, 2) if pace.tilts else np.zeros(2)
        legs.append(Leg(leg.duration_s, leg.velocity, leg.ramp_s, float(tilt[0]), float(tilt[1])))
    return legs


MANOEUVRES: dict[str, Manoeuvre] = {
    "lawnmower": lawnmower,
    "double-S": double_s,
    "square": square,
    "together": together,
    "spin": spin,
    "depth steps": steps_down,
    "rocking": rocking,
}


def sampled(legs: list[Leg], time_s: Array, depth_m: float) -> Array:
    """Reference (n, COLUMNS) at the ticks (n,): rest for REST_S, then the legs, each from the end of the previous leg.

    A ramp is a double-S of triangular acceleration; a ramp of 0 s jumps. Heading and depth are the integrals.
    """
    out = np.zeros((len(time_s), COLUMNS))
    begin_s = REST_S
    before = np.zeros(4)
    for leg in legs:
        part = slice(*np.searchsorted(time_s, [begin_s - 1e-9, begin_s + leg.duration_s - 1e-9]))
        change = np.array(leg.velocity) - before
        share, slope = _ramp(time_s[part] - begin_s, leg.ramp_s)
        for column, axis in ((0, 0), (1, 1), (2, 2), (5, 3)):
            out[part, column] = before[axis] + share * change[axis]
            out[part, 6 + column] = slope * change[axis]
        out[part, 14], out[part, 15] = leg.roll_rad, leg.pitch_rad
        before, begin_s = np.array(leg.velocity), begin_s + leg.duration_s
    tick_s = time_s[1] - time_s[0]
    out[:, 12] = np.cumsum(out[:, 5]) * tick_s
    out[:, 13] = depth_m + np.cumsum(out[:, 2]) * tick_s
    return out


def _ramp(since_s: Array, ramp_s: float) -> tuple[Array, Array]:
    if ramp_s <= 0.0:
        return np.ones_like(since_s), np.zeros_like(since_s)
    x = np.clip(since_s / ramp_s, 0.0, 1.0)
    share = np.where(x < 0.5, 2 * x * x, 1 - 2 * (1 - x) ** 2)
    return share, np.where(x < 0.5, 4 * x, 4 * (1 - x)) / ramp_s


def _length(legs: list[Leg]) -> float:
    return sum(leg.duration_s for leg in legs)
