"""A wet check of the simulated body, and its sensors with any fault that a crew can build in."""

from dataclasses import replace

import numpy as np

from bridge.simulator.plant import Plant
from bridge.simulator.truth import Truth
from bridge.vehicle.coefficients import BY_NAME, MASSES
from bridge.vehicle.config import GRAVITY_M_S2
from bridge.vehicle.thrusters import NEUTRAL_US, thrust_curve
from gcs_plugin.doctor.pulse_plan import duration_s, pulses
from gcs_plugin.doctor.wet_record import FEATURES, Series, WetRecord

TICK_S = 0.05
ADDED = (1.45, 1.75, 2.3, 1.5, 1.9, 1.4)  # not what the doctor assumes


def truth_of(shape):
    rigid = [shape.dry_mass_kg] * 3 + list(shape.inertia_kgm2)
    model = {c.name: rigid[c.dof] * ADDED[c.dof] for c in MASSES}
    damping = (0.4, 0.6, 0.9, 0.8, 0.8, 1.1)
    model |= {n: damping[i] * list(model.values())[i] for i, n in enumerate(list(BY_NAME)[6:])}
    return Truth(model, 0.002 * shape.dry_mass_kg, 0.0005 * shape.dry_mass_kg)


def wet_check(file, configuration, *, wiring=None, signs=None, latency_s=None, seed=0, noise=1.0):
    """The record of a wet check. `wiring[channel]` is the thruster that it drives, `signs` +1, -1 or 0 for dead."""
    vehicle, shape = file.vehicle, file.vehicle.configurations[configuration]
    curve = thrust_curve(vehicle.thrust_curve, file.path.parent)
    planned = pulses(vehicle, configuration, curve)
    count = len(shape.thrusters)
    wiring = list(range(count)) if wiring is None else wiring
    signs = np.ones(count) if signs is None else np.asarray(signs, dtype=float)
    late = {"dvl": 0.0, "imu": 0.0, "fog": 0.0} | (latency_s or {})
    rng = np.random.default_rng(seed)
    wired = replace(
        shape,
        thrusters=tuple(replace(shape.thrusters[wiring[c]], gain=float(signs[c])) for c in range(count)),
    )
    plant = Plant(wired, curve, vehicle.thrust_curve.lag_s, truth_of(shape), rng, depth_m=0.8)
    times, states, rates, pwm = [], [], [], []
    for k in range(round(duration_s(planned) / TICK_S)):
        now_s = k * TICK_S
        command = [NEUTRAL_US] * count
        for pulse in planned:
            if pulse.start_s <= now_s < pulse.start_s + pulse.duration_s - 1e-9:
                command[pulse.thruster] = pulse.pwm_us
        pwm.append((now_s, command))
        stretch = plant.advance(tuple(command), TICK_S)
        times.append(stretch.time_s[1:])
        states.append(stretch.state[1:])
        rates.append(stretch.nu_dot[1:])
    time_s, state, nu_dot = np.concatenate(times), np.concatenate(states), np.concatenate(rates)
    return WetRecord(
        Series(np.array([t for t, _ in pwm]), np.array([c for _, c in pwm])),
        sensed(vehicle, time_s, state, nu_dot, late, rng, noise),
    )


def sensed(vehicle, time_s, state, nu_dot, late, rng, noise):
    velocity, rate = state[:, 7:10], state[:, 10:13]
    sensors = vehicle.sensors.present()
    lever = {name: np.array(device.mounting.position_m) for name, device in sensors.items()}
    at_dvl = velocity + np.cross(rate, lever.get("dvl", np.zeros(3)))
    w, x, y, z = state[:, 3:7].T
    down = np.column_stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    to_imu = lever.get("imu", np.zeros(3))
    force = nu_dot[:, :3] + np.cross(rate, velocity) - GRAVITY_M_S2 * down
    force = force + np.cross(nu_dot[:, 3:], to_imu) + np.cross(rate, np.cross(rate, to_imu))

    def sampled(value, rate_hz, sigma, late_s):
        at = np.arange(0.3 / rate_hz, time_s[-1], 1 / rate_hz)
        true = np.column_stack([np.interp(at - late_s, time_s, column) for column in value.T])
        return Series(at, true + noise * sigma * rng.standard_normal(true.shape))

    return {
        "dvl": sampled(at_dvl, 8.0, 0.004, late["dvl"]),
        "force": sampled(force, 100.0, 0.03, late["imu"]),
        "rate": sampled(rate, 100.0, 0.004, late["imu"]),
        "fog": sampled(rate[:, 2:], 50.0, 0.0005, late["fog"]),
    }


def turned(record, sensor, turn):
    """The record as that sensor would give it if it sat turned: measured = turn @ true; a gyro of one axis sits upside
    down."""
    turn = -np.eye(1) if sensor == "fog" else turn
    true = {name: record.series[name] for name, (signal, _) in FEATURES.items() if signal == sensor}
    felt = {name: Series(series.time_s, series.value @ turn.T) for name, series in true.items()}
    return replace(record, series=record.series | felt)
