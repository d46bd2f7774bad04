"""Alarms of which an operator has to know at once, from the picture of a vehicle and limits that the crew sets.

A dive that ends is no alarm: a disarmed vehicle that falls silent, or whose sensors do, is over. A disarmed vehicle's
battery and its own words still are. An alarm of a value whose readings are lost holds until one says otherwise. Where
critical words come from a leak, they are the vehicle's own ("Leak Detected" of ArduSub): they are shown, and not
interpreted.
"""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from bridge import schema
from bridge.errors import ConfigError
from bridge.files import settings_folder
from bridge.text import beyond
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import shaft_speed, thrust_curve
from gcs_plugin.watch.picture import (
    Alarm,
    Armed,
    Condition,
    Freshness,
    Kind,
    Picture,
    Said,
    SensorRow,
    ThrusterRow,
)

CRITICAL: Final = 2
"""Largest MAV_SEVERITY of words that are an alarm."""

BATTERY_HOLDS_S, ALTITUDE_HOLDS_S = 5.0, 2.0
LEAST_RPM: Final = 200.0
"""A thruster that is asked for less may stand still in its dead zone."""

AWAY_S: Final = 4.0
"""A vehicle whose heartbeat is older is away: its sensors are silent for that reason."""

STANDS_SHARE: Final = 0.1
"""Of the speed that its pulse asks for; a thruster that turns slower stands."""


@dataclass(frozen=True)
class Limits:
    """Limits of the alarms, as in configs/alarms.yaml; 0 switches an alarm off, None leaves it open."""

    battery_v: float | None = None
    depth_m: float | None = None
    altitude_m: float | None = None
    link_s: float | None = None
    sensor_s: float | None = None
    thruster_s: float | None = None
    vehicle_s: float | None = None
    gap_s: float | None = None

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None and value < 0:
                raise ValueError(f"{name} is {value:g}; give 0 to switch it off, or more")

    def over(self, base: "Limits") -> "Limits":
        """These limits, with the open ones from `base`."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        return replace(base, **given)


@dataclass(frozen=True)
class Settings:
    """As in configs/alarms.yaml: the bell, a program for a sound ("" for none), limits in general and by vehicle."""

    bell: bool = True
    sound: str = ""
    limits: Limits = field(default_factory=Limits)
    vehicles: dict[str, Limits] = field(default_factory=dict)

    def of(self, vehicle: str) -> Limits:
        return self.vehicles.get(vehicle, Limits()).over(self.limits)


def user_file() -> Path:
    """Path of the crew's own settings, which may not exist."""
    return settings_folder() / "alarms.yaml"


def load_settings(file: Path | None = None) -> Settings:
    """The shipped settings, with those of the crew's file over them. Raises ConfigError for a file that can't be
    used."""
    file = file or user_file()
    data = schema.load_yaml(file) if file.exists() else None
    if data is None:
        return SHIPPED
    crew = schema.build(Settings, data, str(file))
    return replace(crew, limits=crew.limits.over(SHIPPED.limits))


SHIPPED: Final = Settings(
    limits=Limits(0.0, 0.0, 0.0, link_s=5.0, sensor_s=5.0, thruster_s=3.0, vehicle_s=30.0, gap_s=1.0)
)
"""Of configs/alarms.yaml, to the letter."""


LIMIT_OF: Final = {
    Kind.VEHICLE: "vehicle_s", Kind.LINK: "link_s", Kind.BATTERY: "battery_v", Kind.DEPTH: "depth_m",
    Kind.ALTITUDE: "altitude_m", Kind.THRUSTER: "thruster_s", Kind.SENSOR: "sensor_s", Kind.GAP: "gap_s",
}  # fmt: skip
"""The field of `Limits` that a kind of alarm goes by."""


GRAVEST_FIRST: Final = tuple(Kind)

_Sign = tuple[Alarm, float]
"""A condition that holds now, and how long it has to before it is an alarm, s."""


