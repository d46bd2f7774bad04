"""The next thing to do: one step of the way from no dive to a vehicle that follows its reference. Pure."""

from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import Final

from bridge.vehicle.mode import BY_WORD, Mode


class Task(Enum):
    """The step to take."""

    LOST = auto()
    VEHICLE = auto()
    CONNECT = auto()
    RECORD = auto()
    DIVE = auto()
    DIVE_MORE = auto()
    IDENTIFY = auto()
    UPLOAD = auto()
    TO_SHADOW = auto()
    FLY_SHADOW = auto()
    VALIDATE = auto()
    LOOK = auto()
    TO_BOTH = auto()
    LOWER = auto()
    FLY = auto()
    DIAGNOSE = auto()
    WAIT = auto()
    END = auto()


@dataclass(frozen=True)
class Campaign:
    """The state of a campaign, as far as this computer knows it.

    `vehicle`: its file is known, or nobody may say which it is.
    `heard`: the vehicle is; `contested`: another has its address, so that nothing may be sent; `recording`: a recording
    runs; `over`: its dive is over; `linked`: it is known which links to record. `flies`: it can fly manoeuvres by
    itself; `flying`: it does, as Fly asked. `working` is the long verb that runs, "" for none; `writing`: parameters or
    a mode are on their way to the vehicle.
    `dive` is the dive meant, "" for none; `shown`: the screens show it; `lacking` its masses and dampings of
    feed-forward axes that it can't tell, `told` those that it can, None if it was not read yet; `reading`: dives are
    being read. `identified`: values of it, or of a dive before it, are kept; `accepts`: the newest of them are a
    diagnosis's; `uploaded`: the vehicle accepted the newest of them; `halfway`: an upload or roll back was begun and
    never finished; `taken_back`: a roll back came after those values. `mode` is the vehicle's, "" if unknown. `since`:
    the dive began after that upload; `flown` is the mode in which it was flown, "" if it was not validated, and `go`
    whether that was a GO, None if nothing was judged. `verdict` is that of its diagnosis, "" if there is none.
    `lost`: the vehicle fell silent while it was armed. `gate` is the dive since that upload by which the feed-forward
    is raised to both or is not, with its GO: the newest in shadow, or a newer one that was a NO-GO; None without one.
    """

    vehicle: bool = True
    heard: bool = False
    contested: bool = False
    recording: bool = False
    over: bool = False
    linked: bool = False
    flies: bool = False
    flying: bool = False
    working: str = ""
    writing: bool = False
    dive: str = ""
    shown: bool = True
    lacking: tuple[str, ...] = ()
    told: int | None = None
    reading: bool = False
    identified: bool = False
    accepts: bool = False
    uploaded: bool = False
    halfway: bool = False
    taken_back: bool = False
    mode: str = ""
    since: bool = False
    flown: str = ""
    go: bool | None = None
    verdict: str = ""
    lost: bool = False
    gate: tuple[str, bool] | None = None


@dataclass(frozen=True)
class Next:
    """The task, the ids of the actions that do it, one after the other, and its words."""

    task: Task
    actions: tuple[str, ...]
    words: str


