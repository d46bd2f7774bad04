"""The values of a picture, from the channels of their signals, with their traces, and the thrusters."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.attitude import body_to_earth, heading_of
from bridge.vehicle.config import Configuration, Vehicle, Water
from bridge.vehicle.navigation import velocity_at_origin
from bridge.wire.readings import Values
from gcs_plugin.watch.channels import Channel
from gcs_plugin.watch.picture import Freshness, ThrusterRow, Trace, freshness
from gcs_plugin.watch.sensors import is_pressure

REFERENCE_HOLDS_S: Final = 1.0
FOG_YIELDS_S: Final = 1.0
HEADING_REFERENCE, DEPTH_REFERENCE = 12, 13  # places in NU_REF

# Trace: its name, its unit, and the signal that sets its freshness.
TRACES: Final = {
    "u": ("surge", "m/s", "dvl"),
    "v": ("sway", "m/s", "dvl"),
    "w": ("heave", "m/s", "dvl"),
    "p": ("roll rate", "rad/s", "imu"),
    "q": ("pitch rate", "rad/s", "imu"),
    "r": ("yaw rate", "rad/s", "imu"),
    "depth": ("depth", "m", "pressure"),
    "altitude": ("altitude", "m", "altitude"),
    "heading": ("heading", "deg", "attitude"),
    "voltage": ("voltage", "V", "battery"),
    "current": ("current", "A", "battery"),
}


class Quantities:
    """The traces of a vehicle; `channels` hold the last values of its signals."""

    def __init__(self, vehicle: Vehicle | None, channels: Mapping[str, Channel]) -> None:
        self._channels = channels
        self._water = Water() if vehicle is None else vehicle.water
        dvl = None if vehicle is None else vehicle.sensors.dvl
        self._lever = (0.0, 0.0, 0.0) if dvl is None else dvl.mounting.position_m
        self._has_lever = any(self._lever)
        self._rings = {key: Ring() for key in TRACES}
        self._reference: Values = ()
        self._reference_s = -math.inf
        self._takers: dict[str, Callable[[Values, float], None]] = {
            "rates": self._rates, "fog": self._fog, "velocity": self._velocity, "velocity_ned": self._velocity_ned,
            "pressure": self._pressure, "depth": self._depth, "altitude": self._altitude, "attitude": self._attitude,
            "battery": self._battery, "nu_ref": self._nu_ref,
        }  # fmt: skip

    def take(self, signal: str, values: Values, time_s: float) -> None:
        """Take the values of a signal; many signals give no quantity."""
        taker = self._takers.get(signal)
        if taker is not None:
            taker(values, time_s)

    def traces(self, now_s: float, expected_hz: Callable[[str], float]) -> dict[str, Trace]:
        """The last minute of each quantity; `expected_hz` returns how often a signal should come."""
        return {key: self._trace(key, now_s, expected_hz) for key in TRACES}

    def locked_share(self, now_s: float) -> float:
        """Share of valid velocities in the last minute; NaN without a DVL."""
        if self._channels["dvl"].heard_s == -math.inf:
            return math.nan
        return self._rings["u"].said_share(now_s - KEPT_S)

    def _trace(self, key: str, now_s: float, expected_hz: Callable[[str], float]) -> Trace:
        name, unit, signal = TRACES[key]
        ring = self._rings[key]
        age_s = now_s - ring.last_s
        return Trace(name, unit, *ring.since(now_s - KEPT_S), age_s, freshness(age_s, expected_hz(signal)))

    def _reference_at(self, place: int, time_s: float) -> float:
        return self._reference[place] if time_s - self._reference_s <= REFERENCE_HOLDS_S else math.nan

    def _nu_ref(self, values: Values, time_s: float) -> None:
        self._reference, self._reference_s = values, time_s

    def _put(self, keys: Sequence[str], values: Sequence[float], first: int, time_s: float) -> None:
        """Add values whose references are in NU_REF from index `first` on."""
        for place, key in enumerate(keys):
            self._rings[key].put(time_s, values[place], self._reference_at(first + place, time_s))

    def _rates(self, values: Values, time_s: float) -> None:
        by_fog = time_s - self._channels["fog"].said_s < FOG_YIELDS_S
        self._put(("p", "q") if by_fog else ("p", "q", "r"), values, 3, time_s)

    def _fog(self, values: Values, time_s: float) -> None:
        self._put(("r",), values, 5, time_s)

    def _velocity(self, values: Values, time_s: float) -> None:
        """Velocity at the body's origin: subtract the velocity at the DVL's position due to rotation."""
        rates = self._channels["rates"].values
        if self._has_lever and rates:
            (p, q, r), (u, v, w) = rates, values
            values = velocity_at_origin((u, v, w), (p, q, r), self._lever)
        self._put(("u", "v", "w"), values, 0, time_s)

    def _velocity_ned(self, values: Values, time_s: float) -> None:
        """Velocity of an autopilot's filter, turned into body axes; used if no DVL is heard."""
        attitude = self._channels["attitude"].values
        if self._channels["velocity"].heard_s == -math.inf and attitude:
            self._put(("u", "v", "w"), (body_to_earth(np.array(attitude[:4])).T @ values).tolist(), 0, time_s)

    def _pressure(self, values: Values, time_s: float) -> None:
        if self._channels["depth"].heard_s > -math.inf:
            return
        self._depth((self._water.depth_m(values[0]) if is_pressure(values) else math.nan,), time_s)

    def _depth(self, values: Values, time_s: float) -> None:
        self._rings["depth"].put(time_s, values[0], self._reference_at(DEPTH_REFERENCE, time_s))

    def _altitude(self, values: Values, time_s: float) -> None:
        self._rings["altitude"].put(time_s, values[0])

    def _attitude(self, values: Values, time_s: float) -> None:
        w, x, y, z = values[:4]
        heading = heading_of((w, x, y, z))
        reference = self._reference_at(HEADING_REFERENCE, time_s)
        self._rings["heading"].put(time_s, math.degrees(heading) % 360.0, math.degrees(reference) % 360.0)

    def _battery(self, values: Values, time_s: float) -> None:
        self._rings["voltage"].put(time_s, values[0])
        self._rings["current"].put(time_s, values[1])


