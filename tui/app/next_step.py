"""The next step on the way from no dive to a vehicle that follows its reference, by the situation. Pure."""

from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import Final

from bridge.vehicle.mode import ACTING, BY_WORD, Mode


class Flight(Enum):
    """State of the flight of a plan; WORKED_ON: it is over, and identified and uploaded."""

    NONE = auto()
    BEING_PLANNED = auto()
    PLANNED = auto()
    UNDER_WAY = auto()
    WORKED_ON = auto()


@dataclass(frozen=True)
class Situation:
    """All that the next step depends on, as far as this computer knows it.

    About the vehicle and this computer:

    - vehicle: False while the user must still name its file.
    - heard: the vehicle speaks; linked: there are links to record.
    - contested: another vehicle has its address, so that nothing may be sent.
    - recording: a recording runs; over: its dive is over.
    - disarmed: the vehicle says so; lost: it fell silent while it was armed; departs: an alarm says that it does not
      answer its thrusters as its model does; alarmed: while it is armed, any other alarm.
    - flies: it can fly manoeuvres by itself; flight: the state of the flight that Fly asks for.
    - mode: its feed-forward's mode, "" if unknown; last_mode: the last that was heard, "" for none.
    - working: the long verb that runs, "" for none; then: what was asked for and begins once the dives are read, ""
      for nothing; writing: parameters or a mode are being sent.

    About the dive meant, `dive`, "" for none:

    - shown: the screens show it; reading: dives are being read.
    - determined: how many of its masses and dampings of feed-forward axes it determines, None if it was not read yet;
      lacking: those that it does not.
    - after_upload: it began after the upload below; before_upload: the vehicle accepted values since, whichever.
    - flown: the mode in which it was flown, "" if it was not validated; go: whether that was a GO, None if not judged.
    - verdict: of its diagnosis, "" without one; contradicted: its check dive shows no such effect.

    About values:

    - identified: values of that dive, or of a dive before it, are kept; accepts: the newest are a diagnosis's;
      changed: of something that was accepted before.
    - uploaded: the vehicle accepted the newest, or any where none are kept; taken_back: a roll back came after them;
      after_roll_back: and the dive meant ended after that.
    - halfway: an upload or a roll back was begun and never finished.
    - departed: the newest dive since that upload that was judged before the one meant, if it was a NO-GO with the
      feed-forward, and neither of the two has a diagnosis that stands; "" for none.
    - gate: the dive since that upload by which the feed-forward is raised to both or is not, with its GO: the newest in
      shadow, or a newer one that was a NO-GO; None without one.
    """

    vehicle: bool = True
    heard: bool = False
    contested: bool = False
    recording: bool = False
    over: bool = False
    linked: bool = False
    flies: bool = False
    flight: Flight = Flight.NONE
    working: str = ""
    then: str = ""
    writing: bool = False
    dive: str = ""
    shown: bool = True
    lacking: tuple[str, ...] = ()
    determined: int | None = None
    reading: bool = False
    identified: bool = False
    accepts: bool = False
    changed: bool = False
    uploaded: bool = False
    halfway: bool = False
    taken_back: bool = False
    after_roll_back: bool = False
    mode: str = ""
    last_mode: str = ""
    after_upload: bool = False
    flown: str = ""
    go: bool | None = None
    verdict: str = ""
    contradicted: bool = False
    before_upload: bool = False
    disarmed: bool = False
    lost: bool = False
    departs: bool = False
    alarmed: bool = False
    gate: tuple[str, bool] | None = None
    departed: str = ""


@dataclass(frozen=True)
class Next:
    """The ids of the actions that do it, one after the other, and its words."""

    actions: tuple[str, ...]
    words: str


