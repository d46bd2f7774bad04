"""True size of a hidden effect: the force and reading errors that it adds and that a refit does not absorb."""

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import GRAVITY_M_S2
from bridge.vehicle.thrusters import allocation_matrix
from identify.challenge.sensors import Noise
from identify.challenge.simulate import Simulated
from identify.challenge.site import Site

Array = NDArray[np.float64]


def missing_wrench(site: Site, simulated: Simulated) -> Array:
    """Wrench of the hidden effects, (n, 6) N and N m at the ticks: total minus nominal model, thrust and disturbance.

    The nominal model has the vehicle's true parameters.
    """
    vehicle, ticks = site.vehicle, simulated.ticks
    shape = vehicle.configuration
    nu = ticks.state[:, 7:13]
    columns = nominal_columns(nu, ticks.nu_dot)
    modelled = columns @ np.concatenate([vehicle.mass, vehicle.damping])
    w, x, y, z = ticks.state[:, 3:7].T
    down = np.column_stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    weight_nm = shape.dry_mass_kg * GRAVITY_M_S2 * shape.centre_of_gravity_below_buoyancy_m
    modelled[:, :3] += shape.net_buoyancy_n * down
    modelled[:, 3] += weight_nm * down[:, 1]
    modelled[:, 4] -= weight_nm * down[:, 0]
    return np.asarray(modelled - ticks.nominal @ allocation_matrix(shape).T - simulated.disturbance)


def missing_velocity(site: Site, simulated: Simulated) -> Array:
    """Error of the DVL velocity, (n, 3) m/s at the ticks, against the velocity at the position assumed by the crew."""
    nu, faults = simulated.ticks.state[:, 7:13], site.faults
    dvl = site.vehicle.file.vehicle.sensors.dvl
    arm = np.zeros(3) if dvl is None else np.array(dvl.mounting.position_m)
    ticks = np.arange(len(nu))
    steps = (len(site.time_s) - 1) / len(nu)
    late = np.column_stack([np.interp(ticks - faults.late / steps, ticks, column) for column in nu.T])
    read = (late[:, :3] + np.cross(late[:, 3:], faults.arm)) @ faults.seen.T + faults.bias
    return np.asarray(read - nu[:, :3] - np.cross(nu[:, 3:], arm))


def sizes(site: Site, noise: Noise, simulated: Simulated) -> Array:
    """Size of the effects by degree of freedom, (6,): the larger of two ratios.

    The first is the rms of the missing wrench after a refit, over the standard deviation of the disturbance. The
    second is the rms of the reading error, over the noise of its sensor.
    """
    nu = simulated.ticks.state[:, 7:13]
    std = site.vehicle.disturbance
    columns = nominal_columns(nu, simulated.ticks.nu_dot) / std[None, :, None]
    gap = missing_wrench(site, simulated) / std
    table, value = columns.reshape(-1, 12), gap.reshape(-1)
    theta = np.linalg.lstsq(table, value, rcond=None)[0]
    left = (value - table @ theta).reshape(-1, 6)
    of_force = np.sqrt(np.mean(left**2, axis=0))
    of_reading = np.zeros(6)
    for dof, error in enumerate(missing_velocity(site, simulated).T):
        axis_speed = nu[:, dof]
        error = error - axis_speed * (axis_speed @ error) / max(float(axis_speed @ axis_speed), 1e-12)
        of_reading[dof] = np.sqrt(np.mean(error**2)) / noise.dvl
    of_reading[5] = abs(site.faults.gyro) / noise.gyro
    tilt = GRAVITY_M_S2 * np.abs(site.faults.tilt[:2, 2]) / noise.force
    of_reading[:2] = np.maximum(of_reading[:2], tilt)
    return np.maximum(of_force, of_reading)


def nominal_columns(nu: Array, nu_dot: Array) -> Array:
    """Wrench of the nominal model for a unit of each total mass and damping, (n, 6, 12), Coriolis forces included."""
    out = np.zeros((len(nu), 6, 12))
    for j in range(6):
        momentum = np.zeros((len(nu), 3))
        momentum[:, j % 3] = nu[:, j]
        if j < 3:
            out[:, :3, j] = np.cross(nu[:, 3:], momentum)
            out[:, 3:, j] = np.cross(nu[:, :3], momentum)
        else:
            out[:, 3:, j] = np.cross(nu[:, 3:], momentum)
        out[:, j, j] += nu_dot[:, j]
        out[:, j, 6 + j] = nu[:, j]
    return out
