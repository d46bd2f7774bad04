"""The dry doctor: each check judges one aspect of the traffic heard; a finding is its name, level and sentence."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from statistics import median
from typing import Any, Final

from bridge.errors import SeatrialError
from bridge.firmware.description import Firmware
from bridge.firmware.table import FIRMWARES
from bridge.vehicle.config import GRAVITY_M_S2, Vehicle
from gcs_plugin.doctor.observe import Observed
from gcs_plugin.peers import CROWDED, heartbeat_read, of_commanders


class Level(Enum):
    """How bad a finding is; the value is the word that a user reads."""

    OK = "ok"
    WARN = "warning"
    FAIL = "failed"


@dataclass(frozen=True, slots=True)
class Finding:
    """A single result; `confidence` runs from 0 to 1, None if the check weighs no evidence."""

    name: str
    level: Level
    sentence: str
    confidence: float | None = None

    def to_json(self) -> dict[str, Any]:
        data: dict[str, Any] = {"name": self.name, "level": self.level.value, "sentence": self.sentence}
        if self.confidence is not None:
            data["confidence"] = round(self.confidence, 3)
        return data


def ok(name: str, sentence: str, confidence: float | None = None) -> Finding:
    return Finding(name, Level.OK, sentence, confidence)


def warn(name: str, sentence: str, confidence: float | None = None) -> Finding:
    return Finding(name, Level.WARN, sentence, confidence)


def fail(name: str, sentence: str, confidence: float | None = None) -> Finding:
    return Finding(name, Level.FAIL, sentence, confidence)


def worst(findings: Iterable[Finding]) -> Level:
    """The worst level of all findings; OK if there are none."""
    levels = {finding.level for finding in findings}
    return next((level for level in (Level.FAIL, Level.WARN) if level in levels), Level.OK)


HEARTBEAT_LIMIT_S: Final = 3.5
LOSS_WARN: Final = 0.05
ROUND_TRIP_WARN_S: Final = 0.25
CLOCK_WARN_S: Final = 2.0
GRAVITY_TOLERANCE_M_S2: Final = 0.5
DISK_WARN_BYTES: Final = 500_000_000
DISK_FAIL_BYTES: Final = 20_000_000
RATE_TOLERANCE: Final = 0.8
OF_A_MISSION: Final = ("tau_cmd", "nu_fb", "nu_ref")
EXTRAS: Final = ("esc", "gnss")  # optional devices, expected only if the vehicle file names them


NUMBERS: Final = {"imu": 6, "fog": 1, "pressure": 1, "attitude": 4}
"""How many of a signal's first values a working device always tells; a DVL tells none without bottom lock."""


@dataclass(frozen=True, slots=True)
class Expected:
    """A line of the telemetry contract: a signal's least rate, and the device that must be aboard to send it."""

    signal: str
    label: str
    least_hz: float
    device: str = ""


COMPANION: Final = 191
"""A bridge beside an autopilot keeps to the contract; the autopilot itself, and the ground's streams of it, don't."""

CONTRACT: Final = (
    Expected("imu", "IMU", 25.0, "imu"),
    Expected("fog", "fibre-optic gyro", 25.0, "fog"),
    Expected("dvl", "DVL", 5.0, "dvl"),
    Expected("altitude", "altitude", 5.0, "dvl"),
    Expected("pressure", "depth", 5.0, "depth"),
    Expected("attitude", "attitude", 10.0, "imu"),
    Expected("pwm", "thruster commands", 10.0),
    Expected("rpm", "shaft speeds", 10.0, "esc"),
    Expected("battery", "battery", 1.0, "esc"),
    Expected("gnss", "GNSS", 1.0, "gnss"),
    Expected("tau_cmd", "wrench applied", 10.0),
    Expected("nu_fb", "controller's velocity", 10.0),
    Expected("nu_ref", "reference", 10.0),
    Expected("ff_mode", "feed-forward mode", 1.0),
    Expected("veh_cfg", "configuration", 1.0),
)


def least_hz(expected: Expected, vehicle: Vehicle | None, component: int, firmware: Firmware | None) -> float:
    """Least rate of a signal from this component, beside an autopilot with this firmware or none."""
    device = None if vehicle is None else vehicle.sensors.present().get(expected.device)
    hz = expected.least_hz if device is None or not device.rate_hz else min(expected.least_hz, device.rate_hz)
    return min(hz, firmware.least_hz) if firmware is not None and component != COMPANION else hz


