"""The state machine of a vehicle that flies by itself, and everything that ends a flight. Pure: no clock, no link.

    IDLE -> COUNTDOWN -> GOING (to its station) -> WAITING -> FLYING a manoeuvre -> GOING back -> WAITING ...

From any of these, once: RETURNING to where it began (finished, a limit reached, the ground silent), or HOLDING where it
is (the end key, a sensor silent), or IDLE at once (the pilot's sticks moved, disarmed, the thrusters in other hands). A
return ends in HOLDING, and that by disarming. A flight that ended is over: nothing resumes by itself.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Final

from bridge.flight.limits import FlightLimits
from bridge.flight.pose import Pose, dead_reckoned, tilt_rad
from bridge.flight.transit import HEAVE_M_S, Transit
from bridge.text import beyond
from bridge.vehicle.legs import Leg, Mission
from bridge.vehicle.navigation import Navigation, known_at
from bridge.vehicle.references import ZERO6, Push, Reference

CONFIRM_S: Final = 0.25
"""A limit ends the flight once it has been exceeded for so long, so that a single bad reading does not."""
UNKNOWN_S: Final = 2.0
"""The last reading of altitude or voltage, where they are limited, may be so old."""
SETTLE_S: Final = 2.0
"""A transit is over once the vehicle has been at its target for so long."""
UNASKED_S: Final = 60.0
"""So long it waits on station for the next order, then it returns. The link alone does not tell that the ground station
which flies it has died: the heartbeats that still come may be another's."""
LATE_TIMES, LATE_S = 3.0, 30.0
"""A transit may take this many times its planned time, and this much longer."""
COUNTDOWN_S: Final = (3.0, 60.0)
RUNS_AWAY_S, RUNS_DOWN_M = 3.0, 1.0
"""On its way back, and while it holds, it is disarmed where it has been faster than its limit for so long, or so much
deeper than both its limit and where its flight ended: then the thrusters don't brake it. They, or a sensor, may be
turned round, and every push makes it worse."""


class State(IntEnum):
    """The stage of a flight; the numbers are those of the telemetry and never change."""

    IDLE = 0
    COUNTDOWN = 1
    GOING = 2
    WAITING = 3
    FLYING = 4
    RETURNING = 5
    HOLDING = 6


class End(IntEnum):
    """Why a flight ended, or why none began; the numbers are those of the telemetry and never change."""

    NONE = 0
    FINISHED = 1
    KEY = 2
    STICKS = 3
    DISARMED = 4
    LINK = 5
    TIME = 6
    DEPTH = 7
    ALTITUDE = 8
    DISTANCE = 9
    SPEED = 10
    TILT = 11
    BATTERY = 12
    VELOCITY = 13
    HEADING = 14
    NO_DEPTH = 15
    ASTRAY = 16
    UNASKED = 17
    TAKEN = 18
    UNFIT = 19


WORDS: Final = {
    End.NONE: "",
    End.FINISHED: "finished",
    End.KEY: "end key",
    End.STICKS: "sticks moved, they have control",
    End.DISARMED: "disarmed",
    End.LINK: "ground not heard",
    End.TIME: "time is up",
    End.DEPTH: "depth limit",
    End.ALTITUDE: "altitude limit",
    End.DISTANCE: "distance limit",
    End.SPEED: "speed limit",
    End.TILT: "tilt limit",
    End.BATTERY: "battery limit",
    End.VELOCITY: "no velocity, it holds",
    End.HEADING: "no attitude, it holds",
    End.NO_DEPTH: "no depth, it holds",
    End.ASTRAY: "can't get to its place",
    End.UNASKED: "no further order",
    End.TAKEN: "sticks or mode in other hands",
    End.UNFIT: "autopilot is not fit for it any more",
}
"""Why a flight ended, short enough for a STATUSTEXT."""

UNDER_WAY: Final = (State.GOING, State.WAITING, State.FLYING)
LACKING: Final = {
    End.VELOCITY: "no velocity: put a DVL into the vehicle file, or see why that in it is silent",
    End.HEADING: "no attitude: see why the IMU, or the autopilot in its place, is silent",
    End.NO_DEPTH: "no depth: see why the depth sensor, or the autopilot in its place, is silent",
}
"""Why no flight can begin without it, and the remedy."""
HIGHEST_M: Final = -0.5
"""No hull in water is higher, in the deepest low: of one that seems to be, depth is off by as much, and its limits. One
that went by it would dive for a depth that it never finds."""
NO_HEAVE: Final[Push] = (None, None, 0.0, None, None, None)
BLIND: Final = tuple(LACKING)
"""Without one of these the way back can't be steered, so the vehicle holds where it is."""


