"""Effects planted in the thrusters and their supply, and all effects that a field dive may hide, by name.

Each takes a size: 1 for a typical effect, 0 for none. Except for a soft edge, an amplitude that varies by a twentieth
or a damping that grows a little, the forms are those of the effects' own equations. Parameters are the planted
values.
"""

from collections.abc import Callable

import numpy as np

from bench.field import plants_water
from bench.field.mission import Pilot
from bench.field.plants_water import sign
from bench.field.site import FieldSite, Planted
from bench.field.vehicle import LAG_S, FieldVehicle

MOST_OHM, MOST_LOST = 0.3, 0.25
"""Limits of the resistance of a supply that still dives, ohm, and of the share of voltage lost."""

Plant = Callable[[np.random.Generator, FieldVehicle, Pilot, float], Planted]


def _top_n(vehicle: FieldVehicle, pilot: Pilot) -> float:
    """Thrust of a level thruster at full stick ahead, N."""
    return pilot.surge_n / sum(abs(t.direction[0]) for t in vehicle.configuration.thrusters)


def _one_level(rng: np.random.Generator) -> int:
    """Draw the place of a level thruster; upright thrusters hardly push in a dive at constant depth."""
    return int(rng.integers(4))


def weak_thruster(rng: np.random.Generator, _: FieldVehicle, __: Pilot, size: float) -> Planted:
    index, gain = _one_level(rng), 1.0 - min(0.3 * size, 0.9)

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        each = site.prop.each.copy()
        each[index] = gain
        site.prop = site.prop._replace(each=each)

    return Planted("weak_thruster", {"thruster": float(index + 1), "gain": gain}, apply)


def thruster_misalignment(rng: np.random.Generator, _: FieldVehicle, __: Pilot, size: float) -> Planted:
    """A level thruster turned about the vertical."""
    index, angle = _one_level(rng), sign(rng) * min(0.3 * size, 0.9)

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        way = site.prop.way.copy()
        x, y, z = way[index]
        cos, sin = np.cos(angle), np.sin(angle)
        way[index] = x * cos - y * sin, x * sin + y * cos, z
        site.prop = site.prop._replace(way=way)

    return Planted("thruster_misalignment", {"thruster": float(index + 1), "angle": angle}, apply)


def reverse_thrust_loss(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    loss = min(0.22 * size, 0.9)

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(reverse=loss)

    return Planted("reverse_thrust_loss", {"gain": 1.0 - loss}, apply)


def dead_zone(_: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    width = 0.15 * _top_n(vehicle, pilot) * size

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(dead_n=width)

    return Planted("dead_zone", {"half_width": width}, apply)


def saturation(_: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    """A soft limit, from the thrust at full stick downwards."""
    limit = _top_n(vehicle, pilot) * 1.1 / (0.7 + size) if size > 0 else 0.0

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(limit_n=limit)

    return Planted("saturation", {"limit": limit}, apply)


def thrust_curve(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    """A loss that falls linearly, to zero at full thrust."""
    loss = min(0.35 * size, 0.9)

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(low_line=loss)

    return Planted("thrust_curve", {"low_end_loss": loss}, apply)


def inflow_loss(_: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    slope = 0.35 * float(np.sqrt(_top_n(vehicle, pilot))) / 0.45 * size

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(inflow=slope)

    return Planted("inflow_loss", {"slope": slope}, apply)


def hull_interaction(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    """A loss of thrust of those thrusters whose wash meets the hull: those that push outwards."""
    loss = min(0.2 * size, 0.9)

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(wash=loss)

    return Planted("hull_interaction", {"loss": loss}, apply)


def thruster_lag(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    lag_s = LAG_S + 0.2 * size

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(lag_s=lag_s)

    return Planted("thruster_lag", {"time_constant": lag_s}, apply)


def command_delay(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    """A delay of up to 0.3 s."""
    delay_s = min(0.15 * size, 0.3)

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(delay=np.full(len(site.prop.delay), delay_s))

    return Planted("command_delay", {"delay": delay_s}, apply)


def battery_sag(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    rate = min(5e-4 * size, 1.2e-3)

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        site.felt_fall = rate

    return Planted("battery_sag", {"rate": rate}, apply)


def load_sag(_: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    """A resistance that takes about 12 % of the voltage while all level thrusters push as at full stick."""
    full_a = 4 * 0.08 * _top_n(vehicle, pilot) ** 1.5
    resistance = min(min(0.12 * size, MOST_LOST) * 16.0 / full_a, MOST_OHM)

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        site.felt_ohm = resistance

    return Planted("load_sag", {"resistance": resistance}, apply)


def propeller_torque(_: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    """Propellers that all turn the same way, with a torque that grows a little faster than thrust; the parameters are
    its values at half of full stick."""
    torque = 0.03 * vehicle.share ** (1 / 3) * size
    at_half = torque * (0.5 * _top_n(vehicle, pilot)) ** 0.1

    def apply(site: FieldSite, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(torque=torque)

    return Planted("propeller_torque", {"K": at_half, "N": at_half}, apply)


PLANTS: dict[str, Plant] = {
    plant.__name__: plant
    for plant in (
        *plants_water.ALL, weak_thruster, thruster_misalignment, reverse_thrust_loss, dead_zone, saturation,
        thrust_curve, inflow_loss, hull_interaction, thruster_lag, command_delay, battery_sag, load_sag,
        propeller_torque,
    )
}  # fmt: skip
"""All plants, by the name that a diagnosis has to give."""
