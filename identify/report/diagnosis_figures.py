"""Figures of a diagnosis: map of the gap, slices of it, candidates, drift before and after."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.gap.drift import Drift
from identify.diagnose.result import Diagnosis, Finding, Gap, Prediction, Slice, Tried
from identify.diagnose.words import causes as cause_words
from identify.diagnose.words import diagnosis as wording
from identify.diagnose.words import drift as drift_words
from identify.diagnose.words import gap as gap_words
from identify.report import cells
from identify.report.figures import error_unit
from identify.report.page import Figure, Table
from identify.report.plot import Bar, Line, Panel, bars, heatmap, lines_panel, side_by_side, stack
from identify.report.traces import Traces
from identify.words import decimals_for, fixed

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = 12
"""Number of candidates that are drawn, strongest first; the others go into a table."""

LEAST_TOLD = 2.0
"""Nats up to which candidates are summarised in a single line."""

SLICED = 0.15
"""Share of the gap from which a degree of freedom is sliced."""

BINS = 60
SLICES = {
    "speed": "by speed",
    "heading": "by heading",
    "depth": "by depth",
    "time": "by time into the dive",
    "voltage": "by battery voltage",
    "distance": "by distance from the start",
}
UNITS = {"speed": "m/s", "depth": "m", "time": "s", "voltage": "V", "distance": "m"}
FLOWN = ("measured", "before", "after")
BEFORE, AFTER, NOISE = "before", "after", "floor: noise alone"
STYLE_OF = {AFTER: 0, BEFORE: 1, NOISE: 2}
"""Before and after have the colours that `traces` gives them in FLOWN, on the whole page."""


def where_map(gap: Gap) -> Figure:
    dofs = [dof for dof in DOFS if any(place.dof == dof for place in gap.where)]
    shares = np.zeros((len(gap_words.PHASES), len(dofs)))
    phases = list(gap_words.PHASES)
    for place in gap.where:
        shares[phases.index(place.phase), dofs.index(place.dof)] += place.share
    return Figure(
        "where the gap lies",
        "Where force is missing, by what the vehicle was doing and by degree of freedom: the stronger the colour, the "
        "more of it.",
        stack([heatmap([gap_words.PHASES[phase] for phase in phases], dofs, shares)]),
    )


def slices(gap: Gap) -> tuple[Figure, ...]:
    """A figure for each degree of freedom with a large share of the gap: bars by speed, heading and so on."""
    by_dof = gap_words.shares_by_dof(gap.where)
    held = [dof for dof in sorted(by_dof, key=lambda name: -by_dof[name]) if by_dof[dof] >= SLICED]
    return tuple(drawn for dof in held if (drawn := _slices_of(gap, dof)) is not None)


def _slices_of(gap: Gap, dof: str) -> Figure | None:
    parts = []
    for by, title in SLICES.items():
        own_slices = [each for each in gap.slices if each.dof == dof and each.by == by]
        own_slices.sort(key=_bearing if by == "heading" else lambda each: each.low)
        total = sum(each.share for each in own_slices)
        decimals = _decimals(own_slices)
        # A variable that changes by less than the shown digits is constant over the dive.
        if total > 0 and len(own_slices) > 1 and not _still(own_slices, decimals):
            rows = [Bar(_range(each, decimals), each.share / total, "") for each in own_slices]
            parts.append(bars(rows, f"{dof}, {title}"))
    if not parts:
        return None
    return Figure(
        f"gap in {dof} sliced",
        f"What is missing in {dof}, sliced: each set of bars is the whole of it.",
        side_by_side(parts),
    )


def _still(mine: Sequence[Slice], decimals: int) -> bool:
    """Whether a slice ends at its beginning, to the digits shown."""
    return any(
        part.by != "heading" and fixed(part.low, decimals) == fixed(part.high, decimals) for part in mine
    )


def _decimals(mine: Sequence[Slice]) -> int:
    """Decimals that the narrowest slice needs, at most two."""
    widths = [part.high - part.low for part in mine if part.high > part.low]
    return min(max(decimals_for(min(widths)), 0), 2) if widths else 0


def _range(part: Slice, decimals: int) -> str:
    if part.by == "heading":
        low = _bearing(part)
        return f"{fixed(low, 0)}° to {fixed(low + math.degrees(part.high - part.low), 0)}°"
    return f"{fixed(part.low, decimals)} to {fixed(part.high, decimals)} {UNITS[part.by]}"


def _bearing(part: Slice) -> float:
    """Start of a slice by heading, in degrees clockwise from north, 0 to 360."""
    return round(math.degrees(part.low), 6) % 360.0


def candidates(
    tried: Sequence[Tried], findings: Sequence[Finding], gap: bool
) -> tuple[str, tuple[Figure, ...], tuple[Table, ...]]:
    """Evidence for each candidate of the library, in its best form: text, a figure of the strongest, a table of the
    rest.

    If no candidate has notable evidence, only a sentence that says so; without `gap` no figure, as bars would look like
    one. A cause in `findings` that is less probable than not is called possible, with its probability.
    """
    best: dict[tuple[str, int], Tried] = {}
    for candidate in sorted(tried, key=lambda t: (-t.accepted, -t.gain_nats)):
        best.setdefault((candidate.name, candidate.effect.number), candidate)
    order = sorted(best.values(), key=lambda t: (-t.gain_nats, t.label))
    longest = math.log1p(max((max(candidate.gain_nats, 0.0) for candidate in order), default=0.0))
    notable = [candidate for candidate in order if candidate.accepted or candidate.gain_nats > LEAST_TOLD]
    few = len(order) - len(notable)
    if not notable:
        return f" Here none of {few} candidates saves more than {LEAST_TOLD:g} nats.", (), ()
    _, unlikely = wording.sorted_by_likelihood(findings)
    possible = {
        candidate.cause.effect.label: cause_words.percent_bounded(candidate.probability)
        for candidate in unlikely
    }
    rows = [
        Bar(
            cause_words.candidate_words(candidate.effect) + _aside(candidate, possible),
            math.log1p(max(candidate.gain_nats, 0.0)) / longest if longest > 0 else 0.0,
            str(_saves(candidate)),
            "accepted" if candidate.accepted and candidate.label not in possible else "",
        )
        for candidate in notable
    ]
    first = max(SHOWN, sum(candidate.accepted for candidate in notable)) if gap else 0
    others = (
        f" {few} other{'s' if few > 1 else ''}: {'none' if few > 1 else 'it'} gains "
        f"{'' if few > 1 else 'no '}more than {LEAST_TOLD:g} nats."
        if few
        else ""
    )
    weaker = tuple(
        (bar.name, _saves(candidate)) for bar, candidate in zip(rows[first:], notable[first:], strict=True)
    )
    tables = (Table(("Weaker candidate" if gap else "Candidate", "Saves"), weaker),) if weaker else ()
    if not gap:
        return f" None is accepted.{others}", (), tables
    drawn = Figure(
        "candidates",
        "What each candidate saves on pieces of the dive that it was not fitted to: an accepted one (filled), or a "
        "possible one, which is less probable than not, beside the others of these; any other on top of them all. Of "
        f"several forms of one the best is shown. Bars grow with the logarithm of the nats.{others}",
        stack([bars(rows[:first])]),
    )
    return "", (drawn,), tables


def _saves(candidate: Tried) -> cells.Cell:
    nats = candidate.gain_nats
    return cells.fixed(nats, 0 if abs(nats) >= 10 else 1, "nats")


def _aside(candidate: Tried, possible: Mapping[str, str]) -> str:
    """Text behind a candidate's name; `possible`: probabilities by label."""
    if candidate.accepted and candidate.label in possible:
        return f" (possible: {possible[candidate.label]} probable)"
    return f" ({candidate.why})" if candidate.why else ""