@dataclass(frozen=True, slots=True)
class FlightInputs:
    """All that a flight goes by at one tick: the vehicle, the ground station and the pilot's sticks.

    `ground_heard_s`: when the ground station was last heard. `sticks_moved`: the pilot moves a stick. `in_command`: the
    thrusters obey the flight. `autopilot_ready`: the autopilot would let a flight begin now: its failsafes are set and
    nobody else steers. Without an autopilot in between the last two are always true.
    """

    time_s: float
    navigation: Navigation
    armed: bool
    ground_heard_s: float
    sticks_moved: bool = False
    in_command: bool = True
    autopilot_ready: bool = True


class Flight:
    """The flights of a vehicle, one after the other. `sways`: whether its thrusters can push it sideways."""

    def __init__(self, *, sways: bool) -> None:
        self.state, self.end = State.IDLE, End.NONE
        self.pose = Pose(0.0, 0.0, math.nan, math.nan)
        self.disarms = self._was_armed = False
        self._sways = sways
        self._limits: FlightLimits | None = None
        self._time_s = self._begun_s = self._until_s = self._since_s = 0.0
        self._began = self._station = self.pose
        self._transit: Transit | None = None
        self._mission: Mission | None = None
        self._held: Reference | None = None
        self._exceeded: dict[End, float] = {}
        self._altitude_s = self._voltage_s = 0.0
        self._lowest_m = math.inf

    @property
    def left_s(self) -> float:
        """Time left of countdown, manoeuvre or holding; 0 in other states."""
        ends = (State.COUNTDOWN, State.FLYING, State.HOLDING)
        return max(0.0, self._until_s - self._time_s) if self.state in ends else 0.0

    def begin(self, limits: FlightLimits, depth_m: float, countdown_s: float, inputs: FlightInputs) -> str:
        """Begin a flight whose manoeuvres start at `depth_m`; return why not, "" if it begins."""
        if self.state is not State.IDLE:
            return "a flight is under way"
        if not COUNTDOWN_S[0] <= countdown_s <= COUNTDOWN_S[1]:
            return f"a countdown takes {COUNTDOWN_S[0]:.0f} to {COUNTDOWN_S[1]:.0f} s"
        if not limits.shallowest_m <= depth_m <= limits.deepest_m:
            return "plan's depth is outside the limits"
        if inputs.sticks_moved:
            return "sticks are not at rest"
        navigation = known_at(inputs.navigation, inputs.time_s)
        if blind := _blind(navigation):
            return LACKING[blind]
        if navigation.depth_m < HIGHEST_M:
            return (
                f"depth is {navigation.depth_m:.1f} m, above the surface: set surface_pressure_hpa in the vehicle "
                "file, or mend the depth sensor"
            )
        altitude, battery = navigation.altitude_m, navigation.voltage_v
        if low := _low("altitude", altitude, "m", limits.altitude_m, "altitude_m"):
            return low
        if low := _low("battery", battery, "V", limits.battery_v, "battery_v"):
            return low
        self._limits = limits
        self._began = self.pose = Pose(0.0, 0.0, navigation.depth_m, navigation.heading_rad)
        self._station = Pose(0.0, 0.0, depth_m, navigation.heading_rad)
        self.state, self.end, self.disarms = State.COUNTDOWN, End.NONE, False
        self._was_armed = inputs.armed
        self._time_s = self._begun_s = self._altitude_s = self._voltage_s = inputs.time_s
        self._until_s = inputs.time_s + countdown_s
        self._exceeded.clear()
        return ""

    def fly(self, legs: Sequence[Leg], inputs: FlightInputs) -> str:
        """Fly a manoeuvre from the station; return why not, "" if it begins."""
        if self.state is not State.WAITING or self._limits is None:
            return "vehicle is not on its station"
        if not legs:
            return "manoeuvre has no legs"
        mission = Mission("manoeuvre", tuple(legs), self._station.depth_m, self._station.heading_rad)
        if inputs.time_s + mission.duration_s > self._begun_s + self._limits.time_s:
            return "manoeuvre takes longer than is left"
        self._mission, self._since_s = mission, inputs.time_s
        self._until_s = inputs.time_s + mission.duration_s
        self.state = State.FLYING
        return ""

    def finish(self) -> None:
        """Go back to where the flight began, and end there."""
        if self.state is State.COUNTDOWN:
            self._idle(End.FINISHED)
        elif self.state in UNDER_WAY:
            self._return(End.FINISHED)

    def stop(self) -> None:
        """Hold here and now, whatever it was doing: the end key."""
        if self.state is State.COUNTDOWN:
            self._idle(End.KEY)
        elif self.state in (*UNDER_WAY, State.RETURNING):
            self._hold(End.KEY)

    def step(self, inputs: FlightInputs) -> Reference | None:
        """The reference of this tick, None while no flight steers. `disarms` is set once it is over."""
        if self.state is State.IDLE or self._limits is None:
            return None
        dt_s = max(inputs.time_s - self._time_s, 1e-3)
        self._time_s = inputs.time_s
        navigation = known_at(inputs.navigation, inputs.time_s)
        self.pose = dead_reckoned(self.pose, navigation, dt_s)
        self._judge(inputs, navigation)
        if self.state in (State.COUNTDOWN, State.FLYING) and inputs.time_s >= self._until_s:
            self._go(State.GOING, self._station)
        elif self.state in (State.GOING, State.RETURNING):
            self._travel(inputs, navigation)
        elif self.state is State.HOLDING and inputs.time_s >= self._until_s:
            self.disarms = True
            self._idle(self.end)
        return self._reference(dt_s, navigation)

    def _reference(self, dt_s: float, navigation: Navigation) -> Reference | None:
        if self.state is State.FLYING and self._mission is not None:
            return self._mission.reference(self._time_s - self._since_s)
        if self.state is State.HOLDING and self._held is not None:
            return replace(self._held, push=NO_HEAVE) if navigation.depth_m < HIGHEST_M else self._held
        if self.state in (State.GOING, State.WAITING, State.RETURNING) and self._transit is not None:
            return self._transit.step(self.pose, dt_s)
        return None

    def _judge(self, inputs: FlightInputs, navigation: Navigation) -> None:
        """End the flight if anything is a reason to."""
        if inputs.sticks_moved:
            self._idle(End.STICKS)
        elif not inputs.armed and (self.state is not State.COUNTDOWN or inputs.time_s >= self._until_s):
            self._idle(self.end if self.state is State.HOLDING else End.DISARMED)
        elif not inputs.in_command and (self.state is not State.COUNTDOWN or inputs.time_s >= self._until_s):
            self._idle(End.TAKEN)
        elif self.state is State.COUNTDOWN:
            if end := self._exceeds(inputs, navigation):
                self._idle(end)
        elif self.state in UNDER_WAY:
            if end := self._exceeds(inputs, navigation):
                (self._hold if end in BLIND else self._return)(end)
        elif end := self._runs_away(navigation):
            self.disarms = True
            self._idle(end)
        elif self.state is State.RETURNING:
            tilted = self._confirmed(End.TILT, tilt_rad(navigation) > self._bounds.tilt_rad)
            aloft = self._confirmed(End.NO_DEPTH, navigation.depth_m < HIGHEST_M)
            if _blind(navigation) or tilted or aloft or inputs.time_s >= self._until_s:
                self._hold(self.end)

    def _runs_away(self, navigation: Navigation) -> End:
        """The limit beyond which a vehicle that goes back, or holds, gets all the same; End.NONE if it does not."""
        exceeded = {
            End.SPEED: math.hypot(*navigation.velocity) > self._bounds.speed_m_s,
            End.DEPTH: navigation.depth_m > self._lowest_m,
        }
        confirmed = [end for end, is_over in exceeded.items() if self._confirmed(end, is_over, RUNS_AWAY_S)]
        return confirmed[0] if confirmed else End.NONE

    def _exceeds(self, inputs: FlightInputs, navigation: Navigation) -> End:
        """The first limit that is exceeded, End.NONE if none is."""
        limits, now_s = self._bounds, inputs.time_s
        if now_s - inputs.ground_heard_s > limits.link_s:
            return End.LINK
        if blind := _blind(navigation):
            return blind
        if not inputs.autopilot_ready:
            return End.UNFIT
        if now_s - self._begun_s > limits.time_s:
            return End.TIME
        if self.state is State.WAITING and now_s > self._until_s:
            return End.UNASKED
        if math.isfinite(navigation.altitude_m):
            self._altitude_s = navigation.altitude_time_s
        if math.isfinite(navigation.voltage_v):
            self._voltage_s = navigation.voltage_time_s
        low_altitude = navigation.altitude_m < limits.altitude_m or not now_s - self._altitude_s <= UNKNOWN_S
        low_battery = navigation.voltage_v < limits.battery_v or not now_s - self._voltage_s <= UNKNOWN_S
        deep, high = navigation.depth_m > limits.deepest_m, navigation.depth_m < limits.shallowest_m
        at_work = self.state in (State.WAITING, State.FLYING)
        exceeded = {
            End.NO_DEPTH: navigation.depth_m < HIGHEST_M,
            End.DEPTH: deep or (high and at_work),
            End.ALTITUDE: limits.altitude_m > 0 and low_altitude,
            End.DISTANCE: self.pose.distance_m(self._began) > limits.distance_m,
            End.SPEED: math.hypot(*navigation.velocity) > limits.speed_m_s,
            End.TILT: tilt_rad(navigation) > limits.tilt_rad,
            End.BATTERY: limits.battery_v > 0 and low_battery,
        }
        confirmed = [end for end, is_over in exceeded.items() if self._confirmed(end, is_over)]
        return confirmed[0] if confirmed else End.NONE

    def _confirmed(self, end: End, is_over: bool, for_s: float = CONFIRM_S) -> bool:
        """Whether a limit has been exceeded for long enough."""
        if not is_over:
            self._exceeded.pop(end, None)
            return False
        return self._time_s - self._exceeded.setdefault(end, self._time_s) >= for_s

    @property
    def _bounds(self) -> FlightLimits:
        assert self._limits is not None
        return self._limits

    def _travel(self, inputs: FlightInputs, navigation: Navigation) -> None:
        """See whether a transit has come to its end, or takes too long."""
        assert self._transit is not None
        if not self._transit.arrived(self.pose, math.hypot(*navigation.velocity)):
            self._since_s = inputs.time_s
            if self.state is State.GOING and inputs.time_s >= self._until_s:
                self._return(End.ASTRAY)
        elif inputs.time_s - self._since_s >= SETTLE_S:
            if self.state is State.GOING:
                self.state, self._until_s = State.WAITING, inputs.time_s + UNASKED_S
            else:
                self._hold(self.end)

    def _go(self, state: State, target: Pose) -> None:
        limits = self._bounds
        across_s = self.pose.distance_m(target) / limits.travel_m_s
        down_s = abs(self.pose.depth_m - target.depth_m) / HEAVE_M_S
        self._transit = Transit(self.pose, target, limits.travel_m_s, sways=self._sways)
        self.state, self._since_s = state, self._time_s
        self._until_s = self._time_s + LATE_TIMES * (across_s + down_s) + LATE_S

    def _return(self, end: End) -> None:
        self.end = end
        self._turn_back()
        self._go(State.RETURNING, self._began)

    def _turn_back(self) -> None:
        """From here on it has to brake, and must get no deeper."""
        self._lowest_m = max(self._bounds.deepest_m, self.pose.depth_m) + RUNS_DOWN_M
        for end in (End.SPEED, End.DEPTH):
            self._exceeded.pop(end, None)

    def _hold(self, end: End) -> None:
        if self.state in UNDER_WAY:
            self._turn_back()
        self.state, self.end = State.HOLDING, end
        depth_m = min(max(self.pose.depth_m, 0.0), self._bounds.deepest_m)
        self._held = Reference(ZERO6, ZERO6, self.pose.heading_rad, depth_m)
        self._until_s = self._time_s + self._bounds.hold_s

    def _idle(self, end: End) -> None:
        pilots = end is End.STICKS or (end is End.TAKEN and self._was_armed)
        self.disarms = self.disarms or (self.state is State.COUNTDOWN and not pilots)
        self.state, self.end = State.IDLE, end


def _low(what: str, value: float, unit: str, least: float, limit: str) -> str:
    """Why no flight may begin with a value below its limit `least` (0 for no limit); "" if one may."""
    if not least or value >= least:
        return ""
    if math.isnan(value):
        return f"no {what} measured: mend its sensor, or set {limit} 0 in the limits"
    return f"{what} is {beyond(value, least)} {unit}, below {limit} {least:g} of the limits"


def _blind(navigation: Navigation) -> End:
    """The first measurement that steering needs and that is missing; End.NONE if all are there."""
    if not all(map(math.isfinite, navigation.velocity)):
        return End.VELOCITY
    if not (math.isfinite(navigation.heading_rad) and all(map(math.isfinite, navigation.rate))):
        return End.HEADING
    return End.NONE if math.isfinite(navigation.depth_m) else End.NO_DEPTH
