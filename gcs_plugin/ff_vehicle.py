"""Switching one vehicle's FF_MODE: messages to send and when, its answers and telemetry, and its state in words. Pure.

    SEND (every 0.5 s, each time with a read request) -> QUIET (once its answer and its telemetry report the mode)
    -> READ -> DONE

`ff_switch` gives the reasons.
"""

from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.parameters import MODE, RAISED_ARMED
from bridge.vehicle.feedforward import Mode
from gcs_plugin.ff_words import sent_text, word
from gcs_plugin.params.client import NO_INDEX
from gcs_plugin.params.deadline import Timing
from gcs_plugin.params.transfer import DOES_NOT_EXIST, ERROR_SENTENCES, Source
from gcs_plugin.peers import COMPANIONS_MAY_FOLLOW_S, GROUND_STATION, KnownVehicle, parameter_holder

SEND_EVERY_S: Final = 0.5
QUIET_S: Final = Timing().quiet_s
UNREAD_S: Final = 3.0  # of unanswered read requests: the vehicle may have rebooted or been replaced
CONTESTED_QUIET_S: Final = 3.0  # if two vehicles may answer: each has reported its mode by then
TELL_SILENCE_S: Final = 1.5  # telemetry reports the mode once a second
NOT_HEARD_S: Final = 3.0  # three heartbeats
AGAIN_S: Final = QUIET_S  # a mode reported again after this time is no answer that overtook another
REASON_S: Final = 1.0  # the text of a refusal arrives with it, or with the refusal of the next write

REFUSED: Final = "FF_MODE refused: "
NOT_FROM_HERE: Final = f"orders from system {GROUND_STATION[0]} are refused"
SHADOW: Final = "shadow: "
ARMED: Final = RAISED_ARMED.removeprefix(REFUSED)
ADVICE: Final = "disarm it to raise it all the same, or fly on in shadow"


class Stage(Enum):
    SEND = auto()
    QUIET = auto()
    READ = auto()
    DONE = auto()


@dataclass
class SwitchedVehicle:
    """A system that is being switched to `mode`.

    `holder` is the component that has reported FF_MODE, `beating` are components that send HEARTBEATs, `lacking`
    components without FF_MODE; `unheard` are components that OFF is sent to blindly. `before_s` is the time when the
    vehicle was last heard before the switch, `heard_s` since. `answer` is its last PARAM_VALUE, `told` its last
    telemetry, `was` the mode before the switch; `taken`: it has confirmed a mode other than off once; `lowered`: it
    then left that mode.
    """

    mode: Mode
    since_s: float
    beating: set[Source] = field(default_factory=set)
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
        """Whether every component that sends HEARTBEATs has answered that it has no FF_MODE."""
        return self.holder is None and bool(self.lacking) and self.beating <= self.lacking

    def targets(self, now_s: float) -> list[Source]:
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
        return self.stage is Stage.DONE and self.told == self.mode

    def again(self, now_s: float) -> None:
        """Send the mode again after it was done."""
        if self.stage is Stage.DONE:
            self.stage, self.due_s, self.answer, self.told = Stage.SEND, now_s, None, None
            self.first_s = self.answered_s = now_s

    def know(self, vehicle: KnownVehicle) -> None:
        """Take over what is known from before the switch."""
        self.before_s = max(self.before_s or vehicle.heard_s, vehicle.heard_s)
        self.beating.add(vehicle.source)
        if vehicle.holds:
            self.holder = vehicle.source

    def on_beat(self, source: Source, now_s: float) -> None:
        self.heard_s = now_s
        self.beating.add(source)

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
        self._watch(value, now_s)
        if not self.sent:
            return
        self.taken = self.taken or (value == self.mode is not Mode.OFF)
        self.answer, self.answered_s = value, now_s
        if self.stage is Stage.READ and value == self.mode:
            self.stage = Stage.DONE
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
        """Why the vehicle refuses the mode, in its own words if they arrived, and the advice for the operator."""
        reasons = [self.refusal, self.reason, self.shadow]
        return ": ".join(filter(None, reasons)) + (f"; {ADVICE}" if self.shadow else "")

    def explained(self, now_s: float) -> bool:
        """Whether a refusal and all of its explanation have arrived, or REASON_S have passed since the refusal."""
        whole = bool(self.reason) and (self.reason != ARMED or bool(self.shadow))
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
        elif self.stage is Stage.SEND and self.answer == self.told == self.mode:
            self.stage, self.due_s = Stage.QUIET, self.last_s + self._quiet_s

    @property
    def _quiet_s(self) -> float:
        return CONTESTED_QUIET_S if self.contested else QUIET_S

    def _send_again(self) -> None:
        if self.stage is not Stage.SEND:
            self.stage, self.due_s = Stage.SEND, self.last_s + SEND_EVERY_S

    def words(self, now_s: float) -> str:
        wanted = word(self.mode)
        if self.stage is Stage.DONE and self.told is not None and self.told != self.mode:
            return f"was {wanted}, as read back; its telemetry says {word(self.told)} now"
        if self.stage is Stage.DONE:
            how = "as answered" if self.contested else "as read back and as its telemetry says"
            return f"{wanted}, {how}"
        if self.lacks_it:
            return "has no feed-forward"
        if not self.sent:
            return "heard, nothing is sent yet"
        parts = [sent_text(self.sent)]
        last_s = self.before_s if self.heard_s is None else self.heard_s
        if last_s is None:
            return f"{parts[0]}, never heard: not confirmed"
        if self.heard_s is None or now_s - last_s >= NOT_HEARD_S:
            return f"{parts[0]}, not heard for {now_s - last_s:.0f} s: not confirmed"
        silent_s = now_s - max(self.answered_s, self.first_s)
        if self.answer is None or silent_s >= TELL_SILENCE_S:
            parts.append(f"no answer for {silent_s:.1f} s")
        elif self.answer != self.mode:
            parts.append(f"it answers {word(self.answer)}{f' ({self.against()})' if self.refusal else ''}")
        if self.told is None and now_s - self.first_s >= TELL_SILENCE_S:
            parts.append("no telemetry of it")
        elif self.told is not None and self.told != self.mode:
            parts.append(f"its telemetry says {word(self.told)}")
        if self.stage is not Stage.SEND:
            parts.append(f"it says {wanted}, being read back")
        return ", ".join(parts)
