"""A vehicle that is being switched: sent FF_MODE until its read-back and its telemetry confirm the mode. Pure.

It goes through these states:

    SEND (every 0.5 s, each time with a read request) -> QUIET (once its answer and its telemetry report the mode)
    -> READ -> DONE
"""

from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.firmware.table import alone
from bridge.vehicle.mode import Mode, word_of
from bridge.vehicle.parameters import MODE
from bridge.wire.status_codes import CrewText, Topic
from gcs_plugin.params.deadline import QUIET_S
from gcs_plugin.params.session import NO_INDEX
from gcs_plugin.params.transfer import DOES_NOT_EXIST, ERROR_SENTENCES
from gcs_plugin.peers import (
    COMPANIONS,
    COMPANIONS_MAY_FOLLOW_S,
    GROUND_STATION,
    Heartbeat,
    KnownVehicle,
    Source,
    parameter_holder,
)

SEND_EVERY_S: Final = 0.5
UNREAD_S: Final = 3.0  # of unanswered read requests: the vehicle may have rebooted or been replaced
CONTESTED_QUIET_S: Final = 3.0  # if two vehicles may answer: each has reported its mode by then
SHOW_SILENCE_S: Final = 1.5  # telemetry reports the mode once a second
NOT_HEARD_S: Final = 3.0  # three heartbeats
AGAIN_S: Final = QUIET_S  # a mode reported again after this time is no answer that overtook another
REASON_S: Final = 1.0  # the text of a refusal arrives with it, or with the refusal of the next write


ALONE_S: Final = 5.0
REASONS: Final = {
    Topic.NO_SET: "no active set",
    Topic.UNPROVEN: "armed, shadow not good yet",
    Topic.STRANGER: f"it takes no orders from system {GROUND_STATION[0]}, but from another ground",
}
"""Why a vehicle refuses a mode, by the code of its text."""
ADVICE: Final = "disarm it to raise it all the same, or fly on in shadow"


def sent_text(count: int) -> str:
    return "sent once" if count == 1 else f"sent {count} times"


class Stage(Enum):
    """Stage of an order to a vehicle: send the mode, let late echoes pass, read it back."""

    SEND = auto()
    QUIET = auto()
    READ = auto()
    DONE = auto()


