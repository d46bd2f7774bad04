"""The vehicle's program, on real ports: its options, and how it runs. `seatrial bridge` is the same."""

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from bridge import command_line, exit_codes
from bridge.errors import SeatrialError
from bridge.files import state_folder
from bridge.links import secured
from bridge.text import say, say_warning

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Sequence

    from bridge.ardusub.companion import Companion
    from bridge.clock import Clock
    from bridge.links.link import Link
    from bridge.onboard.file_server import ThreadedFileServer
    from bridge.onboard.orders import Ground
    from bridge.onboard.ring import RingKeeper
    from bridge.onboard.service import Bridge
    from bridge.signing.link import Trouble
    from bridge.vehicle.config import Vehicle, VehicleFile

OPTIONS: Final = "--vehicle ruvifist:hovering --link serial:/dev/ttyS0:921600"
MEGABYTE: Final = 1_000_000
TOTAL_MB: Final = 1000
SEGMENT_MB: Final = 4
FEWEST_SEGMENTS: Final = 4
MOST_SEGMENT_MB: Final = 2000
"""No more of a file is read on the ground (`bridge.wire.tlog.MOST_BYTES`); MAVLink FTP reaches 4 GiB into it."""
NETWORK_BYTES_S: Final = 200_000.0
SERIAL_SHARE: Final = 0.25
"""Share of a serial port's capacity; the telemetry keeps the rest."""
COMPANION_HZ: Final = 100.0
"""The pilot's sticks wait for no more than a step."""
LEAVE_WITHIN_S: Final = 3.0


def main(argv: "Sequence[str] | None" = None) -> int:
    """Run the program with these words of a command line and return its exit code."""
    parser = command_line.Parser(
        prog="seatrial-bridge",
        description="Run on the vehicle: read its sensors, stream MAVLink, hold its parameters.",
        epilog=f"example:\n  seatrial-bridge {OPTIONS}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_arguments(parser)
    try:
        return run(parser.parse_args(sys.argv[1:] if argv is None else argv))
    except SystemExit as stop:
        return int(stop.code or 0)
    except SeatrialError as error:
        say(f"seatrial-bridge: {error}")
        return exit_codes.of(error)
    except KeyboardInterrupt:  # while it loads: once it runs, Ctrl-C ends it in order
        say("seatrial-bridge: stopped before it was done")
        return exit_codes.INTERRUPTED
    except OSError as error:
        say(
            f"seatrial-bridge: {error.filename or 'the disk'}: {error.strerror or error}; check path, rights and disk"
        )
        return exit_codes.BAD_INPUT


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
        "--ring",
        metavar="FOLDER",
        help="keep all that is sent in this folder as well, for dives without a link; the oldest goes first",
    )
    parser.add_argument(
        "--ring-mb",
        type=command_line.size,
        default=TOTAL_MB,
        metavar="N",
        help=f"how large the ring may become, in MB (default: {TOTAL_MB}, some ten hours)",
    )
    parser.add_argument(
        "--segment-mb",
        type=command_line.size,
        default=SEGMENT_MB,
        metavar="N",
        help=f"how large each of its files may become, in MB (default: {SEGMENT_MB})",
    )
    parser.add_argument(
        "--ground",
        type=ground,
        metavar="SYSTEM[:COMPONENT]",
        help="whose orders and parameter writes are taken (default: 255, any component)",
    )
    parser.add_argument(
        "--ardusub",
        action="store_true",
        help="be the companion of an autopilot that runs ArduSub and is heard on a --link: component 191 beside it",
    )
    secured.add_argument(parser)
    parser.add_argument(
        "--seconds", type=command_line.seconds, metavar="N", help="stop after this time (default: at Ctrl-C)"
    )


def ground(text: str) -> "Ground":
    """Parse a MAVLink address, SYSTEM or SYSTEM:COMPONENT, each from 1 to 255."""
    from bridge.onboard.orders import Ground

    given = [int(part) if part.isdecimal() else 0 for part in text.split(":")]
    if len(given) > 2 or not all(1 <= number <= 255 for number in given):
        raise argparse.ArgumentTypeError(f"'{text}' is no SYSTEM or SYSTEM:COMPONENT, each from 1 to 255")
    return Ground(*given)