def growth(gap: Gap) -> Figure:
    present = [i for i in range(len(DOFS)) if any(np.isfinite(drift.floor[i]) for drift in gap.drifts)]
    return Figure(
        "drift by horizon",
        "How far the simulated velocity is off after 1, 5 and 20 s on the model alone (root mean square): with the "
        "plain model (before), with the causes in it (after), and what noise alone would give (floor).",
        side_by_side([_growth_panel(gap, dof) for dof in present]),
    )


def _growth_panel(gap: Gap, dof: int) -> Panel:
    scale, unit = error_unit(dof)
    at = np.array([drift.horizon_s for drift in gap.drifts])
    curves = {
        BEFORE: np.array([drift.rms[dof] for drift in gap.drifts]),
        AFTER: np.array([drift.rms[dof] for drift in gap.after]),
        NOISE: np.array([drift.floor[dof] for drift in gap.drifts]),
    }
    lines = [Line(at[: len(y)], scale * y, label, STYLE_OF[label]) for label, y in curves.items() if len(y)]

    def draw(box: "Axes") -> None:
        box.set_xscale("log")
        lines_panel(f"{DOFS[dof]}, {unit}", "horizon, s", lines, holds=(0.0,)).draw(box)
        box.set_xlim(at[0] / 1.2, at[-1] * 1.2)
        box.set_xticks(at, [f"{x:g}" for x in at])
        box.set_xticks([], minor=True)

    return Panel(draw)


