"""Simulated pressure sensor, speed controllers and satellite receiver."""

import numpy as np

from bridge.clock import SimulatedClock
from bridge.sensors.bar30 import Bar30, FakeBar30
from bridge.simulator.motion import moments, motion_at
from bridge.simulator.plant import Stretch
from bridge.simulator.world import Measured, Surroundings
from bridge.vehicle.config import Device

WATER_C = 15.0


class SimulatedBar30:
    """The real driver on a bus with a fake sensor, asked at 10 Hz unless the vehicle file says otherwise."""

    def __init__(self, slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> None:
        self._slot, self._latency_s, self._world, self._rng = slot, device.latency_s, world, rng
        self._rate_hz = device.rate_hz or 10.0
        self._arm = np.array(device.mounting.position_m)
        self._bus = FakeBar30(temperature_c=WATER_C)
        self._driver = Bar30(self._bus, lambda _: None)

    def arrivals(self, stretch: Stretch) -> list[Measured]:
        water = self._world.water
        motion = motion_at(stretch, moments(stretch, self._rate_hz))
        measured = []
        for time_s, depth_m in zip(motion.time_s.tolist(), motion.depth_of(self._arm).tolist(), strict=True):
            pressure = 100 * water.surface_pressure_hpa
            pressure += water.density_kg_m3 * water.gravity_m_s2 * max(depth_m, 0.0)
            self._bus.pressure_pa = pressure + self._world.noise.pressure_pa * self._rng.standard_normal()
            sample = self._driver.measure(SimulatedClock(time_s))
            if sample is not None:
                measured.append(Measured(self._slot, time_s + self._latency_s, sample))
        return measured