def check_heartbeat(observed: Observed) -> Finding:
    """Whether a vehicle sends heartbeats on the link now."""
    arrivals = observed.arrivals.get("alive", [])
    beats = of_commanders(heartbeat_read(arrival.reading.values, arrival.time_s) for arrival in arrivals)
    if not observed.frames:
        return fail(
            "link",
            f"{observed.link}: nothing arrived in {observed.listened_s:.0f} s; check cable and address",
        )
    if not beats:
        return fail(
            "link",
            f"{observed.link}: {observed.frames} frames, but no vehicle's HEARTBEAT; is this the vehicle?",
        )
    age_s = observed.ended_s - beats[-1].time_s
    if age_s > HEARTBEAT_LIMIT_S:
        return fail(
            "link", f"{observed.link}: the last HEARTBEAT is {age_s:.1f} s old; the vehicle went silent"
        )
    armed = "armed" if beats[-1].armed else "disarmed"
    return ok("link", f"{observed.link}: a vehicle beats, {armed}, last {age_s:.1f} s ago")


def check_alone(observed: Observed) -> Finding | None:
    """Whether the signals are those of a single vehicle; None if they are."""
    if observed.twins:
        return fail("vehicles", observed.twins)
    if len(observed.systems) < 2:
        return None
    systems = ", ".join(map(str, observed.systems))
    return fail(
        "vehicles",
        f"{observed.link}: several vehicles beat (systems {systems}), and the findings mix their signals; "
        "switch all but one off, or take them off this link",
    )


def check_loss(observed: Observed) -> Finding:
    """Share of the frames sent that were lost on the way, for the sender with the largest loss."""
    if observed.left_out:
        return warn("loss", f"{observed.link}: {CROWDED}; find out who does")
    sources = [s for s in observed.receptions if s.received + s.lost >= 20 and s.tells_loss]
    if not sources:
        return warn("loss", f"{observed.link}: too few frames to tell a loss from")
    worst = max(sources, key=lambda source: source.loss)
    whose = f"frames of system {worst.system}, component {worst.component}"
    if not worst.lost:
        return ok("loss", f"{observed.link}: all {worst.received} {whose} arrived")
    sent = worst.received + worst.lost
    sentence = f"{observed.link}: {worst.lost} of {sent} {whose} lost, as seen here"
    if worst.loss > LOSS_WARN:
        return warn("loss", f"{sentence} ({worst.loss:.0%}); better the link")
    return ok("loss", sentence)


def check_timesync(observed: Observed) -> Finding:
    """Whether the vehicle answers TIMESYNC, and how quickly."""
    if not observed.time_answers:
        return warn(
            "time", f"{observed.link}: nobody answers TIMESYNC, latencies can't be told; update the bridge"
        )
    best = min(observed.time_answers, key=lambda answer: answer.round_trip_s)
    sentence = (
        f"round trip {best.round_trip_s * 1e3:.0f} ms, the vehicle's clock is at {best.vehicle_s:.1f} s"
    )
    if best.round_trip_s > ROUND_TRIP_WARN_S:
        return warn("time", f"{sentence}; the link is slow")
    return ok("time", sentence)


def check_date(observed: Observed) -> Finding:
    """Whether the vehicle's date agrees with the ground's."""
    clocks = observed.arrivals.get("clock", [])
    if not clocks:
        return warn("date", "no SYSTEM_TIME arrived, the recording's date is the ground's alone")
    # An autopilot without a GPS states 0 for a date that it does not know.
    clocks = [arrival for arrival in clocks if arrival.reading.values[0] > 0.0]
    if not clocks:
        return warn("date", "the vehicle does not know its date, the recording's is the ground's alone")
    last = clocks[-1]
    vehicle_unix_s = last.reading.values[0] + observed.ended_s - last.time_s
    apart_s = vehicle_unix_s - observed.unix_s
    if abs(apart_s) > CLOCK_WARN_S:
        way = "ahead of" if apart_s > 0 else "behind"
        return warn(
            "date", f"the vehicle's date is {abs(apart_s):.0f} s {way} this computer's; set one of them"
        )
    return ok("date", f"the vehicle's date and this computer's are {abs(apart_s) * 1e3:.0f} ms apart")


