"""The pulses of the wet check: planned, ordered, and run one thruster at a time, stopped at any sign of trouble.

The vehicle ends each pulse by itself when its time is up or no order comes, so a dead link leaves no thruster running.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import ConfigError, LinkError
from bridge.links.link import Link
from bridge.text import printable, typed
from bridge.vehicle.config import Configuration, Vehicle
from bridge.vehicle.thrusters import NEUTRAL_US, Curve, allocation_matrix
from bridge.wire.framing import Encoder, Frame, Framer, decode
from gcs_plugin.asking import Asking
from gcs_plugin.doctor.response import prior_mass_and_damping
from gcs_plugin.peers import GROUND_STATION, Heartbeat, Peers, Source, ground_heartbeat, heartbeat_of

WHOLE_S: Final = 60.0
REST_S: Final = 8.0
PULSE_S: Final = 1.0
LEAST_GAP_S: Final = 2.5
MOST_SPEED_M_S: Final = 0.15
MOST_RATE_RAD_S: Final = 0.5
MOST_SHARE: Final = 0.25  # of the thruster's limit
LEAST_N: Final = 1.0


@dataclass(frozen=True, slots=True)
class PlannedPulse:
    """A single push: `thruster` counts from 0, `start_s` from the beginning of the check."""

    thruster: int
    start_s: float
    duration_s: float
    thrust_n: float
    pwm_us: float


def pulses(vehicle: Vehicle, configuration: str, curve: Curve) -> tuple[PlannedPulse, ...]:
    """A rest, then each thruster forwards once; the next begins when the vehicle has had time to settle.

    No pulse is planned to take the vehicle beyond a slow walk of 0.15 m/s or 0.5 rad/s, unless that is less than 1 N
    of thrust, or a thruster beyond a quarter of its limit. Raises ConfigError for an unknown configuration or one
    without thrusters.
    """
    shape = vehicle.configurations[vehicle.configuration_named(configuration)]
    count = len(shape.thrusters)
    if curve.neutral_us != NEUTRAL_US:
        raise ConfigError(
            f"thrust_curve: neutral_us is {curve.neutral_us:g}, and thrusters are tested from rest at "
            f"{NEUTRAL_US:g} us alone; set the speed controllers to that"
        )
    if not count:
        raise ConfigError(f"configuration '{configuration}' has no thrusters; add them to the vehicle file")
    every_s = max((WHOLE_S - REST_S) / count, PULSE_S + LEAST_GAP_S)
    planned = []
    for index in range(count):
        thrust_n = _gentle_thrust_n(shape, curve, index)
        pwm_us = float(curve.pwm(thrust_n))
        planned.append(PlannedPulse(index, REST_S + index * every_s, PULSE_S, thrust_n, pwm_us))
    return tuple(planned)


def duration_s(planned: tuple[PlannedPulse, ...]) -> float:
    """How long the whole check takes."""
    last = planned[-1]
    return last.start_s + last.duration_s + LEAST_GAP_S


def _gentle_thrust_n(shape: Configuration, curve: Curve, index: int) -> float:
    mass, _ = prior_mass_and_damping(shape)
    per_newton = np.abs(allocation_matrix(shape)[:, index]) * PULSE_S / mass
    limits = np.array([MOST_SPEED_M_S] * 3 + [MOST_RATE_RAD_S] * 3)
    gentle = float((limits / np.maximum(per_newton, 1e-9)).min())
    most = min(MOST_SHARE * shape.thruster_limit_n, curve.max_n)
    return min(max(gentle, LEAST_N), most)


REPEAT_S: Final = 0.2
ASK_EVERY_S: Final = 1.0
SERVO_EVERY_US: Final = 50_000
STICK_CENTRE: Final = 500  # of MANUAL_CONTROL's z


@dataclass(frozen=True, slots=True)
class MotorTest:
    """An order: `thruster` counts from 0; the vehicle returns to neutral by itself after `timeout_s`."""

    thruster: int
    pwm_us: float
    timeout_s: float

    def message(self, system: int, component: int, first: int = 1) -> dialect.MAVLink_command_long_message:
        """Encode the order as COMMAND_LONG: motors count from `first` there, in the order of the vehicle's file."""
        return dialect.MAVLink_command_long_message(
            system,
            component,
            dialect.MAV_CMD_DO_MOTOR_TEST,
            0,
            self.thruster + first,
            dialect.MOTOR_TEST_THROTTLE_PWM,
            self.pwm_us,
            self.timeout_s,
            1,
            dialect.MOTOR_TEST_ORDER_BOARD,
            0,
        )


