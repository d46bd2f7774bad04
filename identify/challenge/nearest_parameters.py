"""Expresses a planted effect in the library's parameters, those whose form comes nearest over the dive's motion, and
its size.

A planted effect has another form than the library's: the quadratic drag that equals a drag with the power 1.8 depends
on the speeds of the dive. The nearest parameters are a least-squares fit to the planted wrench, each degree of freedom
scaled by its disturbance, with masses and dampings free, as in a diagnosis of the same dive (White 1982: the limit of a
fit with another form). A sea is expressed as a single sine of the same power, whatever its spectrum. Wrong readings are
planted in the library's own form.

The true size is the force and the reading errors that a refit does not absorb.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from bridge.arrays import Array
from bridge.attitude import down_in_body
from bridge.vehicle.config import GRAVITY_M_S2
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.challenge.scenario import Planted, Scenario
from identify.challenge.sensors import Noise
from identify.challenge.simulate import Simulated
from identify.effects.course import Course
from identify.effects.effect import Effect
from identify.effects.library import library
from identify.ingest.rotation import euler_angles


def missing_wrench(scenario: Scenario, simulated: Simulated) -> Array:
    """Wrench of the hidden effects, (n, 6) N and N m at the ticks: total minus nominal model, thrust and disturbance.

    The nominal model has the vehicle's true parameters.
    """
    vehicle, ticks = scenario.vehicle, simulated.ticks
    shape = vehicle.configuration
    nu = ticks.state[:, 7:13]
    columns = nominal_columns(nu, ticks.nu_dot)
    modelled = columns @ np.concatenate([vehicle.mass, vehicle.damping])
    down = np.column_stack(down_in_body(ticks.state[:, 3:7].T))
    weight_nm = shape.dry_mass_kg * GRAVITY_M_S2 * shape.centre_of_gravity_below_buoyancy_m
    modelled[:, :3] += shape.net_buoyancy_n * down
    modelled[:, 3] += weight_nm * down[:, 1]
    modelled[:, 4] -= weight_nm * down[:, 0]
    return np.asarray(modelled - ticks.nominal @ allocation_matrix(shape).T - simulated.disturbance)


def missing_velocity(scenario: Scenario, simulated: Simulated) -> Array:
    """Error of the DVL velocity, (n, 3) m/s at the ticks, against the velocity at the position assumed by the crew."""
    nu, faults = simulated.ticks.state[:, 7:13], scenario.faults
    ticks = np.arange(len(nu))
    steps = (len(scenario.time_s) - 1) / len(nu)
    late = np.column_stack(
        [np.interp(ticks - faults.dvl_late_steps / steps, ticks, column) for column in nu.T]
    )
    read = (late[:, :3] + np.cross(late[:, 3:], faults.dvl_arm)) @ faults.dvl_matrix.T + faults.dvl_bias
    return np.asarray(read - nu[:, :3] - np.cross(nu[:, 3:], scenario.vehicle.crew_arm))


def sizes(scenario: Scenario, noise: Noise, simulated: Simulated) -> Array:
    """Size of the effects by degree of freedom, (6,): the larger of two ratios.

    The first is the rms of the missing wrench after a refit, over the standard deviation of the disturbance. The
    second is the rms of the reading error, over the noise of its sensor.
    """
    nu = simulated.ticks.state[:, 7:13]
    std = scenario.vehicle.disturbance
    columns = nominal_columns(nu, simulated.ticks.nu_dot) / std[None, :, None]
    gap = missing_wrench(scenario, simulated) / std
    table, value = columns.reshape(-1, 12), gap.reshape(-1)
    theta = np.linalg.lstsq(table, value, rcond=None)[0]
    left = (value - table @ theta).reshape(-1, 6)
    of_force = np.sqrt(np.mean(left**2, axis=0))
    of_reading = np.zeros(6)
    for dof, error in enumerate(missing_velocity(scenario, simulated).T):
        axis_speed = nu[:, dof]
        error = error - axis_speed * (axis_speed @ error) / max(float(axis_speed @ axis_speed), 1e-12)
        of_reading[dof] = np.sqrt(np.mean(error**2)) / noise.dvl
    of_reading[5] = abs(scenario.faults.gyro_bias) / noise.gyro
    tilt = GRAVITY_M_S2 * np.abs(scenario.faults.accelerometer_tilt[:2, 2]) / noise.force
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


Parameters = dict[str, float]

SEAS = ("waves", "varying_current")

EACH_S = 0.2
"""The wrench is compared at this interval: a vehicle takes longer to respond."""

FINE_S = 0.02
"""Longest step of a course: delayed thrust is interpolated between steps."""


def nearest(planted: Sequence[Planted], scenario: Scenario, simulated: Simulated) -> tuple[Parameters, ...]:
    """Parameters of each planted effect in the library's form.

    Seas are expressed by their power. Wrong readings, and effects that the library lacks, keep their planted
    parameters. All others are fitted together by least squares.
    """
    course = course_of(scenario, simulated)
    forms = [_forms(p, course) for p in planted]
    fitted = [i for i, able in enumerate(forms) if able]
    out = [p.parameters | _of_sea(p, scenario, course) for p in planted]
    if not fitted:
        return tuple(out)
    to = _regression(scenario, simulated, course)
    planted_parameters = [planted[i].parameters for i in fitted]
    fits = [_fit(some, planted_parameters, to) for some in product(*(forms[i] for i in fitted))]
    _, best = min(fits, key=lambda each: each[0])
    for i, (effect, values) in zip(fitted, best, strict=True):
        out[i] = {name: value for name, (value, _) in effect.answer_parameters(values).items()}
    return tuple(out)


def _forms(planted: Planted, course: Course) -> list[Effect]:
    """Forms of the library for a planted force that report the same parameters as an answer."""
    if planted.novel or planted.spoils or planted.name in SEAS:
        return []
    return [
        effect
        for effect in library(course.configuration, course.lag_s)
        if effect.name == planted.name
        and effect.number == planted.number
        and not effect.refit_absorbs
        and effect.parameters
        and effect.answer_parameters(effect.start()).keys() == planted.parameters.keys()
    ]


def course_of(scenario: Scenario, simulated: Simulated) -> Course:
    """True course of a dive, several steps per tick, with the thrust that the crew assumes."""
    vehicle, ticks, dive = scenario.vehicle, simulated.ticks, simulated.dive
    assert dive.pwm is not None
    at_s = dive.pwm.time_s
    within = int(np.ceil((at_s[1] - at_s[0]) / FINE_S))
    time_s = np.interp(np.arange(within * (len(at_s) - 1) + 1) / within, np.arange(len(at_s)), at_s)
    roll, pitch, heading = euler_angles(ticks.state[:, 3:7])
    euler = np.column_stack([roll, pitch, np.unwrap(heading)])

    def fine(values: Array) -> Array:
        return np.column_stack([np.interp(time_s, at_s, column) for column in values.T])

    curve = thrust_curve(vehicle.file.vehicle.thrust_curve, vehicle.file.path.parent)
    asked = curve.thrust(ticks.pwm)[np.arange(len(time_s)) // within]
    depth_m = fine(ticks.state[:, 2:3])[:, 0]
    nothing = np.full(len(time_s), np.nan)
    return Course(
        vehicle.configuration,
        time_s,
        fine(ticks.state[:, 7:13]),
        fine(ticks.nu_dot),
        fine(euler),
        depth_m,
        scenario.hull.floor_m - depth_m,
        fine(ticks.state[:, :2]),
        asked,
        np.full(asked.shape, np.nan),
        nothing if dive.voltage is None else dive.voltage.at(time_s)[:, 0],
        vehicle.file.vehicle.thrust_curve.lag_s,
        vehicle.mass,
        vehicle.damping,
    )


@dataclass(frozen=True)
class _Planted:
    """Planted wrench over the standard deviation of the disturbance: `value` (rows,), at every `every`-th step.

    nominal (rows, 12): orthonormal basis of the wrenches that a refit absorbs.
    """

    course: Course
    every: int
    std: Array
    value: Array
    nominal: Array

    def of(self, wrench: Array) -> Array:
        """A wrench (n, 6) along the course as rows."""
        return np.asarray((wrench[:: self.every] / self.std).reshape(-1))


def _regression(scenario: Scenario, simulated: Simulated, course: Course) -> _Planted:
    missing, std = missing_wrench(scenario, simulated), scenario.vehicle.disturbance
    within = round((len(course.time_s) - 1) / (len(missing) - 1))
    ticks = max(round(EACH_S / (within * course.step_s)), 1)
    every = ticks * within
    columns = nominal_columns(course.nu[::every], course.nu_dot[::every]) / std[None, :, None]
    base = np.linalg.svd(columns.reshape(-1, 12), full_matrices=False)[0]
    return _Planted(course, every, std, (missing[::ticks] / std).reshape(-1), base)


def _fit(
    effects: Sequence[Effect], starting: Sequence[Parameters], to: _Planted
) -> tuple[float, tuple[tuple[Effect, Array], ...]]:
    """Cost of the library's forms `effects` fitted together to the planted wrench, and their best parameter values."""
    ends = np.cumsum([0, *(len(effect.parameters) for effect in effects)])

    def split(values: Array) -> list[tuple[Effect, Array]]:
        return [(effect, values[a:b]) for effect, a, b in zip(effects, ends[:-1], ends[1:], strict=True)]

    def left(values: Array) -> Array:
        residual = to.value.copy()
        for effect, effect_values in split(values):
            act = effect.act(to.course, effect_values)
            wrench = act.wrench if act.water is None else to.course.pushed_by(act.water)
            assert wrench is not None
            residual -= to.of(wrench)
        return np.asarray(residual - to.nominal @ (to.nominal.T @ residual))

    parameters = [p for effect in effects for p in effect.parameters]
    low, high = np.array([p.low for p in parameters]), np.array([p.high for p in parameters])
    drawn = [
        effect_values.get(p.name, p.start)
        for effect, effect_values in zip(effects, starting, strict=True)
        for p in effect.parameters
    ]
    starts = np.array([drawn, [p.start for p in parameters]])
    scale = np.maximum(np.abs(starts[1]), 1e-3)
    tried = [least_squares(left, np.clip(s, low, high), bounds=(low, high), x_scale=scale) for s in starts]
    best = min(tried, key=lambda each: float(each.cost))
    return float(best.cost), tuple(split(best.x))


def _of_sea(planted: Planted, scenario: Scenario, course: Course) -> Parameters:
    """Amplitude of a single sine with the power of the water's movement, or, for waves, of the force on a body at rest.

    The body is taken at the median depth of the dive.
    """
    if planted.name == "varying_current":
        water = scenario.moving_water()[:, :2]
        return {"amplitude": _amplitude(water - water.mean(axis=0))}
    if planted.name != "waves":
        return {}
    columns = scenario.moving_water()[:, 6:].T
    water = np.column_stack([np.interp(course.time_s, scenario.time_s, column) for column in columns])
    fade = np.exp(-scenario.hull.wave_number * (float(np.median(course.depth_m)) - scenario.hull.wave_ref))
    speed, rate = (
        course.in_body(*part[:, :2].T) + part[:, 2:] * course.world[2]
        for part in (water[:, :3], water[:, 3:])
    )
    force = fade * (course.damping[:3] * speed + course.mass[:3] * rate)
    return {"force_amplitude": max(_amplitude(force[:, :2]), _amplitude(force[:, 2:]))}


def _amplitude(values: Array) -> float:
    return float(np.sqrt(2 * np.mean((values**2).sum(axis=1))))
