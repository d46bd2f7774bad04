"""The lines on top of every screen: armed state, link, recording, feed-forward; then the screens, and UTC."""

import math
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeVar

from bridge.vehicle.mode import word_of
from gcs_plugin.feedforward.switched_vehicle import sent_text
from gcs_plugin.recording.state import how_to_end
from gcs_plugin.watch.picture import Armed, LinkRow, Picture
from tui.app.drawing import Line, Lines, Role, Span, ago, apart, cut, left, stopwatch, utc, width
from tui.app.view import GONE_S, STALE_S, Forcing, View

T = TypeVar("T")
SHORT_DISK_S: Final = 600.0
ENGINE_SILENT_S: Final = 3.0
RECORDER_SILENT_S: Final = 5.0
"""The recorder reports once a second, even on a stalled disk, and its report is checked once a second."""
FIRST_LOOK_S: Final = 5.0
"""A younger dive has not been checked yet: whether data arrives is unknown."""
PHONE: Final = 60
"""Cells below which a screen is a phone's, and its parts are stacked."""
ALARM_ROWS, ALARM_ROWS_OF_A_PHONE = 2, 4
APART: Final = ("  │  ", " │ ", "  ")
SHAPES: Final[dict[Armed, tuple[str, Role]]] = {
    Armed.UNKNOWN: (" ? ARMED STATE UNKNOWN ", "lost"),
    Armed.DISARMED: (" □ DISARMED ", "plain"),
    Armed.ARMED: (" ■ ARMED ", "armed"),
    Armed.FAILSAFE: (" ▲ FAILSAFE ", "failsafe"),
}


@dataclass(frozen=True)
class Piece:
    """A part of the first line in its forms, the longest first. Where room is short, a piece of lower `weight` takes a
    shorter form before one of higher weight does."""

    weight: int
    role: Role
    forms: tuple[str, ...]


VIEW_ONLY: Final = Piece(10, "lost", (" VIEW ONLY ",))
OVER: Final = Piece(9, "strong", ("DIVE OVER",))
WAITS: Final = Piece(9, "plain", ("no vehicle heard yet", "no vehicle yet"))
NOT_RECORDED: Final = Piece(7, "plain", ("nothing is recorded", "not recorded"))


@dataclass(frozen=True)
class Tab:
    """A screen's key and title."""

    key: str
    title: str
    shown: bool


def header(view: View, tabs: Sequence[Tab], cells: int) -> Lines:
    """The two lines, more of them on a phone, and one or two for an alert that must not be overlooked."""
    clock: Line = ((f"{utc(view.unix_s)} UTC ", "quiet"),)
    *above, last = (fit(line, cells) for line in _stacked(pieces(view), cells))
    with_clock = apart(last, clock, cells)
    fits = len(with_clock) > len(last)
    *other_tabs, tab_line = map(_tabs, _tab_rows(tabs, cells))
    loud: tuple[Span, ...] = (
        *((alarm, "failsafe") for alarm in _alarms(view, cells - 2)),
        *((piece, "lost") for piece in _at_most_rows(_alert(view), cells - 2)),
    )
    below: Lines = tuple(((f" {text:<{cells - 2}} ", role),) for text, role in loud)
    under = (*other_tabs, tab_line if fits else apart(tab_line, clock, cells))
    return (*above, with_clock, *under, *below)


def _stacked(parts: Sequence[Piece], cells: int) -> list[list[Piece]]:
    """The parts by line: all in one, or on a phone as many in each as fit in their longest forms."""
    return [list(parts)] if cells >= PHONE else _rows(parts, cells, lambda part: len(part.forms[0]) + 2)


def _tab_rows(tabs: Sequence[Tab], cells: int) -> list[list[Tab]]:
    return _rows(tabs, cells, lambda tab: width(_tabs((tab,))))


def _rows(parts: Sequence[T], cells: int, needed: Callable[[T], int]) -> list[list[T]]:
    """The parts in order, as many in each row as fit."""
    rows: list[list[T]] = [[]]
    for part in parts:
        if rows[-1] and sum(map(needed, rows[-1])) + needed(part) > cells:
            rows.append([])
        rows[-1].append(part)
    return rows


def _alarms(view: View, cells: int) -> tuple[str, ...]:
    """The gravest alarm with its causes, and how many others there are."""
    alarms = view.alarms
    if not alarms:
        return ()
    more = f" (and {len(alarms) - 1} more)" if len(alarms) > 1 else ""
    rows = ALARM_ROWS if cells >= PHONE else ALARM_ROWS_OF_A_PHONE
    *above, last = _at_most_rows(f"ALARM {alarms[0].words}", cells, rows)
    if len(last) + len(more) <= cells:
        return (*above, last + more)
    if len(above) + 1 < rows:
        return (*above, last, more.strip())
    return (*above, cut(last, cells - len(more)) + more)


