"""The whole simulated vehicle in lock-step: body, devices, the real bridge, the controller, frames on links.

In every control tick the body moves, its devices write, the bridge reads bytes with their simulated arrival times,
the controller acts on the bridge's navigation, and the bridge sends. No thread, no real clock.
"""

import time
from collections.abc import Callable, Sequence

from bridge.clock import Clock, SimulatedClock
from bridge.errors import ParamRejected
from bridge.links.link import Link, memory_pair
from bridge.onboard.flights import Flights
from bridge.onboard.orders import MotorTests
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.service import Bridge
from bridge.simulator.body import SimulatedBody, Start
from bridge.simulator.plant import Stretch
from bridge.simulator.truth import TYPICAL, NoiseLevels, Truth
from bridge.vehicle.autopilot import RATE_HZ, Autopilot
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.legs import Mission
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import MODE, vehicle_table
from bridge.vehicle.references import Reference

TICK_S = 1 / RATE_HZ
WARM_UP_S = 1.0
PROGRESS_TICKS = 100

Sink = Callable[[float, bytes], None]


class SimulatedVehicle:
    """A vehicle in the water with all its equipment; `links` are the vehicle's ends."""

    def __init__(
        self,
        file: VehicleFile,
        configuration: str,
        links: Sequence[Link],
        start: Start,
        parameters: ParameterServer | None = None,
    ) -> None:
        """Boot at time 0, disarmed and idle, with the given parameters or those of the vehicle file."""
        vehicle = file.vehicle
        self.body = SimulatedBody(file, configuration, start)
        self.clock = SimulatedClock(unix_at_boot_s=start.unix_at_boot_s)
        self.parameters = parameters or ParameterServer(None, vehicle_table(vehicle))
        veh_cfg = vehicle.veh_cfg(configuration)
        self.bridge = Bridge(vehicle, self.clock, links, self.parameters, veh_cfg=veh_cfg)
        self._autopilot = Autopilot(vehicle, configuration, self.parameters.active, file.path.parent)
        self.parameters.unproven = self._autopilot.unproven
        self._motor_tests = MotorTests(len(vehicle.configurations[configuration].thrusters))
        self._flights = Flights(vehicle.configurations[configuration])

    def tick(self, reference: Reference | None) -> Stretch:
        """Run a control tick, 50 ms. Without a reference the thrusters stand still."""
        stretch = self._move()
        self.bridge.motor_tests = None
        if reference is None:
            self.body.idle()
        else:
            self.body.pwm_us = self._control(reference)
        self.bridge.step()
        return stretch

    def rest(self) -> Stretch:
        """Run a tick without a mission: the thrusters stand still, or turn as a motor test or a flight asks."""
        stretch = self._move()
        self.bridge.motor_tests, self.bridge.flights = self._motor_tests, self._flights
        reference = self.bridge.fly()
        self.body.pwm_us = self.bridge.rest() if reference is None else self._control(reference)
        self.bridge.step()
        return stretch

    def _control(self, reference: Reference) -> tuple[float, ...]:
        return control(self._autopilot, self.bridge, self.parameters, self.clock, reference)

    def _move(self) -> Stretch:
        stretch, arrivals = self.body.move(TICK_S)
        for arrival in arrivals:
            self.clock.advance_to(max(arrival.time_s, self.clock.boot_s()))
            self.bridge.take(arrival)
        self.clock.advance_to(max(self.body.time_s, self.clock.boot_s()))
        return stretch


def control(
    autopilot: Autopilot, bridge: Bridge, parameters: ParameterServer, clock: Clock, reference: Reference
) -> tuple[float, ...]:
    """Run a tick of the controller on the bridge's navigation, report it to the ground station, return the pulse
    widths.

    The thrusters of a disarmed vehicle stay at neutral, with or without a mission.
    """
    autopilot.mode = parameters.mode
    tick = autopilot.step if bridge.armed else autopilot.rest
    actuation = tick(clock.boot_s(), bridge.navigation, reference)
    bridge.publish(actuation)
    for text in autopilot.take_texts():
        bridge.say(text)
    return actuation.pwm_us


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
    after: Callable[[SimulatedVehicle], None] = lambda _: None,
) -> None:
    """Dive a mission, after one second of rest in which the sensors start.

    `sink(unix_s, data)` gets the frames of every tick, which also go out on `links`. `mode` None leaves FF_MODE as
    the parameters have it. `pace(boot_s)` may wait until a tick is due; `progress` gets the share of the dive that is
    done; `after` gets the vehicle at its end. Raises ParamRejected if the mode needs a set of parameters that the
    vehicle does not have.
    """
    near, far = memory_pair()
    start = Start(seed, mission.start_depth_m, mission.start_heading_rad, unix_at_boot_s, noise, truth)
    vehicle = SimulatedVehicle(file, configuration, (near, *links), start, parameters)
    _make_ready(vehicle, mode)
    ticks = round((WARM_UP_S + mission.duration_s) * RATE_HZ)
    for tick in range(1, ticks + 1):
        since_s = vehicle.body.time_s + TICK_S - WARM_UP_S
        vehicle.tick(mission.reference(since_s) if since_s >= 0 else None)
        while data := far.read(0.0):
            sink(vehicle.clock.unix_s(), data)
        pace(vehicle.clock.boot_s())
        if tick % PROGRESS_TICKS == 0 or tick == ticks:
            progress(tick / ticks)
    after(vehicle)


def disarm(vehicle: SimulatedVehicle) -> None:
    """Disarm after a mission, and beat once more, so that whoever listens knows that the dive is over."""
    vehicle.bridge.arm(False)
    for _ in range(round(WARM_UP_S * RATE_HZ) + 1):
        vehicle.tick(None)


def _make_ready(vehicle: SimulatedVehicle, mode: Mode | None) -> None:
    parameters = vehicle.parameters
    if mode is not None and parameters.write(MODE, float(mode), armed=False) is not None:
        raise ParamRejected(
            f"the simulated vehicle refused FF_MODE {int(mode)}; check that its store can be written"
        )
    arm_for_mission(vehicle.bridge, parameters)


def arm_for_mission(bridge: Bridge, parameters: ParameterServer) -> None:
    """Arm the vehicle. Raises ParamRejected if the mode needs a set of parameters that the vehicle does not have."""
    if not bridge.arm(True):
        raise ParamRejected(
            f"FF_MODE {parameters.mode} needs a set of parameters in force and the simulated vehicle has none; "
            "upload one first: seatrial params upload"
        )


def real_time(
    speed: float = 1.0,
    now_s: Callable[[], float] = time.monotonic,
    wait: Callable[[float], None] = time.sleep,
) -> Callable[[float], None]:
    """Return a pace function that runs `speed` simulated seconds per second, starting now."""
    begun_s = now_s()

    def pace(boot_s: float) -> None:
        ahead_s = begun_s + boot_s / speed - now_s()
        if ahead_s > 0:
            wait(ahead_s)

    return pace
