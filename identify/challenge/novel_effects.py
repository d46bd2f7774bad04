"""Effects that no library has: a diagnosis must say that something unknown acts, without a name."""

import numpy as np

from identify.challenge.planted_effects import Plant
from identify.challenge.scenario import Planted, Scenario, changed, sized
from identify.challenge.vehicles import DrawnVehicle

HORIZONTAL = 4
"""The first thrusters of each drawn vehicle push horizontally."""


def vortex_shedding(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A side force whose frequency rises with speed (Strouhal number 0.2, diameter 0.2 to 0.4 m)."""
    force = sized(0.6, size) * vehicle.share / vehicle.speed**2
    wave = 2 * np.pi * 0.2 / rng.uniform(0.2, 0.4)

    return Planted("vortex_shedding", {}, changed("hull", shed_n=force, shed_k=wave), size, novel=True)


def sticking_thruster(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """A thruster that freezes at its last thrust, now and then, for seconds."""
    index = int(rng.integers(HORIZONTAL))

    def apply(scenario: Scenario, rng: np.random.Generator) -> None:
        stuck = np.zeros(len(scenario.time_s))
        at = 10.0
        while at < scenario.time_s[-1]:
            at += rng.exponential(25.0 - 15.0 * size)
            long = rng.uniform(1.0, 2.0 + 1.5 * size)
            stuck[(scenario.time_s >= at) & (scenario.time_s < at + long)] = 1.0
            at += long
        scenario.prop = scenario.prop._replace(stuck=index, stuck_when=stuck)

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
    force, above_m = sized(0.5, size) * vehicle.share, rng.uniform(-0.1, 0.3)

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        altitude = scenario.hull.floor_m - scenario.depth_m
        scenario.hull = scenario.hull._replace(chain_n=force, chain_m=altitude + above_m)

    return Planted("dragged_chain", {}, apply, size, novel=True)


def knocks(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """Blows of about a second from random sides, now and then, as from ice or fish."""
    force = sized(1.5, size) * vehicle.share

    def apply(scenario: Scenario, rng: np.random.Generator) -> None:
        at = 10.0
        while True:
            at += rng.exponential(20.0)
            long = rng.uniform(0.6, 1.6)
            part = slice(*np.searchsorted(scenario.time_s, [at, at + long]))
            if part.stop >= len(scenario.time_s):
                return
            shape = np.sin(np.pi * (scenario.time_s[part] - at) / long)
            way = rng.standard_normal(3)
            scenario.push[part, :3] += force * shape[:, None] * way / np.linalg.norm(way)
            scenario.push[part, 5] += 0.15 * force * shape * rng.standard_normal()

    return Planted("knocks", {}, apply, size, novel=True)


def ballast_pump(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A pump that runs for ten seconds in every 45 and shakes the vehicle up and down."""
    force, beat_s = sized(0.8, size) * vehicle.share, rng.uniform(1.0, 1.8)

    def apply(scenario: Scenario, rng: np.random.Generator) -> None:
        since = np.mod(scenario.time_s + rng.uniform(0, 40.0), 45.0)
        scenario.push[:, 2] += np.where(
            since < 10.0, force * (0.6 + np.sin(2 * np.pi * scenario.time_s / beat_s)), 0.0
        )

    return Planted("ballast_pump", {}, apply, size, novel=True)


NOVEL: dict[str, Plant] = {
    plant.__name__: plant
    for plant in (
        vortex_shedding, sticking_thruster, swirl_drag, own_wake, backlash, dragged_chain, knocks, ballast_pump,
    )
}  # fmt: skip
"""By name. No answer may give these names."""