def _at_most_rows(alert: str, cells: int, rows: int = 2) -> list[str]:
    """Break a sentence into at most that many rows, and cut the last if it does not fit."""
    lines = textwrap.wrap(alert, cells)
    return lines if len(lines) <= rows else [*lines[: rows - 1], cut(" ".join(lines[rows - 1 :]), cells)]


def pieces(view: View) -> tuple[Piece, ...]:
    """The parts of the first line."""
    picture = view.picture
    over = WAITS if view.waits else OVER
    heard = (over, *_armed_at_end(picture)) if view.over else (_armed(picture), _link(picture.links))
    seen = (*heard, _recording(view), _feedforward(view))
    return (VIEW_ONLY, *seen) if view.view_only else seen


def fit(parts: Sequence[Piece], cells: int) -> Line:
    """The parts side by side, with the widest gaps and the longest forms that fit."""
    chosen = [0] * len(parts)

    def texts() -> list[str]:
        return [part.forms[form] for part, form in zip(parts, chosen, strict=True)]

    def needed(apart: str) -> int:
        return sum(map(len, texts())) + len(apart) * (len(parts) - 1)

    order = sorted(range(len(parts)), key=lambda n: parts[n].weight)
    while needed(APART[-1]) > cells:
        shorter = [n for n in order if chosen[n] + 1 < len(parts[n].forms)]
        if not shorter:
            break
        chosen[shorter[0]] += 1
    for n in reversed(order):  # lengthen again where shortening gained nothing
        while chosen[n] and needed(APART[-1]) + _growth(parts[n], chosen[n]) <= cells:
            chosen[n] -= 1
    between = next((apart for apart in APART if needed(apart) <= cells), APART[-1])
    spans: list[Span] = []
    for part, text in zip(parts, texts(), strict=True):
        spans += [(between, "rule"), (text, part.role)]
    return tuple(spans[1:])


def _growth(part: Piece, form: int) -> int:
    """Extra cells that the next longer form needs."""
    return len(part.forms[form - 1]) - len(part.forms[form])


def _armed(picture: Picture) -> Piece:
    age_s = picture.armed_age_s
    text, role = SHAPES[picture.armed]
    if picture.armed is Armed.UNKNOWN or age_s <= STALE_S:
        return Piece(9, role, (text,) if picture.armed is not Armed.UNKNOWN else (text, " ? UNKNOWN "))
    word = picture.armed.value
    return Piece(9, "lost", (f" ? was {word}, {ago(age_s)} ", f" ? was {word} "))


def _armed_at_end(picture: Picture) -> tuple[Piece, ...]:
    """How a vehicle that nobody hears any more was when it was last heard; nothing if it was disarmed."""
    is_known = picture.armed in (Armed.ARMED, Armed.FAILSAFE) and picture.armed_age_s > STALE_S
    return (replace(_armed(picture), role="strong"),) if is_known else ()


def _link(links: tuple[LinkRow, ...]) -> Piece:
    if not links:
        return Piece(8, "lost", (" NO LINK ",))
    link = links[0]
    age_s = link.age_s
    if age_s == math.inf and not link.lost:
        return Piece(8, "plain", ("LINK, no HEARTBEAT yet", "LINK"))
    if link.lost or age_s > STALE_S:
        seconds = f"{age_s:.0f} s" if math.isfinite(age_s) else "never heard"
        return Piece(8, "lost", (f" LINK LOST {seconds} ", " LINK LOST "))
    address = f"sys {link.system}/{link.component}"
    losses = (row.loss for row in links if row.system == link.system and row.name == link.name)
    share = next((loss for loss in losses if math.isfinite(loss)), math.nan)
    if math.isnan(share):
        return Piece(8, "plain", (f"LINK {age_s:.1f} s  {address}", f"LINK {age_s:.1f} s"))
    loss = f"loss {100 * share:.0f} %"
    return Piece(
        8,
        "plain",
        (f"LINK {age_s:.1f} s  {loss}  {address}", f"LINK {age_s:.1f} s  {loss}", f"LINK {age_s:.1f} s"),
    )


