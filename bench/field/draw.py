"""`draw(seed, number, effect)`: a field dive with a drawn vehicle, filter and sea, and at most one hidden effect."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bench.field.autopilot import Autopilot, VelocityFilter, draw_autopilot, draw_filter
from bench.field.export import COMPANION, Rates, down, telemetry_of, tlog_of
from bench.field.mission import TICK_S, Pilot, draw_mission, draw_pilot, sticks_of
from bench.field.planted_effects import PLANTS
from bench.field.scenario import Planted, scenario_of
from bench.field.simulate import Flown, Sea, Sensors, draw_sea, draw_sensors, fly
from bench.field.vehicle import FieldVehicle, draw_vehicle
from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import GRAVITY_M_S2
from bridge.vehicle.thrusters import allocation_matrix
from identify.challenge.nearest_parameters import nominal_columns

TILT = 0.01
"""A smaller tilt, rad, can't be seen reliably."""


@dataclass(frozen=True)
class Strength:
    """How strong the effect of a dive is, by degree of freedom, (6,) each.

    of_thrust: rms of the planted wrench over that of the thrust; over_sea: rms of the part that a refit of masses,
    linear and quadratic dampings leaves, over the standard deviation of the sea.
    """

    of_thrust: Array
    over_sea: Array

    @property
    def size(self) -> float:
        """The largest `over_sea` of all degrees of freedom."""
        return float(self.over_sea.max())

    @property
    def where(self) -> str:
        return DOFS[int(self.over_sea.argmax())]


def missing_wrench(flown: Flown) -> Array:
    """Wrench (n, 6), N and N m, body axes, that the true masses and dampings leave unexplained at the ticks.

    Thrust is that of the pulses by the crew's curve and lag; the sea's wrench counts as explained.
    """
    vehicle, ticks = flown.scenario.vehicle, flown.ticks
    shape = vehicle.configuration
    modelled = _columns(flown) @ np.concatenate([vehicle.mass, vehicle.linear, vehicle.quadratic])
    below = down(ticks.state)
    righting = shape.dry_mass_kg * GRAVITY_M_S2 * shape.centre_of_gravity_below_buoyancy_m
    modelled[:, :3] += shape.net_buoyancy_n * below
    modelled[:, 3] += righting * below[:, 1]
    modelled[:, 4] -= righting * below[:, 0]
    return np.asarray(modelled - ticks.nominal @ allocation_matrix(shape).T - flown.sea)


def strength_of(flown: Flown, std: Array) -> Strength:
    """Strength of a dive's effect in a sea of standard deviation `std` (6,).

    In roll and pitch the sea counts as at least the moment that tilts the vehicle by TILT.
    """
    shape = flown.scenario.vehicle.configuration
    tilts = TILT * shape.dry_mass_kg * GRAVITY_M_S2 * shape.centre_of_gravity_below_buoyancy_m
    std = np.maximum(std, np.array([0.0, 0.0, 0.0, tilts, tilts, 0.0]))
    gap = missing_wrench(flown)
    if not np.isfinite(gap).all():
        # The planted effect made the vehicle turn over ever faster. That is no dive, and it will be drawn again.
        return Strength(np.full(6, np.inf), np.full(6, np.inf))
    thrust = flown.ticks.nominal @ allocation_matrix(flown.scenario.vehicle.configuration).T
    rms = np.sqrt(np.mean(thrust**2, axis=0))
    table, value = (_columns(flown) / std[None, :, None]).reshape(-1, 18), (gap / std).reshape(-1)
    left = value - table @ np.linalg.lstsq(table, value, rcond=None)[0]
    of_thrust = np.divide(np.sqrt(np.mean(gap**2, axis=0)), rms, out=np.zeros(6), where=rms > 1e-6)
    return Strength(of_thrust, np.sqrt(np.mean(left.reshape(-1, 6) ** 2, axis=0)))


