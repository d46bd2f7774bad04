"""The simulated part under water: the body with its thrusters, and the devices that measure its motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridge.simulator.instruments import Instruments
from bridge.simulator.noise import TYPICAL, NoiseLevels
from bridge.simulator.plant import Plant, Stretch
from bridge.simulator.truth import Truth, load_truth
from bridge.simulator.world import Arrival, Surroundings
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import NEUTRAL_US, thrust_curve


@dataclass(frozen=True)
class Start:
    """Start conditions of a dive: place, time and water. `truth` None means the truth file next to the vehicle file."""

    seed: int
    depth_m: float = 0.6
    heading_rad: float = 0.0
    unix_at_boot_s: float = 1_790_000_000.0
    noise: NoiseLevels = TYPICAL
    truth: Truth | None = None


class SimulatedBody:
    """A body at rest at time 0, idle until `pwm_us` is set; the seed draws its water and its sensors' noise."""

    def __init__(self, file: VehicleFile, configuration: str, start: Start) -> None:
        vehicle = file.vehicle
        shape = vehicle.configurations[vehicle.configuration_named(configuration)]
        water, devices = np.random.default_rng(start.seed).spawn(2)
        self._plant = Plant(
            shape,
            thrust_curve(vehicle.thrust_curve, file.path.parent),
            vehicle.thrust_curve.lag_s,
            start.truth or load_truth(file, configuration),
            water,
            depth_m=start.depth_m,
            heading_rad=start.heading_rad,
        )
        world = Surroundings(start.noise, vehicle.water, vehicle.thrust_curve, start.unix_at_boot_s)
        self._instruments = Instruments(vehicle.sensors, world, devices)
        self._thrusters = len(shape.thrusters)
        self.pwm_us: tuple[float, ...] = ()
        self.idle()

    @property
    def time_s(self) -> float:
        return self._plant.time_s

    def idle(self) -> None:
        """Stop the thrusters."""
        self.pwm_us = (NEUTRAL_US,) * self._thrusters

    def move(self, duration_s: float) -> tuple[Stretch, Sequence[Arrival]]:
        """Advance under the present commands; return the body's motion and the device data that arrived by its end."""
        stretch = self._plant.advance(self.pwm_us, duration_s)
        return stretch, self._instruments.arrivals(stretch)