ACTING_WORDS: Final = tuple(mode.word for mode in ACTING)
AXES: Final = {"u": "surge", "v": "sway", "r": "yaw"}
LOST = Next(
    ("ff.off",), "lost while armed: mend the link, or fetch the vehicle; the key sends OFF until acknowledged"
)
LOST_UNRECORDED = Next(
    ("ff.off", "recording.begin"),
    "lost while armed, and its recording has ended: the first key sends OFF until acknowledged, the second records",
)
VEHICLE = Next(("vehicle.name",), "say which vehicle this is")
CONNECT = Next(("link.connect",), "connect the vehicle")
RECORD = Next(("recording.begin",), "record a dive")
SWITCH_ON = Next((), "switch the vehicle on, and dive surge, sway and yaw")
OF_FLIGHT: Final = {
    Flight.BEING_PLANNED: Next(("screen.fly",), "a flight is being planned: wait for it"),
    Flight.UNDER_WAY: Next(("flight.end",), "the vehicle flies by itself: this key ends it"),
    Flight.WORKED_ON: Next(("screen.fly",), "the flight is over, and being worked on: wait for it"),
}
FLY_PLAN = Next(("screen.fly", "fly.fly"), "read the plan and its limits, then let it fly")
CALIBRATE = Next(
    ("screen.fly", "fly.plan"),
    "let it fly by itself what calibrates it; or dive surge, sway and yaw by hand, then begin the next dive",
)
DIVE = Next(("recording.next",), "once surge, sway and yaw are dived: begin the next dive")
END = Next(("recording.next",), "the dive is over: begin the next, and work on this one")
IDENTIFY = Next(("screen.dives", "dives.identify"), "identify {dive}")
UPLOAD = Next(("screen.parameters", "parameters.upload"), "compare and upload what was identified")
HALFWAY = replace(UPLOAD, words="the last upload was cut short: compare, and upload or roll back")
TAKEN_BACK = replace(UPLOAD, words="rolled back: dive anew and identify, or compare and upload it again")
DIVE_ANEW = replace(DIVE, words="rolled back: once surge, sway and yaw are dived anew: begin the next dive")
ACCEPT = replace(UPLOAD, words="compare and upload the cause that was diagnosed")
CHANGED = replace(
    UPLOAD, words="what was accepted has changed: compare and upload its new value, or roll back"
)
TO_SHADOW = Next(("ff.raise",), "set the feed-forward to shadow, where it only computes")
TO_HEAR = Next(
    ("screen.watch",), "uploaded: switch the vehicle on; the mode of its feed-forward tells what is next"
)
MODE_TELLS = Next(("screen.watch",), "uploaded: the mode of its feed-forward, once told, says what is next")
TO_HEAR_AND_RAISE = Next(
    ("ff.raise",), "GO in shadow: switch the vehicle on; this key then raises the feed-forward to both"
)
FLY_SHADOW = Next(("recording.next",), "once it has flown a minute in shadow: begin the next dive")
VALIDATE = Next(("screen.validate", "validate.start"), "validate {dive}")
LOOK = Next(("screen.validate",), "{dive} is a NO-GO: read why, then diagnose it")
TO_BOTH = Next(("ff.raise",), "GO in shadow: raise the feed-forward to both")
LOWER = Next(("ff.lower",), "{dive} is a NO-GO: lower the feed-forward to shadow")
LOWER_AND_DIVE = replace(LOWER, words=f"{LOWER.words}, then dive the same again")
LOWER_NOW = replace(LOWER, words="the vehicle departs from its model: lower the feed-forward to shadow")
BRING_HOME = Next(
    ("recording.next",),
    "the vehicle departs from its model: bring it home, begin the next dive, and ask of this one what causes it",
)
SEE_TO = Next(("screen.watch",), "see to the ALARM above first")
FLY = Next(("recording.next",), "once it has flown with the feed-forward: begin the next dive")
FLY_UNKNOWN = replace(
    FLY,
    words="it flies with a model that is not known here; once it has flown with the feed-forward: begin the next dive",
)
DIAGNOSE = Next(("screen.diagnose", "diagnose.start"), "flown and compared: ask what is still missing")
MENDS = replace(DIAGNOSE, words="{dive} is a NO-GO: ask what causes it")
MENDS_BOTH = replace(DIAGNOSE, words="{dive} was flown after a NO-GO: ask what causes it")
FLY_ON = replace(FLY, words="once it has flown on: begin the next dive")
SILENT = Next(("screen.watch",), "the vehicle is not heard: switch it on, or mend the link")
LOOK_CLOSER = Next(("screen.diagnose",), "{dive} is diagnosed: read its last section, what to dive next")
DIVE_AGAIN = replace(
    LOOK_CLOSER, words="the check dive shows no such effect: dive the same again, then ask once more, of both"
)
READS = Next(("screen.dives",), "{dive} is being read: wait to see whether it flew")
ASKED = Next((), "answer what is asked; escape leaves it")
"""While a question is open, every key goes to its answer."""
WRITES = Next((), "the vehicle is being written to: wait for its answer")
OF_OTHERS: Final = {
    IDENTIFY.actions: ("screen.dives", "dives.newest", "dives.identify"),
    VALIDATE.actions: ("screen.dives", "dives.newest", "dives.validate"),
    DIAGNOSE.actions: ("screen.dives", "dives.newest", "dives.diagnose"),
}
"""Where the screens show another dive, the actions that begin with the dive meant."""