def over_time(diagnosis: Diagnosis) -> Figure | None:
    """The 5 s drift over the dive by degree of freedom, before and after; None if it was not computed."""
    before, after = _at_horizon(diagnosis.gap.drifts), _at_horizon(diagnosis.gap.after)
    if before is None or not len(before.starts_s):
        return None
    ways = [(before, BEFORE), *([(after, AFTER)] if after is not None else [])]
    return Figure(
        "drift over the dive",
        "The 5 s drift along the dive by degree of freedom, with the plain model (before), with the causes in it "
        "(after), and what noise alone would give (floor).",
        side_by_side([_over_time(ways, dof) for dof in np.flatnonzero(np.isfinite(before.floor)).tolist()]),
    )


def _over_time(ways: Sequence[tuple[Drift, str]], dof: int) -> Panel:
    scale, unit = error_unit(dof)
    before, _ = ways[0]
    start_s, end_s = float(before.starts_s[0]), float(before.starts_s[-1])
    lines = [_binned(drift, dof, scale, label, start_s) for drift, label in ways]
    floor = np.full(2, scale * before.floor[dof])
    lines.append(Line(np.array([0.0, end_s - start_s]), floor, NOISE, STYLE_OF[NOISE]))
    return lines_panel(f"{DOFS[dof]}, {unit}", "time, s", lines, (0.0, end_s - start_s), (0.0,))


def velocities(prediction: Prediction) -> Traces:
    """Measured velocities and those simulated before and after; a panel for each fitted degree of freedom."""
    panels = []
    ways = (prediction.measured, prediction.before, prediction.after)
    for dof in np.flatnonzero(np.isfinite(prediction.floor)).tolist():
        unit, scale = ("m/s", 1.0) if dof < 3 else ("deg/s", math.degrees(1.0))
        panels.append((f"{DOFS[dof]}, {unit}", np.array([scale * way[:, dof] for way in ways])))
    return Traces(
        "measured and simulated velocities",
        "Velocities in body axes: measured (smoothed), and simulated from thrust and attitude alone, started anew from "
        f"the measured one every {drift_words.DRIFT_S:g} s: by the plain model (before) and with the causes in (after)."
        " The buttons stretch time and height; stretched time can be moved sideways.",
        FLOWN,
        prediction.time_s - prediction.time_s[0],
        prediction.window,
        tuple(panels),
    )


def _at_horizon(drifts: Sequence[Drift]) -> Drift | None:
    return next((drift for drift in drifts if drift.horizon_s == drift_words.DRIFT_S), None)


def _binned(drift: Drift, dof: int, scale: float, label: str, start_s: float) -> Line:
    """Rms over each of at most BINS stretches of the dive."""
    square = drift.off[:, dof] ** 2
    parts = np.array_split(np.arange(len(square)), min(BINS, len(square)))
    value = scale * _over(parts, lambda part: math.sqrt(square[part].mean()))
    time_s = _over(parts, lambda part: drift.starts_s[part].mean() - start_s)
    return Line(time_s, value, label, STYLE_OF[label])


def _over(parts: Sequence[NDArray[np.intp]], mean: Callable[[NDArray[np.intp]], float]) -> Array:
    return np.array([mean(part) for part in parts], dtype=np.float64)
