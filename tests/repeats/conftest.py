"""Short runs of a small vehicle with four vertical thrusters, from rest into one steady push."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from bridge.vehicle.config import GRAVITY_M_S2, VehicleFile, load_vehicle
from identify.dive import Dive, Signal
from identify.ingest.rotation import quaternions_from_euler

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "haizhe"
FULL_US, NEUTRAL_US = 1200.0, 1100.0
STEP_S = 0.05
REST_S, PUSH_S = 0.5, 10.0


@dataclass(frozen=True)
class Made:
    """A vehicle that is what its file says but for what a run is given.

    gains (4,): of the thrusters. heavier_n, and moments of the run about roll, pitch and yaw, N m. reads_m: depth read
    beyond the true one.
    """

    file: VehicleFile
    gains: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    buoyancy_n: float = 9.0
    heavier_n: float = 0.0
    moment_nm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    reads_m: float = 0.0
    voltage_v: float = 12.0
    pulse_us: float = FULL_US
    rest_s: float = REST_S
    push_s: float = PUSH_S
    drag: float = field(default=5.0)

    def but(self, **changes):
        return replace(self, **changes)

    @property
    def shape(self):
        return self.file.vehicle.configurations["quadrotor"]

    def dive(self, name="run"):
        time_s = np.arange(0.0, self.rest_s + self.push_s, STEP_S)
        since_s = np.maximum(time_s - self.rest_s, 0.0)
        pushed = time_s >= self.rest_s - 1e-9
        curve = self.file.vehicle.thrust_curve
        each_n = curve.max_n * ((self.pulse_us - NEUTRAL_US) / curve.span_us) ** 2 * np.array(self.gains)
        each_n *= (self.voltage_v / 12.0) ** 2
        places = np.array([thruster.position_m for thruster in self.shape.thrusters])
        roll_nm = each_n @ places[:, 1] + self.moment_nm[0]
        pitch_nm = -each_n @ places[:, 0] + self.moment_nm[1]
        righting = self.shape.dry_mass_kg * GRAVITY_M_S2 * self.shape.centre_of_gravity_below_buoyancy_m
        sinking = (each_n.sum() - self.buoyancy_n + self.heavier_n) / self.drag
        inertia, damping = self.shape.model["I_r"], self.shape.model["D_r"]
        settles_s = inertia / damping
        yaw = self.moment_nm[2] / damping * (since_s - settles_s * (1.0 - np.exp(-since_s / settles_s)))
        leans = np.where(pushed, 1.0, 0.0)
        euler = (0.1 + leans * roll_nm / righting, leans * pitch_nm / righting, 3.0 + yaw)
        return Dive(
            name,
            Path(f"{name}.csv"),
            name,
            attitude=Signal(time_s, quaternions_from_euler(*euler)),
            depth=Signal(time_s, (self.reads_m + sinking * since_s)[:, None]),
            pwm=Signal(time_s, np.where(pushed, self.pulse_us, NEUTRAL_US)[:, None] * np.ones(4)),
            voltage=Signal(time_s, np.full((len(time_s), 1), self.voltage_v)),
        )

    def dives(self, count, seed):
        """Runs that scatter as runs do: buoyancy, moments, depth at rest."""
        rng = np.random.default_rng(seed)
        return [
            self.but(
                buoyancy_n=self.buoyancy_n + 0.4 * rng.standard_normal(),
                moment_nm=tuple(np.add(self.moment_nm, 0.06 * rng.standard_normal(3))),
                reads_m=self.reads_m + 0.02 * rng.standard_normal(),
            ).dive(f"run {seed}.{number}")
            for number in range(count)
        ]


@pytest.fixture(scope="session")
def sound():
    return Made(load_vehicle(str(EXAMPLE / "haizhe.yaml")))