KEPT_S: Final = 60.0
MOST_HZ: Final = 20.0
STEP_S: Final = 1.0 / MOST_HZ
PLACES: Final = 1 + round(KEPT_S * MOST_HZ)


class Ring:
    """Values with their times and references; of several values within a step, the newest is kept."""

    __slots__ = ("_count", "_place", "_reference", "_step_ends_s", "_time_s", "_value", "last_s")

    def __init__(self) -> None:
        self.last_s = -math.inf
        self._time_s = np.full(PLACES, np.nan)
        self._value = np.full(PLACES, np.nan)
        self._reference = np.full(PLACES, np.nan)
        self._place, self._count = PLACES - 1, 0
        self._step_ends_s = -math.inf

    def put(self, time_s: float, value: float, reference: float = math.nan) -> None:
        """Add a value that came at `time_s`; a time earlier than the previous value's counts as equal to it."""
        time_s = max(time_s, self.last_s)
        if time_s >= self._step_ends_s:
            self._step_ends_s = time_s + STEP_S
            self._place = (self._place + 1) % PLACES
            self._count = min(self._count + 1, PLACES)
        place = self._place
        self._time_s[place], self._value[place], self._reference[place] = time_s, value, reference
        self.last_s = time_s

    def since(self, start_s: float) -> tuple[Array, Array, Array | None]:
        """Times, values and references from `start_s` on; the references are None if none is known."""
        first = (self._place + 1 - self._count) % PLACES
        order = np.arange(first, first + self._count) % PLACES
        time_s = self._time_s[order]
        order = order[np.searchsorted(time_s, start_s) :]
        reference = self._reference[order]
        has_reference = np.isfinite(reference).any()
        return self._time_s[order], self._value[order], reference if has_reference else None

    def said_share(self, start_s: float) -> float:
        """Share of the values from `start_s` on that are numbers; NaN if there are no values."""
        _, value, _ = self.since(start_s)
        return float(np.isfinite(value).mean()) if len(value) else math.nan


MOSTLY: Final = 0.8
"""Cosine of the angle up to which a thruster counts as pushing along an axis."""

OFF_CENTRE: Final = 0.2
"""Share of the farthest thruster's distance beyond which a thruster counts as off the centre line."""


def names_of(configuration: Configuration) -> tuple[str, ...]:
    """The name of each thruster, in the file's order: `fore port`, `vertical aft starboard`, `lateral fore`."""
    reach_m = max((math.hypot(*t.position_m[:2]) for t in configuration.thrusters), default=0.0)
    names = []
    for thruster in configuration.thrusters:
        x, y, _ = thruster.position_m
        _, sideways, down = (abs(c) for c in thruster.direction)
        words = ["vertical"] if down > MOSTLY else ["lateral"] if sideways > MOSTLY else []
        if abs(x) > OFF_CENTRE * reach_m:
            words.append("fore" if x > 0 else "aft")
        if abs(y) > OFF_CENTRE * reach_m:
            words.append("starboard" if y > 0 else "port")
        names.append(" ".join(words) or "midships")
    return tuple(names)


def thruster_rows(
    pwm: Channel, rpm: Channel, names: tuple[str, ...], now_s: float, expected_hz: Callable[[str], float]
) -> tuple[ThrusterRow, ...]:
    """A row for each thruster of the vehicle file; without a file, for each output. Speeds that come no more are NaN.

    `expected_hz` returns how often a signal should come.
    """
    count = len(names) or len(pwm.values)
    age_s = pwm.age_s(now_s)
    fresh = freshness(age_s, expected_hz("pwm"))
    is_gone = freshness(rpm.age_s(now_s), expected_hz("rpm")) is Freshness.GONE
    speeds = () if is_gone else rpm.values
    return tuple(
        ThrusterRow(
            k + 1,
            names[k] if names else "",
            pwm.values[k] if k < len(pwm.values) else math.nan,
            speeds[k] if k < len(speeds) else math.nan,
            age_s,
            fresh,
        )
        for k in range(count)
    )
