"""Switching the feed-forward: FF_MODE is sent until the vehicle has said twice over that it is so. Pure.

    SEND (every 0.5 s, each time with a question) -> QUIET (its answer and its telemetry say so) -> READ -> done

An answer may be the echo of a write that the vehicle then did not keep. So the last word has a read-back that is asked
for after a quiet period, and the telemetry, which the vehicle makes from the mode that it flies; where either says
something else, all begins anew. Nothing here gives up: who drives it may.

OFF waits for nobody: it is sent from the first tick to whoever is known from before, heard or not, and to the system
that is named, known or not, since a link may carry one way only. It is done by the vehicle's own words alone.

Any other mode gives way to OFF: it is sent until the vehicle has said once that it took it, and only asked for from
then on. Where the vehicle says another mode after that, or off where it was raised before, or another program of this
computer has ordered OFF, it is sent no more and that is its refusal.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode
from bridge.messages.readings import Reading
from bridge.messages.readings import decode as decode_reading
from bridge.parameters import MODE, RAISED_ARMED
from bridge.vehicle.feedforward import Mode
from gcs_plugin.known_vehicles import KnownVehicle
from gcs_plugin.params.client import COMPANIONS, COMPANIONS_MAY_FOLLOW_S, NO_INDEX, Heard
from gcs_plugin.params.deadline import Timing
from gcs_plugin.params.transfer import DOES_NOT_EXIST, ERROR_SENTENCES, Source
from gcs_plugin.station import GROUND_STATION

SEND_EVERY_S: Final = 0.5
QUIET_S: Final = Timing().quiet_s
UNREAD_S: Final = 3.0  # of questions without an answer, after which the vehicle may be another than it was
CONTESTED_QUIET_S: Final = 3.0  # where two may answer: each of them has told its mode by then
TELL_SILENCE_S: Final = 1.5  # telemetry says the mode once a second
NOT_HEARD_S: Final = 3.0  # three beats
AGAIN_S: Final = QUIET_S  # a mode that is told again after so long is no answer that overtook another
REASON_S: Final = 1.0  # a refusal's words come with it, or with that of the next write

REFUSED: Final = "FF_MODE refused: "
NOT_FROM_HERE: Final = f"orders from system {GROUND_STATION[0]} are refused"
SHADOW: Final = "shadow: "
ARMED: Final = RAISED_ARMED.removeprefix(REFUSED)
ADVICE: Final = "disarm it to raise it all the same, or fly on in shadow"

WORDS: Final = {Mode.OFF: "off", Mode.SHADOW: "shadow", Mode.ALONE: "only", Mode.BOTH: "both"}
"""What each mode is called by operators."""

NEVER_HEARD: Final = (1, dialect.MAV_COMP_ID_ONBOARD_COMPUTER)
"""The components that are sent OFF in a system that nobody has heard: a bridge's own, or that of a companion."""


def sent_text(count: int) -> str:
    """How often something was sent."""
    return "sent once" if count == 1 else f"sent {count} times"


def word(value: float) -> str:
    """A value of FF_MODE as an operator reads it."""
    return next((text for mode, text in WORDS.items() if mode == value), f"{value:g}")


class _Stage(Enum):
    SEND = auto()
    QUIET = auto()
    READ = auto()
    DONE = auto()