def run(arguments: argparse.Namespace) -> int:
    """Run with these options, alone with its parameters: a second bridge would overwrite those of the first, and a
    second companion take its sticks. Raises UsageError beside another."""
    from bridge.onboard.store_lock import alone_with
    from bridge.vehicle.config import load_vehicle

    if arguments.parameters:
        command_line.check_folder("--parameters", str(Path(arguments.parameters).parent))
        command_line.check_no_folder("--parameters", arguments.parameters)
    file = load_vehicle(arguments.vehicle)
    if arguments.ardusub:
        from bridge.ardusub.companion import companion_file

        file = companion_file(file)
    vehicle = file.vehicle
    store = Path(arguments.parameters) if arguments.parameters else default_store(vehicle)
    with alone_with(store, "bridge", "this one, for another vehicle, --parameters of its own"):
        return _run(arguments, file, store)


def _run(arguments: argparse.Namespace, file: "VehicleFile", store: Path) -> int:
    from concurrent.futures import ThreadPoolExecutor

    from bridge.clock import SystemClock
    from bridge.onboard.orders import Ground
    from bridge.onboard.parameters import parameters_of
    from bridge.onboard.ports import run_ports
    from bridge.onboard.service import Bridge

    vehicle = file.vehicle
    if arguments.ardusub and arguments.ground and arguments.ground.system == vehicle.system_id:
        raise exit_codes.UsageError(
            f"--ground {arguments.ground.system}: that is the vehicle's own system; give the ground station's, usually "
            "255"
        )
    configuration = file.configuration_chosen()
    clock = SystemClock()
    ring = ring_for(arguments, clock)

    def refused(trouble: "Trouble") -> None:
        say_warning(trouble.sentence)
        # A ground without the key receives this too: anyone can read the vehicle's messages.
        bridge.say(trouble.brief)

    station = arguments.ground or Ground()
    opener = secured.Opener(arguments.sign_key, clock, refused, listed=secured.later)
    links = [lasting(spec, clock, opener.open) for spec in arguments.link]
    aside = ThreadPoolExecutor(1, "store")
    parameters = parameters_of(file, store, aside)
    if parameters.trouble:
        say_warning(parameters.trouble)
    files = files_for(arguments, clock)
    companion = None
    if arguments.ardusub:
        from bridge.ardusub.companion import Companion

        held = store.with_name(f"{store.stem}.sticks")
        companion = Companion(file, configuration, parameters, station, held, aside)
    bridge = Bridge(
        vehicle,
        clock,
        links,
        parameters,
        veh_cfg=vehicle.veh_cfg(configuration),
        ground=station,
        ring=ring,
        files=files,
        companion=companion,
    )
    known: dict[str, str] = {}
    said: dict[str, set[str]] = {}

    def work(stop: "threading.Event") -> None:
        kept = (
            f"up to {arguments.ring_mb} MB kept in {arguments.ring}"
            if arguments.ring
            else "nothing is kept on board (see --ring)"
        )
        say(
            f"{vehicle.name}, configuration {configuration}: streaming on {', '.join(arguments.link)}; "
            f"parameters in {store}; {kept}; Ctrl-C ends it"
        )
        say(f"orders are taken from {station} alone")
        for sentence in sockets(arguments.link, vehicle):
            say(sentence)
        if opener.way:
            say(opener.way)
        if companion is None:
            run_ports(bridge, vehicle, clock, stop)
            return
        give_back = partial(leave, bridge, companion, clock)
        run_ports(bridge, vehicle, clock, stop, rate_hz=COMPANION_HZ, last=give_back)

    def each(_: float) -> None:
        of_links = bridge.link_faults
        parts = of_links | bridge.device_faults
        troubles = {
            "the ring": "" if ring is None else ring.fault,
            "the companion": "" if companion is None else companion.trouble(clock.boot_s()),
        }
        faults = parts | {name: trouble for name, trouble in troubles.items() if trouble}
        for name, fault in faults.items():
            # The reasons of a link that is opened again and again take turns, each second.
            if known.get(name) != fault and not (name in of_links and fault in said.get(name, ())):
                say_warning(fault)
                said.setdefault(name, set()).add(fault)
        for name in known.keys() - faults.keys():
            said.pop(name, None)
            say(f"no longer so: {known[name]}" if name in troubles else f"{name} is back")
        known.clear()
        known.update(faults)

    if ring is not None:
        ring.start()
    try:
        command_line.until_stopped(work, clock, arguments.seconds, each)
    finally:
        aside.shutdown(wait=False)
        if files is not None:
            files.close()
        if ring is not None:
            ring.close()
        for link in links:
            link.close()
    devices = vehicle.sensors.present()
    if devices and bridge.unread_ports >= set(devices):
        say(f"no device's port could be opened ({', '.join(devices)}); nothing was read")
        return exit_codes.LINK
    return exit_codes.DONE


