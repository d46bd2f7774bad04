"""Converts sensor samples (in body axes) and control ticks to readings."""

import math

from bridge.messages.readings import Reading
from bridge.sensors.samples import DvlSample, GnssSample, ImuSample, PressureSample
from bridge.vehicle.autopilot import Actuation

NAN = math.nan


def imu_reading(sample: ImuSample) -> Reading:
    """Specific force, rates and temperature."""
    temperature = NAN if sample.temperature_c is None else sample.temperature_c
    return Reading("imu", sample.time_s, (*sample.specific_force, *sample.rate, temperature))


def attitude_reading(sample: ImuSample) -> Reading | None:
    """Attitude and rates; None if the device reports no attitude."""
    if sample.attitude is None:
        return None
    return Reading("attitude", sample.time_s, (*sample.attitude, *sample.rate))


def dvl_readings(sample: DvlSample) -> list[Reading]:
    """Velocity at the transducer, and altitude if known."""
    readings = [Reading("dvl", sample.time_s, (*sample.velocity, sample.sigma))]
    if not math.isnan(sample.altitude_m):
        readings.append(Reading("altitude", sample.time_s, (sample.altitude_m,)))
    return readings


def pressure_reading(sample: PressureSample) -> Reading:
    """Absolute pressure and water temperature."""
    return Reading("pressure", sample.time_s, (sample.pressure_pa, sample.temperature_c))


def gnss_reading(sample: GnssSample) -> Reading:
    """A surface fix."""
    place = (sample.latitude_deg, sample.longitude_deg, sample.altitude_m, sample.horizontal_sigma_m)
    motion = (sample.speed_m_s, sample.course_rad, float(sample.satellites))
    return Reading("gnss", sample.time_s, (float(sample.fix_type), *place, *motion))


def actuation_readings(actuation: Actuation) -> list[Reading]:
    """Result of a control tick: pulses, wrenches, the velocity fed back, the reference."""
    time_s, reference = actuation.time_s, actuation.reference
    wanted = (*reference.nu, *reference.nu_dot, reference.heading_rad, reference.depth_m)
    return [
        Reading("pwm", time_s, actuation.pwm_us),
        Reading("tau_pid", time_s, actuation.tau_pid),
        Reading("tau_ff", time_s, actuation.tau_ff),
        Reading("tau_cmd", time_s, actuation.tau_cmd),
        Reading("nu_fb", time_s, actuation.nu_fb),
        Reading("nu_ref", time_s, wanted),
    ]