def check_disk(free_bytes: int, place: str) -> Finding:
    """Whether the disk has room for a dive's recording."""
    sentence = f"{place}: {free_bytes / 1e9:.1f} GB free"
    if free_bytes < DISK_FAIL_BYTES:
        return fail("disk", f"{sentence}, not enough for a dive; free some space")
    return (
        warn("disk", f"{sentence}; free some space") if free_bytes < DISK_WARN_BYTES else ok("disk", sentence)
    )


def check_signal(observed: Observed, expected: Expected, vehicle: Vehicle | None) -> Finding | None:
    """Rate and age of a signal of the contract; None if this vehicle does not carry the device for it."""
    if vehicle is not None and expected.device and expected.device not in vehicle.sensors.present():
        return None
    arrivals = observed.arrivals.get(expected.signal, [])
    if not arrivals:
        must = vehicle is not None or not expected.device
        if not must and expected.device in EXTRAS:
            return None
        if expected.signal in OF_A_MISSION:
            return ok(expected.signal, f"{expected.label}: none now, it comes while a mission runs")
        says = f"{expected.label}: nothing arrived in {observed.listened_s:.0f} s"
        do = "check the device and its port" if expected.device else "start the program aboard that sends it"
        return fail(expected.signal, f"{says}; {do}") if must else warn(expected.signal, says)
    first_s, last_s = arrivals[0].time_s, arrivals[-1].time_s
    rate_hz = (len(arrivals) - 1) / (last_s - first_s) if last_s > first_s else 0.0
    age_s = observed.ended_s - last_s
    wanted_hz = least_hz(expected, vehicle, arrivals[-1].component, observed.firmware)
    if age_s > max(3.0 / wanted_hz, 1.0):
        return fail(expected.signal, f"{expected.label}: the last value is {age_s:.1f} s old; it went silent")
    sentence = f"{expected.label}: {rate_hz:.1f} Hz"
    values = NUMBERS.get(expected.signal, 0)
    if not any(all(map(math.isfinite, arrival.reading.values[:values])) for arrival in arrivals):
        return fail(expected.signal, f"{sentence}, and no number in any of it; check the device")
    if len(arrivals) < 3 or rate_hz < RATE_TOLERANCE * wanted_hz:
        return warn(expected.signal, f"{sentence}, at least {wanted_hz:g} Hz is needed; check its settings")
    return ok(expected.signal, sentence)


def check_bottom_lock(observed: Observed) -> Finding | None:
    """Share of the DVL's pings with bottom lock; None without a DVL."""
    arrivals = observed.arrivals.get("dvl", [])
    if not arrivals:
        return None
    locked = sum(all(map(math.isfinite, a.reading.values[:3])) for a in arrivals) / len(arrivals)
    sentence = f"DVL: bottom lock in {locked:.0%} of its pings"
    if locked == 0.0:
        return warn("bottom lock", f"{sentence}; out of the water, or too far from the bottom")
    return warn("bottom lock", f"{sentence}; it drops out") if locked < 0.9 else ok("bottom lock", sentence)


def check_gravity(observed: Observed) -> Finding | None:
    """Whether the IMU at rest measures an upward specific force of 1 g; None without an IMU that tells any force."""
    forces = [a.reading.values[:3] for a in observed.arrivals.get("imu", [])]
    forces = [force for force in forces if all(map(math.isfinite, force))]
    if not forces:
        return None
    x, y, z = (median(force[axis] for force in forces) for axis in range(3))
    size = math.sqrt(x * x + y * y + z * z)
    if abs(size - GRAVITY_M_S2) > GRAVITY_TOLERANCE_M_S2:
        return fail(
            "gravity", f"IMU: it feels {size:.2f} m/s2 at rest, not {GRAVITY_M_S2:.2f}; check its units"
        )
    if z > 0.7 * size:
        return fail(
            "gravity", "IMU: zacc is positive at rest, so it is mounted upside down; turn its mounting"
        )
    if z > -0.7 * size:
        axis = "x" if abs(x) > abs(y) else "y"
        return fail(
            "gravity", f"IMU: its {axis} axis points up or down; turn its mounting, or level the vehicle"
        )
    tilt_deg = math.degrees(math.acos(min(1.0, -z / size)))
    return ok("gravity", f"IMU: {size:.2f} m/s2 downwards, {tilt_deg:.0f} deg off level")