def leave(bridge: "Bridge", companion: "Companion", clock: "Clock") -> None:
    """Give the sticks back to the pilot and say how that ended."""
    import time

    until_s = clock.boot_s() + LEAVE_WITHIN_S
    while not companion.leave() and clock.boot_s() < until_s:
        bridge.step()
        time.sleep(1 / COMPANION_HZ)
    bridge.step()
    if not companion.leave():
        say_warning(
            "the autopilot did not confirm that the sticks are the pilot's again; it will disarm without this "
            "companion: start it again, or set SYSID_MYGCS back by hand (255 for QGroundControl)"
        )


def ring_for(arguments: argparse.Namespace, clock: "Clock") -> "RingKeeper | None":
    """Make the ring that the options ask for, not yet begun; None without one.

    Raises UsageError for an unusable folder or sizes.
    """
    from bridge.onboard.ring import RingSize, ring_in

    if arguments.ring is None:
        return None
    command_line.check_folder("--ring", arguments.ring)
    if arguments.ring_mb < FEWEST_SEGMENTS * arguments.segment_mb:
        raise exit_codes.UsageError(
            f"--ring-mb {arguments.ring_mb}: holds fewer than {FEWEST_SEGMENTS} files of "
            f"--segment-mb {arguments.segment_mb}; give more, or make the files smaller"
        )
    if arguments.segment_mb > MOST_SEGMENT_MB:
        raise exit_codes.UsageError(
            f"--segment-mb {arguments.segment_mb}: no more than {MOST_SEGMENT_MB} MB of a file are read on the ground; "
            "make the files smaller"
        )
    bounds = RingSize(arguments.ring_mb * MEGABYTE, arguments.segment_mb * MEGABYTE)
    return ring_in(Path(arguments.ring), bounds, clock)


def files_for(arguments: argparse.Namespace, clock: "Clock") -> "ThreadedFileServer | None":
    """Make the server of the ring's files on the bridge's links, at each link's own pace; None without a ring."""
    from bridge.onboard.file_server import FileServer, Segments, ThreadedFileServer

    if arguments.ring is None:
        return None
    paces = [pace_of(spec) for spec in arguments.link]
    return ThreadedFileServer(FileServer(Segments(Path(arguments.ring)), lambda link: paces[link]), clock)


def pace_of(spec: str) -> float:
    """Bytes per second of files that a link may carry in addition to its telemetry."""
    from bridge.links.addresses import parse_link
    from bridge.links.descriptor import BITS_A_BYTE

    kind, _, number = parse_link(spec)
    return SERIAL_SHARE * number / BITS_A_BYTE if kind == "serial" else NETWORK_BYTES_S


def sockets(links: "Sequence[str]", vehicle: "Vehicle") -> list[str]:
    """Sentences on the open network sockets: links, and the devices that speak TCP."""
    from bridge.links.addresses import of_link, of_links
    from bridge.onboard.ports import port_spec
    from bridge.sensors.drivers import speaks_tcp

    devices = [
        of_link(port_spec(device), f"the {slot}")
        for slot, device in vehicle.sensors.present().items()
        if device.port and speaks_tcp(device)
    ]
    return [
        *of_links(links, "a link to the ground"),
        *(sentence for sentences in devices for sentence in sentences),
    ]


def lasting(spec: str, clock: "Clock", open_by_name: "Callable[[str], Link]") -> "Link":
    """A link that must open now and later reconnects by itself without holding up the sensors. Raises LinkError."""
    from bridge.links.reconnecting import Aside, Reconnecting

    first = [open_by_name(spec)]
    again = Aside(lambda: open_by_name(spec), spec)
    return Reconnecting(lambda: first.pop() if first else again(), clock, spec)


def default_store(vehicle: "Vehicle") -> Path:
    """Default path of a vehicle's parameter store."""
    return state_folder() / f"{vehicle.name}.json"
