"""The companion of an autopilot that runs ArduSub, as a part of the bridge: frames in, messages out, no I/O.

The bridge reads the sensors, holds the parameters and keeps the recording. The companion sends all that goes to the
autopilot, and sends nothing until it has heard the autopilot. Each stick message of the pilot is forwarded once; none
is invented: a pilot who falls silent is silence to the autopilot too, and so is a ground whose heartbeat is gone. Only
a flight is steered without them, within its own limits, until the pilot touches a stick.
"""

import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.ardusub.dvl import VisionDeltas
from bridge.ardusub.handover import Handover, Holder
from bridge.ardusub.heard import FRESH_S, Heard
from bridge.ardusub.law import StickLaw
from bridge.ardusub.mixing import check_rest, mixer_of
from bridge.ardusub.settings import Settings
from bridge.ardusub.steering import TICK_S, Steering
from bridge.arrays import NAN3
from bridge.attitude import quaternion_of_angles
from bridge.errors import ConfigError
from bridge.firmware.ardusub import ARDUSUB, FRAME, MANUAL
from bridge.firmware.description import AUTOPILOT
from bridge.firmware.rates import Rates
from bridge.flight.flight import State
from bridge.onboard.flights import Flights, touched
from bridge.onboard.orders import Ground
from bridge.onboard.parameters import ParameterServer
from bridge.sensors.samples import DvlSample, ImuSample, PressureSample
from bridge.vehicle.autopilot import Actuation, Autopilot
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.parameters import MODE
from bridge.vehicle.references import Reference
from bridge.vehicle.thrusters import thrust_curve
from bridge.wire.framing import Frame, decode
from bridge.wire.status_codes import Topic, coded

COMPONENT: Final = dialect.MAV_COMP_ID_ONBOARD_COMPUTER
GROUND_WITHIN_S: Final = 3.0
TWO_PILOTS_S: Final = 1.0
VOLTAGE_FRESH_S: Final = 5.0
NO_PILOT_S: Final = 0.5
_STICKS: Final = dialect.MAVLINK_MSG_ID_MANUAL_CONTROL
TELL_EVERY_S: Final = 30.0
ASKED_AGAIN_S: Final = 3.0
"""A ground repeats its order until it is answered."""
NO_ARDUSUB: Final = (
    "autopilot is no ArduSub: recorded, nothing sent; for a feed-forward start it beside ArduSub 4.5 or 4.6"
)
HEARD_WITHIN_S: Final = 5.0
"""An autopilot that is there beats within this time of the companion's start."""
ANOTHER: Final = "another companion speaks as this one: end one of the two"
ANOTHER_S: Final = 3.0
LISTENS_S: Final = 1.5
"""For so long from its start, and from the autopilot's first heartbeat, a companion listens for another, which beats
once a second, before it asks the autopilot for anything."""
KNOCKS_AS: Final = dialect.MAV_COMP_ID_ONBOARD_COMPUTER4
KNOCK_EVERY_S: Final = 0.3
"""While it listens it asks, as another component, for a parameter: the autopilot passes the heartbeats of another
companion on to those links alone on which it has heard somebody, and to none from which that very component speaks
(MAVLink_routing.cpp)."""
APPLET: Final = (
    "the applet in the autopilot adds one too: end this companion, or take the applet out without it"
)
_HEARTBEAT: Final = dialect.MAVLINK_MSG_ID_HEARTBEAT
_WRITE: Final = dialect.MAVLINK_MSG_ID_PARAM_SET