def next_of(now: Situation) -> Next:
    if now.lost:
        return LOST if now.recording else LOST_UNRECORDED
    if now.writing:
        return WRITES
    if now.flight in OF_FLIGHT:
        return OF_FLIGHT[now.flight]
    if now.working:
        return Next((f"screen.{now.working}",), f"{now.working} is at work: wait for it")
    if now.then:
        return Next(("screen.dives",), f"the dives are being read; {now.then} begins by itself then")
    if now.over and now.recording:
        return END
    if now.departs and now.recording:
        return LOWER_NOW if lowered_to(now)[0] is not None else BRING_HOME
    if now.alarmed:
        return SEE_TO
    if not now.vehicle:
        return VEHICLE
    if _flew_wrong(now) and lowered_to(now)[0] is not None and not _has_remedy(now):
        return _with_dive(LOWER_AND_DIVE if now.contradicted else LOWER, now)
    if not (now.uploaded or now.identified) and (now.mode in ACTING_WORDS or now.flown in ACTING_WORDS):
        return _with_dive(_with_unknown_model(now), now)
    if not now.dive and not (now.uploaded and now.mode):
        return _with_dive(_to_dive(now), now)
    if now.halfway:
        return _to_vehicle(now, HALFWAY)
    if now.uploaded:
        return _with_dive(_after_upload(now), now)
    if now.taken_back and not now.after_roll_back:
        dives = now.heard and now.recording and not now.disarmed and not now.contested
        return DIVE_ANEW if dives else _to_vehicle(now, TAKEN_BACK)
    if now.taken_back and (now.mode in ACTING_WORDS or now.flown in ACTING_WORDS):
        return _with_dive(_diagnosed(now) if now.flown in ACTING_WORDS else VALIDATE, now)
    if now.identified and not now.taken_back:
        return _to_vehicle(now, CHANGED if now.changed else ACCEPT if now.accepts else UPLOAD)
    if now.lacking and now.determined is not None:
        return _dive_more(now)
    return _with_dive(IDENTIFY, now)


def lowered_to(now: Situation) -> tuple[Mode | None, str]:
    """The mode to which the feed-forward may be lowered now, short of off; or None and the reason."""
    mode, why = _ordered(now)
    if mode is None or mode.applies_feedforward:
        return (Mode.SHADOW if mode is not None else None), why
    return None, f"the feed-forward does not act, in {mode.word}"


def raised_to(now: Situation) -> tuple[Mode | None, str]:
    """The mode to which the feed-forward may be raised now, or None and the reason."""
    mode, why = _ordered(now)
    if mode is None:
        return None, why
    if mode is Mode.OFF:
        return Mode.SHADOW, ""
    if mode is not Mode.SHADOW:
        return None, f"the feed-forward acts already, in {mode.word}"
    if now.gate is None:
        return (
            None,
            "no dive in shadow since the upload was validated as a GO: fly a minute, then validate it",
        )
    dive, go = now.gate
    return (Mode.BOTH, "") if go else (None, f"{dive} is a NO-GO; Validate says why")


def raising_words(now: Situation, key: str) -> str:
    """The effect of the key that raises, after a dive that is a GO in shadow: it goes by `raised_to` as well."""
    mode, why = raised_to(now)
    return f"{key} raises it to {mode.word}." if mode is not None else f"{key} does not raise it now: {why}."


def _ordered(now: Situation) -> tuple[Mode | None, str]:
    """The vehicle's mode, if an order may go to it; else None and the reason."""
    mode = BY_WORD.get(now.mode)
    if now.contested:
        return None, "two vehicles share its address, and both would obey"
    if not now.heard:
        return None, "no vehicle is heard; connect it, or mend the link"
    if mode is None:
        return None, "the vehicle tells no mode of its feed-forward"
    if not now.recording:
        return None, "the order goes by the recording, and none runs"
    return mode, ""


def _flew_wrong(now: Situation) -> bool:
    """Whether the dive meant is a NO-GO of the feed-forward as it acts, with the values that the vehicle has now."""
    return now.go is False and now.flown in ACTING_WORDS and not now.before_upload


