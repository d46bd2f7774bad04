"""Missions of the simulated vehicle: `survey` and `hovering` of the paper, `validation`, or a YAML file of legs."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Literal

from bridge import schema
from bridge.errors import ConfigError
from bridge.vehicle.config import Configuration
from bridge.vehicle.legs import DEPTH_M, Leg, Mission
from bridge.vehicle.thrusters import can_sway

HeadingReference = Literal["smooth", "linear"]

TRANSIENT_S = 5.0
AFLOAT_M = 0.2


def rest(name: str, duration_s: float) -> list[Leg]:
    return [Leg(duration_s, name, "rest")]


def run(name: str, surge_m_s: float, sway_m_s: float, distance_m: float) -> list[Leg]:
    """Legs from rest to rest along a straight line, at a constant heading, with double-S transients."""
    steady_s = distance_m / math.hypot(surge_m_s, sway_m_s) - TRANSIENT_S
    if steady_s <= 0:
        raise ValueError(f"leg '{name}': {distance_m} m are too short for its speed; make it longer")
    steady = Leg(round(steady_s, 1), name, "steady", surge_m_s=surge_m_s, sway_m_s=sway_m_s)
    return [
        replace(steady, duration_s=TRANSIENT_S, phase="acceleration", transient_s=TRANSIENT_S),
        steady,
        Leg(TRANSIENT_S, name, "deceleration", transient_s=TRANSIENT_S),
    ]


def turn(name: str, angle_rad: float, rate_rad_s: float, heading: HeadingReference) -> list[Leg]:
    """Legs that turn on the spot. `smooth` reaches the rate by a double-S; `linear`, as in the paper, jumps to it."""
    rate = math.copysign(rate_rad_s, angle_rad)
    if heading == "linear":
        return [Leg(abs(angle_rad) / rate_rad_s, name, "turning", yaw_rad_s=rate)]
    steady_s = abs(angle_rad) / rate_rad_s - TRANSIENT_S
    if steady_s <= 0:
        raise ValueError(f"turn '{name}': over before {rate_rad_s} rad/s is reached; lower the rate")
    return [
        Leg(TRANSIENT_S, name, "turning", yaw_rad_s=rate, transient_s=TRANSIENT_S),
        Leg(steady_s, name, "turning", yaw_rad_s=rate),
        Leg(TRANSIENT_S, name, "turning", transient_s=TRANSIENT_S),
    ]


def dive(name: str, down_m: float, heave_m_s: float = 0.05, transient_s: float = 2.0) -> list[Leg]:
    """Legs that descend by `down_m` metres (ascend if negative), from rest to rest."""
    rate = math.copysign(heave_m_s, down_m)
    steady_s = abs(down_m) / heave_m_s - transient_s
    return [
        Leg(transient_s, name, "diving", heave_m_s=rate, transient_s=transient_s),
        Leg(steady_s, name, "diving", heave_m_s=rate),
        Leg(transient_s, name, "diving", transient_s=transient_s),
    ]


def survey(heading: HeadingReference = "smooth") -> Mission:
    """The paper's survey: four waypoints, four laps, a stop and a quarter turn at each waypoint (1055 s)."""
    legs = rest("afloat", 8.0) + dive("descent", DEPTH_M - AFLOAT_M) + rest("settle", 6.0)
    for speed in (0.5, 0.4, 0.3, 0.2):
        for side, length_m in enumerate((14.0, 8.0, 14.0, 8.0)):
            legs += run(f"lap {speed} m/s, side {side + 1}", speed, 0.0, length_m)
            legs += turn(f"lap {speed} m/s, turn {side + 1}", math.pi / 2, math.radians(6), heading)
            legs += rest(f"lap {speed} m/s, waypoint {side + 1}", 3.0)
    legs += dive("ascent", AFLOAT_M - DEPTH_M) + rest("afloat again", 8.0)
    return Mission("survey", tuple(legs), start_depth_m=AFLOAT_M)


def hovering(heading: HeadingReference = "smooth") -> Mission:
    """The paper's hovering: a lawnmower at constant heading, then turns on the spot in both directions (804 s)."""
    legs = rest("afloat", 8.0) + dive("descent", DEPTH_M - AFLOAT_M) + rest("settle", 6.0)
    for speed in (0.4, 0.3, 0.2):
        for row, ahead in enumerate((1.0, -1.0, 1.0, -1.0)):
            legs += run(f"rows at {speed} m/s, row {row + 1}", ahead * speed, 0.0, 7.0)
            legs += rest(f"rows at {speed} m/s, end {row + 1}", 2.5)
            legs += run(f"rows at {speed} m/s, step {row + 1}", 0.0, math.copysign(speed, 1.5 - row), 4.5)
            legs += rest(f"rows at {speed} m/s, start {row + 1}", 2.5)
    for number, degrees in enumerate((90.0, -90.0, 180.0, -180.0)):
        legs += turn(f"turn {number + 1}", math.radians(degrees), math.radians(10), heading)
        legs += rest(f"after turn {number + 1}", 3.0)
    legs += dive("ascent", AFLOAT_M - DEPTH_M) + rest("afloat again", 8.0)
    return Mission("hovering", tuple(legs), start_depth_m=AFLOAT_M)


def validation(heading: HeadingReference = "smooth", *, sways: bool) -> Mission:
    """Out and back in surge, in sway if the vehicle can sway, and a quarter turn in both directions."""
    legs = rest("start", 4.0)
    legs += run("surge out", 0.4, 0.0, 4.8) + rest("surge turn", 3.0) + run("surge back", -0.4, 0.0, 4.8)
    if sways:
        legs += rest("sway start", 3.0) + run("sway out", 0.0, 0.3, 3.0)
        legs += rest("sway turn", 3.0) + run("sway back", 0.0, -0.3, 3.0)
    for name, angle in (("turn right", math.pi / 2), ("turn left", -math.pi / 2)):
        legs += rest(f"before {name}", 3.0) + turn(name, angle, math.radians(12), heading)
    return Mission("validation", tuple(legs + rest("end", 4.0)))


def mission_named(name: str, configuration: Configuration, heading: HeadingReference = "smooth") -> Mission:
    """Return one of the three missions, or the mission in the YAML file of that name. Raises ConfigError for any
    other name."""
    if name == "survey":
        return survey(heading)
    if name == "hovering":
        if not can_sway(configuration):
            raise ConfigError("mission 'hovering' moves sideways and this configuration can't; dive 'survey'")
        return hovering(heading)
    if name == "validation":
        return validation(heading, sways=can_sway(configuration))
    if not Path(name).exists():
        if Path(name).suffix or Path(name).name != name:
            raise ConfigError(f"mission file '{name}' is not found; check its name and its folder")
        raise ConfigError(f"no mission '{name}'; there are survey, hovering, validation, or give a YAML file")
    return load_mission(Path(name))


def load_mission(path: Path) -> Mission:
    """Load a mission from the user's file. Raises ConfigError with the file and the key."""
    return schema.build(Mission, schema.load_yaml(path), str(path))
