"""The pulses of the wet check, run one thruster at a time, and stopped at any sign of trouble.

The vehicle ends each pulse by itself when its time is up or no order comes, so a dead link leaves no thruster running.
"""

from collections.abc import Callable
from enum import Enum, auto
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import ConfigError, LinkError
from bridge.links.link import Link
from bridge.text import printable, typed
from bridge.vehicle.thrusters import NEUTRAL_US
from bridge.wire.framing import Encoder, Frame, Framer, decode
from gcs_plugin.doctor.motor_orders import HeldOrders, MotorTest
from gcs_plugin.doctor.pulse_plan import LEAST_GAP_S, PlannedPulse
from gcs_plugin.peers import GROUND_STATION, Heartbeat, Peers, Source, heartbeat_of

POLL_S: Final = 0.02
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