AXES: Final = {"u": "surge", "v": "sway", "r": "yaw"}
LOST = Next(
    Task.LOST,
    ("ff.off",),
    "the link was lost while it was armed: mend the link, or fetch the vehicle; the key sends OFF until it is "
    "acknowledged",
)
VEHICLE = Next(Task.VEHICLE, ("vehicle.name",), "say which vehicle this is")
CONNECT = Next(Task.CONNECT, ("link.connect",), "connect the vehicle")
RECORD = Next(Task.RECORD, ("recording.begin",), "record a dive")
SWITCH_ON = Next(Task.DIVE, (), "switch the vehicle on, and dive surge, sway and yaw")
FLYING = Next(Task.WAIT, ("screen.fly", "flight.end"), "the vehicle flies by itself: the last key ends it")
CALIBRATE = Next(
    Task.DIVE,
    ("screen.fly", "fly.plan"),
    "let it fly by itself what calibrates it; or dive surge, sway and yaw by hand, then begin the next dive",
)
DIVE = Next(
    Task.DIVE,
    ("recording.next",),
    "dive surge, sway and yaw: it is being recorded; then begin the next dive",
)
END = Next(Task.END, ("recording.next",), "the dive is over: begin the next, and work on this one")
IDENTIFY = Next(Task.IDENTIFY, ("screen.dives", "dives.identify"), "identify {dive}")
UPLOAD = Next(
    Task.UPLOAD, ("screen.parameters", "parameters.upload"), "identified, not uploaded: compare and upload"
)
HALFWAY = replace(UPLOAD, words="the last upload was cut short: compare, and upload or roll back")
TAKEN_BACK = replace(UPLOAD, words="rolled back: dive anew and identify, or compare and upload it again")
ACCEPT = replace(UPLOAD, words="a cause was diagnosed: compare and upload")
TO_SHADOW = Next(
    Task.TO_SHADOW, ("ff.raise",), "uploaded: set the feed-forward to shadow, where it only computes"
)
FLY_SHADOW = Next(
    Task.FLY_SHADOW, ("recording.next",), "once it has flown a minute in shadow: begin the next dive"
)
VALIDATE = Next(Task.VALIDATE, ("screen.validate", "validate.start"), "validate {dive}")
LOOK = Next(Task.LOOK, ("screen.validate",), "{dive} is a NO-GO: read why, then diagnose it")
TO_BOTH = Next(Task.TO_BOTH, ("ff.raise",), "GO in shadow: raise the feed-forward to both")
LOWER = Next(Task.LOWER, ("ff.lower",), "{dive} is a NO-GO: lower the feed-forward to shadow")
FLY = Next(Task.FLY, ("recording.next",), "once it has flown with the feed-forward: begin the next dive")
DIAGNOSE = Next(
    Task.DIAGNOSE, ("screen.diagnose", "diagnose.start"), "flown and compared: ask what is still missing"
)
MENDS = replace(DIAGNOSE, words="{dive} is a NO-GO: ask what causes it")
NOTHING_LEFT = replace(FLY, words="nothing is left to explain; once it has flown on: begin the next dive")
LOOK_CLOSER = Next(Task.LOOK, ("screen.diagnose",), "{dive} is diagnosed: read what to dive next")
READS = Next(Task.WAIT, ("screen.dives",), "{dive} is being read: wait to see whether it flew")
WRITES = Next(Task.WAIT, (), "the vehicle is being written to: wait for its answer")
OF_OTHERS: Final = {
    Task.VALIDATE: ("screen.dives", "dives.newest", "dives.validate"),
    Task.DIAGNOSE: ("screen.dives", "dives.newest", "dives.diagnose"),
}
"""Where the screens show another dive, the actions that begin with the dive meant."""


def next_of(campaign: Campaign) -> Next:
    """The thing to do now."""
    if campaign.lost:
        return LOST
    if campaign.writing:
        return WRITES
    if campaign.flying:
        return FLYING
    if campaign.working:
        return Next(Task.WAIT, (f"screen.{campaign.working}",), f"{campaign.working} is at work: wait for it")
    if campaign.over and campaign.recording:
        return END
    if not campaign.vehicle:
        return VEHICLE
    if not campaign.dive:
        return _with_dive(_to_dive(campaign), campaign)
    if campaign.halfway:
        return _to_vehicle(campaign, HALFWAY)
    if campaign.uploaded:
        return _with_dive(_after_upload(campaign), campaign)
    if campaign.identified and campaign.taken_back:
        return _to_vehicle(campaign, TAKEN_BACK)
    if campaign.identified:
        return _to_vehicle(campaign, ACCEPT if campaign.accepts else UPLOAD)
    if campaign.lacking and campaign.told is not None:
        return _dive_more(campaign)
    return _with_dive(IDENTIFY, campaign)


def lowered_to(campaign: Campaign) -> tuple[Mode | None, str]:
    """The mode to which the feed-forward may be lowered now, short of off; or None and the reason."""
    mode, why = _ordered(campaign)
    if mode is None or mode.applies_feedforward:
        return (Mode.SHADOW if mode is not None else None), why
    return None, f"the feed-forward does not act, in {mode.word}"


def raised_to(campaign: Campaign) -> tuple[Mode | None, str]:
    """The mode to which the feed-forward may be raised now, or None and the reason."""
    mode, why = _ordered(campaign)
    if mode is None:
        return None, why
    if mode is Mode.OFF:
        return Mode.SHADOW, ""
    if mode is not Mode.SHADOW:
        return None, f"the feed-forward acts already, in {mode.word}"
    if campaign.gate is None:
        return (
            None,
            "no dive in shadow since the upload was validated as a GO: fly a minute, then validate it",
        )
    dive, go = campaign.gate
    return (Mode.BOTH, "") if go else (None, f"{dive} is a NO-GO; Validate says why")


