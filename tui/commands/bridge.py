"""`seatrial bridge`: the program on the vehicle, on real ports."""

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from tui import bridge_ring, exit_codes, secured
from tui.arguments import seconds

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Sequence

    from bridge.clock import Clock
    from bridge.ground import Ground
    from bridge.link.base import Link
    from bridge.signing.gate import Trouble
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
    bridge_ring.add_arguments(parser)
    parser.add_argument(
        "--ground",
        type=ground,
        metavar="SYSTEM[:COMPONENT]",
        help="whose orders and parameter writes are taken (default: 255, any component)",
    )
    secured.add_argument(parser)
    parser.add_argument(
        "--seconds", type=seconds, metavar="N", help="stop after so long (default: at Ctrl-C)"
    )


def ground(text: str) -> "Ground":
    """Parse a MAVLink address, SYSTEM or SYSTEM:COMPONENT, each from 1 to 255."""
    from bridge.ground import Ground

    given = [int(part) if part.isdecimal() else 0 for part in text.split(":")]
    if len(given) > 2 or not all(1 <= number <= 255 for number in given):
        raise argparse.ArgumentTypeError(f"'{text}' is no SYSTEM or SYSTEM:COMPONENT, each from 1 to 255")
    return Ground(*given)


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.ground import Ground
    from bridge.parameters import parameters_of
    from bridge.ports import run_ports
    from bridge.service import Bridge
    from bridge.vehicle.config import load_vehicle
    from tui import show
    from tui.files import check_folder, check_no_folder
    from tui.running import until_stopped

    if arguments.parameters:
        check_folder("--parameters", str(Path(arguments.parameters).parent))
        check_no_folder("--parameters", arguments.parameters)
    file = load_vehicle(arguments.vehicle)
    vehicle = file.vehicle
    configuration = file.configuration or next(iter(vehicle.configurations))
    clock = SystemClock()
    ring = bridge_ring.ring_for(arguments, clock)
    words = show.words()

    def refused(trouble: "Trouble") -> None:
        show.say(words, f"warning: {trouble.sentence}")
        # A ground without the key receives this too: anyone can read the vehicle's messages.
        bridge.say(trouble.brief)

    station = arguments.ground or Ground()
    opener = secured.Opener(arguments.sign_key, clock, refused, listed=secured.later, system=station.system)
    links = [lasting(spec, clock, opener.open) for spec in arguments.link]
    store = Path(arguments.parameters) if arguments.parameters else default_store(vehicle)
    parameters = parameters_of(file, store)
    if parameters.trouble:
        show.say(words, f"warning: {parameters.trouble}")
    files = bridge_ring.files_for(arguments, clock)
    bridge = Bridge(
        vehicle,
        clock,
        links,
        parameters,
        veh_cfg=vehicle.veh_cfg(configuration),
        ground=station,
        ring=ring,
        files=files,
    )
    told: dict[str, str] = {}

    def work(stop: "threading.Event") -> None:
        show.say(
            words,
            f"{vehicle.name}, configuration {configuration}: streaming on {', '.join(arguments.link)}; "
            f"parameters in {store}; {bridge_ring.words(arguments)}; Ctrl-C ends it",
        )
        show.say(words, f"orders are taken from {station} alone")
        for sentence in sockets(arguments.link, vehicle):
            show.say(words, sentence)
        if opener.way:
            show.say(words, opener.way)
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

    if ring is not None:
        ring.tell = lambda sentence: show.say(words, f"warning: {sentence}")
        ring.begin()
    try:
        until_stopped(work, clock, arguments.seconds, each)
    finally:
        if files is not None:
            files.close()
        if ring is not None:
            ring.close()
        for link in links:
            link.close()
    devices = vehicle.sensors.present()
    if devices and all(bridge.device_faults.get(slot, "").startswith(f"{slot}: ") for slot in devices):
        show.say(words, f"no device's port could be opened ({', '.join(devices)}); nothing was read")
        return exit_codes.LINK
    return exit_codes.DONE


def sockets(links: "Sequence[str]", vehicle: "Vehicle") -> list[str]:
    """Sentences on the open network sockets: links, and the devices that speak TCP."""
    from bridge.drivers import speaks_tcp
    from bridge.ports import port_spec
    from tui.secured import of_link, of_links

    devices = [
        of_link(port_spec(device), f"the {slot}")
        for slot, device in vehicle.sensors.present().items()
        if device.port and speaks_tcp(device)
    ]
    return [
        *of_links(links, "a link to the ground"),
        *(sentence for sentences in devices for sentence in sentences),
    ]


def lasting(spec: str, clock: "Clock", open_one: "Callable[[str], Link]") -> "Link":
    """A link that must open now and later reconnects by itself without holding up the sensors. Raises LinkError."""
    from bridge.link.reconnecting import Aside, Reconnecting

    first = [open_one(spec)]
    again = Aside(lambda: open_one(spec), spec)
    return Reconnecting(lambda: first.pop() if first else again(), clock, spec)


def default_store(vehicle: "Vehicle") -> Path:
    """Default path of a vehicle's parameter store."""
    state = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(state) / "seatrial" / f"{vehicle.name}.json"
