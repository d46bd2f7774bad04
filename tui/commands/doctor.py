"""`seatrial doctor`: check the vehicle, its link and its sensors, before a dive and in the water."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from bridge import exit_codes
from bridge.command_line import seconds
from bridge.links import secured

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bridge.clock import Clock
    from bridge.links.link import Link
    from bridge.vehicle.config import Vehicle, VehicleFile
    from gcs_plugin.doctor.checks import Finding
    from gcs_plugin.doctor.observe import Observed

EXAMPLE = "seatrial doctor --vehicle ruvifist:hovering --link udpin:127.0.0.1:14550"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--vehicle", metavar="FILE[:CONFIGURATION]", help="what the vehicle should have aboard"
    )
    parser.add_argument(
        "--link",
        metavar="SPEC",
        help="the link to the vehicle; without it, that of the recording that runs, else the ports of its devices",
    )
    secured.add_argument(parser)
    parser.add_argument(
        "--out", default="dives", metavar="FOLDER", help="where recordings go (default: dives)"
    )
    parser.add_argument(
        "--wet",
        action="store_true",
        help="in the water: arm, push with each thruster once, disarm; about a minute",
    )
    parser.add_argument(
        "--confirm", metavar="NAME", help="the vehicle's name, so that --wet does not ask for it"
    )
    parser.add_argument(
        "--seconds", type=seconds, default=6.0, metavar="N", help="listen so long (default: 6)"
    )
    parser.add_argument("--json", metavar="FILE", help="write the findings as JSON; - for standard output")


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.command_line import check_folder
    from bridge.vehicle.config import load_vehicle
    from gcs_plugin.doctor.checks import findings_against_wet
    from tui.files import check_file
    from tui.links import link_for, serving_now
    from tui.wet_check import confirmed

    check_file("--json", arguments.json)
    check_folder("--out", arguments.out)
    linked = arguments.link is not None or serving_now()
    if not (arguments.vehicle or linked):
        raise exit_codes.UsageError("nothing to check; give --vehicle FILE, --link SPEC, or both")
    if arguments.wet and not (arguments.vehicle and linked):
        raise exit_codes.UsageError(
            "--wet needs the vehicle and its file; give --vehicle FILE and --link SPEC"
        )
    file = load_vehicle(arguments.vehicle) if arguments.vehicle else None
    if arguments.wet and file is not None:
        confirmed(file.vehicle.name, arguments.confirm)
    if file is not None and not linked:
        return tell(arguments, [vehicle_file(file), disk(Path(arguments.out)), *ports(file.vehicle)])
    clock = SystemClock()
    opener = secured.Opener(arguments.sign_key, clock, secured.on_words)
    link = link_for(arguments.link, opener.open)
    try:
        findings, observed = dry(arguments, file, link, clock)
        findings += signing(opener)
        if arguments.wet and file is not None:
            against = findings_against_wet(findings)
            findings += against or wet(arguments, file, observed, link, clock)
        return tell(arguments, findings)
    finally:
        link.close()


def dry(
    arguments: argparse.Namespace, file: "VehicleFile | None", link: "Link", clock: "Clock"
) -> tuple[list["Finding"], "Observed"]:
    """Listen to the link; return the findings on vehicle, clock, sensors and parameters, and the observations."""
    import shutil

    from gcs_plugin.doctor.checks import check_parameters, dry_findings
    from gcs_plugin.doctor.observe import observe
    from gcs_plugin.params.client import ParameterClient
    from tui import show

    with show.words().status(f"listening for {arguments.seconds:g} s"):
        observed = observe(link, clock, arguments.seconds)
        parameter_findings = []
        if observed.arrivals:
            parameter_findings.append(check_parameters(ParameterClient(link, clock).read_all))
    place = existing(Path(arguments.out))
    free_bytes = shutil.disk_usage(place).free
    if file is None:
        return dry_findings(observed, None, free_bytes, str(place), parameter_findings), observed
    findings = dry_findings(
        observed, file.vehicle, free_bytes, str(place), parameter_findings, file.configuration
    )
    return [vehicle_file(file), *findings], observed


def wet(
    arguments: argparse.Namespace, file: "VehicleFile", observed: "Observed", link: "Link", clock: "Clock"
) -> list["Finding"]:
    """Pulse each thruster once and return the findings; the user has confirmed, and no finding spoke against it."""
    from gcs_plugin.doctor.checks import reported_veh_cfg
    from gcs_plugin.params.client import ParameterClient
    from tui import show
    from tui.wet_check import wet_check

    configuration = file.configuration_of(reported_veh_cfg(observed))
    client = ParameterClient(link, clock)
    client.find_vehicle(arguments.seconds)
    if client.armed:
        raise exit_codes.UsageError(
            f"{link.name}: the vehicle is armed already; end its mission and disarm it, then check again"
        )
    with show.progress("a rest, then each thruster once") as bar:

        def progress(done: int, total: int) -> None:
            bar(done / total, f"thruster {min(done + 1, total)} of {total}")

        return wet_check(file, configuration, link, clock, client.thrusters, Path(arguments.out), progress)


def signing(opener: secured.Opener) -> list["Finding"]:
    """Findings on signed links: whether frames were refused."""
    from gcs_plugin.doctor.checks import ok, warn

    return [
        warn("signing", f"{name}: {gate.words}")
        if gate.words
        else ok("signing", f"{name}: {opener.way}; nothing was refused")
        for name, gate in opener.gates.items()
    ]


def vehicle_file(file: "VehicleFile") -> "Finding":
    """Finding on a loaded vehicle file: it fails if the thrust table is missing, and otherwise lists the contents."""
    from bridge.errors import ConfigError
    from bridge.vehicle.thrusters import thrust_curve
    from gcs_plugin.doctor.checks import fail, ok

    vehicle = file.vehicle
    try:
        thrust_curve(vehicle.thrust_curve, file.path.parent)
    except ConfigError as error:
        return fail("vehicle file", f"{file.path}: {error}")
    devices = (
        ", ".join(f"{slot} {device.kind}" for slot, device in vehicle.sensors.present().items()) or "none"
    )
    configurations = ", ".join(vehicle.configurations)
    return ok(
        "vehicle file", f"{file.path}: '{vehicle.name}', configurations {configurations}; devices: {devices}"
    )


def disk(folder: Path) -> "Finding":
    """Finding on the free disk space for recordings."""
    import shutil

    from gcs_plugin.doctor.checks import check_disk

    place = existing(folder)
    return check_disk(shutil.disk_usage(place).free, str(place))


def ports(vehicle: "Vehicle") -> list["Finding"]:
    """Findings on whether the ports in the vehicle file exist on this computer."""
    from bridge.sensors.bar30 import parse_i2c_port
    from bridge.sensors.drivers import speaks_tcp
    from gcs_plugin.doctor.checks import fail, ok

    findings = []
    for slot, device in vehicle.sensors.present().items():
        if not device.port or speaks_tcp(device):
            continue
        on_bus = device.kind == "bar30"
        path = Path(f"/dev/i2c-{parse_i2c_port(device.port)[0]}" if on_bus else device.port)
        if path.exists():
            findings.append(ok(slot, f"{device.kind}: {path} is there"))
        else:
            findings.append(
                fail(slot, f"{device.kind}: no port {path} here; plug it in, or mend the vehicle file")
            )
    return findings


def existing(folder: Path) -> Path:
    """The folder, or its nearest parent that exists."""
    return next(place for place in (folder, *folder.absolute().parents) if place.is_dir())


def tell(arguments: argparse.Namespace, findings: "Iterable[Finding]") -> int:
    """Print the findings as a table and JSON; the exit code says whether any failed."""
    from gcs_plugin.doctor.checks import Level, worst
    from tui import show

    listed = list(findings)
    rows = [(finding.level.value, finding.name, finding.sentence) for finding in listed]
    show.put(show.results(arguments.json), show.table("", ("", "what", "finding"), rows))
    show.write_json([finding.to_json() for finding in listed], arguments.json)
    return exit_codes.NO if worst(listed) is Level.FAIL else exit_codes.DONE