def _columns(flown: Flown) -> Array:
    """Table (n, 6, 18): the wrench per unit of each mass, linear and quadratic damping."""
    nu = flown.ticks.state[:, 7:13]
    squares = np.zeros((len(nu), 6, 6))
    for j in range(6):
        squares[:, j, j] = np.abs(nu[:, j]) * nu[:, j]
    return np.concatenate([nominal_columns(nu, flown.ticks.nu_dot), squares], axis=2)


NONE = "none"
EMPTY_EACH = 8
"""One dive in this many hides nothing."""

SMALLEST, LARGEST = 0.45, 2.2
"""Sizes relative to the typical size, drawn evenly in logarithms."""

LEAST_OVER_SEA, LARGER, TRIES, MOST_VEHICLES = 0.5, 1.6, 2, 6
"""Redrawing of weak effects.

An effect whose remainder after a refit is below LEAST_OVER_SEA is drawn LARGER times larger, up to TRIES times, and
then for another vehicle, of at most MOST_VEHICLES.
"""

LOST = 0.003
"""Share of the messages that a recording lacks."""

HIGHEST_M, MOST_TILT = 0.3, 0.6
"""A pilot ends a dive above this depth, or at a larger tilt, rad."""

DIVE_S, CHECK_S = (300.0, 600.0), (200.0, 400.0)


@dataclass(frozen=True)
class FieldCase:
    """A vehicle with its hidden effect, and two dives of it: `which` is 0 for the dive to diagnose, 1 for its check."""

    seed: int
    number: int
    vehicle: FieldVehicle
    pilot: Pilot
    autopilot: Autopilot
    sea: Sea
    sensors: Sensors
    filter: VelocityFilter
    seconds: tuple[float, float]
    planted: Planted | None
    size: float
    rates: Rates = COMPANION

    @property
    def name(self) -> str:
        return f"{self.number:03d}"

    @property
    def effect(self) -> str:
        return NONE if self.planted is None else self.planted.name

    @cached_property
    def _flown(self) -> dict[int, Flown]:
        return {}

    def flown(self, which: int) -> Flown:
        """The dive, simulated at the first request."""
        if which not in self._flown:
            self._flown[which] = _fly(self, which)
        return self._flown[which]

    def strength(self) -> Strength:
        return strength_of(self.flown(0), self.sea.std)

    def recording(self, which: int) -> bytes:
        rng = np.random.default_rng([self.seed, self.number, 33, which])
        return tlog_of(
            telemetry_of(self.flown(which), self.sensors, self.filter, self.autopilot, rng),
            LOST,
            rng,
            self.rates,
        )

    def truth(self) -> dict[str, Any]:
        """The hidden effect and the true vehicle, filter and sea, as plain data."""
        strength, vehicle, velocity_filter = self.strength(), self.vehicle, self.filter
        parameters = {} if self.planted is None else self.planted.parameters
        return {
            "name": self.name,
            "effect": [self.effect],
            "effect_parameters": {name: _digits(value) for name, value in parameters.items()},
            "drawn_size": _digits(self.size),
            "size_over_sea": _digits(strength.size if self.planted else 0.0),
            "where": strength.where if self.planted else "",
            "rms_over_thrust": [_digits(value) for value in strength.of_thrust] if self.planted else [0.0] * 6,
            "total_mass_and_inertia": [_digits(value) for value in vehicle.mass],
            "linear_damping": [_digits(value) for value in vehicle.linear],
            "quadratic_damping": [_digits(value) for value in vehicle.quadratic],
            "velocity_filter": {
                "late_s": _digits(velocity_filter.late_s), "smooth_s": _digits(velocity_filter.smooth_s),
                "noise_m_s": _digits(velocity_filter.noise_m_s), "memory_s": _digits(velocity_filter.memory_s),
            },
            "sea": {
                "standard_deviation": [_digits(value) for value in self.sea.std],
                "memory_s": _digits(self.sea.memory_s),
            },
            "seconds": [_digits(value) for value in self.seconds],
        }  # fmt: skip


def _digits(value: float) -> float:
    return float(f"{value:.6g}")


