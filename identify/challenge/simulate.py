"""Simulates a dive from a scenario, a mission and sensors: its readings as a `Dive`, and the truth."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import Water
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.challenge import dive as kernel
from identify.challenge.dive import Control
from identify.challenge.equations_of_motion import STATES
from identify.challenge.hull import voltage_share
from identify.challenge.mission import HEADING
from identify.challenge.scenario import Scenario, coloured, past_of
from identify.challenge.sensors import STEP_S, Noise, Periods, Readings, noise_alone
from identify.challenge.vehicles import LAG_S, DrawnVehicle
from identify.dive import Dive, Signal
from identify.ingest.rotation import quaternions_from_euler

FULL_VOLTAGE_V = 16.4


@dataclass(frozen=True)
class Setup:
    """Equipment of a dive: the vehicle's sensors and its crew's controller."""

    periods: Periods
    noise: Noise
    control: Control
    has_rpm: bool


@dataclass(frozen=True)
class Simulated:
    """A dive and its truth: `ticks` as the kernel filled them, `disturbance` (n, 6) at the ticks."""

    dive: Dive
    ticks: kernel.Ticks
    disturbance: Array
    readings: Readings


def draw_control(rng: np.random.Generator, vehicle: DrawnVehicle) -> Control:
    """Draw gains and a feed-forward that a crew might have found: right for the vehicle within some 25 %."""
    mass, damping = (v * np.exp(0.25 * rng.standard_normal(6)) for v in (vehicle.mass, vehicle.damping))
    pace = rng.uniform(0.5, 1.0, 6)
    kp, ki, kd = mass * pace, 0.5 * damping * pace, np.zeros(6)
    for dof in (2, 5):
        kd[dof] = 1.2 * mass[dof] * pace[dof]
        kp[dof] = 0.6 * pace[dof] * (damping[dof] + kd[dof])
        ki[dof] = 0.12 * pace[dof] * kp[dof]
    kp[3:5], ki[3:5], kd[3:5] = 0.0, 0.0, 0.2 * damping[3:5]
    shape = vehicle.configuration
    reach = np.abs(allocation_matrix(shape)).sum(axis=1) * shape.thruster_limit_n
    ahead = float(rng.choice([0.0, 1.0]))
    memory_s = float(rng.choice([0.0, 0.1, 0.25]))
    limit_n = 0.95 * shape.thruster_limit_n
    return Control(
        kp, ki, kd, 0.4 * reach, mass, damping, ahead, memory_s, -limit_n, limit_n,
    )  # fmt: skip


def simulate(
    name: str, scenario: Scenario, setup: Setup, reference: Array, rng: np.random.Generator
) -> Simulated:
    """Follow the reference (n, 14). `rng` draws disturbance and noise."""
    vehicle, periods = scenario.vehicle, setup.periods
    count, k = len(reference), len(vehicle.configuration.thrusters)
    steps = count * periods.tick
    drawn = coloured(
        rng, len(scenario.time_s), STEP_S, vehicle.disturbance_s, vehicle.poles, vehicle.disturbance
    )
    file = vehicle.file
    curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
    matrix = allocation_matrix(vehicle.configuration)
    scene = kernel.Scene(
        scenario.push + drawn,
        np.zeros((1, 12)) if scenario.water is None else scenario.water,
        scenario.fouled,
        scenario.fouled_s,
        curve.thrust(kernel.LOWEST_US + np.arange(2 * kernel.NEUTRAL + 1)),
        matrix,
        np.ascontiguousarray(np.linalg.pinv(matrix, rcond=1e-6)),
        LAG_S,
        vehicle.crew_arm,
    )
    start = np.zeros(STATES)
    heading = float(reference[0, HEADING])
    start[2], start[3], start[6] = scenario.depth_m, np.cos(0.5 * heading), np.sin(0.5 * heading)
    readings = noise_alone(periods, setup.noise, steps, rng)
    ticks = kernel.Ticks(
        np.zeros((count, STATES)), np.zeros((count, 6)), np.zeros((count, 6)), np.zeros((count, k)),
        np.zeros((count, k)), np.zeros((count, 1)), np.zeros((count, k)), *(np.zeros((count, 6)) for _ in range(4)),
    )  # fmt: skip
    kernel.dive(
        scenario.body(),
        scenario.hull,
        scenario.prop,
        setup.control,
        periods,
        scenario.faults,
        scene,
        reference,
        start,
        readings,
        ticks,
        scenario.drawn,
        past_of(scenario.drawn, STEP_S),
    )
    recorded = _recorded(name, scenario, setup, reference, readings, ticks, rng)
    return Simulated(recorded, ticks, drawn[:: periods.tick][:count], readings)


def _recorded(
    name: str,
    scenario: Scenario,
    setup: Setup,
    reference: Array,
    readings: Readings,
    ticks: kernel.Ticks,
    rng: np.random.Generator,
) -> Dive:
    periods, water = setup.periods, Water()
    time_s = _times(0.0, periods.tick, len(reference))
    curve = scenario.vehicle.file.vehicle.thrust_curve
    k = np.where(ticks.shaft >= 0, curve.forward_n_s2, curve.reverse_n_s2)
    rpm = 60.0 * np.sign(ticks.shaft) * np.sqrt(np.abs(ticks.shaft) / k)
    rpm = np.round(rpm * (1 + 0.004 * rng.standard_normal(rpm.shape))).astype(np.float64)
    seconds = np.arange(0.0, time_s[-1], 1.0, dtype=np.float64)
    share = np.array([voltage_share(t, scenario.sag, scenario.sag_s) for t in seconds])
    load = np.interp(seconds, time_s, ticks.load[:, 0])
    volts: Array = FULL_VOLTAGE_V * share * (1 - scenario.ripple * load) + 0.01 * rng.standard_normal(
        len(seconds)
    )
    pressure = 100.0 * water.surface_pressure_hpa + water.density_kg_m3 * water.gravity_m_s2 * readings.depth
    fog = None
    if periods.fog:
        fog = _signal(readings.fog[1:], 0.5 * periods.fog, periods.fog)
    velocity = _signal(readings.dvl, 0, periods.dvl)
    depth = np.interp(velocity.time_s, time_s, ticks.state[:, 2])
    altitude = np.maximum(scenario.hull.floor_m - depth + 0.01 * rng.standard_normal(len(depth)), 0.0)
    flat = np.zeros((len(seconds), 1))
    return Dive(
        name,
        Path(f"{name}.tlog"),
        hashlib.sha256(ticks.pwm.tobytes() + readings.dvl.tobytes()).hexdigest(),
        velocity=velocity,
        gyro=_signal(readings.gyro, 0, periods.imu),
        fog=fog,
        specific_force=_signal(readings.force, 0, periods.imu),
        attitude=_signal(quaternions_from_euler(*readings.attitude.T), 0, periods.attitude),
        pressure=_signal(pressure, 0, periods.depth),
        altitude=Signal(velocity.time_s, altitude[:, None]),
        pwm=Signal(time_s, ticks.pwm),
        rpm=Signal(time_s, rpm) if setup.has_rpm else None,
        voltage=Signal(seconds, volts[:, None]),
        tau_pid=Signal(time_s, ticks.tau_pid),
        tau_ff=Signal(time_s, ticks.tau_ff),
        tau_cmd=Signal(time_s, ticks.tau_cmd),
        nu_fb=Signal(time_s, ticks.nu_fb),
        nu_ref=Signal(time_s, reference),
        ff_mode=Signal(seconds, flat + (3.0 if setup.control.ahead else 1.0)),
        veh_cfg=Signal(seconds, flat),
        armed=Signal(seconds, flat + 1.0),
    )


def _signal(value: Array, first_steps: float, every_steps: int) -> Signal:
    return Signal(_times(first_steps, every_steps, len(value)), value)


def _times(first_steps: float, every_steps: int, count: int) -> Array:
    return STEP_S * (first_steps + every_steps * np.arange(count, dtype=np.float64))
