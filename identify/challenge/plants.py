"""Plants the effects that a diagnosis must name, in other forms than the library's."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from identify.challenge import plants_thrust, plants_water
from identify.challenge.site import Planted, Site, sized
from identify.challenge.vehicles import DrawnVehicle

Array = NDArray[np.float64]
Plant = Callable[[np.random.Generator, DrawnVehicle, float], Planted]


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def quadratic_drag(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """|u|^1.8 on every axis; expressed as the u|u| drag that is equal at 0.6 of the top speed."""
    top = np.array([vehicle.speed, vehicle.sway, 0.1, 0.2, 0.2, vehicle.turn])
    drag = sized(0.1, size) * vehicle.damping * top**-0.8 * np.exp(0.2 * rng.standard_normal(6))

    def apply(site: Site, _: np.random.Generator) -> None:
        site.hull = site.hull._replace(drag=drag)

    alike = drag * (0.6 * top) ** -0.2
    names = ("X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr")
    return Planted("quadratic_drag", dict(zip(names, alike.tolist(), strict=True)), apply, size)


def drag_asymmetry(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    ratio = sized(0.05, size)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.hull = site.hull._replace(asymmetry=ratio * vehicle.damping[0])

    return Planted("drag_asymmetry", {"ratio": 1.0 + ratio}, apply, size)


def cross_flow_lift(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """Lift that stalls at large drift angles."""
    lift = sized(0.06, size) * vehicle.damping[1] / vehicle.speed
    lever = _sign(rng) * rng.uniform(0.05, 0.25)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.hull = site.hull._replace(lift_y=lift, lift_n=lever * lift)

    return Planted("cross_flow_lift", {"Y_uv": float(lift), "N_uv": float(lever * lift)}, apply, size)


def coupled_damping(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    both = _sign(rng) * sized(0.04, size) * float(np.sqrt(vehicle.damping[1] * vehicle.damping[5]))
    y_r, n_v = both * rng.uniform(0.6, 1.4), both * rng.uniform(0.6, 1.4)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.hull = site.hull._replace(y_r=y_r, n_v=n_v)

    return Planted("coupled_damping", {"Y_r": y_r * 1.1, "N_v": n_v * 1.1}, apply, size)


def munk_moment(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """Larger or smaller Munk moments, by a share that fades at large drift."""
    share = _sign(rng) * sized(0.2, size)
    mass = vehicle.mass

    def apply(site: Site, _: np.random.Generator) -> None:
        site.hull = site.hull._replace(
            munk=share, munk_yaw_kg=float(mass[1] - mass[0]), munk_pitch_kg=float(mass[0] - mass[2])
        )

    return Planted("munk_moment", {"gain": 1.0 + share}, apply, size)


def fouling(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """Drag that grows ever more slowly; expressed as the steady growth with the same mean."""
    total = sized(0.06, size)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.fouled, site.fouled_s = total, 480.0

    return Planted("fouling", {"rate": 1.25 * total / 480.0}, apply, size)


def cg_offset(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """First moments of the mass, with level trim; in half of the cases an added mass that couples sway and yaw."""
    mass = vehicle.configuration.dry_mass_kg
    off = sized(0.008, size) * mass * vehicle.share ** (1 / 3)
    of_water = rng.random() < 0.5
    angle = 0.0 if of_water else rng.uniform(-0.5, 0.5)
    x, y = _sign(rng) * off * np.cos(angle), off * np.sin(angle)

    def apply(site: Site, _: np.random.Generator) -> None:
        matrix = site.added if of_water else site.rigid
        matrix[1, 5] += x
        matrix[5, 1] += x
        matrix[0, 5] -= y
        matrix[5, 0] -= y
        if not of_water:
            matrix[2, 4] -= x
            matrix[4, 2] -= x
            matrix[2, 3] += y
            matrix[3, 2] += y

    return Planted("cg_offset", {"x": float(x) / mass, "y": float(y) / mass}, apply, size)


def pitch_roll_coupling(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A lower centre of mass: a larger righting moment, and pitch while the vehicle accelerates."""
    lower = sized(0.004, size)
    first = vehicle.configuration.dry_mass_kg * lower

    def apply(site: Site, _: np.random.Generator) -> None:
        site.centre_m += lower
        site.rigid[0, 4] += first
        site.rigid[4, 0] += first
        site.rigid[1, 3] -= first
        site.rigid[3, 1] -= first

    return Planted("pitch_roll_coupling", {"height": lower}, apply, size)