@dataclass
class SwitchedVehicle:
    """A system that is being switched to `mode`.

    `holder` is the component that has reported FF_MODE, `beating` are components that send HEARTBEATs, `lacking`
    components without FF_MODE; `present` are components heard since the switch began, `behind` whether an autopilot
    stands before the vehicle's companion, and executes orders to that unheard; `unheard` are components that
    OFF is sent to blindly. `before_s` is the time when the vehicle was last heard before the switch, `heard_s`
    since. `answer` is its last PARAM_VALUE, `telemetry` the mode in its last telemetry, `was` that before the
    switch; `taken`: it has confirmed a mode other than off once; `lowered`: it then left that mode; `obstacle`: why
    it can't act in any mode, as it said since the first send; `alone`: advice for an autopilot that turns out to have
    no companion, "" if there is none.
    """

    mode: Mode
    since_s: float
    beating: set[Source] = field(default_factory=set)
    present: set[Source] = field(default_factory=set)
    behind: bool = False
    holder: Source | None = None
    unheard: tuple[Source, ...] = ()
    before_s: float | None = None
    heard_s: float | None = None
    stage: Stage = Stage.SEND
    due_s: float = 0.0
    sent: int = 0
    first_s: float = 0.0
    last_s: float = 0.0
    answer: float | None = None
    answered_s: float = 0.0
    telemetry: float | None = None
    refusal: str = ""
    refused_s: float = 0.0
    reason: Topic | None = None
    shadow: str = ""
    lacking: set[Source] = field(default_factory=set)
    contested: bool = False
    was: float = float(Mode.OFF)
    taken: bool = False
    other: float | None = None
    other_s: float = 0.0
    lowered: bool = False
    obstacle: str = ""
    alone: str = ""

    @property
    def lacks_it(self) -> bool:
        """Whether every component that sends HEARTBEATs has answered that it has no FF_MODE."""
        return self.holder is None and bool(self.lacking) and self.beating <= self.lacking

    def targets(self, now_s: float) -> list[Source]:
        """Components to send to now, without a companion that ArduPilot may not have heard."""
        return [source for source in self._chosen(now_s) if not self._is_beyond(source)]

    def _is_beyond(self, source: Source) -> bool:
        return self.behind and source[1] in COMPANIONS and source not in self.present

    def _chosen(self, now_s: float) -> list[Source]:
        """Components to send to: the holder of FF_MODE, otherwise one that sends HEARTBEATs, a companion first.

        A mode other than off waits until a companion has had time to send a HEARTBEAT. If no component sends
        HEARTBEATs, those in `unheard`.
        """
        if self.holder is not None:
            return [self.holder]
        if self.mode is not Mode.OFF and now_s < self.since_s + COMPANIONS_MAY_FOLLOW_S:
            return []
        beating = self.beating - self.lacking
        if not beating:
            return [source for source in self.unheard if source not in self.lacking]
        return [parameter_holder(beating)]

    @property
    def in_mode(self) -> bool:
        """Whether read-back and telemetry have confirmed the mode, and telemetry has reported no other mode since."""
        return self.stage is Stage.DONE and self.telemetry == self.mode

    def again(self, now_s: float) -> None:
        """Send the mode again after it was done."""
        if self.stage is Stage.DONE:
            self.stage, self.due_s, self.answer, self.telemetry = Stage.SEND, now_s, None, None
            self.first_s = self.answered_s = now_s

    def know(self, vehicle: KnownVehicle) -> None:
        """Take over the knowledge from before the switch."""
        self.before_s = max(self.before_s or vehicle.heard_s, vehicle.heard_s)
        self.beating.add(vehicle.source)
        self.behind = self.behind or vehicle.behind
        if vehicle.holds:
            self.holder = vehicle.source

    def on_beat(self, beat: Heartbeat, source: Source, now_s: float) -> None:
        self.heard_s = now_s
        self.beating.add(source)
        self.present.add(source)
        self.behind = self.behind or beat.serves_unheard
        self.alone = self.alone or alone(beat.autopilot)

    def tick(self, now_s: float, contested: bool) -> list[Any]:
        self.contested = contested
        unread = self.stage is Stage.READ and now_s >= self.last_s + self._quiet_s + UNREAD_S
        # For off, an answer counts even if two vehicles may have given it; for any other mode it does not.
        if unread or (contested and self.mode is not Mode.OFF):
            self._send_again()
        targets = self.targets(now_s)
        if not targets or self.stage is Stage.DONE or now_s < self.due_s:
            return []
        name = MODE.encode()
        questions = [
            dialect.MAVLink_param_request_read_message(*target, name, NO_INDEX) for target in targets
        ]
        self.due_s = now_s + SEND_EVERY_S
        if self.stage is not Stage.SEND:
            self.stage = Stage.READ
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
        self.present.add(source)
        self._watch(value, now_s)
        if not self.sent:
            return
        self.taken = self.taken or (value == self.mode is not Mode.OFF)
        self.answer, self.answered_s = value, now_s
        if self.stage is Stage.READ and value == self.mode:
            self.stage = Stage.DONE
        else:
            self._judge(value)

    def on_telemetry(self, value: float, source: Source, now_s: float) -> None:
        self.holder, self.heard_s = source, now_s
        self.present.add(source)
        self._watch(value, now_s)
        if self.sent:
            self.telemetry = value
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

    def on_text(self, text: CrewText) -> None:
        if not self.sent or (text.topic is Topic.STRANGER and text.number != GROUND_STATION[0]):
            return
        if text.topic is Topic.OBSTACLE:
            self.obstacle = text.words
        elif text.topic in REASONS:
            self.reason = text.topic
        elif text.topic is Topic.SHADOW:
            self.shadow = text.words

    def against(self) -> str:
        """Why the vehicle refuses the mode, with the reason if it arrived, and the advice for the operator."""
        reasons = [self.refusal, "" if self.reason is None else REASONS[self.reason], self.shadow]
        return ": ".join(filter(None, reasons)) + (f"; {ADVICE}" if self.shadow else "")

    def explained(self, now_s: float) -> bool:
        """Whether a refusal and all of its explanation have arrived, or REASON_S have passed since the refusal."""
        whole = self.reason is not None and (self.reason is not Topic.UNPROVEN or bool(self.shadow))
        return bool(self.refusal) and (whole or now_s >= self.refused_s + REASON_S)

    def _watch(self, value: float, now_s: float) -> None:
        """Notice that somebody lowered the mode: off before the first send although it was raised, or another mode for
        AGAIN_S after the vehicle had taken a mode other than off.
        """
        if self.mode is Mode.OFF or self.stage is Stage.DONE:
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
        """Start the quiet period once answer and telemetry report the mode; send again if `value` is another mode."""
        if self.stage is Stage.DONE:
            return
        if value != self.mode:
            self._send_again()
        elif self.stage is Stage.SEND and self.answer == self.telemetry == self.mode:
            self.stage, self.due_s = Stage.QUIET, self.last_s + self._quiet_s

    @property
    def _quiet_s(self) -> float:
        return CONTESTED_QUIET_S if self.contested else QUIET_S

    def _send_again(self) -> None:
        if self.stage is not Stage.SEND:
            self.stage, self.due_s = Stage.SEND, self.last_s + SEND_EVERY_S

    def words(self, now_s: float) -> str:
        wanted = word_of(self.mode)
        if self.stage is Stage.DONE and self.telemetry is not None and self.telemetry != self.mode:
            return f"was {wanted}, as read back; its telemetry says {word_of(self.telemetry)} now"
        if self.stage is Stage.DONE:
            how = "as answered" if self.contested else "as read back and as its telemetry says"
            but = f"; but {self.obstacle}" if self.obstacle and self.mode is not Mode.OFF else ""
            return f"{wanted}, {how}{but}"
        if self.lacks_it:
            return "has no feed-forward"
        if not self.sent and any(map(self._is_beyond, self._chosen(now_s))):
            return (
                f"{wanted} waits for its companion's heartbeat: ArduSub would take it for its own until then"
            )
        if not self.sent:
            return "heard, nothing is sent yet"
        parts = [sent_text(self.sent)]
        last_s = self.before_s if self.heard_s is None else self.heard_s
        if last_s is None:
            return f"{parts[0]}, never heard: not confirmed"
        if self.heard_s is None or now_s - last_s >= NOT_HEARD_S:
            return f"{parts[0]}, not heard for {now_s - last_s:.0f} s: not confirmed"
        silent_s = now_s - max(self.answered_s, self.first_s)
        if self.answer is None or silent_s >= SHOW_SILENCE_S:
            parts.append(f"no answer for {silent_s:.1f} s")
            if self.answer is None and self.alone and self.holder is None and silent_s >= ALONE_S:
                parts.append(self.alone)
        elif self.answer != self.mode:
            parts.append(f"it answers {word_of(self.answer)}{f' ({self.against()})' if self.refusal else ''}")
        if self.telemetry is None and now_s - self.first_s >= SHOW_SILENCE_S:
            parts.append("no telemetry of it")
        elif self.telemetry is not None and self.telemetry != self.mode:
            parts.append(f"its telemetry says {word_of(self.telemetry)}")
        if self.stage is not Stage.SEND:
            parts.append(f"it says {wanted}, being read back")
        return ", ".join(parts)
