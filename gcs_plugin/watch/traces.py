"""The traces of a picture: the last minute of each quantity, such as surge or depth, beside its reference.

A signal brings one quantity or several; readings of the signals are in their channels (`channels`).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from bridge.attitude import body_to_earth, heading_of
from bridge.vehicle.config import Vehicle, Water
from bridge.vehicle.navigation import velocity_at_origin
from bridge.wire.readings import Values
from gcs_plugin.watch.channels import OF_A_DELTA, Channel
from gcs_plugin.watch.picture import Trace, freshness
from gcs_plugin.watch.sensors import is_pressure
from gcs_plugin.watch.trace_ring import KEPT_S, TraceRing

REFERENCE_HOLDS_S: Final = 1.0
"""A reference counts for so long after it came."""
FOG_YIELDS_S: Final = 1.0
"""The yaw rate is the IMU's once the fibre-optic gyro has been silent for so long."""
HEADING_REFERENCE, DEPTH_REFERENCE = 12, 13  # indices in NU_REF, after nu (6) and its rate (6)

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


ARRAYS: Final = ("tau_pid", "tau_ff", "tau_cmd", "nu_fb", "nu_ref", "flight")
"""Signals of the contract that no stranger sends."""


class Traces:
    """The traces of one vehicle; `channels` hold the newest values of its signals."""

    def __init__(self, vehicle: Vehicle | None, channels: Mapping[str, Channel]) -> None:
        self._channels = channels
        self._water = Water() if vehicle is None else vehicle.water
        dvl = None if vehicle is None else vehicle.sensors.dvl
        self._lever = (0.0, 0.0, 0.0) if dvl is None else dvl.mounting.position_m
        self._has_lever = any(self._lever)
        self._rings = {key: TraceRing() for key in TRACES}
        self._reference: Values = ()
        self._reference_s = -math.inf
        self._by_signal: dict[str, Callable[[Values, float], None]] = {
            "rates": self._rates, "fog": self._fog, "velocity": self._velocity, "velocity_ned": self._velocity_ned,
            "pressure": self._pressure, "depth": self._depth, "altitude": self._altitude, "attitude": self._attitude,
            "battery": self._battery, "nu_ref": self._nu_ref,
        }  # fmt: skip

    def take(self, signal: str, values: Values, time_s: float) -> None:
        """Take the values of a signal; many signals give no quantity."""
        take_values = self._by_signal.get(signal)
        if take_values is not None:
            take_values(values, time_s)

    def now(self, now_s: float, expected_hz: Callable[[str], float]) -> dict[str, Trace]:
        """The last minute of each quantity, by its key in TRACES.

        `expected_hz` returns how often a signal should come.
        """
        return {key: self._trace(key, now_s, expected_hz) for key in TRACES}

    def locked_share(self, now_s: float) -> float:
        """Share of valid velocities in the last minute; NaN without a DVL."""
        if self._channels["dvl"].heard_s == -math.inf:
            return math.nan
        return self._rings["u"].known_share(now_s - KEPT_S)

    def _trace(self, key: str, now_s: float, expected_hz: Callable[[str], float]) -> Trace:
        name, unit, signal = TRACES[key]
        ring = self._rings[key]
        age_s = now_s - ring.last_s
        return Trace(name, unit, *ring.since(now_s - KEPT_S), age_s, freshness(age_s, expected_hz(signal)))

    def _reference_at(self, index: int, time_s: float) -> float:
        return self._reference[index] if time_s - self._reference_s <= REFERENCE_HOLDS_S else math.nan

    def _nu_ref(self, values: Values, time_s: float) -> None:
        self._reference, self._reference_s = values, time_s

    def _put(self, keys: Sequence[str], values: Sequence[float], first: int, time_s: float) -> None:
        """Add values whose references are in NU_REF from index `first` on."""
        for n, key in enumerate(keys):
            self._rings[key].put(time_s, values[n], self._reference_at(first + n, time_s))

    def _rates(self, values: Values, time_s: float) -> None:
        by_fog = time_s - self._channels["fog"].said_s < FOG_YIELDS_S
        self._put(("p", "q") if by_fog else ("p", "q", "r"), values, 3, time_s)

    def _fog(self, values: Values, time_s: float) -> None:
        self._put(("r",), values, 5, time_s)

    def _velocity(self, values: Values, time_s: float) -> None:
        """Velocity at the body's origin: subtract the velocity at the DVL's position due to rotation."""
        rates = self._channels["rates"].values
        if self._has_lever and rates and not self._is_at_origin():
            (p, q, r), (u, v, w) = rates, values
            values = velocity_at_origin((u, v, w), (p, q, r), self._lever)
        self._put(("u", "v", "w"), values, 0, time_s)

    def _is_at_origin(self) -> bool:
        """Whether our companion tells the velocity to an autopilot, for the body's origin; the contract's arrays of the
        same component tell that it is ours."""
        rank, component = self._channels["velocity"].teller
        tellers = [self._channels[signal].teller[1] for signal in ARRAYS if self._channels[signal].values]
        return rank == OF_A_DELTA and component in tellers

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
