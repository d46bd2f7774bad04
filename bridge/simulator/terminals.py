"""The simulated vehicle in real time: its devices write into pseudo-terminals that the real bridge reads."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from threading import Event, Thread

from bridge.clock import Clock
from bridge.errors import LinkLost
from bridge.links.descriptor import open_pty
from bridge.links.link import Link
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.ports import run_ports
from bridge.onboard.service import Bridge
from bridge.sensors.bar30 import FakeBar30, I2cBus
from bridge.simulator.body import SimulatedBody, Start
from bridge.simulator.dive import arm_for_mission, control
from bridge.simulator.missions import Mission
from bridge.simulator.world import Chunk
from bridge.vehicle.autopilot import Autopilot
from bridge.vehicle.config import Vehicle, VehicleFile

STEP_S = 0.01


@dataclass(frozen=True)
class Terminals:
    """A pseudo-terminal for each device with a serial port; the ports in `vehicle` point to them."""

    vehicle: Vehicle
    links: dict[str, Link]

    def close(self) -> None:
        for link in self.links.values():
            link.close()


def open_terminals(vehicle: Vehicle) -> Terminals:
    """Open stand-ins for the serial ports of a vehicle file."""
    links: dict[str, Link] = {}
    devices = {}
    for slot, device in vehicle.sensors.present().items():
        if device.kind != "bar30":
            links[slot], path = open_pty()
            devices[slot] = replace(device, port=path)
    return Terminals(replace(vehicle, sensors=replace(vehicle.sensors, **devices)), links)


def dive_in_real_time(
    file: VehicleFile,
    configuration: str,
    mission: Mission,
    *,
    seed: int,
    links: Sequence[Link],
    parameters: ParameterServer,
    clock: Clock,
    stop: Event,
    each_tick: Callable[[Bridge, SimulatedBody], None] = lambda _bridge, _body: None,
) -> None:
    """Dive a mission by the computer's clock, armed, until its end or until `stop` is set.

    One thread moves the body and writes its devices' data; `run_ports` does everything else as on a vehicle.
    `each_tick` is called in the bridge's thread at the control rate. Raises ParamRejected if FF_MODE needs a set of
    parameters that the vehicle does not have.
    """
    begun_s = clock.boot_s()
    start = Start(seed, mission.start_depth_m, mission.start_heading_rad, clock.unix_s())
    body = SimulatedBody(file, configuration, start)
    bus = FakeBar30()
    with ExitStack() as stack:
        terminals = open_terminals(file.vehicle)
        stack.callback(terminals.close)
        vehicle = terminals.vehicle
        autopilot = Autopilot(vehicle, configuration, parameters.active, file.path.parent)
        parameters.unproven = autopilot.unproven
        bridge = Bridge(vehicle, clock, links, parameters, veh_cfg=vehicle.veh_cfg(configuration))
        arm_for_mission(bridge, parameters)

        def act() -> None:
            since_s = clock.boot_s() - begun_s
            body.pwm_us = control(autopilot, bridge, parameters, clock, mission.reference(since_s))
            each_tick(bridge, body)
            if since_s >= mission.duration_s:
                stop.set()

        def open_bus(_number: int) -> I2cBus:
            return bus

        def swim() -> None:
            _swim(body, terminals.links, bus, lambda: clock.boot_s() - begun_s, stop)

        water = Thread(target=swim, name="water", daemon=True)
        water.start()
        try:
            run_ports(bridge, vehicle, clock, stop, act=act, open_bus=open_bus)
        finally:
            stop.set()
            water.join()


def _swim(
    body: SimulatedBody, links: dict[str, Link], bus: FakeBar30, since_s: Callable[[], float], stop: Event
) -> None:
    """Move the body along with the clock, in steps of 10 ms."""
    while not stop.is_set():
        while body.time_s + STEP_S <= since_s() and not stop.is_set():
            for arrival in body.move(STEP_S)[1]:
                if isinstance(arrival, Chunk):
                    _write(links[arrival.slot], arrival.data)
                else:
                    bus.pressure_pa = arrival.sample.pressure_pa
        stop.wait(STEP_S / 4)


def _write(link: Link, data: bytes) -> None:
    """Write to a port that may not be open yet, or no longer; bytes from the bridge to the device are read and
    dropped."""
    try:
        link.write(data)
        link.read(0.0)
    except LinkLost:
        return