@dataclass
class _Vehicle:
    """One system on its way to `mode`; `holder` is the component that has said FF_MODE, or that would have it.

    `before_s` is when it was last heard before the switch, `heard_s` since; `unheard` are sent OFF blindly.
    """

    mode: Mode
    since_s: float
    beating: set[Source] = field(default_factory=set)
    holder: Source | None = None
    unheard: tuple[Source, ...] = ()
    before_s: float | None = None
    heard_s: float | None = None
    stage: _Stage = _Stage.SEND
    due_s: float = 0.0
    sent: int = 0
    first_s: float = 0.0
    last_s: float = 0.0
    answer: float | None = None
    answered_s: float = 0.0
    told: float | None = None
    refusal: str = ""
    refused_s: float = 0.0
    reason: str = ""
    shadow: str = ""
    lacking: set[Source] = field(default_factory=set)
    contested: bool = False
    was: float = float(Mode.OFF)
    taken: bool = False
    other: float | None = None
    other_s: float = 0.0
    lowered: bool = False

    @property
    def lacks_it(self) -> bool:
        """Whether all of it that beats says that it has no such parameter."""
        return self.holder is None and bool(self.lacking) and self.beating <= self.lacking

    def targets(self, now_s: float) -> list[Source]:
        """Whom to send to: who told FF_MODE, else who beats, a companion before an autopilot.

        Another mode than off waits before it takes an autopilot, until a companion had time to beat.
        """
        if self.holder is not None:
            return [self.holder]
        if self.mode is not Mode.OFF and now_s < self.since_s + COMPANIONS_MAY_FOLLOW_S:
            return []
        beating = self.beating - self.lacking
        if not beating:
            return [source for source in self.unheard if source not in self.lacking]
        return [min(beating, key=lambda source: (source[1] not in COMPANIONS, source[1]))]

    def know(self, vehicle: KnownVehicle) -> None:
        """It was heard before, as this."""
        self.before_s = max(self.before_s or vehicle.heard_s, vehicle.heard_s)
        self.beating.add(vehicle.source)
        if vehicle.holds:
            self.holder = vehicle.source

    def on_beat(self, source: Source, now_s: float) -> None:
        self.heard_s = now_s
        self.beating.add(source)

    def tick(self, now_s: float, contested: bool) -> list[Any]:
        self.contested = contested
        unread = self.stage is _Stage.READ and now_s >= self.last_s + self._quiet_s + UNREAD_S
        # Off is worth its answer even where two may have given it; any other mode is not.
        if unread or (contested and self.mode is not Mode.OFF):
            self._send_again()
        targets = self.targets(now_s)
        if not targets or self.stage is _Stage.DONE or now_s < self.due_s:
            return []
        name = MODE.encode()
        questions = [
            dialect.MAVLink_param_request_read_message(*target, name, NO_INDEX) for target in targets
        ]
        self.due_s = now_s + SEND_EVERY_S
        if self.stage is not _Stage.SEND:
            self.stage = _Stage.READ
            return questions
        if self.taken:
            return questions
        self.sent += 1
        self.first_s = now_s if self.sent == 1 else self.first_s
        self.last_s = now_s
        real32, value = dialect.MAV_PARAM_TYPE_REAL32, float(self.mode)
        sets = [dialect.MAVLink_param_set_message(*target, name, value, real32) for target in targets]
        return [*sets, *questions]

    def on_value(self, value: float, source: Source, now_s: float) -> None:
        self.holder, self.heard_s = source, now_s
        self._watch(value, now_s)
        if not self.sent:
            return
        self.taken = self.taken or (value == self.mode is not Mode.OFF)
        self.answer, self.answered_s = value, now_s
        if self.stage is _Stage.READ and value == self.mode:
            self.stage = _Stage.DONE
        else:
            self._judge(value)

    def on_told(self, value: float, source: Source, now_s: float) -> None:
        self.holder, self.heard_s = source, now_s
        self._watch(value, now_s)
        if self.sent:
            self.told = value
            self._judge(value)

    def on_error(self, code: int, source: Source, now_s: float) -> None:
        self.heard_s = now_s
        if code == DOES_NOT_EXIST and self.holder is None and source in self.targets(now_s):
            self.beating.add(source)
            self.lacking.add(source)
            self.due_s = now_s
        elif source == self.holder:
            self.refused_s = self.refused_s if self.refusal else now_s
            self.refusal = ERROR_SENTENCES.get(code, f"error {code}")

    def on_text(self, text: str) -> None:
        if self.sent and text.startswith(REFUSED):
            self.reason = text.removeprefix(REFUSED)
        elif self.sent and text == NOT_FROM_HERE:
            self.reason = f"it takes no orders from system {GROUND_STATION[0]}, but from another ground"
        elif self.sent and text.startswith(SHADOW):
            self.shadow = text

    def against(self) -> str:
        """What it has against the mode: its own words where they were heard, and what to do."""
        said = [self.refusal, self.reason, self.shadow]
        return ": ".join(filter(None, said)) + (f"; {ADVICE}" if self.shadow else "")

    def explained(self, now_s: float) -> bool:
        """Whether all has been heard that it has against the mode, or time enough has gone for it."""
        whole = bool(self.reason) and (self.reason != ARMED or bool(self.shadow))
        return bool(self.refusal) and (whole or now_s >= self.refused_s + REASON_S)

    def _watch(self, value: float, now_s: float) -> None:
        """See whether a mode other than off, once it was taken, was taken back by somebody."""
        if self.mode is Mode.OFF or self.stage is _Stage.DONE:
            return
        if not self.sent:
            self.lowered = self.lowered or (value == Mode.OFF != self.was)
        elif value == self.mode or not self.taken:
            self.other = None
        elif self.other is None:
            self.other, self.other_s = value, now_s
        elif now_s >= self.other_s + AGAIN_S:
            self.lowered, self.other = True, value

    def _judge(self, value: float) -> None:
        """Be quiet once answer and telemetry say what is wanted; send again where `value`, the newest, does not."""
        if self.stage is _Stage.DONE:
            return
        if value != self.mode:
            self._send_again()
        elif self.stage is _Stage.SEND and self.answer == self.told == self.mode:
            self.stage, self.due_s = _Stage.QUIET, self.last_s + self._quiet_s

    @property
    def _quiet_s(self) -> float:
        return CONTESTED_QUIET_S if self.contested else QUIET_S

    def _send_again(self) -> None:
        if self.stage is not _Stage.SEND:
            self.stage, self.due_s = _Stage.SEND, self.last_s + SEND_EVERY_S

    def words(self, now_s: float) -> str:
        wanted = word(self.mode)
        if self.stage is _Stage.DONE:
            how = "as answered" if self.contested else "as read back and as its telemetry says"
            return f"{wanted}, {how}"
        if self.lacks_it:
            return "has no feed-forward"
        if not self.sent:
            return "heard, nothing is sent yet"
        said = [sent_text(self.sent)]
        last_s = self.before_s if self.heard_s is None else self.heard_s
        if last_s is None:
            return f"{said[0]}, never heard: not confirmed"
        if self.heard_s is None or now_s - last_s >= NOT_HEARD_S:
            return f"{said[0]}, not heard for {now_s - last_s:.0f} s: not confirmed"
        silent_s = now_s - max(self.answered_s, self.first_s)
        if self.answer is None or silent_s >= TELL_SILENCE_S:
            said.append(f"no answer for {silent_s:.1f} s")
        elif self.answer != self.mode:
            said.append(f"it answers {word(self.answer)}{f' ({self.against()})' if self.refusal else ''}")
        if self.told is None and now_s - self.first_s >= TELL_SILENCE_S:
            said.append("no telemetry of it")
        elif self.told is not None and self.told != self.mode:
            said.append(f"its telemetry says {word(self.told)}")
        if self.stage is not _Stage.SEND:
            said.append(f"it says {wanted}, being read back")
        return ", ".join(said)


