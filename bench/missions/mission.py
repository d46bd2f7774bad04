"""`draw_one(seed)`: a mission, with its dive as a recording would give it and the truth behind it.

The simulation uses the estimators' own model class: six degrees of freedom with full Coriolis, diagonal total mass,
linear damping, restoring, a constant trim force, a first-order Gauss-Markov disturbance, white noise without bias.
The thruster curve, its lag and the sensors' positions are those of the vehicle file. Effects that a real vehicle adds
(drag that grows as the speed squared, currents, a tether) are not judged here.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.missions import kernel
from bench.missions.manoeuvres import LONGEST_S, MANOEUVRES, REST_S, SHORTEST_S, paces, sampled
from bench.missions.sensors import STEP_S, SensorSuite, draw_sensors
from bench.missions.vehicles import DrawnVehicle, draw_vehicle
from bridge.arrays import Array
from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.challenge.dive import LOWEST_US, NEUTRAL
from identify.dive import Dive, Signal
from identify.ingest.rotation import quaternions_from_euler


@dataclass(frozen=True)
class Mission:
    """One dive with its truth; SI units, body FRD.

    truth: total masses and dampings by name, of the axes that the thrusters reach. `drawn` and `sensors` hold the
    rest of the truth: all six masses, trim, disturbance, noise levels. time_s (n,) control ticks; position (n, 3)
    NED; attitude (n, 4) w x y z; nu (n, 6); disturbance (n, 6) N and N m.
    """

    seed: int
    kind: str
    file: VehicleFile
    configuration: str
    dive: Dive
    truth: dict[str, float]
    time_s: Array
    position: Array
    attitude: Array
    nu: Array
    disturbance: Array
    drawn: DrawnVehicle
    sensors: SensorSuite


def draw_one(seed: int, repeat: int = 0, seconds: float | None = None, kind: str | None = None) -> Mission:
    """The mission of a seed; another `repeat` has another disturbance and other noise, and all else the same.

    `seconds` and `kind` (of MANOEUVRES) override the seed's own draws.
    """
    rng = np.random.default_rng(seed)
    vehicle = draw_vehicle(rng, str(seed))
    drawn_kind = list(MANOEUVRES)[rng.integers(len(MANOEUVRES))]
    drawn_s = rng.uniform(SHORTEST_S, LONGEST_S)
    kind, seconds = kind or drawn_kind, seconds or drawn_s
    dvl = vehicle.file.vehicle.sensors.dvl
    has_fog = vehicle.file.vehicle.sensors.fog is not None
    sensors = draw_sensors(rng, has_fog, 0.0 if dvl is None else dvl.latency_s)
    gains, pace, depth_m = _gains(rng, vehicle), paces(rng, vehicle), rng.uniform(4.0, 9.0)
    tick_s = STEP_S * sensors.tick_steps
    time_s = tick_s * np.arange(int(seconds / tick_s), dtype=np.float64)
    wanted = sampled(MANOEUVRES[kind](rng, pace, seconds - REST_S), time_s, depth_m)
    readings, ticks = _dive(vehicle, sensors, gains, wanted, np.random.default_rng([seed, repeat + 1]))
    name = f"bench-{seed}" if repeat == 0 else f"bench-{seed}-{repeat}"
    names = [group[dof].name for group in (MASSES, DAMPINGS) for dof in vehicle.driven]
    values = [float(group[dof]) for group in (vehicle.mass, vehicle.damping) for dof in vehicle.driven]
    return Mission(
        seed,
        kind,
        vehicle.file,
        vehicle.name,
        _recorded(name, sensors, time_s, wanted, readings, ticks),
        dict(zip(names, values, strict=True)),
        time_s,
        ticks.state[:, :3],
        ticks.state[:, 3:7],
        ticks.state[:, 7:13],
        ticks.disturbance,
        vehicle,
        sensors,
    )


def _gains(rng: np.random.Generator, vehicle: DrawnVehicle) -> kernel.Gains:
    """Gains that a crew would have found: right for the vehicle within some 30 %, zero in axes without thrust."""
    mass, damping = (
        values * np.exp(0.3 * rng.standard_normal(6)) for values in (vehicle.mass, vehicle.damping)
    )
    pace = np.concatenate([rng.uniform(0.4, 1.2, 2), rng.uniform(0.5, 1.0, 4)])
    kp, ki, kd = mass * pace, damping * pace, np.zeros(6)
    for dof in (2, 5):
        kd[dof] = 1.4 * mass[dof] * pace[dof]
        kp[dof] = 0.7 * pace[dof] * (damping[dof] + kd[dof])
        ki[dof] = 0.15 * pace[dof] * kp[dof]
    # A stiffer loop through lagging thrusters would make roll and pitch oscillate.
    kp[3:5], ki[3:5], kd[3:5] = 0.0, 0.0, 0.3 * damping[3:5]
    driven = np.isin(np.arange(6), vehicle.driven)
    return kernel.Gains(kp * driven, ki * driven, kd * driven, 0.5 * vehicle.reach)


def _dive(
    vehicle: DrawnVehicle,
    sensors: SensorSuite,
    gains: kernel.Gains,
    wanted: Array,
    rng: np.random.Generator,
) -> tuple[kernel.Readings, kernel.Ticks]:
    shape, ticks = vehicle.configuration, len(wanted)
    steps = ticks * sensors.tick_steps
    keep, share, kicks = _disturbance(vehicle, steps, rng)
    start = np.zeros(kernel.STATES)
    start[2], start[3] = wanted[0, 13], 1.0
    thrusters = len(shape.thrusters)
    readings = _noise(sensors, steps, rng)
    filled = kernel.Ticks(
        np.empty((ticks, kernel.STATES)), np.empty((ticks, 6)), np.empty((ticks, thrusters)),
        np.empty((ticks, 6)), np.empty((ticks, 6)), np.empty((ticks, 6)),
    )  # fmt: skip
    dvl = vehicle.file.vehicle.sensors.dvl
    arm = np.zeros(3) if dvl is None else np.array(dvl.mounting.position_m)
    clock = kernel.Clockwork(
        STEP_S, sensors.tick_steps, sensors.dvl_steps, sensors.dvl_first, sensors.dvl_latency_steps,
        sensors.gyro_steps, sensors.fog_steps, sensors.attitude_steps, sensors.depth_steps,
    )  # fmt: skip
    kernel.dive(_body(vehicle), gains, clock, arm, wanted, keep, share, kicks, start, readings, filled)
    return readings, filled


def _disturbance(vehicle: DrawnVehicle, steps: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """What takes a first-order Gauss-Markov force (6,) from the start of a step to its end, and to its mean over it.

    Returns two factors on the value at the start, `keep` for the end and `share` for the mean, (6,) each, and the noise
    `kicks` to be added to both, (steps + 1, 2, 6). Given the start, end and mean are jointly normal (Gillespie 1996,
    Phys. Rev. E 54, 2084), so the noise of the mean is drawn given that of the end.
    """
    step = STEP_S / vehicle.disturbance_time_s
    keep = np.exp(-step)
    share = (1 - keep) / step
    end_variance = 1 - keep**2
    covariance = (1 - keep) ** 2 / step
    mean_variance = (2 * step - 3 + 4 * keep - keep**2) / step**2
    draw = rng.standard_normal((steps + 1, 2, 6))
    kicks = np.empty_like(draw)
    left_variance = mean_variance - covariance**2 / end_variance
    kicks[:, 0] = np.sqrt(end_variance) * draw[:, 0]
    kicks[:, 1] = covariance / np.sqrt(end_variance) * draw[:, 0] + np.sqrt(left_variance) * draw[:, 1]
    kicks[0, 0] = draw[0, 0]
    return keep, share, vehicle.disturbance_std * kicks


def _body(vehicle: DrawnVehicle) -> kernel.Body:
    shape = vehicle.configuration
    curve = thrust_curve(vehicle.file.vehicle.thrust_curve, vehicle.file.path.parent)
    matrix = allocation_matrix(shape)
    return kernel.Body(
        vehicle.mass,
        vehicle.damping,
        vehicle.trim,
        vehicle.righting_nm,
        shape.net_buoyancy_n,
        matrix,
        np.ascontiguousarray(np.linalg.pinv(matrix, rcond=1e-6)),
        -shape.thruster_limit_n,
        shape.thruster_limit_n,
        curve.thrust(LOWEST_US + np.arange(2 * NEUTRAL + 1)),
        vehicle.file.vehicle.thrust_curve.lag_s,
    )


def _noise(sensors: SensorSuite, steps: int, rng: np.random.Generator) -> kernel.Readings:
    """Readings of each sensor for the whole dive, with only the noise in them."""
    dvl = sensors.dvl_m_s * rng.standard_normal((len(range(sensors.dvl_first, steps, sensors.dvl_steps)), 3))
    dvl[rng.random(len(dvl)) < sensors.dvl_loss] = np.nan
    gyro = sensors.gyro_rad_s * rng.standard_normal((len(range(0, steps, sensors.gyro_steps)), 3))
    means = len(range(sensors.fog_steps, steps, sensors.fog_steps)) if sensors.fog_steps else 0
    fog = sensors.fog_rad_s * rng.standard_normal((means, 1))
    spread = np.array([sensors.tilt_rad, sensors.tilt_rad, sensors.heading_rad])
    attitude = spread * rng.standard_normal((len(range(0, steps, sensors.attitude_steps)), 3))
    depth = sensors.depth_m * rng.standard_normal((len(range(0, steps, sensors.depth_steps)), 1))
    return kernel.Readings(dvl, gyro, fog, attitude, depth)


def _recorded(
    name: str,
    sensors: SensorSuite,
    time_s: Array,
    wanted: Array,
    readings: kernel.Readings,
    ticks: kernel.Ticks,
) -> Dive:
    fog = None
    if sensors.fog_steps:
        fog = _signal(readings.fog, 0.5 * sensors.fog_steps, sensors.fog_steps)
    nothing = np.zeros_like(time_s)[:, None]
    return Dive(
        name,
        Path(f"{name}.tlog"),
        hashlib.sha256(ticks.pwm.tobytes() + readings.dvl.tobytes()).hexdigest(),
        velocity=_signal(readings.dvl, sensors.dvl_first, sensors.dvl_steps),
        gyro=_signal(readings.gyro, 0, sensors.gyro_steps),
        fog=fog,
        attitude=_signal(quaternions_from_euler(*readings.attitude.T), 0, sensors.attitude_steps),
        depth=_signal(readings.depth, 0, sensors.depth_steps),
        pwm=Signal(time_s, ticks.pwm),
        tau_pid=Signal(time_s, ticks.tau_pid),
        tau_ff=Signal(time_s, np.zeros_like(ticks.tau_pid)),
        tau_cmd=Signal(time_s, ticks.tau_cmd),
        nu_fb=Signal(time_s, ticks.nu_fb),
        nu_ref=Signal(time_s, wanted[:, :14]),
        ff_mode=Signal(time_s, nothing),
        armed=Signal(time_s, nothing + 1.0),
    )


def _signal(value: Array, first_steps: float, every_steps: int) -> Signal:
    return Signal(STEP_S * (first_steps + every_steps * np.arange(len(value), dtype=np.float64)), value)
