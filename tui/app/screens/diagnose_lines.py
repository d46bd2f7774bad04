"""A diagnosis as lines: where the gap lies, its causes, how far it shrinks, and the next dive."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from bridge.vehicle.coefficients import DOFS
from identify.diagnose.verdict import LIKELY
from identify.words import significant
from tui.app.drawing import NOTHING, Line, Lines, Role, apart, bar, cut, number, wrapped
from tui.app.jobs import real

PHASES: Final = {
    "rest": "at rest",
    "accelerating": "speeds up",
    "decelerating": "slows",
    "steady": "steady",
    "turning": "turns",
    "reversing": "reverses",
}
VERDICTS: Final = {
    "no_gap": "No gap: nothing but noise is between model and recording.",
    "explained": "The gap is explained.",
    "partly": "Part of the gap is explained, and something is left that no candidate explains.",
    "ambiguous": "A cause is one of several that this dive can't tell apart.",
    "unknown": "Something is there that no candidate explains.",
}

SHADES: Final = ((0.3, "█"), (0.1, "▓"), (0.03, "▒"), (0.005, "░"))
"""Shade of a cell by its least share of the gap; below the last share it is blank."""
SHADE_CELLS, SHARE_CELLS, WIDEST_CELLS = 4, 5, 15
FORCE: Final = "   missing force"
NAME_CELLS: Final = 7
FORCE_FROM: Final = 104
BAR_CELLS: Final = 24
MOST_TRIED: Final = 6
SLIVER: Final = 0.01
LEAST_NATS: Final = 1.0
"""A candidate with less gain is not worth showing."""
MARKS: Final[dict[str, tuple[str, Role]]] = {
    "no_gap": ("● NO GAP", "strong"),
    "explained": ("● EXPLAINED", "strong"),
    "partly": ("◑ PARTLY", "warn"),
    "ambiguous": ("◐ AMBIGUOUS", "warn"),
    "unknown": ("▲ UNKNOWN", "bad"),
}


@dataclass(frozen=True)
class Cause:
    """A cause in words, accepted or possible; `gain_nats` is NaN if the file lacks it."""

    name: str
    probability: float
    gain_nats: float
    sentence: str
    alike: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class Tried:
    """A candidate that was not accepted; `why` explains the rejection of one with enough gain, "" for none."""

    name: str
    gain_nats: float
    why: str


@dataclass(frozen=True)
class AxisFall:
    """Drift over 5 s of a degree of freedom, m/s or rad/s, and the RMS error of its simulated velocity relative to
    the spread of the measured velocity; NaN if unknown.
    """

    dof: str
    before: float
    after: float
    floor: float
    nrmse_before: float
    nrmse_after: float
    nrmse_baseline: float


@dataclass(frozen=True)
class Fall:
    """Drift before and after in multiples of the noise floor, on the data named by `what`; `value` is the fraction of
    the closable gap that was closed. NaN if unknown. `axes`: the same by degree of freedom.
    """

    what: str
    before: float
    after: float
    floor: float
    value: float
    low95: float = math.nan
    high95: float = math.nan
    axes: tuple[AxisFall, ...] = ()


@dataclass(frozen=True)
class Answer:
    """`shares` of the squared gap by degree of freedom and phase; `force_n` is the missing force, N or N m;
    `disturbance` describes the disturbance in words.
    """

    dive: str
    check: str
    verdict: str
    sentence: str
    shares: Mapping[tuple[str, str], float]
    force_n: Mapping[str, float]
    causes: tuple[Cause, ...]
    tried: tuple[Tried, ...]
    falls: tuple[Fall, ...]
    disturbance: tuple[str, ...]
    character: tuple[str, ...]
    next: tuple[str, ...]
    notes: tuple[str, ...]


def answer(data: Any) -> Answer | None:
    """Parse a diagnosis from a JSON value; None if it is not a diagnosis."""
    try:
        return _answer(data)
    except (KeyError, TypeError, ValueError, AttributeError):
        return None


def _answer(data: Mapping[str, Any]) -> Answer:
    gap, wording = data["gap"], data.get("told") or {}
    words = wording.get("causes") or [{}] * len(data["effects"])
    more = data["next"] or {}
    dives = [more.get("manoeuvre"), more.get("sensor")]
    return Answer(
        dive=str(wording.get("dive", "")),
        check=str(wording.get("check", "")),
        verdict=str(data["verdict"]),
        sentence=str(wording.get("verdict") or VERDICTS[data["verdict"]]),
        shares={(str(entry["dof"]), str(entry["phase"])): float(entry["share"]) for entry in gap["where"]},
        force_n={dof: real(force) for dof, force in (gap.get("force") or {}).items() if dof in DOFS},
        causes=tuple(_parsed_cause(*both) for both in zip(data["effects"], words, strict=True)),
        tried=tuple(
            Tried(str(entry["name"]), float(entry["gain_nats"]), str(entry["why"]))
            for entry in wording.get("tried", ())
        ),
        falls=tuple(_falls(gap, data["shrink"], wording)),
        disturbance=tuple(map(str, wording.get("disturbance", ()))),
        character=tuple(map(str, wording.get("character", ()))),
        next=tuple(map(str, wording.get("next") or filter(None, dives))),
        notes=tuple(map(str, wording.get("notes", ()))),
    )


def _parsed_cause(effect: Mapping[str, Any], words: Mapping[str, Any]) -> Cause:
    plain = str(effect["name"]).replace("_", " ")
    values = [f"{name} {_interval(entry)}" for name, entry in effect["parameters"].items()]
    alike = ", ".join(str(entry).replace("_", " ") for entry in effect["also"])
    return Cause(
        str(words.get("name", plain)),
        float(effect["probability"]),
        real(words.get("gain_nats")),
        str(words.get("sentence", "")),
        str(words.get("alike") or (f"This dive can't tell it from {alike}." if alike else "")),
        tuple(map(str, words.get("values", values))),
    )


def _falls(gap: Mapping[str, Any], shrink: Mapping[str, Any], wording: Mapping[str, Any]) -> list[Fall]:
    """Shrinkage on the dive itself, on held-out pieces, and on the check dive."""
    held, sides = shrink["heldout"], wording.get("heldout") or {}
    falls = [Fall("this dive", real(gap["before"]), real(wording.get("after")), 1.0, math.nan)]
    if held is not None:
        ends = (real(sides.get("before")), real(sides.get("after")), 1.0)
        value, low95, high95 = (real(held.get(key)) for key in ("value", "low95", "high95"))
        falls.append(Fall("pieces held out", *ends, value, low95, high95, _axes(sides)))
    check = shrink["check"]
    if check is not None:
        name = wording.get("check")
        name_of_data = f"check dive {name}" if name else "check dive"
        before, after, floor, value = (real(check.get(key)) for key in ("before", "after", "floor", "value"))
        falls.append(Fall(name_of_data, before, after, floor, value, axes=_axes(check)))
    return falls


def _axes(data: Mapping[str, Any]) -> tuple[AxisFall, ...]:
    keys = ("before", "after", "floor", "nrmse_before", "nrmse_after", "nrmse_baseline")
    per_axis = data.get("by_axis") or {}
    return tuple(
        AxisFall(dof, *(real(per_axis[dof].get(key)) for key in keys)) for dof in DOFS if dof in per_axis
    )


def _interval(value: Mapping[str, Any]) -> str:
    ends = value["low95"], value["high95"]
    interval = "" if None in ends else f" (95 %: {ends[0]:.3g} to {ends[1]:.3g})"
    return f"{value['value']:.3g} {value['unit']}{interval}"


def verdict(answer: Answer, cells: int) -> Lines:
    """The verdict as a mark and a word, then the sentence."""
    text, role = MARKS.get(answer.verdict, (answer.verdict, "plain"))
    about = f"{answer.dive}, checked on {answer.check}" if answer.check else answer.dive
    head = apart(((f" {text} ", role),), ((cut(about, cells - len(text) - 3), "quiet"),), cells)
    return (head, *wrapped(answer.sentence, "strong", cells))


def where(answer: Answer, cells: int) -> Lines:
    """Map of the gap: degrees of freedom against the vehicle's phases of motion. Each cell is shaded and shows its
    share of the squared gap in per cent; sums stand below and at the right, and the missing force if it fits.
    """
    known = [dof for dof in DOFS if dof in answer.force_n or any(name == dof for name, _ in answer.shares)]
    with_force = cells >= FORCE_FROM
    room = cells - NAME_CELLS - 1 - (len(FORCE) if with_force else 0)
    width = min(room // (len(PHASES) + 1), WIDEST_CELLS)
    head = f"{'':<{NAME_CELLS}}" + "".join(f"{words:>{width}}" for words in (*PHASES.values(), "all"))
    lines: list[Line] = [((head + (FORCE if with_force else ""), "quiet"),)]
    for dof in known:
        shares = [answer.shares.get((dof, phase), 0.0) for phase in PHASES]
        line: Line = ((f"{dof:<{NAME_CELLS}}", "plain"),)
        for share in shares:
            line = (*line, *_cell(share, width))
        line = (*line, (f"{_percent(sum(shares)):>{width}}", "strong"))
        if with_force:
            unit = "N" if dof in DOFS[:3] else "N m"
            force = number(answer.force_n.get(dof, math.nan), 2)
            line = (*line, (f"{force:>12}", "plain"), (f" {unit}", "quiet"))
        lines.append(line)
    sums = [sum(answer.shares.get((dof, phase), 0.0) for dof in known) for phase in PHASES]
    foot = "".join(f"{_percent(total):>{width}}" for total in sums)
    lines.append(((f"{'all':<{NAME_CELLS}}", "quiet"), (foot, "strong")))
    if answer.verdict == "no_gap":
        lines.append((("there is no gap: these are shares of noise", "warn"),))
    for sentence in answer.disturbance:
        lines += wrapped(sentence, "quiet", cells)
    return tuple(lines)


def _cell(share: float, width: int) -> Line:
    mark = next((shade for least, shade in SHADES if share >= least), " ")
    dark = mark in "█▓"
    number = f"{_percent(share):>{SHARE_CELLS}}"
    blank = " " * (width - SHADE_CELLS - SHARE_CELLS)
    return (
        (blank, "plain"),
        (mark * SHADE_CELLS, "accent" if dark else "faded"),
        (number, "strong" if dark else "plain" if mark != " " else "quiet"),
    )


def _percent(share: float) -> str:
    """`78 %`, `<1 %`, `·` for none."""
    if share <= 0:
        return "·"
    return f"{100 * share:.0f} %" if share >= 0.005 else "<1 %"


def which(answer: Answer, cells: int) -> Lines:
    """Accepted causes, the strongest first, then possible causes, then rejected candidates with some gain."""
    tried = [cause for cause in answer.tried if cause.gain_nats >= LEAST_NATS][:MOST_TRIED]
    nats = [cause.gain_nats for cause in answer.causes] + [cause.gain_nats for cause in tried]
    most = max(filter(math.isfinite, nats), default=LEAST_NATS)
    likely = [cause for cause in answer.causes if cause.probability >= LIKELY]
    possible = [cause for cause in answer.causes if cause.probability < LIKELY]
    columns: Line = (("evidence on held-out pieces  probable", "quiet"),)
    lines: list[Line] = []
    if likely:
        lines.append(apart((("cause", "quiet"),), columns, cells))
    for place, cause in enumerate(likely, 1):
        lines += _cause(place, cause, most, cells, "accent")
    if not likely:
        lines += wrapped("No candidate of the library is accepted as a cause.", "plain", cells)
    if possible:
        lines += [(), apart((("possible, not accepted", "warn"),), columns, cells)]
    for place, cause in enumerate(possible, len(likely) + 1):
        lines += _cause(place, cause, most, cells, "faded")
    for line in answer.character:
        lines += wrapped(line, "warn", cells)
    if tried:
        lines += [(), (("tried as well, and not accepted", "quiet"),)]
        lines += [_tried(cause, most, cells) for cause in tried]
    return tuple(lines)


def _cause(place: int, cause: Cause, most: float, cells: int, role: Role) -> Lines:
    probability = "over 99 %" if cause.probability >= 0.995 else f"{100 * cause.probability:.0f} %"
    head: Line = ((f"{place} ", "quiet"), (cut(cause.name, cells - 44), "strong"))
    evidence = _evidence(cause.gain_nats, most, role)
    lines: list[Line] = [apart(head, (*evidence, (f"{probability:>10}", "strong")), cells)]
    for value in cause.values:
        lines += wrapped(value, "accent", cells, "  ")
    lines += wrapped(cause.sentence, "plain", cells, "  ") if cause.sentence else ()
    lines += wrapped(cause.alike, "warn", cells, "  ") if cause.alike else ()
    return tuple(lines)


def _tried(cause: Tried, most: float, cells: int) -> Line:
    name = f"{cause.name}: {cause.why}" if cause.why else cause.name
    right: Line = (*_evidence(cause.gain_nats, most, "faded"), (" " * 10, "plain"))
    return apart((("  " + cut(name, cells - 41), "plain"),), right, cells)


def _evidence(nats: float, most: float, role: Role) -> Line:
    """Bar, on a logarithmic scale, and number of the gain on held-out pieces, nats."""
    if not math.isfinite(nats):
        return ((" " * (BAR_CELLS - 8), role), ("evidence " + NOTHING, "quiet"))
    share = math.log1p(max(nats, 0.0)) / math.log1p(max(most, LEAST_NATS))
    return ((bar(max(share, SLIVER), BAR_CELLS - 8), role), (f"{number(nats, 0):>6} nats", "quiet"))


def how_far(answer: Answer, cells: int) -> Lines:
    """Bars in noise floors of the drift before, after and by noise alone: the dive, held-out pieces, check dive."""
    drifts = [
        drift
        for fall in answer.falls
        for drift in (fall.before, fall.after, fall.floor)
        if math.isfinite(drift)
    ]
    most = max(drifts, default=1.0)
    lines: list[Line] = []
    axes = next((fall for fall in reversed(answer.falls) if fall.axes), None)
    if axes is not None:
        lines += _by_axis(axes)
    lines.append((("drift of the model over 5 s, in floors: 1 is what noise alone gives", "quiet"),))
    for fall in answer.falls:
        lines += _fall(fall, most, cells)
    return tuple(lines)


def _by_axis(fall: Fall) -> Lines:
    """A row per degree of freedom: drift in its own unit, and errors next to those of a plain fit."""
    head = (
        f"{'':<{NAME_CELLS}}{'before':>9}{'after':>9}{'noise':>9}      {'NRMSE':>6}{'':>8}{'plain fit':>11}"
    )
    return (
        ((f"{fall.what}: drift over 5 s by degree of freedom", "strong"),),
        ((head, "quiet"),),
        *(_axis(axis) for axis in fall.axes),
        (),
    )


def _axis(axis: AxisFall) -> Line:
    turning = axis.dof not in DOFS[:3]
    scale, unit = (math.degrees(1.0), "°/s") if turning else (1e3, "mm/s")
    before, after, floor = (significant(scale * value, 2) for value in (axis.before, axis.after, axis.floor))
    errors = f"{number(axis.nrmse_before, 2)} to {number(axis.nrmse_after, 2)}"
    return (
        (f"{axis.dof:<{NAME_CELLS}}{before:>9}", "plain"),
        (f"{after:>9}", "accent"),
        (f"{floor:>9} {unit:<5}", "quiet"),
        (f"{errors:>14}{number(axis.nrmse_baseline, 2):>11}", "plain"),
    )


def _fall(fall: Fall, most: float, cells: int) -> Lines:
    closed = ""
    if math.isfinite(fall.value):
        has_interval = math.isfinite(fall.high95 - fall.low95)
        ends = f" ({100 * fall.low95:.0f} to {100 * fall.high95:.0f} %)" if has_interval else ""
        closed = f"{100 * fall.value:.0f} %{ends} of what can be closed"
    rows: list[tuple[str, float, Role]] = [
        ("before", fall.before, "plain"),
        ("after", fall.after, "accent"),
        ("floor", fall.floor, "faded"),
    ]
    lines: list[Line] = [apart(((fall.what, "strong"),), ((closed, "plain"),), cells)]
    for word, value, role in rows:
        if math.isfinite(value) and math.isfinite(fall.before):
            drawn = bar(max(value / most, SLIVER), cells - 20)
            lines.append(((f"  {word:<7}", "quiet"), (f"{_floors(value):>8}  ", "strong"), (drawn, role)))
    return tuple(lines)


def _floors(value: float) -> str:
    return number(value, 2 if value < 100 else 0)


def what_next(answer: Answer, cells: int) -> Lines:
    """The next dive to make, and notes on this dive."""
    lines: list[Line] = []
    for sentence in answer.next or ("Nothing is left to split: dive on.",):
        lines += wrapped(sentence, "strong", cells)
    for note in answer.notes:
        lines += wrapped(note, "quiet", cells)
    return tuple(lines)
