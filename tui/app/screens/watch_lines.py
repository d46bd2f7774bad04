"""What Watch shows as text: links and sensors, thrusters, drift of the model, messages, and the bar of a replay."""

import math
import textwrap
from typing import Final

from bridge.vehicle.coefficients import DOFS
from gcs_plugin.monitor.gap import AxisGap, Gap, in_units
from gcs_plugin.monitor.gap import worst as worst_axis
from gcs_plugin.watch.picture import Condition, Freshness, Kind, LinkRow, Said, SensorRow, ThrusterRow
from tui.app.drawing import (
    NOTHING,
    Line,
    Lines,
    Role,
    Span,
    age,
    ago,
    apart,
    cut,
    heading,
    number,
    stopwatch,
    utc,
    width,
    wrapped,
)
from tui.app.view import STALE_S, Replayed

WIDE: Final = 50
LEAST_NAME, WITHOUT_NAME = 18, 37
"""Cells of a thruster's name on a wide row at least, and those that its number, bar and readings take."""
NAME_CELLS: Final = 17
AXIS_CELLS: Final = 19  # of an axis with its drift and floor
RATE_AND_AGE: Final = 17  # cells of a narrow row after its name
MARKS: Final[dict[Condition, Span]] = {
    Condition.OK: ("●", "quiet"),
    Condition.DEGRADED: ("◐", "warn"),
    Condition.BAD: ("▲", "bad"),
    Condition.MISSING: ("○", "bad"),
    Condition.AWAITED: ("○", "quiet"),
}
ERROR, WARNING = 3, 4
PAST: Final = "(past)"
"""In place of a severity: an old warning is none."""
NEUTRAL_US, FULL_US = 1500.0, 400.0


def sensors(links: tuple[LinkRow, ...], rows: tuple[SensorRow, ...], cells: int) -> Lines:
    """Links, then sensors. A fault replaces rate and age, or gets a line of its own if it is long."""
    names = [_link_name(link) for link in links] + [row.name for row in rows]
    name_cells = min(max((len(name) for name in names), default=0), NAME_CELLS, max(cells - RATE_AND_AGE, 1))
    lines: list[Line] = []
    for link in links:
        lines += _link(link, name_cells, cells)
    for row in rows:
        lines += _sensor(row, name_cells, cells)
    return tuple(lines)


def unset_lines(unset: tuple[Kind, ...], cells: int) -> Lines:
    """Which alarms are switched off, so that nobody relies on them, and what sets them; no line for none."""
    kinds = ", ".join(kind.value for kind in unset)
    return wrapped(f"no alarm set: {kinds} (alarms.yaml)", "quiet", cells) if unset else ()


def _link_name(link: LinkRow) -> str:
    return f"link {link.system}/{link.component}"


def _link(link: LinkRow, name_cells: int, cells: int) -> Lines:
    condition = Condition.BAD if link.lost else Condition.OK
    head = _head(condition, _link_name(link), "plain", name_cells, cells)
    if link.lost:
        heard = f"heard {ago(link.age_s)}" if math.isfinite(link.age_s) else "never heard"
        return _with_words(head, f"lost, {heard}", "bad", cells)
    return (_with_rate(head, link.rate_hz, math.nan, link.age_s, cells),)


def _sensor(row: SensorRow, name_cells: int, cells: int) -> Lines:
    fresh = row.freshness is Freshness.FRESH
    head = _head(row.condition, row.name, "plain" if fresh else "stale", name_cells, cells)
    if row.freshness is Freshness.GONE:
        unheard = "not heard yet" if row.condition is Condition.AWAITED else "never heard"
        heard = ago(row.age_s) if math.isfinite(row.age_s) else unheard
        forms = (f"{NOTHING} {row.words}" if row.words else "", f"{NOTHING} {heard}")
        room = cells - width(head)
        return _with_words(
            head, next((form for form in forms if 0 < len(form) < room), heard), "stale", cells
        )
    if not fresh:
        return _with_words(head, ", ".join(filter(None, (ago(row.age_s), row.words))), "stale", cells)
    if row.words:
        return _with_words(head, row.words, MARKS[row.condition][1], cells)
    return (_with_rate(head, row.rate_hz, row.expected_hz, row.age_s, cells),)