class Companion:
    """Bridge-side partner of an ArduSub autopilot: adds the feed-forward to the pilot's sticks, or steers a flight.

    `ground` is the pilot's address; `store` the file that remembers SYSID_MYGCS while the companion holds it.
    """

    def __init__(
        self,
        file: VehicleFile,
        configuration: str,
        parameters: ParameterServer,
        ground: Ground,
        store: Path | None,
        aside: Executor | None = None,
    ) -> None:
        vehicle = file.vehicle
        system = vehicle.system_id
        self._file, self._configuration, self._parameters = file, configuration, parameters
        self._ground = ground
        self._has_imu = vehicle.sensors.imu is not None
        thrusters = len(vehicle.configurations[configuration].thrusters)
        self.heard = Heard(system)
        self.knocks_as = system, KNOCKS_AS
        self.rates = Rates(system, ARDUSUB, (system, COMPONENT))
        self.settings = Settings(system, AUTOPILOT, thrusters, vehicle.sensors.dvl is not None)
        self.handover = Handover(system, AUTOPILOT, ground.system, store, aside)
        self.law: StickLaw | None = None
        self.steering = Steering(system)
        self.flights = Flights(vehicle.configurations[configuration])
        self._has_pressure = vehicle.sensors.depth is not None
        self._left_behind_s = math.inf
        self._next_tick_s = -math.inf
        self._deltas = VisionDeltas()
        self._ground_s = self._sticks_s = -math.inf
        self._pilots: dict[int, float] = {}
        self._actuations: list[Actuation] = []
        self._samples: list[ImuSample | PressureSample] = []
        self._texts: list[str] = []
        self._leaving = False
        self._wiring: tuple[float, ...] = ()
        self._thrusters_fault = ""
        self._first_s = self._there_s = math.nan
        self._another_s, self._strange_beats = -math.inf, 0
        self._advised: set[str] = set()
        self._told, self._told_again_s = "", math.inf
        self._asked_s = self._knock_s = -math.inf
        parameters.unproven = self.unproven

    @property
    def armed(self) -> bool:
        return self.heard.armed

    @property
    def link(self) -> int:
        """Number of the link on which the autopilot was heard last; below 0 before."""
        return self.heard.link

    def beats(self, now_s: float) -> bool:
        """Whether to send a HEARTBEAT: not while it stands back; where it holds the sticks only while the autopilot
        beats, which else might hear it and never stop, and, where it does not fly, the ground."""
        if self.stands_back(now_s) or (self.handover.forwards and not self.heard.is_there(now_s)):
            return False
        heard = now_s - self._ground_s <= GROUND_WITHIN_S
        return not self.handover.forwards or self.steering.active or heard

    def voltage_v(self, now_s: float) -> float:
        """Battery voltage that the autopilot reports; NaN if it is not heard."""
        return self.heard.voltage_v if now_s - self.heard.voltage_s <= VOLTAGE_FRESH_S else math.nan

    @property
    def voltage_time_s(self) -> float:
        """When it reported the voltage last; -inf before."""
        return self.heard.voltage_s

    def no_flight(self, now_s: float) -> str:
        """Why no flight may begin, "" if one may."""
        obstacle = self.obstacle(now_s)
        if self.law is None:
            return obstacle or "autopilot not known yet"
        if not self.heard.is_there(now_s):
            return "autopilot is silent"
        doubt = self.settings.flight_obstacle or self.heard.sticks_doubt(now_s)
        return obstacle or doubt or self.handover.obstacle

    def arm(self, wanted: bool) -> bool:
        """Have the autopilot disarmed, or armed in the countdown of a flight; False at any other time."""
        if wanted and self.flights.flight.state is not State.COUNTDOWN:
            return False
        self.steering.arm(wanted)
        return True

    def control_doubt(self, now_s: float) -> str:
        """Why the thrusters may obey other sticks than the companion's, "" if they obey those alone."""
        doubt = self._thrusters_fault if self.heard.is_there(now_s) else "the autopilot is silent"
        doubt = doubt or ("" if self.handover.holder is Holder.HELD else "the sticks are not held")
        doubt = doubt or ("" if self.heard.mode == MANUAL else f"flight mode {self.heard.mode}")
        return doubt or self.heard.sticks_doubt(now_s)

    def tell_lost_sticks(self, doubt: str) -> None:
        """Queue a text for the crew on a doubt about the control, if a flight steers."""
        if doubt and self.flights.flight.state not in (State.IDLE, State.COUNTDOWN):
            self._texts.append(f"lost the sticks: {doubt}")

    def take_tick(self, now_s: float) -> bool:
        """Begin a tick of a flight if one is due; return whether it was."""
        if now_s < self._next_tick_s:
            return False
        self._next_tick_s = now_s + TICK_S
        return True

    def steer(self, now_s: float, reference: Reference | None, navigation: Navigation) -> list[Any]:
        """Return the messages to the autopilot of a flight's tick."""
        if not self.heard.is_there(now_s):
            return self.steering.unheard(now_s)
        if self._left_behind_s < math.inf:
            return self._left_behind(now_s)
        flight = self.flights.flight
        messages, actuation = self.steering.step(
            now_s, flight.state, flight.left_s, reference, navigation, self.heard,
            held=self.handover.holder is Holder.HELD, mode=self._parameters.mode, sticks_s=self._sticks_s,
        )  # fmt: skip
        self._actuations += [actuation] if actuation else []
        return messages

    def _left_behind(self, now_s: float) -> list[Any]:
        """A companion that died has left its last sticks in force: sticks at rest, and disarmed if no pilot is
        there."""
        if now_s - self._sticks_s <= FRESH_S:
            self._left_behind_s = math.inf
            return []
        if now_s - self._left_behind_s >= NO_PILOT_S:
            self._left_behind_s = math.inf
            if self.heard.armed:
                self.steering.arm(False)
                self._texts.append("disarmed: a companion died, no pilot's sticks")
        return self.steering.rest(now_s, self.heard)

    def unproven(self) -> str:
        return "the autopilot is not known yet" if self.law is None else self.law.unproven()

    def hear(self, link: int, frame: Frame, now_s: float, navigation: Callable[[], Navigation]) -> list[Any]:
        """Take a frame; return the messages to the autopilot to send at once."""
        if frame.system == self._ground.system:
            if frame.message_id == _HEARTBEAT:
                if now_s - self._ground_s > GROUND_WITHIN_S:
                    self._told_again_s = now_s
                self._ground_s = now_s
            if frame.message_id == _WRITE:
                self._asked(frame, now_s)
            # The same sticks may come on a link of the ground's own as well.
            if frame.message_id == _STICKS and link == self.heard.link:
                return self._fly(frame, now_s, navigation())
            return []
        if (frame.system, frame.component) == (self.heard.system, AUTOPILOT):
            self.rates.on_frame(frame.message_id)
        before_s = self.heard.attitude_s
        answer = self.heard.hear(link, frame, now_s)
        if answer is not None:
            self._answered(answer, now_s)
        if not self._has_imu and self.heard.attitude_s > before_s:
            rate, attitude = self.heard.rate, quaternion_of_angles(*self.heard.attitude)
            self._samples.append(ImuSample(now_s, NAN3, rate, attitude))
        if not self._has_pressure and self.heard.pressure_s == now_s:
            self._samples.append(PressureSample(now_s, self.heard.pressure_pa, math.nan))
        return []

    def hear_own_address(self, is_ours: bool, now_s: float) -> None:
        """A HEARTBEAT with the companion's own address arrived; `is_ours`: it is one of its own, come back.

        At its start a single strange one is another companion's; later it may be one of its own that came back late.
        """
        self._strange_beats = 0 if is_ours else self._strange_beats + 1
        if self._strange_beats > (0 if self.handover.starting else 1):
            self._another_s = now_s

    def step(self, now_s: float) -> list[Any]:
        """Return the messages to the autopilot that are due."""
        if math.isnan(self._first_s):
            self._first_s = now_s
        if math.isnan(self._there_s) and self.heard.is_there(now_s):
            self._there_s = now_s
        if not self.heard.is_there(now_s) or self.stands_back(now_s):
            self._tell_trouble(now_s)
            return []
        if self.settings.complete and not self.settings.obstacle and self.settings.wiring != self._wiring:
            self._build()
        self._tell_trouble(now_s)
        mode, ready = self._parameters.mode, not self.obstacle(now_s)
        acts = mode.applies_feedforward and bool(self._parameters.active_crc)
        asked = acts or self.steering.active
        wanted = ((acts and ready) or self.steering.active) and not self._leaving
        if self.law is not None and now_s - self._sticks_s > FRESH_S:
            self.law.off()
        if self.law is not None and not self.heard.armed:
            self.law.disarmed()
        return [
            *self.rates.step(now_s, self.heard.has_switches(now_s)),
            *self.settings.step(now_s),
            *self.handover.step(wanted, now_s, asked=asked),
        ]

    def knock(self, now_s: float) -> list[Any]:
        """The question to send from the address `knocks_as` now, so that another companion can be heard."""
        if now_s < self._knock_s or not (self.heard.is_there(now_s) and self.stands_back(now_s)):
            return []
        self._knock_s = now_s + KNOCK_EVERY_S
        return [dialect.MAVLink_param_request_read_message(self.heard.system, AUTOPILOT, FRAME.encode(), -1)]

    def stands_back(self, now_s: float) -> bool:
        """Whether it has just been started and listens for another companion, or hears one: what that holds is taken
        for what a companion that died has left, and put back, before the second heartbeat of either. It says nothing
        from its own address meanwhile, or the autopilot would pass on none of the other's heartbeats."""
        return self.listens(now_s) or (self.handover.starting and bool(self._another(now_s)))

    def listens(self, now_s: float) -> bool:
        """Whether it has just been started, or just heard the autopilot, and has heard no other companion yet: not
        where the one before it on this computer held the sticks until just now, for then no other did."""
        if not self.handover.starting or self.handover.held_lately or self._another(now_s):
            return False
        return not now_s - self._first_s >= LISTENS_S or now_s - self._there_s < LISTENS_S

    def leave(self) -> bool:
        """Give the sticks back from now on; True once that is proven."""
        self._leaving = True
        if self.flights.flight.state is State.COUNTDOWN:
            self.flights.flight.stop()
        if self.steering.flying:
            self.steering.arm(False)
        return self.handover.given_back and not self.steering.pending

    def take_dvl(self, sample: DvlSample, navigation: Navigation, now_s: float) -> list[Any]:
        """Return the message to the autopilot of a DVL's reading."""
        sends = self.heard.is_there(now_s) and not self.stands_back(now_s)
        return self._deltas.take(sample, navigation) if sends else []

    def take_samples(self) -> list[ImuSample | PressureSample]:
        """The autopilot's attitudes with rates, and pressures, since the last call, for a vehicle on which the bridge
        has no IMU or pressure sensor of its own."""
        samples, self._samples = self._samples, []
        return samples

    def take_actuations(self) -> list[Actuation]:
        """The law's forces since the last call, without pulses: those are the autopilot's."""
        actuations, self._actuations = self._actuations, []
        return actuations

    def take_texts(self) -> list[str]:
        """Sentences for the crew since the last call."""
        law = self.law.take_texts() if self.law is not None else []
        texts, self._texts = [*self._texts, *self.handover.said, *law], []
        self.handover.said.clear()
        return texts

    def _answered(self, answer: Any, now_s: float) -> None:
        if answer.get_type() == "COMMAND_ACK":
            self.rates.on_ack(answer, now_s)
            return
        if answer.get_type() == "AUTOPILOT_VERSION":
            self.settings.on_version(answer.flight_sw_version)
            return
        # What another companion asked for says nothing of who is there now.
        if not self.stands_back(now_s):
            starting = self.handover.starting
            self.handover.on_value(answer.param_id, answer.param_value, now_s)
            if starting and self.handover.value == self.heard.system:
                self._left_behind_s = now_s
        self.settings.on_value(answer.param_id, answer.param_value)
        self._texts += [advice for advice in self.settings.advice if advice not in self._advised]
        self._advised = {*self.settings.advice}

    def _build(self) -> None:
        """Make the law once the autopilot's wiring is known, and anew whenever that changes."""
        self._wiring, self.law, self._thrusters_fault = self.settings.wiring, None, ""
        vehicle, folder = self._file.vehicle, self._file.path.parent
        shape = vehicle.configurations[self._configuration]
        read = {name: value for name, value in self.settings.values.items() if math.isfinite(value)}
        try:
            mixer = mixer_of(read, shape, thrust_curve(vehicle.thrust_curve, folder))
        except ConfigError as error:
            self._thrusters_fault = str(error)
            return
        self.law = StickLaw(vehicle, self._configuration, self._parameters.active, folder, mixer)
        self.steering.fit(Autopilot(vehicle, self._configuration, self._parameters.active, folder), mixer)

    def obstacle(self, now_s: float) -> str:
        """Why the companion may not hold the sticks, and the way out; "" if it may."""
        if another := self._another(now_s):
            return another
        if self.heard.has_applet(now_s):
            return APPLET
        return self.settings.obstacle or self._thrusters_fault

    def _another(self, now_s: float) -> str:
        """What is said of another companion; "" where none is heard."""
        return ANOTHER if now_s - self._another_s <= ANOTHER_S else ""

    def trouble(self, now_s: float) -> str:
        """Why the companion can't act, a sentence for the crew with the way out; "" if it can."""
        if not self.heard.is_there(now_s):
            return self._silence(now_s)
        if obstacle := self.obstacle(now_s) if self.settings.complete else self._another(now_s):
            return f"no feed-forward: {obstacle}"
        return self.handover.trouble

    def _silence(self, now_s: float) -> str:
        """Why no autopilot is heard, as far as that is known."""
        if self.heard.is_other:
            return NO_ARDUSUB
        if self.heard.beat_s > -math.inf:
            return "autopilot is silent: look at its power and its link"
        if not now_s - self._first_s > HEARD_WITHIN_S:
            return ""
        if self.heard.elsewhere:
            return (
                f"no autopilot of system {self.heard.system}, but one of system {self.heard.elsewhere}: give the "
                f"vehicle file system_id {self.heard.elsewhere}, or the companion another --link"
            )
        return "no autopilot heard: look at --link, and the endpoint or cable that leads there"

    def _tell_trouble(self, now_s: float) -> None:
        """Tell the crew of the trouble: at once, and while it holds in a mode that needs the companion."""
        trouble = self.trouble(now_s)
        if trouble and (trouble != self._told or now_s >= self._told_again_s):
            self._texts.append(coded(Topic.OBSTACLE, trouble))
            raised = self._parameters.mode is not Mode.OFF
            self._told_again_s = now_s + TELL_EVERY_S if raised else math.inf
        self._told = trouble

    def _asked(self, frame: Frame, now_s: float) -> None:
        """Another mode than off was asked for: whoever asks is told of the trouble, though not for each repeat."""
        message = decode(frame)
        if message is None or (message.param_id, message.target_system) != (MODE, self.heard.system):
            return
        if message.param_value != Mode.OFF and now_s >= self._asked_s + ASKED_AGAIN_S:
            self._asked_s = self._told_again_s = now_s

    def _fly(self, frame: Frame, now_s: float, navigation: Navigation) -> list[Any]:
        """Take the pilot's sticks, and return them as they are to be sent on, if the companion holds them.

        A flight's own sticks stand for those at rest alone. The touch that ends it may be a tap on a button, and that
        comes once.
        """
        message = decode(frame)
        if message is None or message.target != self.heard.system:
            return []
        self._sticks_s = self._pilots[frame.component] = now_s
        if self.steering.flying and self.heard.is_there(now_s) and not touched(message):
            return []
        sticks, added = np.array([message.x, message.y, message.r], dtype=float), np.zeros(3)
        doubt = self._doubt(now_s)
        if self.law is not None and np.abs(sticks).max() <= 1000:
            mode = self._parameters.mode
            if self._leaving or (mode.applies_feedforward and self.obstacle(now_s)):
                mode = Mode.OFF
            pwm_us = self.heard.pwm_us if now_s - self.heard.pwm_s <= FRESH_S else ()
            added, actuation = self.law.step(
                now_s, sticks, self.heard.gain, mode, doubt, self.heard.mode, navigation, pwm_us
            )
            self._actuations.append(actuation)
        if not self.handover.forwards:
            return []
        if added.any():
            message.x, message.y, message.r = (int(v) for v in np.rint(sticks + added))
        return [message]

    def _doubt(self, now_s: float) -> str:
        """Why the pilot's sticks are to pass as they are, "" for no reason."""
        if not self.heard.is_there(now_s):
            return "the autopilot is silent"
        if not self.heard.armed:
            return "disarmed"
        if sum(now_s - seen_s <= TWO_PILOTS_S for seen_s in self._pilots.values()) > 1:
            return "two programs send sticks: end one"
        return self.heard.sticks_doubt(now_s) or self.handover.fault


def companion_file(file: VehicleFile) -> VehicleFile:
    """The vehicle file with the companion's own component: the autopilot has the first for itself.

    Raises ConfigError for thrusters that ArduSub can't hold at rest.
    """
    check_rest(file)
    return replace(file, vehicle=replace(file.vehicle, component_id=COMPONENT))
