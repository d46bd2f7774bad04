"""Diagnose: the gap between model and recording, its causes, how far they shrink it, and the next dive."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar, Final

from bridge.errors import ConfigError
from bridge.schema import build
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.shrunk import LIKELY, AxisShrink, Shrink
from identify.words import significant
from tui.app.desk import ACCEPTABLE, DIAGNOSED, can_check
from tui.app.drawing import Line, Lines, Role, Span, apart, bar, cut, number, width, wrapped
from tui.app.header import Tab
from tui.app.jobs import Kept, newer, real
from tui.app.keys import LOOKS, Action, bindings
from tui.app.screens.on_dive import SectionScreen

JSON, REPORT, PARAM = DIAGNOSED, "diagnosis.html", ACCEPTABLE
PHASES: Final = {
    "rest": "at rest",
    "accelerating": "speeds up",
    "decelerating": "slows",
    "steady": "steady",
    "turning": "turns",
    "reversing": "reverses",
}
SHADES: Final = ((0.3, "█"), (0.1, "▓"), (0.03, "▒"), (0.005, "░"))
"""Shade of a cell by its least share of the gap; below the last share it is blank."""
SHADE_CELLS: Final = (4, 2, 0)
"""Cells of a shade, from the widest that fits."""
SHARE_CELLS, WIDEST_CELLS = 5, 15
LISTED_CELLS: Final = 27
FORCE: Final = "   missing force"
NAME_CELLS: Final = 7
FORCE_FROM: Final = 104
BAR_CELLS: Final = 16
MOST_TRIED: Final = 6
SLIVER: Final = 0.01
WITH_ERRORS: Final = 65
"""Cells from which the drift by degree of freedom has its errors beside it."""
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
    """The words of a cause, accepted or possible."""

    name: str
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
class Words:
    """What the diagnosis says in sentences, with the causes in the order of its effects."""

    dive: str
    check: str
    configuration: str
    verdict: str
    causes: tuple[Cause, ...]
    tried: tuple[Tried, ...]
    character: tuple[str, ...]
    next: tuple[str, ...]
    notes: tuple[str, ...]
    disturbance: tuple[str, ...] = ()


@dataclass(frozen=True)
class Answer:
    """`shares` of the squared gap by degree of freedom and phase; `force_n` is the missing force, N or N m;
    `probabilities` of the causes; `shrinks` of the drift by the data that it was measured on, NaN if unknown.
    """

    verdict: str
    shares: Mapping[tuple[str, str], float]
    force_n: Mapping[str, float]
    probabilities: tuple[float, ...]
    shrinks: Mapping[str, Shrink]
    words: Words


def answer(data: Any) -> Answer | None:
    """Parse a diagnosis from a JSON value; None if it is not a diagnosis."""
    try:
        return _answer(data)
    except (KeyError, TypeError, ValueError, AttributeError, ConfigError):
        return None


def _answer(data: Mapping[str, Any]) -> Answer:
    gap, worded = data["gap"], data["told"]
    words = build(Words, {key: worded[key] for key in worded if key not in ("after", "heldout")}, "told")
    shrinks = {"this dive": _shrink({"before": gap["before"], "after": worded["after"]})}
    if data["shrink"]["heldout"] is not None:
        shrinks["pieces held out"] = _shrink(data["shrink"]["heldout"] | worded["heldout"])
    if data["shrink"]["check"] is not None:
        shrinks[f"check dive {words.check}"] = _shrink(data["shrink"]["check"])
    probabilities = tuple(float(effect["probability"]) for effect in data["effects"])
    if len(probabilities) != len(words.causes):
        raise ValueError("causes without words")
    return Answer(
        verdict=str(data["verdict"]),
        shares={(str(entry["dof"]), str(entry["phase"])): float(entry["share"]) for entry in gap["where"]},
        force_n={dof: real(force) for dof, force in gap["force"].items() if dof in DOFS},
        probabilities=probabilities,
        shrinks=shrinks,
        words=words,
    )


def _shrink(data: Mapping[str, Any]) -> Shrink:
    by_axis = data.get("by_axis", {})
    return Shrink(
        **{name: real(data.get(name)) for name in ("before", "after", "value", "low95", "high95")},
        floor=real(data.get("floor", 1.0)),
        by_axis=tuple(_axis_shrink(dof, by_axis[dof]) for dof in DOFS if dof in by_axis),
    )


def _axis_shrink(dof: str, data: Mapping[str, Any]) -> AxisShrink:
    names = (field.name for field in fields(AxisShrink) if field.name != "dof")
    return AxisShrink(dof, **{name: real(data.get(name)) for name in names})


def verdict_lines(answer: Answer, cells: int) -> Lines:
    """The verdict as a mark and a word, then the sentence."""
    text, role = MARKS.get(answer.verdict, (answer.verdict, "plain"))
    words = answer.words
    about = f"{words.dive}, checked on {words.check}" if words.check else words.dive
    head = apart(((f" {text} ", role),), ((cut(about, cells - len(text) - 3), "quiet"),), cells)
    return (head, *wrapped(words.verdict, "strong", cells))


def where(answer: Answer, cells: int) -> Lines:
    """Map of the gap: degrees of freedom against the vehicle's phases of motion. Each cell is shaded and shows its
    share of the squared gap in per cent; sums stand below and at the right, and the missing force if it fits. A list
    of the parts if the map does not fit.
    """
    if answer.verdict == "no_gap":
        none = wrapped("There is no gap, so it lies nowhere.", "plain", cells)
        return (
            *none,
            *(line for words in answer.words.disturbance for line in wrapped(words, "quiet", cells)),
        )
    known = [dof for dof in DOFS if dof in answer.force_n or any(name == dof for name, _ in answer.shares)]
    with_force = cells >= FORCE_FROM
    room = cells - NAME_CELLS - 1 - (len(FORCE) if with_force else 0)
    heads = (*PHASES.values(), "all")
    shade, widths = next(
        (
            (shade, widths)
            for shade in SHADE_CELLS
            if sum(widths := [max(len(words), SHARE_CELLS + shade) + 1 for words in heads]) <= room
        ),
        (0, []),
    )
    if not widths:
        return _parts(answer, cells)
    spare = (room - sum(widths)) // len(widths)
    widths = [max(width, min(width + spare, WIDEST_CELLS)) for width in widths]
    head = f"{'':<{NAME_CELLS}}" + "".join(
        f"{words:>{width}}" for words, width in zip(heads, widths, strict=True)
    )
    lines: list[Line] = [((head + (FORCE if with_force else ""), "quiet"),)]
    for dof in known:
        shares = [answer.shares.get((dof, phase), 0.0) for phase in PHASES]
        line: Line = ((f"{dof:<{NAME_CELLS}}", "plain"),)
        for share, room in zip(shares, widths, strict=False):
            line = (*line, *_cell(share, shade, room))
        line = (*line, (f"{_percent(sum(shares)):>{widths[-1]}}", "strong"))
        if with_force:
            unit = "N" if dof in DOFS[:3] else "N m"
            force = number(answer.force_n.get(dof, math.nan), 2)
            line = (*line, (f"{force:>12}", "plain"), (f" {unit}", "quiet"))
        lines.append(line)
    sums = [sum(answer.shares.get((dof, phase), 0.0) for dof in known) for phase in PHASES]
    foot = "".join(f"{_percent(total):>{width}}" for total, width in zip(sums, widths, strict=False))
    lines.append(((f"{'all':<{NAME_CELLS}}", "quiet"), (foot, "strong")))
    for sentence in answer.words.disturbance:
        lines += wrapped(sentence, "quiet", cells)
    return tuple(lines)


def _parts(answer: Answer, cells: int) -> Lines:
    """The parts of the gap, the largest first, with a bar each."""
    parts = sorted(answer.shares.items(), key=lambda part: -part[1])
    lines: list[Line] = [
        (
            (f"{dof:<{NAME_CELLS}}{PHASES[phase]:<11}", "plain"),
            (f"{_percent(share):>{SHARE_CELLS}}  ", "strong"),
            (bar(share, max(cells - LISTED_CELLS, 0)), "accent"),
        )
        for (dof, phase), share in parts
        if share > 0
    ]
    for sentence in answer.words.disturbance:
        lines += wrapped(sentence, "quiet", cells)
    return tuple(lines)


def _cell(share: float, shade: int, width: int) -> Line:
    mark = next((shade for least, shade in SHADES if share >= least), " ")
    dark = mark in "█▓"
    number = f"{_percent(share):>{SHARE_CELLS}}"
    blank = " " * (width - shade - SHARE_CELLS)
    return (
        (blank, "plain"),
        (mark * shade, "accent" if dark else "faded"),
        (number, "strong" if dark else "plain" if mark != " " else "quiet"),
    )


def _percent(share: float) -> str:
    """`78 %`, `<1 %`, `·` for none."""
    if share <= 0:
        return "·"
    return f"{100 * share:.0f} %" if share >= 0.005 else "<1 %"


def which(answer: Answer, cells: int) -> Lines:
    """Accepted causes, the strongest first, then possible causes, then rejected candidates with some gain."""
    words = answer.words
    tried = [cause for cause in words.tried if cause.gain_nats >= LEAST_NATS][:MOST_TRIED]
    nats = [cause.gain_nats for cause in words.causes] + [cause.gain_nats for cause in tried]
    most = 0.0 if answer.verdict == "no_gap" else max([LEAST_NATS, *nats])
    known = list(zip(words.causes, answer.probabilities, strict=True))
    likely = [(cause, probability) for cause, probability in known if probability >= LIKELY]
    possible = [(cause, probability) for cause, probability in known if probability < LIKELY]
    columns: Line = (("evidence on held-out pieces  probable", "quiet"),)
    lines: list[Line] = []
    if likely:
        lines.append(apart((("cause", "quiet"),), columns, cells))
    else:
        lines += wrapped("No candidate of the library is accepted as a cause.", "plain", cells)
    for place, (cause, probability) in enumerate(likely, 1):
        lines += _cause(place, cause, probability, most, cells, "accent")
    if possible:
        lines += [(), apart((("possible, not accepted", "warn"),), columns, cells)]
    for place, (cause, probability) in enumerate(possible, len(likely) + 1):
        lines += _cause(place, cause, probability, most, cells, "faded")
    for line in words.character:
        lines += wrapped(line, "warn", cells)
    if tried:
        lines += [(), (("tried as well, and not accepted", "quiet"),)]
        for candidate in tried:
            lines += _tried(candidate, most, cells)
    return tuple(lines)


def _cause(place: int, cause: Cause, probability: float, most: float, cells: int, role: Role) -> Lines:
    probable = "over 99 %" if probability >= 0.995 else f"{100 * probability:.0f} %"
    right: Line = (*_evidence(cause.gain_nats, most, role), (f"{probable:>10}", "strong"))
    lines = list(_named((f"{place} ", "quiet"), (cause.name, "strong"), right, cells))
    for value in cause.values:
        lines += wrapped(value, "accent", cells, "  ")
    lines += wrapped(cause.sentence, "plain", cells, "  ")
    lines += wrapped(cause.alike, "warn", cells, "  ") if cause.alike else ()
    return tuple(lines)


def _tried(cause: Tried, most: float, cells: int) -> Lines:
    name = f"{cause.name}: {cause.why}" if cause.why else cause.name
    right: Line = (*_evidence(cause.gain_nats, most, "faded"), (" " * 10, "plain"))
    return _named(("  ", "plain"), (name, "plain"), right, cells)


def _named(mark: Span, name: Span, right: Line, cells: int) -> Lines:
    """A name and what stands at its right: in the same line where both fit, else in the line below."""
    if len(mark[0]) + len(name[0]) + width(right) < cells:
        return (apart((mark, name), right, cells),)
    first, *more = wrapped(name[0], name[1], cells - len(mark[0]))
    blank: Span = (" " * len(mark[0]), "plain")
    return ((mark, *first), *((blank, *line) for line in more), apart((), right, cells))


def _evidence(nats: float, most: float, role: Role) -> Line:
    """Bar, on a logarithmic scale, and number of the gain on held-out pieces, nats."""
    share = max(math.log1p(max(nats, 0.0)) / math.log1p(most), SLIVER) if most > 0 else 0.0
    return ((bar(share, BAR_CELLS), role), (f"{number(nats, 0):>6} nats", "quiet"))


def how_far(answer: Answer, cells: int) -> Lines:
    """Bars in noise floors of the drift before, after and by noise alone: the dive, held-out pieces, check dive."""
    shrinks = answer.shrinks
    drifts = [drift for shrink in shrinks.values() for drift in (shrink.before, shrink.after, shrink.floor)]
    most = max(filter(math.isfinite, drifts), default=1.0) if answer.verdict != "no_gap" else math.inf
    lines: list[Line] = []
    by_axis = next((what for what, shrink in reversed([*shrinks.items()]) if shrink.by_axis), None)
    if by_axis is not None:
        lines += _by_axis(by_axis, shrinks[by_axis].by_axis, cells)
    lines += wrapped("drift of the model over 5 s, in floors: 1 is what noise alone gives", "quiet", cells)
    for what, shrink in shrinks.items():
        lines += _fall(what, shrink, most, cells)
    return tuple(lines)


def _by_axis(what: str, axes: Sequence[AxisShrink], cells: int) -> Lines:
    """A row per degree of freedom: drift in its own unit, and errors next to those of a plain fit."""
    head = f"{'':<{NAME_CELLS}}{'before':>9}{'after':>9}{'noise':>9}"
    errors = f"      {'NRMSE':>6}{'':>8}{'plain fit':>11}" if cells >= WITH_ERRORS else ""
    return (
        *wrapped(f"{what}: drift over 5 s by degree of freedom", "strong", cells),
        ((head + errors, "quiet"),),
        *(_axis(axis)[: 4 if errors else 3] for axis in axes),
        (),
    )


def _axis(axis: AxisShrink) -> Line:
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


def _fall(what: str, fall: Shrink, most: float, cells: int) -> Lines:
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
    lines: list[Line] = [apart(((what, "strong"),), ((closed, "plain"),), cells)]
    for word, value, role in rows:
        if math.isfinite(value) and math.isfinite(fall.before):
            drawn = bar(max(value / most, SLIVER), cells - 20) if math.isfinite(most) else ""
            lines.append(((f"  {word:<7}", "quiet"), (f"{_floors(value):>8}  ", "strong"), (drawn, role)))
    return tuple(lines)


def _floors(value: float) -> str:
    return number(value, 2 if value < 100 else 0)


def what_next(answer: Answer, cells: int) -> Lines:
    """The next dive to make, and notes on this dive."""
    lines: list[Line] = []
    for sentence in answer.words.next or ("Nothing is left to split: dive on.",):
        lines += wrapped(sentence, "strong", cells)
    for note in answer.words.notes:
        lines += wrapped(note, "quiet", cells)
    return tuple(lines)


MAKES: Final = {"where": where, "which": which, "far": how_far, "next": what_next}


class DiagnoseScreen(SectionScreen):
    """Result of `seatrial diagnose`; a key chooses the check dive."""

    VERB = "diagnose"
    SECTIONS: ClassVar[dict[str, str]] = {
        "where": "WHERE the gap lies, % of its square",
        "which": "WHICH causes it has",
        "far": "HOW FAR it shrinks",
        "next": "WHAT TO DIVE NEXT",
    }
    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action("diagnose.start", "d", "Diagnose", "diagnose the chosen dive, in a process of its own"),
        Action("diagnose.check", "c", "Check on", "the next older dive to check it on, then none", LOOKS),
        Action("diagnose.section", "s", "Section", "the next section, where not all fit", LOOKS),
        Action("diagnose.cancel", "x", "Cancel", "end the diagnosis that runs"),
        Action("diagnose.parameters", "p", "Parameters", "what it would upload, beside the vehicle"),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        ("░ ▒ ▓ █", "0.5, 3, 10, 30 % of the squared gap and more"),
        ("floors", "drift over what noise alone gives: 1 is no gap, 0.8 to 1.2 is noise"),
        ("nats", "what held-out pieces gain by a cause; its bar is logarithmic"),
    )

    def __init__(self, title: str, tabs: Sequence[Tab]) -> None:
        super().__init__(title, tabs)
        self._kept: Kept[Answer] = Kept(answer)
        self._other = 0

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "check":
            return not self.at_work and bool(self.others)
        if action == "parameters":
            accepted = self.dive is not None and newer(self.dive / PARAM, self.dive / JSON)
            return not self.at_work and accepted and self.unkept is None
        return super().check_action(action, parameters)

    def action_check(self) -> None:
        self._other = (self._other + 1) % (len(self.others) + 1)
        self.draw()

    async def action_parameters(self) -> None:
        if self.dive is not None:
            self.desk.param = self.dive / PARAM
            await self.begin_on("parameters")

    def comparable(self, dive: Path) -> tuple[Path, ...]:
        return tuple(filter(can_check, super().comparable(dive)))

    def on_other_dive(self) -> None:
        self._other = 0

    def result(self) -> Answer | None:
        return self._kept.read(self.dive / JSON, self.unkept) if self.dive is not None else None

    def verdict(self, cells: int) -> Lines:
        diagnosis = self.result()
        return verdict_lines(diagnosis, cells) if diagnosis is not None else ()

    def section(self, name: str, cells: int, _: int) -> Lines:
        diagnosis = self.result()
        return MAKES[name](diagnosis, cells) if diagnosis is not None else ()

    def aim(self) -> tuple[str, str]:
        check = self._check_dive()
        return "diagnoses", "without a check dive" if check is None else f"checked on {check.name}"

    def words(self, dive: Path, vehicle: str) -> tuple[str, ...]:
        check = self._check_dive()
        leaves = (("--json", JSON), ("--report", REPORT), ("--accept", PARAM))
        outputs = (word for option, name in leaves for word in (option, str(dive / name)))
        checked = ("--check", str(check)) if check is not None else ()
        return (self.VERB, str(dive), "--vehicle", vehicle, *checked, *outputs)

    def _check_dive(self) -> Path | None:
        return self.others[self._other] if self._other < len(self.others) else None