class Switch:
    """Brings the feed-forward to `mode`: of `system`, or of every vehicle that is heard where that is None.

    Give it every frame of a link (or what it is to know of them), send what `tick` returns, until it is `done`. While
    `twins` says that two vehicles share one address nobody can tell whether both obeyed: another mode than off is sent
    on and never done, off is done by what was answered, once nothing says otherwise for longer, and says so.

    `known` are those who were heard before, by the clock of `tick`: with `system`, they are sent off at once.
    `was` is the mode before, where it is known. Set `overruled` where another program has ordered OFF since.
    """

    def __init__(
        self,
        mode: Mode | int,
        system: int | None = None,
        known: Iterable[KnownVehicle] = (),
        was: float = float(Mode.OFF),
    ) -> None:
        self.mode = Mode(mode)
        self.twins = ""
        self.overruled = False
        self._was = was
        self._system = system
        self._vehicles: dict[int, _Vehicle] = {}
        self._now_s = 0.0
        for vehicle in known if self.mode is Mode.OFF else ():
            self._of(vehicle.source, 0.0).know(vehicle)
        if self.mode is Mode.OFF and system is not None and not self._vehicles:
            unheard = tuple((system, component) for component in NEVER_HEARD)
            self._vehicles[system] = _Vehicle(self.mode, 0.0, unheard=unheard)

    @property
    def done(self) -> bool:
        """Whether every vehicle that has a feed-forward says by both ways that it is so."""
        having = [vehicle for vehicle in self._vehicles.values() if not vehicle.lacks_it]
        certain = self.mode is Mode.OFF or not self.twins
        return bool(having) and certain and all(v.stage is _Stage.DONE for v in having)

    @property
    def waits_for(self) -> tuple[int, ...]:
        """The systems that have a feed-forward and are not known to be in the mode."""
        return tuple(
            n for n, v in sorted(self._vehicles.items()) if not v.lacks_it and v.stage is not _Stage.DONE
        )

    @property
    def sent(self) -> int:
        """How often the mode was sent."""
        return sum(vehicle.sent for vehicle in self._vehicles.values())

    @property
    def heard(self) -> bool:
        """Whether any vehicle is heard, not only known from before."""
        return any(vehicle.heard_s is not None for vehicle in self._vehicles.values())

    @property
    def lacking(self) -> bool:
        """Whether all that is heard has no feed-forward."""
        return self.heard and all(vehicle.lacks_it for vehicle in self._vehicles.values())

    @property
    def refusal(self) -> str:
        """What a vehicle has said against it, "" for nothing; a second late where its words are not heard.

        Of another mode than off also that OFF was ordered, or the mode taken back: then nothing more is sent.
        """
        if self._gives_way:
            return self._way_given
        said = (
            f"vehicle {n}: {v.against()}"
            for n, v in self._vehicles.items()
            if v.explained(self._now_s) and v.answer != self.mode
        )
        return "; ".join(said)

    @property
    def words(self) -> str:
        """What is seen, as of the last tick, in a sentence without an end."""
        if self._gives_way and not self.done:
            return self._way_given
        seen = [
            f"vehicle {system}: {vehicle.words(self._now_s)}"
            for system, vehicle in sorted(self._vehicles.items())
        ]
        if not seen:
            return self.twins or "no vehicle heard, nothing is sent yet"
        but = f"; but two vehicles answer: {self.twins}" if self.done else f"; {self.twins}"
        return "; ".join(seen) + (but if self.twins else "")

    def tick(self, now_s: float) -> list[Any]:
        """The messages to send now."""
        self._now_s = now_s
        if self._gives_way:
            return []
        return [m for vehicle in self._vehicles.values() for m in vehicle.tick(now_s, bool(self.twins))]

    def on_frame(self, frame: Frame, now_s: float) -> None:
        """A frame arrived; of any kind."""
        source = (frame.system, frame.component)
        if frame.message_id in _READINGS:
            reading = decode_reading(frame)
            if reading is not None:
                self.on_reading(reading, source, now_s)
        elif frame.message_id in _ANSWERS:
            message = decode(frame)
            if message is None:
                return
            if frame.message_id == dialect.MAVLINK_MSG_ID_STATUSTEXT:
                # Whoever speaks is no vehicle for it: only one that is known is listened to.
                if source[0] in self._vehicles:
                    self._vehicles[source[0]].on_text(message.text)
            elif frame.message_id == dialect.MAVLINK_MSG_ID_PARAM_VALUE:
                self.on_value(message.param_id, message.param_value, source, now_s)
            elif message.target_system in (0, GROUND_STATION[0]):
                self.on_error(message.param_id, message.error, source, now_s)

    def on_reading(self, reading: Reading, source: Source, now_s: float) -> None:
        """A heartbeat or what the vehicle tells of its mode; other readings say nothing here."""
        if reading.signal == "ff_mode":
            self._of(source, now_s).on_told(reading.values[0], source, now_s)
        elif reading.signal == "alive":
            armed, kind, autopilot = reading.values
            if Heard(source, int(kind), int(autopilot), bool(armed), now_s).is_vehicle:
                self._of(source, now_s).on_beat(source, now_s)

    def on_value(self, name: str, value: float, source: Source, now_s: float) -> None:
        """A PARAM_VALUE arrived."""
        if name == MODE:
            self._of(source, now_s).on_value(value, source, now_s)

    def on_error(self, name: str, code: int, source: Source, now_s: float) -> None:
        """A PARAM_ERROR arrived."""
        if name == MODE:
            self._of(source, now_s).on_error(code, source, now_s)

    @property
    def _gives_way(self) -> bool:
        lowered = any(vehicle.lowered for vehicle in self._vehicles.values())
        return self.mode is not Mode.OFF and (self.overruled or lowered)

    @property
    def _way_given(self) -> str:
        raised = word(self.mode)
        if self.overruled:
            return f"OFF was ordered meanwhile and wins: {raised} is sent no more; look, and ask again if need be"
        said = "; ".join(
            f"vehicle {n}: it says {word(v.other or 0.0)} after {word(self.mode if v.taken else v.was)}"
            for n, v in sorted(self._vehicles.items())
            if v.lowered
        )
        return (
            f"{said}, as if another has switched it: {raised} is sent no more; look, and ask again if need be"
        )

    def _of(self, source: Source, now_s: float) -> _Vehicle:
        """The vehicle of a source; one that is not asked for is watched by nobody."""
        if self._system not in (None, source[0]):
            return _Vehicle(self.mode, now_s)
        return self._vehicles.setdefault(source[0], _Vehicle(self.mode, now_s, was=self._was))


_READINGS: Final = (dialect.MAVLINK_MSG_ID_HEARTBEAT, dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT)
_ANSWERS: Final = (
    dialect.MAVLINK_MSG_ID_PARAM_VALUE,
    dialect.MAVLINK_MSG_ID_PARAM_ERROR,
    dialect.MAVLINK_MSG_ID_STATUSTEXT,
)