class HeldOrders:
    """Repeats every order, and neutral between orders, for firmware that holds an order and counts motors from 0.

    Any other vehicle ends each test by itself: a single message is an order to it.

    ArduSub ignores the timeout: an order holds until the next, and without an order for 0.5 s it disarms itself
    (ArduSub/motors.cpp).
    Its failsafes also expect a pilot and a ground station, and it sends its outputs only twice a second unless asked.
    """

    def __init__(self, target: Source) -> None:
        self._target = target
        self._test = MotorTest(0, NEUTRAL_US, 0.0)
        self._end_s, self._due_s, self._ask_s = math.inf, -math.inf, -math.inf

    def order(self, test: MotorTest, now_s: float) -> list[Any]:
        self._test, self._end_s, self._due_s = test, now_s + test.timeout_s, now_s + REPEAT_S
        return [test.message(*self._target, first=0)]

    def meanwhile(self, now_s: float) -> list[Any]:
        if now_s >= self._end_s:
            self._test, self._end_s = MotorTest(self._test.thruster, NEUTRAL_US, 0.0), math.inf
            self._due_s = now_s
        if now_s < self._due_s:
            return []
        self._due_s = now_s + REPEAT_S
        system, _ = self._target
        sticks = dialect.MAVLink_manual_control_message(system, 0, 0, STICK_CENTRE, 0, 0)
        return [self._test.message(*self._target, first=0), sticks, *self._asked(now_s)]

    def _asked(self, now_s: float) -> list[Any]:
        if now_s < self._ask_s:
            return []
        self._ask_s = now_s + ASK_EVERY_S
        wanted, every_us = dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, SERVO_EVERY_US
        interval = dialect.MAVLink_command_long_message(
            *self._target, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 0, wanted, every_us, 0, 0, 0, 0, 0
        )
        return [ground_heartbeat(), interval]


POLL_S: Final = 0.02
WITHIN_S: Final = 5.0
CERTAIN_BEATS: Final = 2
"""HEARTBEATs in a row that must say disarmed: the first may be older than an order to arm that is still on its way."""


def arm(link: Link, clock: Clock, target: Source) -> None:
    """Arm the vehicle `target` (system, component).

    Raises LinkError if it refuses, LinkTimeout if it does not answer within WITHIN_S.
    """
    awaited = "an answer to the order to arm"
    number = dialect.MAV_CMD_COMPONENT_ARM_DISARM
    result = Asking(link, clock, target).command(number, 1.0, seconds=WITHIN_S, awaited=awaited)
    if result != dialect.MAV_RESULT_ACCEPTED:
        raise LinkError(f"{link.name}: the vehicle refused to arm (answer {result}); see what it says")


def disarm(link: Link, clock: Clock, target: Source) -> None:
    """Disarm the vehicle `target`. Its HEARTBEATs are believed, since a late answer may be to the order to arm.

    Raises LinkTimeout if they do not say so within WITHIN_S.
    """
    in_a_row = 0

    def is_disarmed(message: Any) -> bool | None:
        nonlocal in_a_row
        if message.get_type() == "HEARTBEAT":
            armed = message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED
            in_a_row = 0 if armed else in_a_row + 1
        return in_a_row >= CERTAIN_BEATS or None

    number = dialect.MAV_CMD_COMPONENT_ARM_DISARM
    order = dialect.MAVLink_command_long_message(*target, number, 0, 0, 0, 0, 0, 0, 0, 0)
    Asking(link, clock, target).until(is_disarmed, WITHIN_S, order, "a HEARTBEAT that says disarmed")


