"""Plants effects in the thrusters, in other forms than the library's."""

import numpy as np

from identify.challenge.site import Planted, Site, changed, sized
from identify.challenge.vehicles import LAG_S, DrawnVehicle


def thrust_gain(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    gain = 1.0 + rng.choice([-1.0, 1.0]) * sized(0.015, size)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(way=gain * site.prop.way)

    return Planted("thrust_gain", {"gain": float(gain)}, apply, size)


def thrust_curve(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """A loss that decreases exponentially with thrust."""
    loss = sized(0.06, size)

    return Planted("thrust_curve", {"low_end_loss": loss}, changed("prop", low_end=loss), size)


def reverse_thrust_loss(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """A loss of reverse thrust that sets in over some tenths of a newton."""
    loss = sized(0.04, size)

    return Planted("reverse_thrust_loss", {"gain": 1.0 - loss}, changed("prop", reverse=loss), size)


def dead_zone(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A dead zone with soft edges."""
    width = sized(0.12, size) * vehicle.share**0.5

    return Planted("dead_zone", {"half_width": width}, changed("prop", dead_n=width), size)


def saturation(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A soft limit: between twice the thrust needed to accelerate to the top speed (size 0) and half of it (size 1)."""
    limit = float(vehicle.top_thrust_n * 2.0 * 0.25**size)

    return Planted("saturation", {"limit": limit}, changed("prop", limit_n=limit), size)


def inflow_loss(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A loss by the speed of advance with a quadratic part."""
    cruise_n = 0.5 * vehicle.top_thrust_n
    slope = sized(0.04, size) * float(np.sqrt(cruise_n)) / vehicle.speed

    return Planted("inflow_loss", {"slope": slope}, changed("prop", inflow=slope, inflow_2=0.2 * slope), size)


def hull_interaction(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """A share of thrust lost by the thrusters whose wash meets the hull; the share grows with thrust."""
    loss = sized(0.04, size)

    return Planted("hull_interaction", {"loss": loss}, changed("prop", wash=loss), size)


def weak_thruster(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A weak thruster that loses a larger share at higher thrust."""
    index = int(rng.integers(len(vehicle.configuration.thrusters)))
    gain = 1.0 - sized(0.05, size)

    def apply(site: Site, _: np.random.Generator) -> None:
        each = site.prop.each.copy()
        each[index] = gain
        site.prop = site.prop._replace(each=each)

    parameters = {"thruster": float(index + 1), "gain": gain}
    return Planted("weak_thruster", parameters, apply, size, number=index + 1)


def thruster_misalignment(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A thruster that is turned and moved by a centimetre; a vertical thruster is turned about the body's x."""
    index = int(rng.integers(len(vehicle.configuration.thrusters)))
    angle = float(rng.choice([-1.0, 1.0]) * sized(0.03, size))
    moved = rng.uniform(-0.01, 0.01, 3) * vehicle.share ** (1 / 3)

    def apply(site: Site, _: np.random.Generator) -> None:
        way, place = site.prop.way.copy(), site.prop.place.copy()
        x, y, z = way[index]
        cos, sin = np.cos(angle), np.sin(angle)
        if abs(z) > 0.5:
            way[index] = x, y * cos - z * sin, y * sin + z * cos
        else:
            way[index] = x * cos - y * sin, x * sin + y * cos, z
        place[index] += moved
        site.prop = site.prop._replace(way=way, place=place)

    parameters = {"thruster": float(index + 1), "angle": angle}
    return Planted("thruster_misalignment", parameters, apply, size, number=index + 1)


def thruster_lag(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """A second-order lag: two equal lags in series, expressed by their total delay."""
    total = LAG_S + sized(0.03, size)

    apply = changed("prop", lag_s=0.5 * total, second_s=0.5 * total)
    return Planted("thruster_lag", {"time_constant": total}, apply, size)


def command_delay(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """A delay that jitters by a tenth."""
    delay = sized(0.03, size)

    def apply(site: Site, rng: np.random.Generator) -> None:
        late = delay * (1.0 + 0.1 * rng.uniform(-1, 1, len(site.prop.delay)))
        site.prop = site.prop._replace(delay=late)

    return Planted("command_delay", {"delay": delay}, apply, size)


def battery_sag(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """Thrust that follows a discharge curve, which is steepest at its end; expressed by the mean slope."""
    lost = sized(0.05, size)
    volts = 1.0 - (1.0 - lost) ** (1 / 1.9)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(sag=volts, sag_s=480.0)
        site.sag, site.sag_s = volts, 480.0

    return Planted("battery_sag", {"rate": 0.9 * lost / 480.0}, apply, size)


def load_sag(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """A voltage that drops under load, with a memory of some tenths of a second."""
    resistance = sized(0.1, size)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.prop = site.prop._replace(load=resistance)
        site.ripple = resistance

    return Planted("load_sag", {"resistance": resistance}, apply, size)


def propeller_torque(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """Propellers that all turn the same way, with a torque that grows slightly faster than thrust."""
    torque = sized(0.003, size) * vehicle.share ** (1 / 3)

    apply = changed("prop", torque=torque)
    return Planted("propeller_torque", {"K": 1.1 * torque, "N": 1.1 * torque}, apply, size)


def thrust_bias(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A horizontal force and a yaw moment on the body that vary by a tenth."""
    angle = rng.uniform(-np.pi, np.pi)
    force = sized(0.2, size) * vehicle.share
    bias = force * np.array([np.cos(angle), np.sin(angle), 0.0, 0.0, 0.0, rng.uniform(-0.2, 0.2)])

    def apply(site: Site, _: np.random.Generator) -> None:
        site.push += (1.0 + 0.1 * np.sin(0.013 * site.time_s))[:, None] * bias

    parameters = {"X": float(bias[0]), "Y": float(bias[1]), "Z": 0.0, "N": float(bias[5])}
    return Planted("thrust_bias", parameters, apply, size)


ALL = (
    thrust_gain, thrust_curve, reverse_thrust_loss, dead_zone, saturation, inflow_loss, hull_interaction, weak_thruster,
    thruster_misalignment, thruster_lag, command_delay, battery_sag, load_sag, propeller_torque, thrust_bias,
)  # fmt: skip
