"""Draws missions, and effects that no library has: a diagnosis must say that something unknown acts, without a name."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from identify.challenge.site import Planted, Site, changed, sized
from identify.challenge.vehicles import DrawnVehicle

Plant = Callable[[np.random.Generator, DrawnVehicle, float], Planted]


SHORTEST_S, LONGEST_S = 300.0, 600.0
REST_S = 8.0
SINK_M_S = 0.12
LEVELS = (0.35, 0.55, 0.8, 1.0)


def vortex_shedding(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A side force whose frequency rises with speed (Strouhal number 0.2, diameter 0.2 to 0.4 m)."""
    force = sized(0.6, size) * vehicle.share / vehicle.speed**2
    wave = 2 * np.pi * 0.2 / rng.uniform(0.2, 0.4)

    return Planted("vortex_shedding", {}, changed("hull", shed_n=force, shed_k=wave), size, novel=True)


def sticking_thruster(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A thruster that freezes at its last thrust, now and then, for seconds."""
    index = int(rng.integers(4))
    del vehicle

    def apply(site: Site, rng: np.random.Generator) -> None:
        stuck = np.zeros(len(site.time_s))
        at = 10.0
        while at < site.time_s[-1]:
            at += rng.exponential(25.0 - 15.0 * size)
            long = rng.uniform(1.0, 2.0 + 1.5 * size)
            stuck[(site.time_s >= at) & (site.time_s < at + long)] = 1.0
            at += long
        site.prop = site.prop._replace(stuck=index, stuck_when=stuck)

    return Planted("sticking_thruster", {}, apply, size, novel=True)


def swirl_drag(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A force in surge proportional to yaw rate times depth, and one in sway to its square, signed, times depth."""
    gain = sized(0.5, size) * vehicle.share

    return Planted("swirl_drag", {}, changed("hull", swirl=gain), size, novel=True)


def own_wake(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """The vehicle's wake, which still pushes for seconds after a reversal."""
    force = sized(0.8, size) * vehicle.share / vehicle.speed

    return Planted("own_wake", {}, changed("hull", trail_n=force), size, novel=True)


def backlash(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """Thrust that depends on the direction in which its command changed."""
    play = sized(0.3, size) * vehicle.share**0.5

    return Planted("backlash", {}, changed("prop", play_n=play), size, novel=True)


def dragged_chain(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """Dry friction of a chain that reaches the bottom below an altitude."""
    force, share = sized(0.5, size) * vehicle.share, rng.uniform(-0.1, 0.3)

    def apply(site: Site, _: np.random.Generator) -> None:
        altitude = site.hull.floor_m - site.depth_m
        site.hull = site.hull._replace(chain_n=force, chain_m=altitude + share)

    return Planted("dragged_chain", {}, apply, size, novel=True)


def knocks(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """Blows of about a second from random sides, now and then, as from ice or fish."""
    force = sized(1.5, size) * vehicle.share

    def apply(site: Site, rng: np.random.Generator) -> None:
        at = 10.0
        while True:
            at += rng.exponential(20.0)
            long = rng.uniform(0.6, 1.6)
            part = slice(*np.searchsorted(site.time_s, [at, at + long]))
            if part.stop >= len(site.time_s):
                return
            shape = np.sin(np.pi * (site.time_s[part] - at) / long)
            way = rng.standard_normal(3)
            site.push[part, :3] += force * shape[:, None] * way / np.linalg.norm(way)
            site.push[part, 5] += 0.15 * force * shape * rng.standard_normal()

    return Planted("knocks", {}, apply, size, novel=True)


def ballast_pump(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A pump that runs for ten seconds in every 45 and shakes the vehicle up and down."""
    force, beat_s = sized(0.8, size) * vehicle.share, rng.uniform(1.0, 1.8)

    def apply(site: Site, rng: np.random.Generator) -> None:
        since = np.mod(site.time_s + rng.uniform(0, 40.0), 45.0)
        site.push[:, 2] += np.where(
            since < 10.0, force * (0.6 + np.sin(2 * np.pi * site.time_s / beat_s)), 0.0
        )

    return Planted("ballast_pump", {}, apply, size, novel=True)


NOVEL: dict[str, Plant] = {
    plant.__name__: plant
    for plant in (
        vortex_shedding, sticking_thruster, swirl_drag, own_wake, backlash, dragged_chain, knocks, ballast_pump,
    )
}  # fmt: skip
"""By name. No answer may give these names."""


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


def sampled(legs: list[Leg], time_s: Array, depth_m: float, heading: float) -> Array:
    """Reference (n, 14) at the ticks (n,): velocity (6), acceleration (6), heading, depth; REST_S at rest first."""
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
    out[:, 12] = heading + np.cumsum(out[:, 5]) * tick_s
    out[:, 13] = depth_m + np.cumsum(out[:, 2]) * tick_s
    return out
