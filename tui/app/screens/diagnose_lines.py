"""A diagnosis as lines: the verdict, where force is missing, which causes it has, how far it shrinks, the next dive."""

import math
from typing import Final

from bridge.vehicle.coefficients import DOFS
from identify.diagnose.shrink.shrunk import LIKELY, AxisShrink, Shrink
from identify.words import significant
from tui.app.diagnosis import PHASES, Answer, Cause, Tried
from tui.app.drawing import Line, Lines, Role, Span, apart, bar, number, stacked, width, with_head, wrapped

SHADES: Final = ((0.3, "█"), (0.1, "▓"), (0.03, "▒"), (0.005, "░"))
"""Shade of a cell by its least share of the missing force, squared; below the last share it is blank."""
NOWHERE: Final = "There is no gap, so it lies nowhere."
NOTHING_RETURNS: Final = (
    "The model drifts further than noise drives it, but no force that returns is missing: fly the same again to see "
    "whether it lasts."
)
SHADE_CELLS, WIDEST_CELLS = 4, 15
LISTED_CELLS: Final = 20
FORCE: Final = "     missing"
NAME_CELLS: Final = 7
DRIFT_CELLS: Final = 48
"""Cells of a drift in numbers."""
BAR_CELLS: Final = 16
EVIDENCE_CELLS: Final = BAR_CELLS + 12
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


def verdict_lines(answer: Answer, cells: int) -> Lines:
    """The verdict as a mark and a word, then the sentence."""
    text, role = MARKS.get(answer.verdict, (answer.verdict, "plain"))
    words = answer.words
    about = f"{words.dive}, checked on {words.check}" if words.check else words.dive
    mark: Span = (f" {text} ", role)
    fits = len(mark[0]) + len(about) < cells
    head = (
        (apart((mark,), ((about, "quiet"),), cells),) if fits else ((mark,), *wrapped(about, "quiet", cells))
    )
    return (*head, *wrapped(words.verdict, "strong", cells))


def where_lines(answer: Answer, cells: int) -> Lines:
    """Map of the missing force: degrees of freedom against the vehicle's phases of motion, each cell the darker the
    more of it, and the missing force beside it. A list of the parts if the map does not fit.
    """
    if answer.verdict == "no_gap":
        none = NOTHING_RETURNS if answer.drifts else NOWHERE
        return (*wrapped(none, "plain", cells), *stacked(answer.words.disturbance, "quiet", cells))
    known = [dof for dof in DOFS if dof in answer.force_n or any(name == dof for name, _ in answer.shares)]
    room = cells - NAME_CELLS - 1 - len(FORCE)
    widths = [max(len(words), SHADE_CELLS) + 1 for words in PHASES.values()]
    if sum(widths) > room:
        return _parts(answer, cells)
    spare = (room - sum(widths)) // len(widths)
    widths = [max(width, min(width + spare, WIDEST_CELLS)) for width in widths]
    head = "".join(f"{words:>{width}}" for words, width in zip(PHASES.values(), widths, strict=True))
    lines: list[Line] = [((f"{'':<{NAME_CELLS}}{head}{FORCE}", "quiet"),)]
    for dof in known:
        line: Line = ((f"{dof:<{NAME_CELLS}}", "plain"),)
        for phase, room in zip(PHASES, widths, strict=True):
            line = (*line, *_cell(answer.shares.get((dof, phase), 0.0), room))
        force = number(answer.force_n.get(dof, math.nan), 2)
        line = (*line, (f"{force:>8}", "plain"), (f" {'N' if dof in DOFS[:3] else 'N m'}", "quiet"))
        lines.append(line)
    return (*lines, *stacked(answer.words.disturbance, "quiet", cells))


def _parts(answer: Answer, cells: int) -> Lines:
    """The parts of the gap, the largest first, with a bar each."""
    parts = sorted(answer.shares.items(), key=lambda part: -part[1])
    lines: list[Line] = [
        (
            (f"{dof:<{NAME_CELLS}}{PHASES[phase]:<11}", "plain"),
            (bar(share, max(cells - LISTED_CELLS, 0)), "accent"),
        )
        for (dof, phase), share in parts
        if share > 0
    ]
    return (*lines, *stacked(answer.words.disturbance, "quiet", cells))


def _cell(share: float, width: int) -> Line:
    mark = next((shade for least, shade in SHADES if share >= least), "·")
    role: Role = "accent" if mark in "█▓" else "faded" if mark != "·" else "quiet"
    shade = mark * SHADE_CELLS if mark != "·" else mark
    return ((f"{shade:>{width}}", role),)


def which_lines(answer: Answer, cells: int) -> Lines:
    """Accepted causes, the strongest first, then possible causes, then rejected candidates with some gain."""
    words = answer.words
    tried = [cause for cause in words.tried if cause.gain_nats >= LEAST_NATS][:MOST_TRIED]
    nats = [cause.gain_nats for cause in words.causes] + [cause.gain_nats for cause in tried]
    most = 0.0 if answer.verdict == "no_gap" else max([LEAST_NATS, *nats])
    known = list(zip(words.causes, answer.probabilities, strict=True))
    likely = [(cause, probability) for cause, probability in known if probability >= LIKELY]
    possible = [(cause, probability) for cause, probability in known if probability < LIKELY]
    columns: Line = ((f"{'probable':>10}  {'evidence on held-out pieces':<{EVIDENCE_CELLS}}", "quiet"),)
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
    lines += stacked(words.character, "warn", cells)
    if tried:
        lines += [(), (("tried as well, and not accepted", "quiet"),)]
    for candidate in tried:
        lines += _tried(candidate, most, cells)
    return tuple(lines)


