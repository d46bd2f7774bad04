"""`seatrial doctor`: what is well and what is not, before the vehicle gets wet and in the water."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from tui import exit_codes

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bridge.clock import Clock
    from bridge.link.base import Link
    from bridge.vehicle.config import Vehicle, VehicleFile
    from gcs_plugin.doctor.findings import Finding

EXAMPLE = "seatrial doctor --vehicle ruvifist:hovering --link udpin:127.0.0.1:14550"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--vehicle", metavar="FILE[:CONFIGURATION]", help="what the vehicle should have aboard"
    )
    parser.add_argument(
        "--link", metavar="SPEC", help="the link to the vehicle; without it, the ports of its devices"
    )
    parser.add_argument(
        "--out", default="dives", metavar="FOLDER", help="where recordings go (default: dives)"
    )
    parser.add_argument("--seconds", type=float, default=6.0, metavar="N", help="listen so long (default: 6)")
    parser.add_argument("--json", metavar="FILE", help="write the findings as JSON; - for standard output")


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.link.open import open_link
    from bridge.vehicle.config import load_vehicle

    if not (arguments.vehicle or arguments.link):
        raise exit_codes.UsageError("nothing to check; give --vehicle FILE, --link SPEC, or both")
    file = load_vehicle(arguments.vehicle) if arguments.vehicle else None
    if arguments.link is None:
        assert file is not None
        return tell(arguments, [vehicle_file(file), disk(Path(arguments.out)), *ports(file.vehicle)])
    link = open_link(arguments.link)
    try:
        return tell(arguments, dry(arguments, file, link, SystemClock()))
    finally:
        link.close()


def dry(
    arguments: argparse.Namespace, file: "VehicleFile | None", link: "Link", clock: "Clock"
) -> list["Finding"]:
    """What the link tells: the vehicle, its clock, its sensors, its parameters."""
    import shutil

    from gcs_plugin.doctor.checks import check_parameters, dry_findings
    from gcs_plugin.doctor.observe import observe
    from gcs_plugin.params.client import ParameterClient
    from tui import show

    with show.words().status(f"listening for {arguments.seconds:g} s"):
        observed = observe(link, clock, arguments.seconds)
        others = []
        if observed.arrivals:
            others.append(check_parameters(ParameterClient(link, clock).read_all))
    place = existing(Path(arguments.out))
    vehicle = file.vehicle if file else None
    found = dry_findings(observed, vehicle, shutil.disk_usage(place).free, str(place), others)
    return [vehicle_file(file), *found] if file else found


def vehicle_file(file: "VehicleFile") -> "Finding":
    """A file that was loaded is well; what is in it is said."""
    from gcs_plugin.doctor.findings import ok

    vehicle = file.vehicle
    devices = (
        ", ".join(f"{slot} {device.kind}" for slot, device in vehicle.sensors.present().items()) or "none"
    )
    configurations = ", ".join(vehicle.configurations)
    return ok(
        "vehicle file", f"{file.path}: '{vehicle.name}', configurations {configurations}; devices: {devices}"
    )


def disk(folder: Path) -> "Finding":
    """The space where recordings go."""
    import shutil

    from gcs_plugin.doctor.checks import check_disk

    place = existing(folder)
    return check_disk(shutil.disk_usage(place).free, str(place))


def ports(vehicle: "Vehicle") -> list["Finding"]:
    """Whether the ports of the vehicle file are on this computer."""
    from gcs_plugin.doctor.findings import fail, ok

    found = []
    for slot, device in vehicle.sensors.present().items():
        path = Path(f"/dev/i2c-{device.port.split(':')[1]}") if device.kind == "bar30" else Path(device.port)
        if not device.port or device.port.startswith("tcp:"):
            continue
        if path.exists():
            found.append(ok(slot, f"{device.kind}: {path} is there"))
        else:
            found.append(
                fail(slot, f"{device.kind}: no port {path} here; plug it in, or mend the vehicle file")
            )
    return found


def existing(folder: Path) -> Path:
    """The folder, or the nearest above it that exists."""
    return next(place for place in (folder, *folder.absolute().parents) if place.is_dir())


def tell(arguments: argparse.Namespace, findings: "Iterable[Finding]") -> int:
    """The findings as a table and JSON; the exit code says whether one failed."""
    from gcs_plugin.doctor.findings import Level, worst
    from tui import show

    found = list(findings)
    rows = [(finding.level.value, finding.name, finding.sentence) for finding in found]
    show.results(arguments.json).print(show.table("", ("", "what", "finding"), rows))
    show.write_json([finding.to_json() for finding in found], arguments.json)
    return exit_codes.NO if worst(found) is Level.FAIL else exit_codes.DONE
