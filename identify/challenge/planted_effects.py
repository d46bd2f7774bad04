"""Plants the effects that a diagnosis must name, in other forms than the library's.

Each function draws one effect of a `size` from 0, the smallest that is drawn, to 1, ten times as large, and returns how
to put it into a dive with its parameters as the truth that an answer is compared with.
"""

from collections.abc import Callable

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import GRAVITY_M_S2
from identify.challenge.scenario import Planted, Scenario, changed, sized
from identify.challenge.vehicles import LAG_S, DrawnVehicle

Plant = Callable[[np.random.Generator, DrawnVehicle, float], Planted]


def random_sign(rng: np.random.Generator) -> float:
    """1 or -1, equally likely."""
    return float(rng.choice([-1.0, 1.0]))


def quadratic_drag(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """|u|^1.8 on every axis; expressed as the u|u| drag that is equal at 0.6 of the top speed."""
    top = np.array([vehicle.speed, vehicle.sway, 0.1, 0.2, 0.2, vehicle.turn])
    drag = sized(0.1, size) * vehicle.damping * top**-0.8 * np.exp(0.2 * rng.standard_normal(6))

    apply = changed("hull", drag=drag)
    alike = drag * (0.6 * top) ** -0.2
    names = ("X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr")
    return Planted("quadratic_drag", dict(zip(names, alike.tolist(), strict=True)), apply, size)


def drag_asymmetry(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    ratio = sized(0.05, size)

    apply = changed("hull", asymmetry=ratio * vehicle.damping[0])
    return Planted("drag_asymmetry", {"ratio": 1.0 + ratio}, apply, size)


def cross_flow_lift(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """Lift that stalls at large drift angles."""
    lift = sized(0.06, size) * vehicle.damping[1] / vehicle.speed
    lever = random_sign(rng) * rng.uniform(0.05, 0.25)

    apply = changed("hull", lift_y=lift, lift_n=lever * lift)
    return Planted("cross_flow_lift", {"Y_uv": float(lift), "N_uv": float(lever * lift)}, apply, size)


def coupled_damping(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    both = random_sign(rng) * sized(0.04, size) * float(np.sqrt(vehicle.damping[1] * vehicle.damping[5]))
    y_r, n_v = both * rng.uniform(0.6, 1.4), both * rng.uniform(0.6, 1.4)

    apply = changed("hull", y_r=y_r, n_v=n_v)
    return Planted("coupled_damping", {"Y_r": y_r * 1.1, "N_v": n_v * 1.1}, apply, size)


def munk_moment(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """Larger or smaller Munk moments, by a share that fades at large drift."""
    share = random_sign(rng) * sized(0.2, size)
    mass = vehicle.mass

    apply = changed(
        "hull", munk=share, munk_yaw_kg=float(mass[1] - mass[0]), munk_pitch_kg=float(mass[0] - mass[2])
    )
    return Planted("munk_moment", {"gain": 1.0 + share}, apply, size)


def fouling(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """Drag that grows ever more slowly; expressed as a steady growth, from which the nearest one is sought."""
    total = sized(0.06, size)

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        scenario.fouled, scenario.fouled_s = total, 480.0

    return Planted("fouling", {"rate": total / 480.0}, apply, size)


def add_first_moments(matrix: Array, x: float, y: float, of_water: bool) -> None:
    """Add the first moments of a mass, kg m ahead and to starboard, to a mass matrix (6, 6), in place; of water that
    couples sway and yaw alone."""
    matrix[1, 5] += x
    matrix[5, 1] += x
    matrix[0, 5] -= y
    matrix[5, 0] -= y
    if not of_water:
        matrix[2, 4] -= x
        matrix[4, 2] -= x
        matrix[2, 3] += y
        matrix[3, 2] += y


def cg_offset(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """First moments of the mass, with level trim; in half of the cases an added mass that couples sway and yaw."""
    mass = vehicle.configuration.dry_mass_kg
    off = sized(0.008, size) * mass * vehicle.share ** (1 / 3)
    of_water = rng.random() < 0.5
    angle = 0.0 if of_water else rng.uniform(-0.5, 0.5)
    x, y = random_sign(rng) * off * np.cos(angle), off * np.sin(angle)

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        add_first_moments(scenario.added if of_water else scenario.rigid, x, y, of_water)

    return Planted("cg_offset", {"x": float(x) / mass, "y": float(y) / mass}, apply, size)


def pitch_roll_coupling(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A lower centre of mass: a larger righting moment, and pitch while the vehicle accelerates."""
    lower = sized(0.004, size)
    first = vehicle.configuration.dry_mass_kg * lower

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        scenario.centre_m += lower
        scenario.rigid[0, 4] += first
        scenario.rigid[4, 0] += first
        scenario.rigid[1, 3] -= first
        scenario.rigid[3, 1] -= first

    return Planted("pitch_roll_coupling", {"height": lower}, apply, size)


def net_buoyancy(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A buoyancy force (up or down) that falls slightly with depth, as air spaces are compressed."""
    force = random_sign(rng) * sized(0.4, size) * vehicle.share

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        scenario.hull = scenario.hull._replace(buoyancy_n=force, squeeze=0.03, wave_ref=scenario.depth_m)

    return Planted("net_buoyancy", {"force": force}, apply, size)


def entrained_water(_: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    mass = sized(0.03, size) * vehicle.configuration.dry_mass_kg

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        for i in range(3):
            scenario.added[i, i] += mass

    return Planted("entrained_water", {"mass": mass}, apply, size)


def added_payload(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    mass = sized(0.03, size) * vehicle.configuration.dry_mass_kg
    drag = 1.0 + mass / vehicle.configuration.dry_mass_kg * rng.uniform(0.5, 1.5)

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        for i in range(3):
            scenario.added[i, i] += mass
            scenario.damping[i, i] *= drag

    return Planted("added_payload", {"mass": mass}, apply, size)


def dvl_scale(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    scale = 1.0 + random_sign(rng) * sized(0.01, size)

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        scenario.faults = scenario.faults._replace(dvl_matrix=scale * scenario.faults.dvl_matrix)

    return Planted("dvl_scale", {"scale": scale}, apply, size, spoils=(0, 1, 2))


def depth_scale(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    scale = 1.0 + random_sign(rng) * sized(0.04, size)

    return Planted("depth_scale", {"scale": scale}, changed("faults", depth_gain=scale), size, spoils=(2,))


def dvl_bias(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """A DVL bias that varies by a tenth."""
    way = rng.standard_normal(3)
    bias = sized(0.002, size) * way / float(np.linalg.norm(way))

    apply = changed("faults", dvl_bias=bias, bias_wander=0.1)
    return Planted("dvl_bias", dict(zip("xyz", bias.tolist(), strict=True)), apply, size, spoils=(0, 1, 2))


def dvl_misalignment(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """A DVL turned about the vertical, and tilted by a tenth of that angle."""
    yaw = random_sign(rng) * sized(0.012, size)
    cos, sin, tilt = float(np.cos(yaw)), float(np.sin(yaw)), 0.1 * yaw
    turned = np.array([[cos, -sin, 0.0], [sin, cos, tilt], [0.0, -tilt, 1.0]])

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        scenario.faults = scenario.faults._replace(dvl_matrix=turned @ scenario.faults.dvl_matrix)

    return Planted("dvl_misalignment", {"yaw": yaw}, apply, size, spoils=(0, 1))


def dvl_lever_arm(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """A DVL mostly ahead or aside of its assumed position, and slightly higher or lower."""
    angle = rng.uniform(-np.pi, np.pi)
    off = sized(0.03, size) * np.array([np.cos(angle), np.sin(angle), rng.uniform(-0.3, 0.3)])

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        scenario.faults = scenario.faults._replace(dvl_arm=scenario.faults.dvl_arm + off)

    parameters = dict(zip("xyz", off.tolist(), strict=True))
    return Planted("dvl_lever_arm", parameters, apply, size, spoils=(0, 1))


def dvl_delay(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    steps = max(round(sized(0.03, size) * 130), 1)

    apply = changed("faults", dvl_late_steps=steps)
    return Planted("dvl_delay", {"delay": steps / 130.0}, apply, size, spoils=(0, 1, 2))


def gyro_bias(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """A bias of every gyro aboard that varies by a tenth."""
    bias = random_sign(rng) * sized(0.0005, size)

    return Planted(
        "gyro_bias", {"z": bias}, changed("faults", gyro_bias=bias, bias_wander=0.1), size, spoils=(5,)
    )


def imu_gravity_leak(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """An accelerometer tilted about both horizontal axes."""
    angle = rng.uniform(-np.pi, np.pi)
    roll, pitch = sized(0.003, size) * np.cos(angle), sized(0.003, size) * np.sin(angle)
    about_x = np.array([[1, 0, 0], [0, np.cos(roll), np.sin(roll)], [0, -np.sin(roll), np.cos(roll)]])
    about_y = np.array([[np.cos(pitch), 0, -np.sin(pitch)], [0, 1, 0], [np.sin(pitch), 0, np.cos(pitch)]])

    apply = changed("faults", accelerometer_tilt=about_x @ about_y)
    parameters = {"roll": float(roll), "pitch": float(pitch)}
    return Planted("imu_gravity_leak", parameters, apply, size, spoils=(0, 1))


def wrong_feedback_log(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """A controller that uses its own velocity estimate but logs the DVL's."""

    return Planted("wrong_feedback_log", {}, changed("faults", feedback_unlogged=1), size, spoils=(0, 1))


def _sum_of_sines(
    rng: np.random.Generator, time_s: Array, low_s: float, high_s: float, count: int
) -> tuple[Array, Array]:
    """A sum of `count` sines with drawn periods and variance 1, and its time derivative; (n,) each."""
    value, rate = np.zeros_like(time_s), np.zeros_like(time_s)
    for period in rng.uniform(low_s, high_s, count):
        omega, phase = 2 * np.pi / period, rng.uniform(0, 2 * np.pi)
        value += np.sqrt(2 / count) * np.sin(omega * time_s + phase)
        rate += np.sqrt(2 / count) * omega * np.cos(omega * time_s + phase)
    return value, rate


def steady_current(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """A current that varies slowly by a tenth of its speed."""
    speed, angle = sized(0.012, size), rng.uniform(-np.pi, np.pi)
    north, east = float(speed * np.cos(angle)), float(speed * np.sin(angle))

    def apply(scenario: Scenario, rng: np.random.Generator) -> None:
        water = scenario.moving_water()
        for column, mean in ((0, north), (1, east)):
            value, rate = _sum_of_sines(rng, scenario.time_s, 200.0, 600.0, 3)
            water[:, column] += mean + 0.1 * speed * value
            water[:, 3 + column] += 0.1 * speed * rate

    return Planted("steady_current", {"north": north, "east": east}, apply, size)


def varying_current(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    """Currents north and east that each beat within a narrow band of periods, independently."""
    amplitude, period = sized(0.01, size), float(np.exp(rng.uniform(np.log(20.0), np.log(150.0))))

    def apply(scenario: Scenario, rng: np.random.Generator) -> None:
        water = scenario.moving_water()
        for column in (0, 1):
            value, rate = _sum_of_sines(rng, scenario.time_s, 0.85 * period, 1.15 * period, 5)
            water[:, column] += amplitude / np.sqrt(2) * value
            water[:, 3 + column] += amplitude / np.sqrt(2) * rate

    return Planted("varying_current", {"amplitude": amplitude, "period": period}, apply, size)


def waves(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A narrow spectrum of deep-water waves whose orbits fade with depth; expressed as the force on a body at rest."""
    speed, period, course = sized(0.006, size), rng.uniform(2.5, 7.0), rng.uniform(-np.pi, np.pi)
    omega = 2 * np.pi / period

    def apply(scenario: Scenario, rng: np.random.Generator) -> None:
        water = scenario.moving_water()
        for share in (0.88, 0.94, 1.0, 1.06, 1.12):
            w, phase = omega * share * rng.uniform(0.99, 1.01), rng.uniform(0, 2 * np.pi)
            cos, sin = np.cos(w * scenario.time_s + phase), np.sin(w * scenario.time_s + phase)
            part = speed / np.sqrt(5)
            for column, way in ((6, np.cos(course)), (7, np.sin(course))):
                water[:, column] += part * way * cos
                water[:, 3 + column] -= part * way * w * sin
            water[:, 8] -= part * sin
            water[:, 11] -= part * w * cos
        scenario.hull = scenario.hull._replace(wave_number=omega**2 / GRAVITY_M_S2, wave_ref=scenario.depth_m)

    force = float((vehicle.mass[0]) * omega * speed)
    return Planted("waves", {"force_amplitude": force, "period": period}, apply, size)


def free_surface(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """Added mass that falls off exponentially below the surface."""
    more = sized(0.15, size)

    apply = changed("hull", surface=more, surface_m=0.45)
    return Planted("free_surface", {"mass_change": 0.6 * more}, apply, size, needs="shallow")


def bottom_or_wall(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """Added mass that falls off as the cube of the altitude, as of a sphere at a wall (Lamb 1932, article 99)."""
    more = sized(0.15, size)

    apply = changed("hull", bottom=more, bottom_m=0.5)
    return Planted("bottom_or_wall", {"mass_change": 0.6 * more}, apply, size, needs="low")


def tether(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A line that stiffens as it is drawn out, as a catenary does, from an anchor a few metres away."""
    grip = sized(0.06, size) * vehicle.share
    far, angle = rng.uniform(1.0, 5.0), rng.uniform(-np.pi, np.pi)
    north, east = float(far * np.cos(angle)), float(far * np.sin(angle))

    apply = changed("hull", grip=grip, slack_m=6.0, anchor_n=north, anchor_e=east)
    stiff = grip * (1.0 + (far / 6.0) ** 2)
    parameters = {"stiffness": stiff, "north": stiff * north, "east": stiff * east}
    return Planted("tether", parameters, apply, size)


def thrust_gain(rng: np.random.Generator, _: DrawnVehicle, size: float) -> Planted:
    gain = 1.0 + rng.choice([-1.0, 1.0]) * sized(0.015, size)

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        scenario.prop = scenario.prop._replace(way=gain * scenario.prop.way)

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

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        each = scenario.prop.each.copy()
        each[index] = gain
        scenario.prop = scenario.prop._replace(each=each)

    parameters = {"thruster": float(index + 1), "gain": gain}
    return Planted("weak_thruster", parameters, apply, size, number=index + 1)


def thruster_misalignment(rng: np.random.Generator, vehicle: DrawnVehicle, size: float) -> Planted:
    """A thruster that is turned and moved by a centimetre; a vertical thruster is turned about the body's x."""
    index = int(rng.integers(len(vehicle.configuration.thrusters)))
    angle = float(rng.choice([-1.0, 1.0]) * sized(0.03, size))
    moved = rng.uniform(-0.01, 0.01, 3) * vehicle.share ** (1 / 3)

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        way, place = scenario.prop.way.copy(), scenario.prop.place.copy()
        x, y, z = way[index]
        cos, sin = np.cos(angle), np.sin(angle)
        if abs(z) > 0.5:
            way[index] = x, y * cos - z * sin, y * sin + z * cos
        else:
            way[index] = x * cos - y * sin, x * sin + y * cos, z
        place[index] += moved
        scenario.prop = scenario.prop._replace(way=way, place=place)

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

    def apply(scenario: Scenario, rng: np.random.Generator) -> None:
        late = delay * (1.0 + 0.1 * rng.uniform(-1, 1, len(scenario.prop.delay)))
        scenario.prop = scenario.prop._replace(delay=late)

    return Planted("command_delay", {"delay": delay}, apply, size)


def battery_sag(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """Thrust that follows a discharge curve, which is steepest at its end; expressed by the mean slope."""
    lost = sized(0.05, size)
    volts = 1.0 - (1.0 - lost) ** (1 / 1.9)

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        scenario.prop = scenario.prop._replace(sag=volts, sag_s=480.0)
        scenario.sag, scenario.sag_s = volts, 480.0

    return Planted("battery_sag", {"rate": 0.9 * lost / 480.0}, apply, size)


def load_sag(_: np.random.Generator, __: DrawnVehicle, size: float) -> Planted:
    """A voltage that drops under load, with a memory of some tenths of a second."""
    resistance = sized(0.1, size)

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        scenario.prop = scenario.prop._replace(load=resistance)
        scenario.ripple = resistance

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

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        scenario.push += (1.0 + 0.1 * np.sin(0.013 * scenario.time_s))[:, None] * bias

    parameters = {"X": float(bias[0]), "Y": float(bias[1]), "Z": 0.0, "N": float(bias[5])}
    return Planted("thrust_bias", parameters, apply, size)


PLANTS: dict[str, Plant] = {
    plant.__name__: plant
    for plant in (
        quadratic_drag, drag_asymmetry, cross_flow_lift, coupled_damping, munk_moment, fouling, cg_offset,
        pitch_roll_coupling, net_buoyancy, entrained_water, added_payload, dvl_scale, depth_scale, dvl_bias,
        dvl_misalignment, dvl_lever_arm, dvl_delay, gyro_bias, imu_gravity_leak, wrong_feedback_log,
        thrust_gain, thrust_curve, reverse_thrust_loss, dead_zone, saturation, inflow_loss, hull_interaction,
        weak_thruster, thruster_misalignment, thruster_lag, command_delay, battery_sag, load_sag, propeller_torque,
        thrust_bias, steady_current, varying_current, waves, free_surface, bottom_or_wall, tether,
    )
}  # fmt: skip
"""Effects by the name that a diagnosis must give."""

BY_NAME_ALONE = ("depth_scale",)
"""Effects that are planted where they are asked for, not drawn: a true size does not count depth readings."""

ABSORBED = ("thrust_gain", "dvl_scale", "entrained_water", "added_payload")
"""Effects that a refit of the nominal parameters absorbs whole: without earlier accepted parameters, they leave no
gap.
"""