def _cause(place: int, cause: Cause, probability: float, most: float, cells: int, role: Role) -> Lines:
    probable = "over 99 %" if probability >= 0.995 else f"{100 * probability:.0f} %"
    right: Line = ((f"{probable:>10}  ", "strong"), *_evidence(cause.gain_nats, most, role))
    lines = list(_named((f"{place} ", "quiet"), (cause.name, "strong"), right, cells))
    for value in cause.values:
        lines += wrapped(value, "accent", cells, "  ")
    lines += wrapped(cause.sentence, "plain", cells, "  ")
    lines += wrapped(cause.alike, "warn", cells, "  ") if cause.alike else ()
    return tuple(lines)


def _tried(cause: Tried, most: float, cells: int) -> Lines:
    name = f"{cause.name}: {cause.why}" if cause.why else cause.name
    right = _evidence(cause.gain_nats, most, "faded")
    return _named(("  ", "plain"), (name, "plain"), right, cells)


def _named(mark: Span, name: Span, right: Line, cells: int) -> Lines:
    """A name, and text at its right: in the same line if both fit, else in the line below."""
    if len(mark[0]) + len(name[0]) + width(right) < cells:
        return (apart((mark, name), right, cells),)
    return (*with_head((mark,), *name, cells), apart((), right, cells))


def _evidence(nats: float, most: float, role: Role) -> Line:
    """Bar, on a logarithmic scale, and number of the gain on held-out pieces, nats."""
    share = max(math.log1p(max(nats, 0.0)) / math.log1p(most), SLIVER) if most > 0 else 0.0
    return ((bar(share, BAR_CELLS), role), (f"{number(nats, 0):>6} nats", "quiet"))


def how_far_lines(answer: Answer, cells: int) -> Lines:
    """Drift over 5 s by degree of freedom, without and with the causes: the dive, held-out pieces, check dive."""
    lines: list[Line] = [*wrapped("drift of the model over 5 s, without → with the causes", "quiet", cells)]
    every = [axis for shrink in answer.shrinks.values() for axis in shrink.by_axis if _is_known(axis)]
    most = max((axis.before / axis.floor for axis in every), default=1.0)
    for what, shrink in answer.shrinks.items():
        closed = f"closes {_share(shrink)} of what is beyond noise" if math.isfinite(shrink.value) else ""
        fits = len(what) + len(closed) < cells
        lines += (
            (apart(((what, "strong"),), ((closed, "strong"),), cells),)
            if fits
            else (*wrapped(what, "strong", cells), *wrapped(closed, "strong", cells, "  "))
        )
        drawn = answer.verdict != "no_gap" and cells > DRIFT_CELLS
        lines += [_axis(axis, most, cells - DRIFT_CELLS if drawn else 0) for axis in shrink.by_axis]
    return tuple(lines)


def _is_known(axis: AxisShrink) -> bool:
    """Whether all three of its drifts are known, so that they have a bar."""
    return math.isfinite(axis.before) and math.isfinite(axis.after) and axis.floor > 0


def _share(shrink: Shrink) -> str:
    """`98 % (93 to 100 %)`."""
    known = math.isfinite(shrink.high95 - shrink.low95)
    ends = f" ({100 * shrink.low95:.0f} to {100 * shrink.high95:.0f} %)" if known else ""
    return f"{100 * shrink.value:.0f} %{ends}"


def _axis(axis: AxisShrink, most: float, cells: int) -> Line:
    """Numbers, and a bar, its remaining part solid, the closed part shaded; `most` floors fill it."""
    turning = axis.dof not in DOFS[:3]
    scale, unit = (math.degrees(1.0), "deg/s") if turning else (1e3, "mm/s")
    before, after, floor = (significant(scale * value, 2) for value in (axis.before, axis.after, axis.floor))
    whole = round(cells * axis.before / axis.floor / most) if _is_known(axis) else 0
    stays = min(round(whole * axis.after / axis.before), whole) if whole else 0
    return (
        (f"  {axis.dof:<{NAME_CELLS}}{before:>8} →", "plain"),
        (f"{after:>7}", "strong"),
        (f" {unit:<5}", "quiet"),
        (f" noise{floor:>7}  ", "quiet"),
        ("█" * stays, "accent"),
        ("░" * (whole - stays), "faded"),
    )


def next_dive_lines(answer: Answer, cells: int) -> Lines:
    """The next dive to make, and notes on this dive."""
    sends = answer.verdict == "explained" and not answer.contradicted
    then = "upload what was found, and dive on" if sends else "dive on"
    following = answer.words.next or (f"Nothing is left to split: {then}.",)
    return (*stacked(following, "strong", cells), *stacked(answer.words.notes, "quiet", cells))