def effects_of(seed: int, count: int) -> list[str]:
    """The effect of each of `count` dives, in a drawn order.

    Every effect appears equally often, as nearly as possible; one dive in EMPTY_EACH hides nothing.
    """
    empty = round(count / EMPTY_EACH)
    rng = np.random.default_rng([seed, 30])
    names: list[str] = []
    while len(names) < count - empty:
        names += [str(name) for name in rng.permutation(list(PLANTS))]
    whole = [NONE] * empty + names[: count - empty]
    return [whole[place] for place in rng.permutation(count)]


def draw(
    seed: int, number: int, effect: str, size: float | None = None, seconds: float | None = None
) -> FieldCase:
    """The case of a number.

    An effect that is too weak is drawn larger unless `size` is given; a vehicle that would come near the surface or
    capsize is drawn again. seconds: length of both dives, drawn if None.
    """
    for attempt in range(MOST_VEHICLES):
        case = _drawn(seed, number, effect, size, seconds, attempt)
        shows = effect == NONE or size is not None or case.strength().size >= LEAST_OVER_SEA
        if shows and all(stays_down(case.flown(which)) for which in (0, 1)):
            break
    return case


def _drawn(
    seed: int, number: int, effect: str, size: float | None, seconds: float | None, attempt: int
) -> FieldCase:
    rng = np.random.default_rng([seed, number, 31, attempt])
    vehicle = draw_vehicle(rng, f"rov-{number:03d}")
    pilot = draw_pilot(rng, vehicle)
    autopilot = draw_autopilot(rng, vehicle, pilot)
    parts = (
        vehicle,
        pilot,
        autopilot,
        draw_sea(rng, vehicle, pilot, autopilot),
        draw_sensors(rng),
        draw_filter(rng),
    )
    drawn_s = rng.uniform(*DIVE_S), rng.uniform(*CHECK_S)
    both_s = drawn_s if seconds is None else (seconds, seconds)
    drawn = float(np.exp(rng.uniform(np.log(SMALLEST), np.log(LARGEST))))
    if effect == NONE:
        return FieldCase(seed, number, *parts, both_s, None, 0.0)
    case = _planted(seed, number, parts, both_s, effect, drawn if size is None else size)
    for _ in range(TRIES if size is None else 0):
        if case.strength().size >= LEAST_OVER_SEA:
            break
        case = _planted(seed, number, parts, both_s, effect, LARGER * case.size)
    return case


def stays_down(flown: Flown) -> bool:
    """Whether a pilot would have gone on with the dive: under water, and not on its side."""
    level = down(flown.ticks.state)[:, 2]
    return float(flown.ticks.state[:, 2].min()) > HIGHEST_M and float(level.min()) > np.cos(MOST_TILT)


def _planted(
    seed: int,
    number: int,
    parts: tuple[FieldVehicle, Pilot, Autopilot, Sea, Sensors, VelocityFilter],
    seconds: tuple[float, float],
    effect: str,
    size: float,
) -> FieldCase:
    planted = PLANTS[effect](np.random.default_rng([seed, number, 32]), parts[0], parts[1], size)
    return FieldCase(seed, number, *parts, seconds, planted, size)


def _fly(case: FieldCase, which: int) -> Flown:
    # Mission, sea and the effect's own draws have separate streams: an effect of size zero changes nothing.
    rng, of_sea, of_effect = (
        np.random.default_rng([case.seed, case.number, part, which]) for part in (34, 35, 36)
    )
    ticks = int(case.seconds[which] / TICK_S)
    depth_m, heading = rng.uniform(2.0, 4.0), rng.uniform(-np.pi, np.pi)
    sticks = sticks_of(rng, draw_mission(rng, case.seconds[which]), case.pilot, ticks)
    scenario = scenario_of(case.vehicle, case.pilot, ticks, depth_m)
    if case.planted is not None:
        case.planted.apply(scenario, of_effect)
    return fly(scenario, case.autopilot, sticks, case.sea, case.sensors, heading, of_sea)
