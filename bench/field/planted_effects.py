"""Plants the effects that a field dive may hide: in the water, at the hull, in the thrusters and in their supply.

Each function draws one effect of a `size` (1 for a typical one, 0 for none) and returns how to put it into a dive with
its parameters as planted. The forms are those of the effects' own equations, apart from a soft edge, an amplitude that
varies by a twentieth or a damping that grows a little with speed.
"""

from collections.abc import Callable

import numpy as np

from bench.field.mission import Pilot
from bench.field.scenario import FieldScenario, Planted
from bench.field.vehicle import LAG_S, FieldVehicle
from bridge.arrays import Array
from bridge.vehicle.config import GRAVITY_M_S2
from identify.challenge.planted_effects import add_first_moments, random_sign
from identify.challenge.scenario import changed

USUAL_M_S = 0.15
"""Speed of the water past the body at which the drag on it by waves is taken."""

SURGE, SWAY, HEAVE = range(3)


def sum_of_sines(
    rng: np.random.Generator, time_s: Array, low_s: float, high_s: float, count: int
) -> tuple[Array, Array]:
    """A sum of `count` sines with drawn periods, of mean square 1 over the times, and its derivative; (n,) each."""
    value, rate = np.zeros_like(time_s), np.zeros_like(time_s)
    for period_s in rng.uniform(low_s, high_s, count):
        omega, phase = 2 * np.pi / period_s, rng.uniform(0, 2 * np.pi)
        value += np.sin(omega * time_s + phase)
        rate += omega * np.cos(omega * time_s + phase)
    size = float(np.sqrt(np.mean(value**2)))
    return value / size, rate / size


def steady_current(rng: np.random.Generator, _: FieldVehicle, __: Pilot, size: float) -> Planted:
    """A current that varies slowly by a twentieth of itself."""
    speed, angle = 0.13 * size, rng.uniform(-np.pi, np.pi)
    north, east = float(speed * np.cos(angle)), float(speed * np.sin(angle))

    def apply(scenario: FieldScenario, rng: np.random.Generator) -> None:
        water = scenario.water()
        for column, mean in ((0, north), (1, east)):
            value, rate = sum_of_sines(rng, scenario.time_s, 200.0, 600.0, 3)
            water[:, column] += mean + 0.05 * speed * value
            water[:, 3 + column] += 0.05 * speed * rate

    return Planted("steady_current", {"north": north, "east": east}, apply)


def varying_current(rng: np.random.Generator, _: FieldVehicle, __: Pilot, size: float) -> Planted:
    """A narrow band of periods, north and east independently; its parameters are those of a sine of equal power."""
    amplitude, period_s = 0.1 * size, float(np.exp(rng.uniform(np.log(18.0), np.log(120.0))))

    def apply(scenario: FieldScenario, rng: np.random.Generator) -> None:
        water = scenario.water()
        for column in (0, 1):
            value, rate = sum_of_sines(rng, scenario.time_s, 0.97 * period_s, 1.03 * period_s, 3)
            water[:, column] += 0.5 * amplitude * value
            water[:, 3 + column] += 0.5 * amplitude * rate

    return Planted("varying_current", {"amplitude": amplitude, "period": period_s}, apply)


def waves(rng: np.random.Generator, vehicle: FieldVehicle, _: Pilot, size: float) -> Planted:
    """A narrow spectrum of deep-water waves whose orbits fade with depth; the parameter is the force on a body at
    rest."""
    speed, period_s, course = 0.06 * size, rng.uniform(2.5, 7.0), rng.uniform(-np.pi, np.pi)
    omega = 2 * np.pi / period_s

    def apply(scenario: FieldScenario, rng: np.random.Generator) -> None:
        water = scenario.water()
        for share in (0.94, 1.0, 1.06):
            w, phase = omega * share, rng.uniform(0, 2 * np.pi)
            cos, sin = np.cos(w * scenario.time_s + phase), np.sin(w * scenario.time_s + phase)
            part = speed / np.sqrt(3)
            for column, way in ((6, np.cos(course)), (7, np.sin(course))):
                water[:, column] += part * way * cos
                water[:, 3 + column] -= part * way * w * sin
            water[:, 8] -= part * sin
            water[:, 11] -= part * w * cos
        scenario.hull = scenario.hull._replace(wave_number=omega**2 / GRAVITY_M_S2)

    # Water flowing past the body at USUAL_M_S: inertia, and drag a quarter of a period behind.
    drag = np.array([vehicle.drag(axis, USUAL_M_S) / USUAL_M_S for axis in range(3)])
    level, upright = (
        float(np.hypot(vehicle.mass[axes].mean() * omega, drag[axes].mean()) * speed)
        for axes in ([SURGE, SWAY], [HEAVE])
    )
    return Planted("waves", {"force_amplitude": max(level, upright), "period": period_s}, apply)