def _recording(view: View) -> Piece:
    recording = view.recording
    if recording is None:
        return NOT_RECORDED if view.over else Piece(7, "lost", (" NOT RECORDING ", " NOT REC "))
    silent_s = view.recorder_silent_s
    if silent_s > RECORDER_SILENT_S:
        return Piece(
            11, "lost", (f" NOT RECORDING? silent {silent_s:.0f} s ", f" NOT REC? {silent_s:.0f} s ")
        )
    lasted_s = recording.lasted_s(view.unix_s)
    clock = f"REC {stopwatch(lasted_s)}"
    if recording.unwritten:
        return Piece(11, "lost", (f" {clock}  NOT WRITTEN ", " NOT WRITTEN "))
    if not math.isfinite(recording.disk_left_s):
        nothing = (f"{clock}  nothing comes",) if lasted_s > FIRST_LOOK_S else ()
        return Piece(11, "plain", (*nothing, clock))
    lasts = left(recording.disk_left_s)
    if recording.disk_left_s < SHORT_DISK_S:
        return Piece(11, "lost", (f" {clock}  {lasts} ", f" REC {lasts} "))
    return Piece(11, "plain", (f"{clock}  {lasts}", f"{clock} {lasts}", f"REC {lasts}"))


def _feedforward(view: View) -> Piece:
    if view.forcing is not None:
        return _forced(view.forcing, view)
    mode, age_s = view.picture.ff_mode, view.picture.ff_mode_age_s
    if mode is None or age_s > GONE_S:
        return Piece(5, "quiet", ("FF --",))
    word = word_of(mode)
    if age_s > STALE_S:
        return Piece(5, "stale", (f"FF {word} {ago(age_s)}", "FF --"))
    return Piece(5, "plain", (f"FF {word}",))


def _forced(forcing: Forcing, view: View) -> Piece:
    """The off switch. Until all vehicles are off, the mode of the vehicle on screen stands before it.

    Even the shortest form says that the switch is not done: OFF alone would read as if it were. Orders handed to a
    silent recorder count as not sent: they have not left this computer.
    """
    picture = view.picture
    if forcing.done:
        return Piece(10, "strong", (f"FF OFF, {forcing.words}", "FF OFF, acknowledged", "FF OFF, done"))
    mode, age_s = picture.ff_mode, picture.ff_mode_age_s
    is_now = "FF --"
    if mode is not None and age_s <= GONE_S:
        is_now = f"FF {'was ' if age_s > STALE_S else ''}{word_of(mode)}"
    shown = picture.links[0].system if picture.links else None
    other_systems = [system for system in forcing.waits_for if system != shown]
    addressees = f" of {' and '.join(map(str, other_systems))}" if other_systems else ""
    if forcing.sent and view.recorder_silent_s <= RECORDER_SILENT_S:
        short = "not done"
        forms: tuple[str, ...] = (
            f": {forcing.words}",
            f"{addressees} {sent_text(forcing.sent)}, not confirmed",
            f"{addressees} not confirmed",
        )
    else:
        short = "not sent"
        forms = (
            f"{addressees} not sent, the recorder is silent"
            if forcing.sent
            else f"{addressees} not sent yet",
            f"{addressees} not sent",
        )
    long_forms = (
        *(f" {is_now}; OFF{form} " for form in forms),
        f"{is_now}; OFF{addressees} {short}",
        f"{is_now}; OFF {short}",
    )
    return Piece(10, "lost", (*long_forms, f"OFF {short}"))


def _tabs(tabs: Sequence[Tab]) -> Line:
    line: Line = ()
    for tab in tabs:
        label = f" {tab.key} {tab.title} "
        line = (*line, (label, "tab" if tab.shown else "quiet"))
    return line


def tab_at(view: View, tabs: Sequence[Tab], cells: int, x: int, y: int) -> Tab | None:
    """The tab under the cell (x, y) of the header, for a click; None if there is none."""
    rows = _tab_rows(tabs, cells)
    row = y - len(_stacked(pieces(view), cells))
    start = 0
    for tab in rows[row] if 0 <= row < len(rows) else ():
        start += width(_tabs((tab,)))
        if x < start:
            return tab
    return None


def _alert(view: View) -> str:
    """The gravest condition that must not be overlooked; "" for none."""
    if view.behind_s > ENGINE_SILENT_S:
        return f"nothing is read from the link since {view.behind_s:.0f} s: leave the app and start it again"
    if view.picture.twins or view.picture.wrong_file:
        return view.picture.twins or view.picture.wrong_file
    silent_s = view.recorder_silent_s
    if view.recording is not None and view.recorder_hangs:
        return f"the recorder hangs since {silent_s:.0f} s: {how_to_end(view.recording.pid)}"
    if silent_s > RECORDER_SILENT_S:
        return f"the recorder has not reported for {silent_s:.0f} s: it may have stopped writing"
    if view.recording is not None and view.recording.unwritten:
        frames = "1 frame waits" if view.recording.waiting == 1 else f"{view.recording.waiting} frames wait"
        return f"NOTHING IS WRITTEN, {frames} in memory: {view.recording.unwritten}"
    if view.recording is not None and view.recording.lost:
        return f"{view.recording.lost} frames are in no file of the dive: check the disk"
    if view.recording is None and view.over:
        return ""
    return view.trouble or (view.recording.trouble if view.recording else "")