def net_buoyancy(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A buoyancy force (up or down) that falls slightly with depth, as air spaces are compressed."""
    force = _sign(rng) * sized(0.4, size) * vehicle.share

    def apply(site: Site, _: np.random.Generator) -> None:
        site.hull = site.hull._replace(buoyancy_n=force, squeeze=0.03, wave_ref=site.depth_m)

    return Planted("net_buoyancy", {"force": force}, apply, size)


def entrained_water(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    mass = sized(0.03, size) * vehicle.configuration.dry_mass_kg

    def apply(site: Site, _: np.random.Generator) -> None:
        for i in range(3):
            site.added[i, i] += mass

    return Planted("entrained_water", {"mass": mass}, apply, size)


def added_payload(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    mass = sized(0.03, size) * vehicle.configuration.dry_mass_kg
    drag = 1.0 + mass / vehicle.configuration.dry_mass_kg * rng.uniform(0.5, 1.5)

    def apply(site: Site, _: np.random.Generator) -> None:
        for i in range(3):
            site.added[i, i] += mass
            site.damping[i, i] *= drag

    return Planted("added_payload", {"mass": mass}, apply, size)


def dvl_scale(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    scale = 1.0 + _sign(rng) * sized(0.01, size)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.faults = site.faults._replace(seen=scale * site.faults.seen)

    return Planted("dvl_scale", {"scale": scale}, apply, size, spoils=(0, 1, 2))


def dvl_bias(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """A DVL bias that varies by a tenth."""
    way = rng.standard_normal(3)
    bias = sized(0.002, size) * way / float(np.linalg.norm(way))

    def apply(site: Site, _: np.random.Generator) -> None:
        site.faults = site.faults._replace(bias=bias, wander=0.1)

    return Planted("dvl_bias", dict(zip("xyz", bias.tolist(), strict=True)), apply, size, spoils=(0, 1, 2))


def dvl_misalignment(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """A DVL turned about the vertical, and tilted by a tenth of that angle."""
    yaw = _sign(rng) * sized(0.012, size)
    cos, sin, tilt = float(np.cos(yaw)), float(np.sin(yaw)), 0.1 * yaw
    seen = np.array([[cos, -sin, 0.0], [sin, cos, tilt], [0.0, -tilt, 1.0]])

    def apply(site: Site, _: np.random.Generator) -> None:
        site.faults = site.faults._replace(seen=seen @ site.faults.seen)

    return Planted("dvl_misalignment", {"yaw": yaw}, apply, size, spoils=(0, 1))


def dvl_lever_arm(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """A DVL mostly ahead or aside of its assumed position, and slightly higher or lower."""
    angle = rng.uniform(-np.pi, np.pi)
    off = sized(0.03, size) * np.array([np.cos(angle), np.sin(angle), rng.uniform(-0.3, 0.3)])

    def apply(site: Site, _: np.random.Generator) -> None:
        site.faults = site.faults._replace(arm=site.faults.arm + off)

    parameters = dict(zip("xyz", off.tolist(), strict=True))
    return Planted("dvl_lever_arm", parameters, apply, size, spoils=(0, 1))


def dvl_delay(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    steps = max(round(sized(0.03, size) * 130), 1)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.faults = site.faults._replace(late=steps)

    return Planted("dvl_delay", {"delay": steps / 130.0}, apply, size, spoils=(0, 1, 2))


def gyro_bias(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """A bias of every gyro aboard that varies by a tenth."""
    bias = _sign(rng) * sized(0.0005, size)

    def apply(site: Site, _: np.random.Generator) -> None:
        site.faults = site.faults._replace(gyro=bias, wander=0.1)

    return Planted("gyro_bias", {"z": bias}, apply, size, spoils=(5,))


def imu_gravity_leak(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """An accelerometer tilted about both horizontal axes."""
    angle = rng.uniform(-np.pi, np.pi)
    roll, pitch = sized(0.003, size) * np.cos(angle), sized(0.003, size) * np.sin(angle)
    about_x = np.array([[1, 0, 0], [0, np.cos(roll), np.sin(roll)], [0, -np.sin(roll), np.cos(roll)]])
    about_y = np.array([[np.cos(pitch), 0, -np.sin(pitch)], [0, 1, 0], [np.sin(pitch), 0, np.cos(pitch)]])

    def apply(site: Site, _: np.random.Generator) -> None:
        site.faults = site.faults._replace(tilt=about_x @ about_y)

    parameters = {"roll": float(roll), "pitch": float(pitch)}
    return Planted("imu_gravity_leak", parameters, apply, size, spoils=(0, 1))


def wrong_feedback_log(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """A controller that uses its own velocity estimate but logs the DVL's."""

    def apply(site: Site, _: np.random.Generator) -> None:
        site.faults = site.faults._replace(unseen=1)

    return Planted("wrong_feedback_log", {}, apply, size, spoils=(0, 1))


PLANTS: dict[str, Plant] = {
    plant.__name__: plant
    for plant in (
        quadratic_drag, drag_asymmetry, cross_flow_lift, coupled_damping, munk_moment, fouling, cg_offset,
        pitch_roll_coupling, net_buoyancy, entrained_water, added_payload, dvl_scale, dvl_bias, dvl_misalignment,
        dvl_lever_arm, dvl_delay, gyro_bias, imu_gravity_leak, wrong_feedback_log,
        *plants_thrust.ALL, *plants_water.ALL,
    )
}  # fmt: skip
"""Effects by the name that a diagnosis must give."""

ABSORBED = ("thrust_gain", "dvl_scale", "entrained_water", "added_payload")
"""Effects that a refit of the nominal parameters absorbs whole: without earlier accepted parameters, they leave no
gap.
"""