def raising_words(campaign: Campaign, key: str) -> str:
    """What the key that raises would do about a dive that is a GO in shadow: it goes by `raised_to` as well."""
    mode, why = raised_to(campaign)
    return f"{key} raises it to {mode.word}." if mode is not None else f"{key} does not raise it now: {why}."


def _ordered(campaign: Campaign) -> tuple[Mode | None, str]:
    """The vehicle's mode, if an order may go to it; else None and the reason."""
    mode = BY_WORD.get(campaign.mode)
    if campaign.contested:
        return None, "two vehicles share its address, and both would obey"
    if mode is None or not campaign.heard:
        return None, "the vehicle tells no mode of its feed-forward"
    if not campaign.recording:
        return None, "the order goes by the recording, and none runs"
    return mode, ""


def _to_dive(campaign: Campaign) -> Next:
    if not campaign.recording:
        return _to_vehicle(campaign, RECORD)
    if not campaign.heard:
        return SWITCH_ON
    return CALIBRATE if campaign.flies else DIVE


def _after_upload(campaign: Campaign) -> Next:
    acts = campaign.mode in (Mode.ALONE.word, Mode.BOTH.word)
    if campaign.since and not campaign.flown:
        return READS if campaign.reading and campaign.told is None else VALIDATE
    if campaign.since and campaign.go is False and campaign.flown == Mode.SHADOW.word:
        return LOOK if not campaign.verdict else LOOK_CLOSER
    if campaign.since and campaign.flown in (Mode.ALONE.word, Mode.BOTH.word):
        return _diagnosed(campaign)
    if acts:
        return _to_vehicle(campaign, FLY)
    if campaign.mode == Mode.SHADOW.word:
        return TO_BOTH if raised_to(campaign)[0] is Mode.BOTH else _to_vehicle(campaign, FLY_SHADOW)
    if campaign.gate is not None and campaign.gate[1]:
        return _to_vehicle(campaign, TO_SHADOW if campaign.mode == Mode.OFF.word else TO_BOTH)
    return _to_vehicle(campaign, TO_SHADOW)


def _diagnosed(campaign: Campaign) -> Next:
    if campaign.go is False and lowered_to(campaign)[0] is not None:
        return LOWER
    if not campaign.verdict:
        return MENDS if campaign.go is False else DIAGNOSE
    return NOTHING_LEFT if campaign.verdict == "no_gap" else LOOK_CLOSER


def _to_vehicle(campaign: Campaign, then: Next) -> Next:
    """`then`, once the vehicle is there and recorded."""
    if campaign.contested:
        return Next(
            then.task, ("screen.watch",), f"two vehicles share an address: part them; then: {then.words}"
        )
    if campaign.heard or (then is RECORD and campaign.linked):
        return _to_recording(campaign, then)
    if not campaign.linked and not campaign.recording:
        return CONNECT
    if campaign.recording:
        return Next(then.task, then.actions, f"not heard, switch it on or mend the link; then: {then.words}")
    return _to_recording(campaign, then)


def _to_recording(campaign: Campaign, then: Next) -> Next:
    """`then`, once it is recorded."""
    if campaign.recording or then is RECORD:
        return then
    return Next(Task.RECORD, RECORD.actions, f"record it; then: {then.words}")


def _dive_more(campaign: Campaign) -> Next:
    axes = " and ".join(dict.fromkeys(AXES[name[-1]] for name in campaign.lacking if name[-1] in AXES))
    words = f"{', '.join(campaign.lacking)} not told by {campaign.dive}: "
    if campaign.flies and campaign.heard and campaign.recording:
        return Next(
            Task.DIVE_MORE, ("screen.fly", "fly.plan"), f"{words}let it fly {axes} by itself, or dive by hand"
        )
    actions = ("recording.next",) if campaign.recording else ("recording.begin",)
    return Next(Task.DIVE_MORE, actions, f"{words}dive {axes} there and back at two speeds")


def _with_dive(step: Next, campaign: Campaign) -> Next:
    actions = step.actions if campaign.shown else OF_OTHERS.get(step.task, step.actions)
    return Next(step.task, actions, step.words.format(dive=campaign.dive))