ANSWER_S: Final = 1.0
TRIES: Final = 3
SILENCE_S: Final = 3.0

DISARMED: Final = (
    "the vehicle is disarmed: another ground station or a switch did it, it started anew, or its failsafe acted "
    "(leak, battery, lost ground station); mend that and run the check again"
)

_REFUSALS: Final = {
    dialect.MAV_RESULT_TEMPORARILY_REJECTED: "the vehicle can't do it now: arm it and end its mission",
    dialect.MAV_RESULT_DENIED: "the vehicle does not permit it: arm it and end its mission",
    dialect.MAV_RESULT_UNSUPPORTED: (
        "nobody on this link answers motor tests (`seatrial bridge` by itself turns no thruster): "
        "bring the controller that drives the thrusters onto the link"
    ),
    dialect.MAV_RESULT_FAILED: "the vehicle tried and failed",
}


class _State(Enum):
    REST = auto()
    ASKED = auto()
    RUNNING = auto()
    DONE = auto()


class PulseRun:
    """The schedule of pulses as a state machine without I/O; `trouble` says why it stopped early, "" if it did not."""

    def __init__(self, planned: tuple[PlannedPulse, ...], start_s: float) -> None:
        self._planned = planned
        self._index = 0
        self._state = _State.REST
        self._due_s = start_s + planned[0].start_s
        self._tries = 0
        self._asked_s = start_s
        self._last_beat_s = start_s
        self.trouble = ""

    @property
    def done(self) -> bool:
        return self._state is _State.DONE

    @property
    def progress(self) -> tuple[int, int]:
        """Number of finished pulses, and of all pulses."""
        return self._index, len(self._planned)

    def on_heartbeat(self, beat: Heartbeat) -> list[MotorTest]:
        """Handle a heartbeat of the vehicle; any state except armed and well stops the run."""
        self._last_beat_s = beat.time_s
        if self.done:
            return []
        if not beat.armed:
            return self._stop(DISARMED)
        if beat.in_failsafe:
            return self._stop("the vehicle is in a failsafe")
        return []

    def on_answer(self, result: int, time_s: float) -> list[MotorTest]:
        """Handle a COMMAND_ACK to the motor test."""
        if self._state is not _State.ASKED:
            return []
        if result != dialect.MAV_RESULT_ACCEPTED:
            return self._stop(_REFUSALS.get(result, f"the vehicle answers {result} to the motor test"))
        self._state, self._due_s = _State.RUNNING, time_s + self._pulse.duration_s
        return []

    def tick(self, time_s: float) -> list[MotorTest]:
        if self.done:
            return []
        if time_s - self._last_beat_s > SILENCE_S:
            return self._stop(f"no HEARTBEAT for {SILENCE_S:.0f} s")
        if time_s < self._due_s:
            return []
        if self._state is _State.RUNNING:
            return self._next(time_s)
        if self._tries >= TRIES:
            return self._stop("the vehicle does not answer the motor test")
        self._tries += 1
        self._state, self._asked_s = _State.ASKED, time_s
        # An order whose answer was lost may have run: let the vehicle settle before the next try.
        self._due_s = time_s + self._pulse.duration_s + max(ANSWER_S, LEAST_GAP_S)
        return [MotorTest(self._pulse.thruster, self._pulse.pwm_us, self._pulse.duration_s)]

    def stop(self, sentence: str) -> list[MotorTest]:
        """Stop now, for example because the operator asks for it."""
        return [] if self.done else self._stop(sentence)

    @property
    def _pulse(self) -> PlannedPulse:
        return self._planned[self._index]

    def _next(self, time_s: float) -> list[MotorTest]:
        behind_s = self._asked_s - self._pulse.start_s
        self._index, self._tries = self._index + 1, 0
        if self._index == len(self._planned):
            self._state = _State.DONE
        else:
            self._state = _State.REST
            self._due_s = max(behind_s + self._pulse.start_s, time_s + LEAST_GAP_S)
        return []

    def _stop(self, sentence: str) -> list[MotorTest]:
        self.trouble = sentence
        running = self._state in (_State.ASKED, _State.RUNNING)
        self._state = _State.DONE
        return [MotorTest(self._pulse.thruster, NEUTRAL_US, 0.0)] if running else []