def _head(condition: Condition, name: str, role: Role, name_cells: int, cells: int) -> Line:
    mark = MARKS[condition]
    word: Line = ((f" {condition.value:<8}", mark[1]),) if cells >= WIDE else ()
    return (mark, *word, (f" {cut(name, name_cells):<{name_cells}}", role))


def _with_rate(head: Line, rate_hz: float, expected_hz: float, age_s: float, cells: int) -> Line:
    """Rate and age; with the least rate expected, if it fits."""
    rate, old = number(rate_hz, 1), age(age_s)
    if cells < WIDE:
        return apart(head, ((rate, "plain"), (" Hz", "quiet"), (f"{old:>6}", "plain")), cells)
    unit = f" / {expected_hz:.0f} Hz" if math.isfinite(expected_hz) else " Hz"
    return (*head, (f"{rate:>{15 - len(unit)}}", "plain"), (unit, "quiet"), (f"{old:>8}", "plain"))


def _with_words(head: Line, words: str, role: Role, cells: int) -> Lines:
    if len(words) < cells - width(head):
        return ((*head, (f" {words}", role)),)
    return (head, (("    ", "plain"), (cut(words, cells - 4), role)))


def thrusters_heading(configuration: str, cells: int) -> Line:
    """Heading of the thrusters, with the pulses' unit if the rows are too narrow for it."""
    return heading("THRUSTERS" if cells >= WIDE else "THRUSTERS, µs", configuration, cells)


def thrusters(rows: tuple[ThrusterRow, ...], cells: int) -> Lines:
    """A signed bar per thruster, zero at the neutral pulse; in two columns on a narrow screen."""
    if not rows:
        return ((("none heard", "quiet"),),)
    if cells >= WIDE:
        longest = max(len(row.name) for row in rows)
        name_cells = min(longest, max(cells - WITHOUT_NAME, LEAST_NAME))
        return tuple(_wide_thruster(row, name_cells, cells) for row in rows)
    each = cells // 2
    below = (len(rows) + 1) // 2
    return tuple(
        tuple(span for row in rows[n::below] for span in _narrow_thruster(row, each)) for n in range(below)
    )


