"""`seatrial bridge`: the vehicle's side, on real ports."""

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from tui import exit_codes, numbers

if TYPE_CHECKING:
    import threading

    from bridge.clock import Clock
    from bridge.link.base import Link
    from bridge.vehicle.config import Vehicle

EXAMPLE = "seatrial bridge --vehicle ruvifist:hovering --link serial:/dev/ttyS0:115200"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--vehicle", required=True, metavar="FILE[:CONFIGURATION]", help="which sensors, on which ports"
    )
    parser.add_argument(
        "--link", required=True, action="append", metavar="SPEC", help="where to stream; may be given again"
    )
    parser.add_argument(
        "--parameters",
        metavar="FILE",
        help="where the vehicle keeps its parameters (default: ~/.local/state/seatrial/VEHICLE.json)",
    )
    parser.add_argument(
        "--seconds", type=numbers.seconds, metavar="N", help="stop after so long (default: at Ctrl-C)"
    )


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.parameters import ParameterServer, vehicle_table
    from bridge.ports import run_ports
    from bridge.service import Bridge
    from bridge.vehicle.config import load_vehicle
    from tui import show
    from tui.outputs import check_folder
    from tui.running import until_stopped

    if arguments.parameters:
        check_folder("--parameters", str(Path(arguments.parameters).parent))
    file = load_vehicle(arguments.vehicle)
    vehicle = file.vehicle
    configuration = file.configuration or next(iter(vehicle.configurations))
    clock = SystemClock()
    links = [lasting(spec, clock) for spec in arguments.link]
    store = Path(arguments.parameters) if arguments.parameters else default_store(vehicle)
    parameters = ParameterServer(
        store, vehicle_table(vehicle), system=vehicle.system_id, component=vehicle.component_id
    )
    bridge = Bridge(vehicle, clock, links, parameters, veh_cfg=vehicle.veh_cfg(configuration))
    words = show.words()
    if parameters.trouble:
        show.say(words, f"warning: {parameters.trouble}")
    told: dict[str, str] = {}

    def work(stop: "threading.Event") -> None:
        show.say(
            words,
            f"{vehicle.name}, configuration {configuration}: streaming on {', '.join(arguments.link)}; "
            f"parameters in {store}; Ctrl-C ends it",
        )
        run_ports(bridge, vehicle, clock, stop)

    def each(_: float) -> None:
        faults = bridge.link_faults | bridge.device_faults
        for name, fault in faults.items():
            if told.get(name) != fault:
                show.say(words, f"warning: {fault}")
        for name in told.keys() - faults.keys():
            show.say(words, f"{name} is back")
        told.clear()
        told.update(faults)

    try:
        until_stopped(work, clock, arguments.seconds, each)
    finally:
        for link in links:
            link.close()
    devices = vehicle.sensors.present()
    if devices and all(bridge.device_faults.get(slot, "").startswith(f"{slot}: ") for slot in devices):
        show.say(words, f"no device's port could be opened ({', '.join(devices)}); nothing was read")
        return exit_codes.LINK
    return exit_codes.DONE


def lasting(spec: str, clock: "Clock") -> "Link":
    """A link that must open now, and comes back by itself later, without the sensors waiting. Raises LinkError."""
    from bridge.link.open import open_link
    from bridge.link.reconnecting import Aside, Reconnecting

    first = [open_link(spec)]
    again = Aside(lambda: open_link(spec), spec)
    return Reconnecting(lambda: first.pop() if first else again(), clock, spec)


def default_store(vehicle: "Vehicle") -> Path:
    """Where a vehicle's parameters are kept when nobody says."""
    state = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(state) / "seatrial" / f"{vehicle.name}.json"