def check_parameters(read_all: Callable[[], dict[str, float]]) -> list[Finding]:
    """Whether the vehicle's parameters can be read, and which of an autopilot's leave it without sticks or a fail-safe;
    `read_all` raises SeatrialError if not."""
    try:
        values = read_all()
    except SeatrialError as error:
        return [fail("parameters", str(error))]
    hints = [hint for firmware in FIRMWARES if firmware.frame in values for hint in firmware.hints(values)]
    return [ok("parameters", f"{len(values)} parameters read"), *(warn("parameters", hint) for hint in hints)]


def dry_findings(
    observed: Observed,
    vehicle: Vehicle | None,
    free_bytes: int,
    place: str,
    others: Sequence[Finding] = (),
    configuration: str | None = None,
) -> list[Finding]:
    """Run every check, in the order in which a crew would ask; if nothing arrived, only those that still make sense.

    `configuration` is the configuration that the user named.
    """
    first, disk = check_heartbeat(observed), check_disk(free_bytes, place)
    if not observed.arrivals:
        return [first, disk, *others]
    link = (first, check_loss(observed), check_timesync(observed), check_date(observed))
    aboard = [check_alone(observed)]
    if vehicle is not None:
        aboard.append(check_configuration(observed, vehicle, configuration))
        aboard.append(check_thrusters(observed, vehicle, configuration))
    aboard += [check_signal(observed, expected, vehicle) for expected in CONTRACT]
    aboard += [check_bottom_lock(observed), check_gravity(observed)]
    return [*link, disk, *(finding for finding in aboard if finding is not None), *others]


FORBIDS_WET: Final = ("vehicle file", "link", "vehicles", "configuration", "thrusters")


def reported_veh_cfg(observed: Observed) -> int | None:
    """The last VEH_CFG that the vehicle sent; None if it sent none, or a value that is no whole number."""
    arrivals = observed.arrivals.get("veh_cfg")
    value = arrivals[-1].reading.values[0] if arrivals else math.nan
    return int(value) if value.is_integer() else None


def check_configuration(observed: Observed, vehicle: Vehicle, chosen: str | None) -> Finding | None:
    """Whether the vehicle is in the configuration `chosen`, or in any of its file; None if it sent no VEH_CFG."""
    veh_cfg = reported_veh_cfg(observed)
    if veh_cfg is None:
        return None
    known = vehicle.by_veh_cfg
    if veh_cfg not in known:
        return fail(
            "configuration",
            f"the vehicle says VEH_CFG {veh_cfg}, '{vehicle.name}' has {vehicle.listed}; give this vehicle's own file",
        )
    if chosen is not None and chosen != known[veh_cfg]:
        return fail(
            "configuration",
            f"the vehicle says VEH_CFG {veh_cfg}, {known[veh_cfg]}, and you chose {chosen} "
            f"({vehicle.veh_cfg(chosen)}); choose {known[veh_cfg]}, or start the vehicle as {chosen}",
        )
    return ok("configuration", f"VEH_CFG {veh_cfg}, {known[veh_cfg]}")


def check_thrusters(observed: Observed, vehicle: Vehicle, chosen: str | None) -> Finding | None:
    """Whether the vehicle commands as many thrusters as its file has; None if no commands arrived."""
    arrivals = observed.arrivals.get("pwm")
    if not arrivals:
        return None
    # A pulse width of zero is no command: some autopilots fill the message's 32 fields up with zeros.
    commanded = max((i for i, pulse in enumerate(arrivals[-1].reading.values, 1) if pulse), default=0)
    shapes = [vehicle.configurations[chosen]] if chosen else list(vehicle.configurations.values())
    counts = sorted({len(shape.thrusters) for shape in shapes})
    if commanded in counts:
        return ok("thrusters", f"{commanded} thrusters are commanded, as the vehicle file has them")
    listed = " or ".join(map(str, counts))
    whose = f"'{vehicle.name}:{chosen}'" if chosen else f"'{vehicle.name}'"
    return fail(
        "thrusters",
        f"the vehicle commands {commanded} thrusters, {whose} has {listed}; give this vehicle's own file",
    )


def findings_against_wet(findings: Sequence[Finding]) -> list[Finding]:
    """Reasons to turn no thruster; empty for a vehicle that sends heartbeats, is alone, and matches its file."""
    names = [f"'{f.name}'" for f in findings if f.level is Level.FAIL and f.name in FORBIDS_WET]
    if not names:
        return []
    sentence = f"not begun, no thruster turned; first mend what failed: {', '.join(names)}"
    return [fail("wet check", sentence)]