def confirm(vehicle_name: str, given: str | None) -> None:
    """Allow thrusters to turn only if the vehicle's name was typed. Raises ConfigError otherwise."""
    if given != vehicle_name:
        wrong = f"'{given}' is not this vehicle's name; " if given else ""
        raise ConfigError(
            f"{wrong}the wet check turns every thruster of '{vehicle_name}' once; with the vehicle in the water "
            f"and nobody near it, confirm by its name: {typed('--confirm', vehicle_name)}"
        )


def run_pulses(
    link: Link,
    clock: Clock,
    target: Source,
    planned: tuple[PlannedPulse, ...],
    on_progress: Callable[[int, int], None] = lambda *_: None,
) -> list[Frame]:
    """Run the pulses with the vehicle `target` (system, component), the component that turns its thrusters.

    Returns every frame that its system sent meanwhile, since a companion may read its sensors. Call `confirm` first.
    Raises LinkError if the vehicle refused, or the run had to be stopped.
    """
    framer, encoder = Framer(), Encoder(*GROUND_STATION)
    run = PulseRun(planned, clock.boot_s())
    frames: list[Frame] = []
    peers = Peers(link)
    said: list[str] = []
    held: HeldOrders | None = None

    def send(messages: list[Any]) -> None:
        for message in messages:
            link.write(encoder.encode(message))

    def order(tests: list[MotorTest]) -> None:
        for test in tests:
            send(held.order(test, clock.boot_s()) if held else [test.message(*target)])

    def listen() -> None:
        nonlocal held
        for frame in framer.feed(link.read(POLL_S)):
            peers.on_frame(frame, link.name, clock.boot_s())
            if frame.system == target[0]:
                frames.append(frame)
                message = decode(frame) if frame.message_id == dialect.MAVLINK_MSG_ID_STATUSTEXT else None
                said.extend([] if message is None else [printable(message.text)])
            if (frame.system, frame.component) == target:
                is_beat = frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT
                firmware = heartbeat_of(frame, 0.0).firmware if is_beat and held is None else None
                if firmware is not None and firmware.holds_motor_test:
                    held = HeldOrders(target)
                order(_heard(run, frame, clock.boot_s()))
        trouble = peers.fault(target[0])
        if trouble:
            order(run.stop(trouble))
        if held is not None:
            send(held.meanwhile(clock.boot_s()))

    try:
        while not run.done:
            order(run.tick(clock.boot_s()))
            listen()
            on_progress(*run.progress)
    finally:
        order(run.stop("stopped by hand"))
    if run.trouble:
        words = f"; it said last: '{said[-1]}'" if said else ""
        raise LinkError(
            f"{link.name}: the wet check stopped, its thrusters are at neutral: {run.trouble}{words}"
        )
    end_s = clock.boot_s() + LEAST_GAP_S
    while clock.boot_s() < end_s:
        listen()
    return frames


def _heard(run: PulseRun, frame: Frame, now_s: float) -> list[MotorTest]:
    if frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:
        return run.on_heartbeat(heartbeat_of(frame, now_s))
    message = decode(frame) if frame.message_id == dialect.MAVLINK_MSG_ID_COMMAND_ACK else None
    if message is None or message.command != dialect.MAV_CMD_DO_MOTOR_TEST:
        return []
    return run.on_answer(message.result, now_s) if message.target_system in (0, GROUND_STATION[0]) else []
