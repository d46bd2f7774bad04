"""Simulate a dive from a scenario and a mission: motion, commands and forces."""

from dataclasses import dataclass

import numpy as np

from bench.field import dive as kernel
from bench.field.autopilot import NEUTRAL, Autopilot, fresh
from bench.field.mission import Pilot, Sticks
from bench.field.scenario import FieldScenario
from bench.field.vehicle import LAG_S, FieldVehicle
from bridge.arrays import Array
from identify.challenge.equations_of_motion import STATES
from identify.challenge.scenario import coloured

STICK_US = 200
"""A full stick, as ArduSub has it at its default gain of a half."""


@dataclass(frozen=True)
class Sea:
    """A stationary first-order disturbance: standard deviation (6,), N and N m, and correlation time."""

    std: Array
    memory_s: float


@dataclass(frozen=True)
class Sensors:
    """Standard deviations: tilt (roll and pitch) and heading rad, rates rad/s, force m/s2, depth m, position_z m,
    volts.

    full_v: voltage of the full battery. ohm: resistance of a battery whose sag no thruster feels; fall: share of its
    squared voltage lost per second.
    """

    tilt: float
    heading: float
    rates: float
    force: float
    depth: float
    height: float
    volts: float
    full_v: float
    ohm: float
    fall: float


@dataclass(frozen=True)
class Flown:
    """A dive: the pilot's sticks, `ticks` as the kernel filled them, the noise (n, 8) of the autopilot's readings, and
    the sea's wrench (n, 6) at the ticks."""

    scenario: FieldScenario
    sticks: Sticks
    ticks: kernel.Ticks
    noise: Array
    sea: Array


def draw_sea(rng: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot, autopilot: Autopilot) -> Sea:
    """Draw a sea of 0.5 to 3 % of full thrust, a sixth of it in N m, with a correlation time of 0.7 to 4 s.

    Full thrust is the geometric mean of a full stick ahead at the autopilot's own gain and of this pilot's full
    surge.
    """
    one_n = float(autopilot.thrust_at[NEUTRAL + STICK_US])
    full_n = float(np.sqrt(one_n * autopilot.reach[0] * vehicle.share * pilot.surge_n))
    force = float(np.exp(rng.uniform(np.log(0.005), np.log(0.03)))) * full_n
    moment = force / 6.0 * vehicle.share ** (1 / 3)
    unequal = np.exp(0.15 * rng.standard_normal(6))
    std = unequal * np.array([force, force, force, 0.1 * moment, 0.1 * moment, moment])
    return Sea(std, float(np.exp(rng.uniform(np.log(0.7), np.log(4.0)))))


def draw_sensors(rng: np.random.Generator) -> Sensors:
    return Sensors(
        tilt=rng.uniform(0.0003, 0.001),
        heading=rng.uniform(0.0003, 0.002),
        rates=rng.uniform(0.002, 0.005),
        force=rng.uniform(0.02, 0.07),
        depth=rng.uniform(0.002, 0.006),
        height=rng.uniform(0.004, 0.012),
        volts=rng.uniform(0.01, 0.06),
        full_v=rng.uniform(15.8, 16.6),
        ohm=rng.uniform(0.01, 0.04),
        fall=rng.uniform(1e-5, 8e-5),
    )


def fly(
    scenario: FieldScenario,
    autopilot: Autopilot,
    sticks: Sticks,
    sea: Sea,
    sensors: Sensors,
    heading: float,
    rng: np.random.Generator,
) -> Flown:
    """Dive the sticks. `rng` draws sea and noise."""
    count, k = len(sticks.asked), scenario.prop.way.shape[0]
    drawn = coloured(rng, len(scenario.time_s), kernel.STEP_S, sea.memory_s, 1, sea.std)
    spread = [
        sensors.tilt,
        sensors.tilt,
        sensors.heading,
        *[sensors.rates] * 3,
        sensors.depth,
        sensors.height,
    ]
    noise = rng.standard_normal((count, 8)) * np.array(spread)
    start = np.zeros(STATES)
    start[2], start[3], start[6] = scenario.depth_m, np.cos(0.5 * heading), np.sin(0.5 * heading)
    ticks = kernel.Ticks(
        np.zeros((count, STATES)), np.zeros((count, 6)), np.zeros((count, 6)), np.zeros((count, k)),
        np.zeros((count, k)), np.zeros((count, 2)), np.zeros((count, 5)), np.zeros((count * kernel.EACH, 3)),
    )  # fmt: skip
    supply = kernel.Supply(
        sensors.full_v,
        scenario.felt_ohm or sensors.ohm,
        scenario.felt_fall or sensors.fall,
        scenario.felt_ohm,
        scenario.felt_fall,
    )
    water = kernel.Water(
        np.zeros((1, 12)) if scenario.moved is None else scenario.moved, scenario.push + drawn, scenario.grown
    )
    kernel.dive(
        scenario.body(), scenario.hull, scenario.prop, autopilot, fresh(scenario.depth_m, heading), water, supply,
        sticks.asked, sticks.leg, scenario.pilot.leash_m, noise, LAG_S, start, ticks,
    )  # fmt: skip
    return Flown(scenario, sticks, ticks, noise, drawn[:: kernel.EACH][:count])
