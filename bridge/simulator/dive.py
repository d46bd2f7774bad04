"""The whole simulated vehicle in lock-step: body, devices, the real bridge, the controller, frames on links.

Every control tick the body moves, its devices write, the bridge reads bytes with their simulated time of
arrival, the controller acts on what the bridge then knows, and the bridge sends. No thread, no real clock.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bridge.clock import SimulatedClock
from bridge.errors import ParamRejected
from bridge.link.base import Link
from bridge.link.memory import memory_pair
from bridge.parameters import MODE, ParameterServer, vehicle_table
from bridge.service import Bridge
from bridge.simulator.instruments import Instruments
from bridge.simulator.missions import Mission
from bridge.simulator.noise import TYPICAL, NoiseLevels
from bridge.simulator.plant import Plant, Stretch
from bridge.simulator.truth import Truth, load_truth
from bridge.simulator.world import Chunk, Surroundings
from bridge.vehicle.autopilot import RATE_HZ, Autopilot
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.feedforward import Mode
from bridge.vehicle.references import Reference
from bridge.vehicle.thrusters import NEUTRAL_US, thrust_curve

TICK_S = 1 / RATE_HZ
WARM_UP_S = 1.0
PROGRESS_TICKS = 100

Sink = Callable[[float, bytes], None]


@dataclass(frozen=True)
class Start:
    """Where and in which water a dive begins. `truth` None is that beside the vehicle file."""

    seed: int
    depth_m: float = 0.6
    heading_rad: float = 0.0
    unix_at_boot_s: float = 1_790_000_000.0
    noise: NoiseLevels = TYPICAL
    truth: Truth | None = None


class SimulatedVehicle:
    """A vehicle in the water with everything aboard; `links` are the vehicle's ends."""

    def __init__(
        self,
        file: VehicleFile,
        configuration: str,
        links: Sequence[Link],
        start: Start,
        parameters: ParameterServer | None = None,
    ) -> None:
        """Boots at time 0, disarmed and idle, with the parameters given or those of the vehicle file."""
        vehicle = file.vehicle
        shape = vehicle.configurations[vehicle.configuration_named(configuration)]
        directory = file.path.parent
        body, devices = np.random.default_rng(start.seed).spawn(2)
        self.clock = SimulatedClock(unix_at_boot_s=start.unix_at_boot_s)
        self.parameters = parameters or ParameterServer(None, vehicle_table(vehicle))
        self.bridge = Bridge(
            vehicle, self.clock, links, self.parameters, veh_cfg=vehicle.veh_cfg(configuration)
        )
        self.plant = Plant(
            shape,
            thrust_curve(vehicle.thrust_curve, directory),
            vehicle.thrust_curve.lag_s,
            start.truth or load_truth(file, configuration),
            body,
            depth_m=start.depth_m,
            heading_rad=start.heading_rad,
        )
        self._autopilot = Autopilot(vehicle, configuration, self.parameters.active, directory)
        world = Surroundings(start.noise, vehicle.water, vehicle.thrust_curve, self.clock.unix_at_boot_s)
        self._instruments = Instruments(vehicle.sensors, world, devices)
        self._idle = (NEUTRAL_US,) * len(shape.thrusters)
        self._pwm_us = self._idle

    def tick(self, reference: Reference | None) -> Stretch:
        """One control tick, 50 ms. Without a reference the thrusters stand still."""
        stretch = self.plant.advance(self._pwm_us, TICK_S)
        for arrival in self._instruments.arrivals(stretch):
            self.clock.advance_to(max(arrival.time_s, self.clock.boot_s()))
            if isinstance(arrival, Chunk):
                self.bridge.receive(arrival.slot, arrival.data, arrival.time_s)
            else:
                self.bridge.accept(arrival.slot, (arrival.sample,))
        self.clock.advance_to(max(self.plant.time_s, self.clock.boot_s()))
        self._pwm_us = self._idle
        if reference is not None:
            self._act(reference)
        self.bridge.step()
        return stretch

    def _act(self, reference: Reference) -> None:
        self._autopilot.mode = Mode(self.parameters.mode)
        actuation = self._autopilot.step(self.clock.boot_s(), self.bridge.navigation, reference)
        self.bridge.publish(actuation)
        for text in self._autopilot.take_texts():
            self.bridge.say(text)
        self._pwm_us = actuation.pwm_us


def simulate_dive(
    file: VehicleFile,
    configuration: str,
    mission: Mission,
    *,
    seed: int,
    sink: Sink,
    parameters: ParameterServer | None = None,
    mode: Mode | None = None,
    noise: NoiseLevels = TYPICAL,
    truth: Truth | None = None,
    unix_at_boot_s: float = 1_790_000_000.0,
    links: Sequence[Link] = (),
    pace: Callable[[float], None] = lambda _: None,
    progress: Callable[[float], None] = lambda _: None,
) -> None:
    """Dive a mission, after one second of rest in which the sensors speak up.

    `sink(unix_s, data)` gets the frames of every tick, which also go out on `links`. `mode` None leaves FF_MODE
    as the parameters have it. `pace(boot_s)` may wait until a tick is due; `progress` hears shares of the whole.
    Raises ParamRejected where the mode needs a set of parameters that the vehicle does not have.
    """
    near, far = memory_pair()
    start = Start(seed, mission.start_depth_m, mission.start_heading_rad, unix_at_boot_s, noise, truth)
    vehicle = SimulatedVehicle(file, configuration, (near, *links), start, parameters)
    _make_ready(vehicle, mode)
    ticks = round((WARM_UP_S + mission.duration_s) * RATE_HZ)
    for tick in range(1, ticks + 1):
        since_s = vehicle.plant.time_s + TICK_S - WARM_UP_S
        vehicle.tick(mission.reference(since_s) if since_s >= 0 else None)
        while data := far.read(0.0):
            sink(vehicle.clock.unix_s(), data)
        pace(vehicle.clock.boot_s())
        if tick % PROGRESS_TICKS == 0 or tick == ticks:
            progress(tick / ticks)


def _make_ready(vehicle: SimulatedVehicle, mode: Mode | None) -> None:
    parameters = vehicle.parameters
    if mode is not None and parameters.write(MODE, float(mode), armed=False) is not None:
        raise ParamRejected(
            f"the simulated vehicle refused FF_MODE {int(mode)}; check that its store can be written"
        )
    if not vehicle.bridge.arm(True):
        raise ParamRejected(
            f"FF_MODE {parameters.mode} needs a set of parameters in force and the simulated vehicle has none; "
            "upload one first, or give the vehicle file a 'model'"
        )


def real_time(speed: float = 1.0) -> Callable[[float], None]:
    """A pace of `speed` simulated seconds a second, from the first tick on."""
    begun_s = time.monotonic()

    def pace(boot_s: float) -> None:
        ahead_s = begun_s + boot_s / speed - time.monotonic()
        if ahead_s > 0:
            time.sleep(ahead_s)

    return pace