class Alarms:
    """Takes each picture; keeps since when each condition has held."""

    def __init__(self, settings: Settings, file: VehicleFile | None) -> None:
        self._limits = settings.of("" if file is None else file.vehicle.name)
        self._rpm = _Shafts(file)
        self._since_s: dict[tuple[Kind, str], float] = {}
        self._read: dict[tuple[Kind, str], Alarm] = {}  # each by its last reading
        self._alarming: frozenset[tuple[Kind, str]] = frozenset()
        self._back_s: float | None = None  # since when the vehicle has been heard without a break

    @property
    def unset(self) -> tuple[Kind, ...]:
        """Kinds of alarm that are switched off."""
        return tuple(kind for kind, name in LIMIT_OF.items() if not getattr(self._limits, name))

    def look(self, picture: Picture) -> tuple[Alarm, ...]:
        """The alarms of a picture, the gravest kind first."""
        now_s, before_s, read = picture.now_s, self._since_s, list(self._signs(picture))
        self._read |= {alarm.key: alarm for alarm, _ in read}
        signs = sorted(
            (*read, *self._unread(picture, {alarm.key for alarm, _ in read})),
            key=lambda sign: GRAVEST_FIRST.index(sign[0].kind),
        )
        self._since_s = {alarm.key: before_s.get(alarm.key, now_s) for alarm, _ in signs}
        self._read = {key: self._read[key] for key in self._since_s}
        alarms = tuple(alarm for alarm, holds_s in signs if now_s - self._since_s[alarm.key] >= holds_s)
        self._alarming = frozenset(alarm.key for alarm in alarms)
        return alarms

    def _unread(self, picture: Picture, read: Collection[tuple[Kind, str]]) -> Iterator[_Sign]:
        """Conditions whose readings are lost: those that are alarms hold, and no other becomes one meanwhile."""
        for key, alarm in self._read.items():
            if key not in read and self._is_lost(*key, picture):
                words = f"{alarm.words}; no reading since"
                yield replace(alarm, words=words), 0.0 if key in self._alarming else math.inf

    def _is_lost(self, kind: Kind, subject: str, picture: Picture) -> bool:
        """Whether no reading tells now if a condition still holds, of a dive that is not over."""
        if picture.armed is Armed.DISARMED and (kind is not Kind.BATTERY or picture.armed_age_s > AWAY_S):
            return False
        if kind is Kind.BATTERY:
            return math.isnan(picture.newest("voltage"))
        if kind in (Kind.DEPTH, Kind.ALTITUDE):
            return math.isnan(picture.newest(kind.value))
        if kind is Kind.GAP:
            return (picture.gap is None or picture.armed_age_s > AWAY_S) and not picture.lacks
        if kind is Kind.THRUSTER:
            rows = (row for row in picture.thrusters if str(row.number) == subject)
            return any(
                row.freshness is not Freshness.FRESH or math.isnan(row.rpm + row.pwm_us) for row in rows
            )
        sensors = (row for row in picture.sensors if row.signal == subject)
        return kind is Kind.SENSOR and any(row.freshness is not Freshness.FRESH for row in sensors)

    def _signs(self, picture: Picture) -> Iterator[_Sign]:
        yield from self._of_vehicle(picture)
        armed = picture.armed in (Armed.ARMED, Armed.FAILSAFE)
        if picture.armed_age_s > AWAY_S:
            self._back_s = None
        elif self._back_s is None:
            self._back_s = picture.now_s
        link = picture.links[0] if picture.links else None
        limits = self._limits
        if armed and link is not None and limits.link_s and picture.armed_age_s > limits.link_s:
            yield Alarm(Kind.LINK, "", f"nothing heard of the vehicle for {picture.armed_age_s:.0f} s"), 0.0
            return  # whatever else is silent then, is so for that reason
        yield from self._of_battery(picture)
        if armed:
            yield from self._of_water(picture)
            for thruster in picture.thrusters:
                yield from self._of_thruster(thruster)
            for sensor in picture.sensors:
                yield from self._of_sensor(sensor, picture.now_s)
            yield from self._of_gap(picture)

    def _of_vehicle(self, picture: Picture) -> Iterator[_Sign]:
        if picture.armed is Armed.FAILSAFE and picture.armed_age_s <= (self._limits.link_s or math.inf):
            yield Alarm(Kind.VEHICLE, "failsafe", "the vehicle is in failsafe"), 0.0
        newest = {said.text: said for said in picture.said if said.severity <= CRITICAL and not said.past}
        for said in newest.values():
            if self._limits.vehicle_s and picture.now_s - said.heard_s <= self._limits.vehicle_s:
                yield Alarm(Kind.VEHICLE, said.text, f"the vehicle says: {said.text}"), 0.0

    def _of_battery(self, picture: Picture) -> Iterator[_Sign]:
        volts, limit_v = picture.newest("voltage"), self._limits.battery_v
        if limit_v and volts < limit_v:
            words = f"battery {beyond(volts, limit_v)} V, below {limit_v:g} V"
            yield Alarm(Kind.BATTERY, "", words), BATTERY_HOLDS_S

    def _of_water(self, picture: Picture) -> Iterator[_Sign]:
        limits, depth_m, altitude_m = self._limits, picture.newest("depth"), picture.newest("altitude")
        if limits.depth_m and depth_m > limits.depth_m:
            words = f"depth {beyond(depth_m, limits.depth_m)} m, deeper than {limits.depth_m:g} m"
            yield Alarm(Kind.DEPTH, "", words), 0.0
        if limits.altitude_m and altitude_m < limits.altitude_m:
            words = f"altitude {beyond(altitude_m, limits.altitude_m)} m, less than {limits.altitude_m:g} m"
            yield Alarm(Kind.ALTITUDE, "", words), ALTITUDE_HOLDS_S

    def _of_thruster(self, row: ThrusterRow) -> Iterator[_Sign]:
        if self._limits.thruster_s and row.freshness is Freshness.FRESH and self._rpm.stands(row):
            words = f"thruster {row.number} stands still at {row.pwm_us:.0f} us"
            yield Alarm(Kind.THRUSTER, str(row.number), words), self._limits.thruster_s

    def _of_sensor(self, row: SensorRow, now_s: float) -> Iterator[_Sign]:
        limit_s = self._limits.sensor_s
        alarm = Alarm(Kind.SENSOR, row.signal, f"{row.name}: {row.words}")
        if not limit_s:
            return
        if row.condition is Condition.BAD:
            yield alarm, limit_s
            return
        # A vehicle that was off, or out of hearing, has its sensors speak again one by one.
        settled = self._back_s is not None and now_s - self._back_s >= limit_s
        if settled and row.freshness is Freshness.GONE and limit_s <= row.age_s < math.inf:
            yield alarm, 0.0

    def _of_gap(self, picture: Picture) -> Iterator[_Sign]:
        gap = picture.gap
        if not self._limits.gap_s or gap is None or gap.since_s is None:
            return
        causes = " or ".join(cause.words for cause in gap.causes) or "no known cause fits"
        axes = ", ".join(DOFS[axis.dof] for axis in gap.axes if axis.high)
        yield Alarm(Kind.GAP, "", f"it departs from its model in {axes}: {causes}"), self._limits.gap_s


