"""`seatrial doctor`: check the vehicle, its link and its sensors, before a dive and in the water."""

import argparse
import shutil
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from bridge import clock as clocks
from bridge import exit_codes
from bridge.clock import Clock, EvenClock
from bridge.errors import ConfigError, LinkError
from bridge.links import secured
from bridge.links.link import Link, Wrapper
from bridge.sensors.bar30 import parse_i2c_port
from bridge.sensors.drivers import speaks_tcp
from bridge.vehicle.config import Vehicle, VehicleFile, load_vehicle
from bridge.vehicle.thrusters import thrust_curve
from bridge.wire.framing import Framer
from bridge.wire.tlog import TlogWriter
from gcs_plugin.dives.folder import about_vehicle, new_folder
from gcs_plugin.doctor.checks import (
    Finding,
    Level,
    check_disk,
    check_parameters,
    dry_findings,
    fail,
    findings_against_wet,
    ok,
    reported_veh_cfg,
    warn,
    worst,
)
from gcs_plugin.doctor.latency import wet_findings
from gcs_plugin.doctor.motor_orders import arm, disarm
from gcs_plugin.doctor.observe import Observed, observe
from gcs_plugin.doctor.pulse_plan import duration_s, pulses
from gcs_plugin.doctor.pulses import confirm, run_pulses
from gcs_plugin.params.client import ParameterClient
from tui import links, show
from tui.show import harmless

Progress = Callable[[int, int], None]


def run(arguments: argparse.Namespace) -> int:
    holding = links.usable_now() if arguments.link is None else None
    linked = arguments.link is not None or bool(holding and holding.hub)
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
    clock = clocks.SystemClock()
    opener = secured.Opener(arguments.sign_key, clock, secured.on_words)
    link = links.link_for(arguments.link, opener.open)
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
    arguments: argparse.Namespace, file: VehicleFile | None, link: Link, clock: Clock
) -> tuple[list[Finding], Observed]:
    """Listen to the link; return the findings on vehicle, clock, sensors and parameters, and the observations."""
    with show.words().status(f"listening for {arguments.seconds:g} s"):
        observed = observe(link, clock, arguments.seconds)
        parameter_findings: list[Finding] = []
        if observed.arrivals:
            parameter_findings = check_parameters(ParameterClient(link, clock).read_all)
    place = existing(Path(arguments.out))
    vehicle, named = (None, None) if file is None else (file.vehicle, file.configuration)
    free_bytes = shutil.disk_usage(place).free
    findings = dry_findings(observed, vehicle, free_bytes, str(place), parameter_findings, named)
    return ([] if file is None else [vehicle_file(file)]) + findings, observed


def wet(
    arguments: argparse.Namespace, file: VehicleFile, observed: Observed, link: Link, clock: Clock
) -> list[Finding]:
    """Pulse each thruster once and return the findings; the user has confirmed, and no finding spoke against it."""
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


def signing(opener: secured.Opener) -> list[Finding]:
    """Findings on signed links: whether frames were refused."""
    return [
        warn("signing", f"{name}: {gate.words}")
        if gate.words
        else ok("signing", f"{name}: {opener.way}; nothing was refused")
        for name, gate in opener.gates.items()
    ]


def vehicle_file(file: VehicleFile) -> Finding:
    """Finding on a loaded vehicle file: it fails if the thrust table is missing, and otherwise lists the contents."""
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


def disk(folder: Path) -> Finding:
    """Finding on the free disk space for recordings."""
    place = existing(folder)
    return check_disk(shutil.disk_usage(place).free, str(place))


def ports(vehicle: Vehicle) -> list[Finding]:
    """Findings on whether the ports in the vehicle file exist on this computer."""
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
    return next(place for place in (folder, *folder.absolute().parents) if place.is_dir())


def tell(arguments: argparse.Namespace, findings: Iterable[Finding]) -> int:
    """Print the findings as a table and JSON; the exit code says whether any failed."""
    listed = list(findings)
    rows = [(finding.level.value, finding.name, finding.sentence) for finding in listed]
    show.put(show.results(arguments.json), show.Table("", ("", "what", "finding"), rows))
    show.write_json([finding.to_json() for finding in listed], arguments.json)
    return exit_codes.NO if worst(listed) is Level.FAIL else exit_codes.DONE


class Recorded(Wrapper):
    """A link whose received frames are also written to a recording; no change of the computer's clock shows in it."""

    def __init__(self, link: Link, writer: TlogWriter, clock: Clock) -> None:
        super().__init__(link)
        self._writer, self._clock = writer, EvenClock(clock)
        self._framer = Framer()

    def read(self, timeout_s: float) -> bytes:
        data = self._link.read(timeout_s)
        for frame in self._framer.feed(data):
            self._writer.write(round(self._clock.unix_s() * 1e6), frame.raw)
        return data


def wet_check(
    file: VehicleFile,
    configuration: str,
    link: Link,
    clock: Clock,
    target: tuple[int, int],
    out: Path,
    progress: Progress,
) -> list[Finding]:
    """Arm, push with each thruster once, disarm, and judge; the recording goes into a dive folder under `out`.

    Raises LinkError if the vehicle refuses or goes silent, LogError if its frames hold no wet check.
    """
    vehicle = file.vehicle
    planned = pulses(vehicle, configuration, thrust_curve(vehicle.thrust_curve, file.path.parent))
    folder = new_folder(out, clock.unix_s(), f"{configuration}-wet-check")
    noted, begun = f"wet check, {duration_s(planned):.0f} s", False
    try:
        folder.describe(about_vehicle(file, configuration, noted))
        with folder.open_telemetry(1) as writer:
            recorded = Recorded(link, writer, clock)
            try:
                arm(recorded, clock, target)
                begun = True
                frames = run_pulses(recorded, clock, target, planned, on_progress=progress)
                disarm(recorded, clock, target)
            except BaseException:
                # Over the link itself: a recording that failed must not leave the vehicle armed.
                _disarm_anyway(link, clock, target)
                raise
    finally:
        if not begun:  # a dive without a pulse can't be read
            folder.discard(noted)
    return [ok("recording", str(folder.path)), *wet_findings(file, configuration, frames)]


def _disarm_anyway(link: Link, clock: Clock, target: tuple[int, int]) -> None:
    try:
        disarm(link, clock, target)
    except LinkError as error:
        print(harmless(f"seatrial: the vehicle may still be armed: {error}"), file=sys.stderr)


def confirmed(vehicle_name: str, typed: str | None) -> None:
    """Ask for the vehicle's name if it was not given and stdin is a terminal. Raises ConfigError without it."""
    if typed is None and sys.stdin.isatty():
        print(
            f"after some seconds of listening each thruster of '{vehicle_name}' turns once: the vehicle in the "
            "water, nobody near it\ntype its name to begin: ",
            end="",
            file=sys.stderr,
            flush=True,
        )
        typed = sys.stdin.readline().strip()
    confirm(vehicle_name, typed)
