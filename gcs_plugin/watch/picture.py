"""The state of a vehicle at an instant, as an operator sees it. SI units; ages and rates by arrival on the ground."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final

from bridge.arrays import Array
from gcs_plugin.monitor.gap import Gap


class Freshness(Enum):
    """How old a value is, in periods of its expected rate: see `freshness`."""

    FRESH = "fresh"
    STALE = "stale"
    GONE = "gone"


class Condition(Enum):
    """Condition of a sensor; the value is the word shown for it. AWAITED: it had no time to be heard yet."""

    OK = "ok"
    DEGRADED = "degraded"
    BAD = "bad"
    MISSING = "missing"
    AWAITED = "awaited"


class Armed(Enum):
    """Armed state; FAILSAFE if the vehicle calls its own state critical or an emergency."""

    UNKNOWN = "UNKNOWN"
    DISARMED = "DISARMED"
    ARMED = "ARMED"
    FAILSAFE = "FAILSAFE"


@dataclass(frozen=True)
class SensorRow:
    """A sensor. `rate_hz` is its recent rate, `expected_hz` the least required rate; `words` name a problem, if any."""

    name: str
    signal: str
    rate_hz: float
    expected_hz: float
    age_s: float
    freshness: Freshness
    condition: Condition
    words: str


@dataclass(frozen=True)
class Trace:
    """The last 60 s of a quantity, (n,) each, on the clock of `Picture.now_s`; NaN for a reading without a value.

    `reference` is the controller's reference at these times; None if it had none.
    """

    name: str
    unit: str
    time_s: Array
    value: Array
    reference: Array | None
    age_s: float
    freshness: Freshness


@dataclass(frozen=True)
class LinkRow:
    """A sender on a link. `age_s` since its last HEARTBEAT, `lost` if that is over 3 s; `loss` and `rate_hz` of its
    frames over the last 10 s, as seen here: routers can falsify them. `loss` is NaN for a sender whose gaps are no
    losses (`Reception`)."""

    name: str
    system: int
    component: int
    age_s: float
    loss: float
    rate_hz: float
    lost: bool


@dataclass(frozen=True)
class ThrusterRow:
    """A thruster, numbered from 1; NaN for a value that was not sent."""

    number: int
    name: str
    pwm_us: float
    rpm: float
    age_s: float
    freshness: Freshness


SEVERITIES: Final = ("emergency", "alert", "critical", "error", "warning", "notice", "info", "debug")


@dataclass(frozen=True)
class Said:
    """A STATUSTEXT, a restart of the vehicle, or an alarm of the ground's. `utc_s` is Unix time, NaN if neither side
    knows the date; severity as in MAVLink, 0 to 7; `heard_s` on the clock of `Picture.now_s`, for alarms. `of_set`:
    about the parameter set in force; `until_armed`: about what arming begins. `past`: the vehicle started anew
    since, or has another set in force, or is armed, so that it may hold no longer."""

    utc_s: float
    severity: int
    text: str
    heard_s: float = -math.inf
    past: bool = False
    of_set: bool = False
    until_armed: bool = False

    @property
    def severity_word(self) -> str:
        """The severity as MAVLink calls it; of one beyond its numbers, the nearest."""
        return SEVERITIES[min(max(self.severity, 0), len(SEVERITIES) - 1)]


class Kind(Enum):
    """Subjects of alarms; the value is the word for it."""

    VEHICLE = "vehicle"
    LINK = "link"
    BATTERY = "battery"
    DEPTH = "depth"
    ALTITUDE = "altitude"
    THRUSTER = "thruster"
    SENSOR = "sensor"
    GAP = "model"


@dataclass(frozen=True)
class Alarm:
    """A condition that the crew must see.

    The same alarm keeps its kind and subject, while its words follow the values. `subject`: which of its kind, "" if
    there can only be a single one.
    """

    kind: Kind
    subject: str
    words: str

    @property
    def key(self) -> tuple[Kind, str]:
        return self.kind, self.subject


@dataclass(frozen=True)
class Picture:
    """The state of the watched vehicle at `now_s`.

    links: the vehicle's own senders first, of these the one that says whether it is armed, then other systems, except
        those that are long gone.
    traces: by u v w p q r depth altitude heading voltage current, always complete.
    active_set: number of the parameter set that it last said it flies (FF_ACTIVE); None if unknown.
    configuration: "" if unknown.
    said: texts of the vehicle, the newest last.
    twins: says that two vehicles share its address; "" if none do.
    wrong_file: says that the vehicle file is another vehicle's; "" if nothing speaks for it.
    gap: how far it departs from its model; None if unknown, for the reason in `lacks`.
    hidden: why a companion may be on board unheard while this program sends nothing; "" if none can be.
    alarms: the gravest kind first.
    unset: kinds of alarm that are switched off.
    flies: the vehicle reports that it can fly plans by itself.
    """

    now_s: float
    armed: Armed
    armed_age_s: float
    links: tuple[LinkRow, ...]
    sensors: tuple[SensorRow, ...]
    traces: Mapping[str, Trace]
    thrusters: tuple[ThrusterRow, ...]
    ff_mode: int | None
    ff_mode_age_s: float
    active_set: int | None
    active_set_age_s: float
    configuration: str
    said: tuple[Said, ...]
    twins: str
    wrong_file: str = ""
    gap: Gap | None = None
    lacks: str = ""
    hidden: str = ""
    alarms: tuple[Alarm, ...] = ()
    unset: tuple[Kind, ...] = ()
    flies: bool = False

    def newest(self, key: str) -> float:
        """The newest value of a trace; NaN unless it is fresh."""
        trace = self.traces[key]
        fresh = trace.freshness is Freshness.FRESH and len(trace.value)
        return float(trace.value[-1]) if fresh else math.nan


STALE_PERIODS: Final = 3.0
"""An older value is stale."""
GONE_PERIODS: Final = 10.0
"""An older value is gone."""
SHORTEST_PERIOD_S: Final = 0.1
"""Links deliver frames in batches: a faster signal is not stale after a pause of a few of its own periods."""


def period_s(expected_hz: float) -> float:
    """Period in which ages are counted."""
    return max(1.0 / expected_hz, SHORTEST_PERIOD_S)


def freshness(age_s: float, expected_hz: float) -> Freshness:
    """Freshness of a value that should come at `expected_hz`; its age is inf if it never came."""
    periods = age_s / period_s(expected_hz)
    if periods > GONE_PERIODS:
        return Freshness.GONE
    return Freshness.STALE if periods > STALE_PERIODS else Freshness.FRESH