class _Shafts:
    """Which shafts stand although they are asked to turn. A vehicle without speeds of its shafts has none that does:
    one of them has to have turned."""

    def __init__(self, file: VehicleFile | None) -> None:
        self._curve = None if file is None else file.vehicle.thrust_curve
        self._turned = False
        try:
            self._thrust = None if file is None else thrust_curve(file.vehicle.thrust_curve, file.path.parent)
        except ConfigError:
            self._thrust = None

    def stands(self, row: ThrusterRow) -> bool:
        if self._thrust is None or self._curve is None or not math.isfinite(row.rpm + row.pwm_us):
            return False
        self._turned = self._turned or abs(row.rpm) > LEAST_RPM
        asked = 60.0 * abs(float(shaft_speed(self._curve, self._thrust.thrust(row.pwm_us))))
        return self._turned and asked > LEAST_RPM and abs(row.rpm) < STANDS_SHARE * asked


SEVERITY, SEVERITY_OVER = 3, 4
"""MAV_SEVERITY of an alarm among the words: an error while it holds, a warning once it is over."""

KEPT: Final = 10
BACK_S: Final = 10.0
"""An alarm that comes back so soon goes on: a value near its limit would fill the list."""


@dataclass(frozen=True)
class _Lasted:
    """An alarm with its last words; `last_s` is when it was last seen."""

    alarm: Alarm
    began_s: float
    last_s: float
    utc_s: float


class AlarmTrace:
    """Takes the alarms of each picture. Those in the vehicle's own words are left out: the words stand there anyway.

    Of those that are over, the oldest go once there are more than KEPT; none goes that holds.
    """

    def __init__(self) -> None:
        self._lasted: list[_Lasted] = []

    def take(self, alarms: Sequence[Alarm], now_s: float, unix_s: float) -> None:
        """The alarms that hold at `now_s`, Unix time `unix_s` (NaN if nobody knows the date)."""
        for alarm in alarms:
            if alarm.kind is Kind.VEHICLE:
                continue
            same = (n for n, kept in enumerate(self._lasted) if kept.alarm.key == alarm.key)
            before = next((n for n in same if now_s - self._lasted[n].last_s <= BACK_S), None)
            if before is None:
                self._lasted.append(_Lasted(alarm, now_s, now_s, unix_s))
            else:
                kept = self._lasted[before]
                self._lasted[before] = _Lasted(alarm, kept.began_s, now_s, kept.utc_s)
        over = [kept for kept in self._lasted if now_s - kept.last_s > BACK_S]
        for kept in over[: max(len(self._lasted) - KEPT, 0)]:
            self._lasted.remove(kept)

    def said(self, now_s: float) -> tuple[Said, ...]:
        """Each alarm as a text at the time at which it began, the oldest first."""
        return tuple(self._text(kept, now_s) for kept in self._lasted)

    def _text(self, kept: _Lasted, now_s: float) -> Said:
        words = f"ALARM {kept.alarm.words}"
        if now_s - kept.last_s <= BACK_S:
            return Said(kept.utc_s, SEVERITY, words, kept.began_s)
        lasted_s = kept.last_s - kept.began_s
        return Said(kept.utc_s, SEVERITY_OVER, f"{words}; over after {lasted_s:.0f} s", kept.began_s)
