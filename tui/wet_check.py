"""Run the wet check for the operator: confirmed by name, recorded, armed only as long as it takes."""

import sys
from collections.abc import Callable
from pathlib import Path

from bridge.clock import Clock
from bridge.errors import LinkError
from bridge.links.link import Link, Wrapper
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import thrust_curve
from bridge.wire.framing import Framer
from bridge.wire.tlog import TlogWriter
from gcs_plugin.dives.folder import about_vehicle, new_folder
from gcs_plugin.doctor.checks import Finding, ok
from gcs_plugin.doctor.latency import wet_findings
from gcs_plugin.doctor.pulses import arm, confirm, disarm, duration_s, pulses, run_pulses
from tui.show import harmless

Progress = Callable[[int, int], None]


class Recorded(Wrapper):
    """A link whose received frames are also written to a recording."""

    def __init__(self, link: Link, writer: TlogWriter, clock: Clock) -> None:
        super().__init__(link)
        self._writer, self._clock = writer, clock
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
    folder.describe(about_vehicle(file, configuration, f"wet check, {duration_s(planned):.0f} s"))
    with folder.open_telemetry(1) as writer:
        recorded = Recorded(link, writer, clock)
        try:
            arm(recorded, clock, target)
            frames = run_pulses(recorded, clock, target, planned, on_progress=progress)
            disarm(recorded, clock, target)
        except BaseException:
            # Over the link itself: a recording that failed must not leave the vehicle armed.
            _disarm_anyway(link, clock, target)
            raise
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
