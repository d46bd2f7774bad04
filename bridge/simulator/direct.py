"""A simulated dive without bytes: body, controller and mission, with arrays of the true motion."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from bridge.arrays import Array
from bridge.attitude import heading_of, unwrapped
from bridge.simulator.plant import Plant, Stretch
from bridge.simulator.truth import Truth, load_truth
from bridge.vehicle.autopilot import RATE_HZ, Actuation, Autopilot
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.controller import GAINS
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.references import Reference
from bridge.vehicle.thrusters import NEUTRAL_US, thrust_curve

TICK_S = 1 / RATE_HZ


class Itinerary(Protocol):
    """A `Mission`, or the reference of a recorded dive."""

    @property
    def start_depth_m(self) -> float: ...

    @property
    def start_heading_rad(self) -> float: ...

    @property
    def duration_s(self) -> float: ...

    def reference(self, time_s: float) -> Reference:
        """The reference so long after the start."""
        ...


@dataclass(frozen=True)
class Noise:
    """White noise on the controller's inputs: standard deviations in SI units."""

    velocity_m_s: float = 0.004
    rate_rad_s: float = 0.0007
    heading_rad: float = 0.0005
    depth_m: float = 0.002
    velocity_ticks: int = 2


QUIET = Noise(0.0, 0.0, 0.0, 0.0, 1)


@dataclass(frozen=True)
class TruthRun:
    """A simulated dive, with a row per control tick.

    `state` (n, 13) and `nu_dot` (n, 6) are the truth at `time_s` (n,), before the commands of that tick act; the
    other fields are as in `Actuation`. `wrench` (n, 6) is that of the true thrusts.
    """

    time_s: Array
    state: Array
    nu_dot: Array
    wrench: Array
    actuations: tuple[Actuation, ...]

    @property
    def nu(self) -> Array:
        """True body velocity (n, 6)."""
        return self.state[:, 7:]

    def column(self, name: str) -> Array:
        """A field of the actuations as an array (n, k): `tau_pid`, `tau_cmd`, `nu_fb`, `pwm_us` ..."""
        return np.array([getattr(actuation, name) for actuation in self.actuations])

    @property
    def nu_ref(self) -> Array:
        """Wanted body velocity (n, 6)."""
        return np.array([actuation.reference.nu for actuation in self.actuations])


def simulate_truth(
    file: VehicleFile,
    configuration: str,
    mission: Itinerary,
    *,
    seed: int,
    parameters: Mapping[str, float] | None = None,
    mode: Mode = Mode.OFF,
    noise: Noise | None = None,
    truth: Truth | None = None,
    gains: Path = GAINS,
) -> TruthRun:
    """Dive a mission under the real controller, fed with the truth plus white noise; no sensor, no bytes.

    `parameters` are the feed-forward's coefficients (without any, it stays at zero). `noise` defaults to the level of
    the real sensors, `truth` to the truth file next to the vehicle file, `gains` to the file of gain tables that comes
    with the controller. The velocity is renewed every `velocity_ticks` ticks.
    """
    noise = noise or Noise()
    rng = np.random.default_rng(seed)
    vehicle, shape = (
        file.vehicle,
        file.vehicle.configurations[file.vehicle.configuration_named(configuration)],
    )
    plant = Plant(
        shape,
        thrust_curve(vehicle.thrust_curve, file.path.parent),
        vehicle.thrust_curve.lag_s,
        truth or load_truth(file, configuration),
        rng,
        depth_m=mission.start_depth_m,
        heading_rad=mission.start_heading_rad,
    )
    given = dict(parameters or {})
    autopilot = Autopilot(vehicle, configuration, lambda _: given, file.path.parent, mode, gains)
    navigation = Navigation(heading_rad=mission.start_heading_rad)
    count = round(mission.duration_s * RATE_HZ)
    states, rates, wrenches = np.empty((count, 13)), np.empty((count, 6)), np.empty((count, 6))
    actuations = []
    stretch = plant.advance((NEUTRAL_US,) * len(shape.thrusters), TICK_S)
    for tick in range(count):
        states[tick], rates[tick] = stretch.state[-1], stretch.nu_dot[-1]
        wrenches[tick] = plant.wrench(stretch.thrust_n)
        navigation = _sense(navigation, stretch, noise, rng, renew=tick % noise.velocity_ticks == 0)
        actuation = autopilot.step(tick * TICK_S, navigation, mission.reference(tick * TICK_S))
        actuations.append(actuation)
        stretch = plant.advance(actuation.pwm_us, TICK_S)
    return TruthRun(TICK_S * np.arange(count, dtype=np.float64), states, rates, wrenches, tuple(actuations))


def _sense(
    before: Navigation, stretch: Stretch, noise: Noise, rng: np.random.Generator, *, renew: bool
) -> Navigation:
    state = stretch.state[-1]
    draw = rng.standard_normal(8)
    velocity = state[7:10] + noise.velocity_m_s * draw[:3]
    rate = state[10:13] + noise.rate_rad_s * draw[3:6]
    w, x, y, z = state[3:7].tolist()
    now_s = float(stretch.time_s[-1]) - TICK_S  # the body is one tick old when the controller's clock starts
    return replace(
        before,
        velocity=tuple(velocity.tolist()) if renew else before.velocity,
        velocity_time_s=now_s if renew else before.velocity_time_s,
        rate=tuple(rate.tolist()),
        rate_time_s=now_s,
        attitude_time_s=now_s,
        depth_time_s=now_s,
        attitude=(w, x, y, z),
        heading_rad=unwrapped(heading_of((w, x, y, z)), before.heading_rad) + noise.heading_rad * draw[6],
        depth_m=float(state[2]) + noise.depth_m * draw[7],
    )