def _has_remedy(now: Situation) -> bool:
    """Whether the cause of a NO-GO can be uploaded at once: its vehicle moves nothing meanwhile."""
    return now.disarmed and now.accepts and bool(now.verdict) and not (now.contradicted or now.taken_back)


def _with_unknown_model(now: Situation) -> Next:
    """Of a vehicle that flies, or flew, with a model of which nothing is kept here."""
    if now.flown in ACTING_WORDS:
        return _diagnosed(now)
    return VALIDATE if now.dive and not now.flown else _to_vehicle(now, FLY_UNKNOWN)


def _to_dive(now: Situation) -> Next:
    if not now.recording:
        return _to_vehicle(now, RECORD)
    if not now.heard:
        return SWITCH_ON
    if not now.flies:
        return DIVE
    return FLY_PLAN if now.flight is Flight.PLANNED else CALIBRATE


def _after_upload(now: Situation) -> Next:
    if now.after_upload and not now.flown:
        if now.reading and now.determined is None:
            return READS
        # Two dives of a vehicle that departs from its model are one question. One that still flies so is judged first.
        return MENDS_BOTH if now.departed and lowered_to(now)[0] is None else VALIDATE
    if now.after_upload and now.go is False and now.flown == Mode.SHADOW.word:
        return LOOK if not now.verdict else _read_closer(now)
    if now.after_upload and now.flown in ACTING_WORDS:
        return _diagnosed(now)
    if (now.mode or now.last_mode) in ACTING_WORDS:
        return _to_vehicle(now, FLY)
    if now.mode == Mode.SHADOW.word:
        return TO_BOTH if raised_to(now)[0] is Mode.BOTH else _to_vehicle(now, FLY_SHADOW)
    if now.recording and not (now.mode or now.heard or now.contested):
        return TO_HEAR_AND_RAISE if now.gate is not None and now.gate[1] else TO_HEAR
    if now.mode or now.last_mode == Mode.OFF.word:
        return _to_vehicle(now, TO_SHADOW)
    if now.last_mode == Mode.SHADOW.word:
        return _to_vehicle(now, TO_BOTH if now.gate is not None and now.gate[1] else FLY_SHADOW)
    return _to_vehicle(now, MODE_TELLS)


def _diagnosed(now: Situation) -> Next:
    if not now.verdict:
        return MENDS if now.go is False else DIAGNOSE
    if now.verdict != "no_gap":
        return _read_closer(now)
    step = _to_vehicle(now, FLY_ON)
    return replace(step, words=f"nothing is left to explain; {step.words}")


def _read_closer(now: Situation) -> Next:
    return DIVE_AGAIN if now.contradicted else LOOK_CLOSER


def _to_vehicle(now: Situation, then: Next) -> Next:
    """`then`, once the vehicle is there and recorded."""
    if now.contested:
        return Next(("screen.watch",), f"two vehicles share an address: part them; then: {then.words}")
    if now.heard or (then is RECORD and now.linked):
        return _to_recording(now, then)
    if not now.linked and not now.recording:
        return CONNECT if then is RECORD else replace(CONNECT, words=f"{CONNECT.words}; then: {then.words}")
    if now.recording:
        return replace(SILENT, words=f"{SILENT.words}; then: {then.words}")
    return _to_recording(now, then)


def _to_recording(now: Situation, then: Next) -> Next:
    """`then`, once it is recorded."""
    if now.recording or then is RECORD:
        return then
    return Next(RECORD.actions, f"begin a recording; then: {then.words}")


def _dive_more(now: Situation) -> Next:
    axes = " and ".join(dict.fromkeys(AXES[name[-1]] for name in now.lacking if name[-1] in AXES))
    words = f"{', '.join(now.lacking)} not determined by {now.dive}: "
    if now.flies and now.heard and now.recording:
        if now.flight is Flight.PLANNED:
            return FLY_PLAN
        return Next(("screen.fly", "fly.plan"), f"{words}let it fly {axes} by itself, or dive by hand")
    actions = ("recording.next",) if now.recording else ("recording.begin",)
    return Next(actions, f"{words}dive {axes} there and back at two speeds")


def _with_dive(step: Next, now: Situation) -> Next:
    actions = step.actions if now.shown else OF_OTHERS.get(step.actions, step.actions)
    return Next(actions, step.words.format(dive=now.dive))