def tether(rng: np.random.Generator, _: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    """A level spring to an anchor some metres away; parameters: its pull at the start of the dive and its stiffness."""
    stiffness = 0.012 * pilot.surge_n * size
    far, angle = rng.uniform(1.0, 6.0), rng.uniform(-np.pi, np.pi)
    north, east = float(far * np.cos(angle)), float(far * np.sin(angle))

    apply = changed("hull", grip=stiffness, anchor_n=north, anchor_e=east)
    parameters = {"stiffness": stiffness, "north": stiffness * north, "east": stiffness * east}
    return Planted("tether", parameters, apply)


def net_buoyancy(rng: np.random.Generator, vehicle: FieldVehicle, _: Pilot, size: float) -> Planted:
    force = random_sign(rng) * 2.0 * vehicle.share * size

    return Planted("net_buoyancy", {"force": force}, changed("hull", buoyancy_n=force))


def thrust_bias(rng: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    """A level force on the body and a yaw moment, which vary by a twentieth."""
    angle, force = rng.uniform(-np.pi, np.pi), 0.12 * pilot.surge_n * size
    moment = force * rng.uniform(-0.1, 0.1) * vehicle.share ** (1 / 3)
    bias = np.array([force * np.cos(angle), force * np.sin(angle), 0.0, 0.0, 0.0, moment])

    def apply(scenario: FieldScenario, _: np.random.Generator) -> None:
        scenario.push += (1.0 + 0.05 * np.sin(0.013 * scenario.time_s))[:, None] * bias

    parameters = {"X": float(bias[0]), "Y": float(bias[1]), "Z": 0.0, "N": float(bias[5])}
    return Planted("thrust_bias", parameters, apply)


def drag_asymmetry(_: np.random.Generator, vehicle: FieldVehicle, __: Pilot, size: float) -> Planted:
    """Surge drag astern, linear and quadratic, multiplied by a ratio."""
    more = 0.6 * size

    apply = changed("hull", astern=more, asymmetry=more * float(vehicle.linear[0]))
    return Planted("drag_asymmetry", {"ratio": 1.0 + more}, apply)


def cross_flow_lift(rng: np.random.Generator, vehicle: FieldVehicle, _: Pilot, size: float) -> Planted:
    lift = 0.8 * float(vehicle.quadratic[1]) * size
    lever = random_sign(rng) * rng.uniform(0.03, 0.12) * vehicle.share ** (1 / 3)

    apply = changed("hull", lift_y=lift, lift_n=lever * lift)
    return Planted("cross_flow_lift", {"Y_uv": lift, "N_uv": float(lever * lift)}, apply)


def coupled_damping(rng: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    """Damping that grows a little with speed; the parameters are its values in the middle of the dive's speeds."""
    y_r = random_sign(rng) * 0.5 * pilot.sway_n / pilot.turn * size * rng.uniform(0.6, 1.4)
    same_sign, length = float(np.sign(y_r)), vehicle.share ** (1 / 3)
    n_v = same_sign * 0.08 * pilot.sway_n * length / 0.3 * size * rng.uniform(0.6, 1.4)

    apply = changed("hull", y_r=y_r, n_v=n_v)
    return Planted("coupled_damping", {"Y_r": 1.08 * y_r, "N_v": 1.12 * n_v}, apply)


def munk_moment(rng: np.random.Generator, vehicle: FieldVehicle, _: Pilot, size: float) -> Planted:
    """A Munk moment in yaw as of fins or a frame, in addition to that of the masses."""
    of_masses = float(vehicle.mass[1] - vehicle.mass[0])
    more = random_sign(rng) * 6.0 * vehicle.share * size

    apply = changed("hull", munk=1.0, munk_yaw_kg=more)
    return Planted("munk_moment", {"gain": 1.0 + more / of_masses}, apply)


def fouling(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    rate = 1.2e-3 * size

    def apply(scenario: FieldScenario, _: np.random.Generator) -> None:
        scenario.grown = rate

    return Planted("fouling", {"rate": rate}, apply)


def cg_offset(rng: np.random.Generator, vehicle: FieldVehicle, _: Pilot, size: float) -> Planted:
    """First moments of the mass, trimmed level; half the time an added mass that couples sway and yaw instead."""
    mass = vehicle.configuration.dry_mass_kg
    off = 0.05 * size * mass * vehicle.share ** (1 / 3)
    of_water = rng.random() < 0.5
    angle = 0.0 if of_water else rng.uniform(-0.5, 0.5)
    x, y = random_sign(rng) * off * float(np.cos(angle)), off * float(np.sin(angle))

    def apply(scenario: FieldScenario, _: np.random.Generator) -> None:
        add_first_moments(scenario.added if of_water else scenario.rigid, x, y, of_water)

    return Planted("cg_offset", {"x": x / mass, "y": y / mass}, apply)


WATER_AND_HULL = (
    steady_current, varying_current, waves, tether, net_buoyancy, thrust_bias, drag_asymmetry, cross_flow_lift,
    coupled_damping, munk_moment, fouling, cg_offset,
)  # fmt: skip


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

    def apply(scenario: FieldScenario, _: np.random.Generator) -> None:
        each = scenario.prop.each.copy()
        each[index] = gain
        scenario.prop = scenario.prop._replace(each=each)

    return Planted("weak_thruster", {"thruster": float(index + 1), "gain": gain}, apply)


def thruster_misalignment(rng: np.random.Generator, _: FieldVehicle, __: Pilot, size: float) -> Planted:
    """A level thruster turned about the vertical."""
    index, angle = _one_level(rng), random_sign(rng) * min(0.3 * size, 0.9)

    def apply(scenario: FieldScenario, _: np.random.Generator) -> None:
        way = scenario.prop.way.copy()
        x, y, z = way[index]
        cos, sin = np.cos(angle), np.sin(angle)
        way[index] = x * cos - y * sin, x * sin + y * cos, z
        scenario.prop = scenario.prop._replace(way=way)

    return Planted("thruster_misalignment", {"thruster": float(index + 1), "angle": angle}, apply)


def reverse_thrust_loss(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    loss = min(0.22 * size, 0.9)

    return Planted("reverse_thrust_loss", {"gain": 1.0 - loss}, changed("prop", reverse=loss))


def dead_zone(_: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    width = 0.15 * _top_n(vehicle, pilot) * size

    return Planted("dead_zone", {"half_width": width}, changed("prop", dead_n=width))


def saturation(_: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    """A soft limit, from the thrust at full stick downwards."""
    limit = _top_n(vehicle, pilot) * 1.1 / (0.7 + size) if size > 0 else 0.0

    return Planted("saturation", {"limit": limit}, changed("prop", limit_n=limit))


def thrust_curve(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    """A loss that falls linearly, to zero at full thrust."""
    loss = min(0.35 * size, 0.9)

    return Planted("thrust_curve", {"low_end_loss": loss}, changed("prop", low_line=loss))


def inflow_loss(_: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    slope = 0.35 * float(np.sqrt(_top_n(vehicle, pilot))) / 0.45 * size

    return Planted("inflow_loss", {"slope": slope}, changed("prop", inflow=slope))


def hull_interaction(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    """A loss of thrust of those thrusters whose wash meets the hull: those that push outwards."""
    loss = min(0.2 * size, 0.9)

    return Planted("hull_interaction", {"loss": loss}, changed("prop", wash=loss))


def thruster_lag(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    lag_s = LAG_S + 0.2 * size

    return Planted("thruster_lag", {"time_constant": lag_s}, changed("prop", lag_s=lag_s))


def command_delay(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    """A delay of up to 0.3 s."""
    delay_s = min(0.15 * size, 0.3)

    def apply(scenario: FieldScenario, _: np.random.Generator) -> None:
        scenario.prop = scenario.prop._replace(delay=np.full(len(scenario.prop.delay), delay_s))

    return Planted("command_delay", {"delay": delay_s}, apply)


def battery_sag(_: np.random.Generator, __: FieldVehicle, ___: Pilot, size: float) -> Planted:
    rate = min(5e-4 * size, 1.2e-3)

    def apply(scenario: FieldScenario, _: np.random.Generator) -> None:
        scenario.felt_fall = rate

    return Planted("battery_sag", {"rate": rate}, apply)


def load_sag(_: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    """A resistance that takes about 12 % of the voltage while all level thrusters push as at full stick."""
    full_a = 4 * 0.08 * _top_n(vehicle, pilot) ** 1.5
    resistance = min(min(0.12 * size, MOST_LOST) * 16.0 / full_a, MOST_OHM)

    def apply(scenario: FieldScenario, _: np.random.Generator) -> None:
        scenario.felt_ohm = resistance

    return Planted("load_sag", {"resistance": resistance}, apply)


def propeller_torque(_: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, size: float) -> Planted:
    """Propellers that all turn the same way, with a torque that grows a little faster than thrust; the parameters are
    its values at half of full stick."""
    torque = 0.03 * vehicle.share ** (1 / 3) * size
    at_half = torque * (0.5 * _top_n(vehicle, pilot)) ** 0.1

    return Planted("propeller_torque", {"K": at_half, "N": at_half}, changed("prop", torque=torque))


PLANTS: dict[str, Plant] = {
    plant.__name__: plant
    for plant in (
        *WATER_AND_HULL, weak_thruster, thruster_misalignment, reverse_thrust_loss, dead_zone, saturation,
        thrust_curve, inflow_loss, hull_interaction, thruster_lag, command_delay, battery_sag, load_sag,
        propeller_torque,
    )
}  # fmt: skip
"""All plants, by the name that a diagnosis has to give."""