def _narrow_thruster(row: ThrusterRow, cells: int) -> Line:
    role, value = _reading(row, row.pwm_us, "strong")
    bar = signed_bar(row.pwm_us, (cells - 10) // 2)
    line: Line = ((f"{row.number:>2} ", "quiet"), *_coloured(bar, row), (f"{value:>5}", role))
    return (*line, (" " * (cells - width(line)), "plain"))


def _wide_thruster(row: ThrusterRow, name_cells: int, cells: int) -> Line:
    role, pulse = _reading(row, row.pwm_us, "strong")
    _, speed = _reading(row, row.rpm, "plain")
    name = row.name if row.name != str(row.number) else ""
    head: Line = (
        (f"{row.number:>2} ", "quiet"),
        (f"{cut(name, name_cells):<{name_cells}} " if name else "", "plain"),
    )
    tail: Line = ((f"{pulse:>6}", role), (" µs", "quiet"), (f"{speed:>7}", role), (" rpm", "quiet"))
    if row.freshness is not Freshness.FRESH:
        tail = ((f"{pulse:>6}", role), (f" {ago(row.age_s):<13}", "stale"))
    return (
        *head,
        *_coloured(signed_bar(row.pwm_us, (cells - width(head) - width(tail) - 1) // 2), row),
        *tail,
    )


def _reading(row: ThrusterRow, value: float, role: Role) -> tuple[Role, str]:
    if row.freshness is Freshness.GONE:
        return "stale", NOTHING
    return role if row.freshness is Freshness.FRESH else "stale", number(value, 0)


def _coloured(bar: str, row: ThrusterRow) -> Line:
    middle = len(bar) // 2
    role: Role = "accent" if row.freshness is Freshness.FRESH else "faded"
    if row.freshness is Freshness.GONE:
        bar = " " * middle + "│" + " " * middle
    return ((bar[:middle], role), ("│", "rule"), (bar[middle + 1 :], role))


def signed_bar(pwm_us: float, half: int) -> str:
    """A bar in half cells from the middle of 2 `half` + 1 cells, to the right for pulses above neutral."""
    share = (pwm_us - NEUTRAL_US) / FULL_US if math.isfinite(pwm_us) else 0.0
    halves = min(round(abs(share) * 2 * half), 2 * half)
    full, odd = divmod(halves, 2)
    if share >= 0:
        side = ("█" * full + "▌" * odd).ljust(half)
        return " " * half + "│" + side
    side = ("▐" * odd + "█" * full).rjust(half)
    return side + "│" + " " * half


def gap_lines(gap: Gap | None, lacks: str, cells: int, silent_s: float = 0.0) -> Lines:
    """How far the vehicle is off its model, and the floor of that: every axis on a wide screen, else the worst; or why
    it isn't compared. `silent_s`: the vehicle's, which dates it."""
    if silent_s > STALE_S and gap is not None:
        return (heading("MODEL", f"last compared {ago(silent_s)}", cells),)
    if gap is None:
        return (heading("MODEL", "not compared", cells), *wrapped(lacks, "quiet", cells)) if lacks else ()
    axis = worst_axis(gap)
    if axis is None:
        return (heading("MODEL", f"its floor is learnt, {gap.learns_s:.0f} s", cells),)
    if cells < 3 * AXIS_CELLS:
        drift, floor, unit = in_units(axis)
        return (heading("MODEL", f"{DOFS[axis.dof]} {drift}, floor {floor} {unit}", cells),)
    rows = [tuple(axis for axis in gap.axes if axis.dof in dofs) for dofs in (range(3), range(3, 6))]
    return (
        heading("MODEL", "off in 5 s / floor, mm/s and deg/s", cells),
        *(tuple(span for axis in row for span in _axis_gap(axis, cells // 3)) for row in rows if row),
    )


def _axis_gap(axis: AxisGap, cells: int) -> Line:
    drift, floor, _ = in_units(axis)
    line: Line = (
        (f"{DOFS[axis.dof]:<6}", "plain"),
        (f"{drift:>6}", "bad" if axis.high else "strong"),
        (f" /{floor:>5}", "quiet"),
    )
    return (*line, (" " * (cells - width(line)), "plain"))


def words(said: tuple[Said, ...], cells: int) -> Lines:
    """The vehicle's messages, the newest first, with the severity as a word."""
    if not said:
        return ((("nothing said", "quiet"),),)
    return tuple(line for message in reversed(said) for line in _message(message, cells))


def _message(message: Said, cells: int) -> Lines:
    role: Role = "bad" if message.severity <= ERROR else "warn" if message.severity == WARNING else "plain"
    if message.past:
        role = "quiet"
    severity = PAST if message.past else message.severity_word.upper()
    head: Line = (
        (f"{utc(message.utc_s)} ", "quiet"),
        (f"{severity:<10}", "quiet" if role == "plain" else role),
    )
    first, *further = textwrap.wrap(
        message.text, cells, initial_indent=" " * width(head), subsequent_indent="  "
    ) or [""]
    return ((*head, (first[width(head) :], role)), *(((line, role),) for line in further))


def worst(said: tuple[Said, ...]) -> str:
    """Number of errors and warnings since the vehicle last started: `1 error, 2 warnings`."""
    present = [message.severity for message in said if not message.past]
    errors, warnings = sum(severity <= ERROR for severity in present), present.count(WARNING)
    counts = ((errors, "error"), (warnings, "warning"))
    return ", ".join(f"{count} {name}{'s' * (count > 1)}" for count, name in counts if count)


def replay_line(replayed: Replayed, cells: int) -> Line:
    """The line that marks the lines below it as a replay and not the live vehicle."""
    clock = f"{stopwatch(replayed.at_s)} of {stopwatch(replayed.length_s)}"
    speed = "  PAUSED" if replayed.paused else f"  {replayed.speed:g}x"
    left, right = f" REPLAY {replayed.name}", f"{clock}{speed:<8} "
    live = "  only the lines above are live"
    if len(left) + len(live) + len(right) + 2 <= cells:
        left += live
    left = cut(left, max(cells - len(right) - 2, 0))
    return ((f"{left}{right:>{max(cells - len(left), 0)}}", "lost"),)
