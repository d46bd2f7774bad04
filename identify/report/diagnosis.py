"""Pages of a diagnosis, and of the comparison of a dive with a simulator, as a crew reads them on a boat."""

import math
from dataclasses import replace

import numpy as np

from bridge.vehicle.coefficients import DOFS
from identify.diagnose.causes.requirement import LEAST_GAIN
from identify.diagnose.result import Diagnosis, Finding, Gap, Value
from identify.diagnose.shrink.shrunk import CHANCE, Shrink
from identify.diagnose.simulators.comparison import Against, Difference
from identify.diagnose.simulators.thrust_ratio import ThrustRatio
from identify.diagnose.words import causes as cause_words
from identify.diagnose.words import diagnosis as wording
from identify.diagnose.words import drift as drift_words
from identify.diagnose.words import gap as gap_words
from identify.diagnose.words.against import lines, thrust_sentences, verdict_sentence
from identify.effects.effect import COMPENSATED_BY
from identify.report import cells
from identify.report import diagnosis_figures as figures
from identify.report.cells import Cell, Form
from identify.report.page import Report, Section, Table
from identify.words import MISSING, capital, fixed, seconds, unit

NOISE = (
    "Noise alone: the drift that sensor noise and a stationary disturbance would make on this very dive, on average "
    f"over their chances. {fixed(1 - CHANCE, 1)} to {fixed(1 + CHANCE, 1)} times as much is as good as a model gets; "
    "what is below it is chance, most of all in a single degree of freedom or over a few windows."
)
NOWHERE = (
    "There is no gap, so it lies nowhere: the model drifts no further than noise drives it, and nothing that could be "
    "shared out over what the vehicle did is missing."
)
NOTHING_RETURNS = (
    "The model drifts further than noise drives it, but no force that returns is missing, so there is nothing to share "
    "out over what the vehicle did: fly the same again to see whether it lasts."
)
BY_FORCE = (
    "This is where force is missing, over what disturbs that degree of freedom: it counts as much where it makes "
    "little drift."
)
NATS = (
    "A nat is a unit of evidence: with each one more, the pieces that were held out are 2.7 times as likely with the "
    f"cause as without it. A cause is named from {LEAST_GAIN:g} nats on (about "
    f"{100 * round(math.exp(LEAST_GAIN) / 100)} to 1); from more where it was sought in several forms or at several "
    "thrusters, since one of them may fit by chance; and from more beside others that are named: what one of these "
    "makes up for, in whatever form, is no evidence for another. It is accepted where it is likelier there than not; "
    "else it is possible."
)
LIKENESS = (
    "Likeness: at 1 no method could tell the two apart in this dive, at 0 they have nothing in common. The "
    "probability is that the cause, or one of those, is there."
)
DISTURBED = (
    " Disturbance: the fitted stationary disturbance, and its share of the variance of the thrusters' force, or of the "
    "force of the motion where no thruster pushes. More than a third where the vehicle is driven is more than a model "
    "may leave to it; where a depth or a heading is only held, thrust answers the disturbance and is as large."
)
FITTED = "over the whole dive, which was fitted"
BY_AXIS = (
    "The 5 s drift (root mean square) of each degree of freedom without and with the causes, and what noise alone "
    "would make it. Closes: (before − after) / (before − noise), how much of what is beyond noise goes with the "
    "causes. NRMSE: error of the velocity simulated over 5 s windows, over the standard deviation of the measured one, "
    "without → with the causes. Least squares: the NRMSE of a plain baseline, of linear and quadratic drag, trim and a "
    "delay, with neither the library nor a noise model."
)


def diagnosis_report(diagnosis: Diagnosis) -> Report:
    d = diagnosis
    return Report(
        f"{d.vehicle}: diagnosis of {d.dive}",
        subtitle(d),
        wording.verdict_sentence(d),
        sections(d),
    )


def subtitle(d: Diagnosis) -> str:
    return f"Configuration {d.configuration}, computed in {seconds(d.seconds)}."


def sections(d: Diagnosis) -> tuple[Section, ...]:
    parts = [
        _where(d),
        _by_dof(d),
        _depends(d),
        _what(d),
        _candidates(d),
        _how_far(d),
        _over_time(d),
    ]
    if following := wording.next_lines(d):
        parts.append(Section("What to dive next", "\n\n".join(following)))
    if d.notes:
        parts.append(Section("Notes", "\n\n".join(d.notes)))
    return tuple(part for part in parts if part is not None)


def _where(d: Diagnosis) -> Section:
    if not d.gap.where:
        return Section("1. Where it lies", "No degree of freedom could be compared with the model.")
    if d.verdict == "no_gap":
        return Section("1. Where it lies", NOTHING_RETURNS if d.gap.before > 1.0 + CHANCE else NOWHERE)
    largest = gap_words.where_line(d)
    elsewhere = gap_words.drifts_elsewhere(d.gap)
    parts = (
        f"Where most force is missing, the largest part first: {largest}." if largest else "",
        f"Most of the drift is in {elsewhere}." if elsewhere else "",
        BY_FORCE,
    )
    text = " ".join(filter(None, parts))
    return Section("1. Where it lies", text, (), (figures.where_map(d.gap), *figures.slices(d.gap)))


def _depends(d: Diagnosis) -> Section | None:
    if not d.gap.depends_on or d.verdict == "no_gap":
        return None
    rows = tuple(
        (
            wording.variable(dependence.variable),
            dependence.dof,
            dependence.parity or MISSING,
            gap_words.strength(dependence.strength),
        )
        for dependence in d.gap.depends_on
    )
    caption = (
        "What the missing force goes with, whatever its cause, and how closely. Odd: it turns its sign with that; "
        "even: it keeps it."
    )
    return Section(
        "1.2 What it goes with", "", (Table(("Goes with", "In", "Sign", "How closely"), rows, caption),)
    )


def _by_dof(d: Diagnosis) -> Section:
    shares = gap_words.shares_by_dof(d.gap.where)
    fitted = [i for i in range(len(DOFS)) if any(np.isfinite(entry.floor[i]) for entry in d.gap.drifts)]
    present = [i for i, dof in enumerate(DOFS) if dof in shares or i in fitted]
    horizons = tuple(f"After {entry.horizon_s:g} s" for entry in d.gap.drifts)
    no_gap = d.verdict == "no_gap"
    rows = []
    for i in present:
        force = d.gap.force.get(DOFS[i], math.nan)
        missing = cells.significant(force, 2, "N" if i < 3 else "N m")
        shared = () if no_gap else (missing,)
        drifts = (_before_after(d, k, i) for k in range(len(d.gap.drifts)))
        rows.append((DOFS[i], *shared, *_disturbed(d.gap, i), *drifts))
    columns = (
        "Degree of freedom",
        *(() if no_gap else ("Missing",)),
        *(("Disturbance",) if d.gap.disturbance else ()),
        *horizons,
    )
    caption = (
        "Drift of the simulated velocity"
        if no_gap
        else "Missing force or moment, root mean square; drift of the simulated velocity without → with the causes"
    )
    table = Table(columns, tuple(rows), f"{caption}, {FITTED}.{DISTURBED if d.gap.disturbance else ''}")
    time = figures.over_time(d)
    drawn = (*((time,) if time else ()), figures.growth(d.gap)) if d.gap.drifts else ()
    return Section("1.1 How large it is", "", (table,), drawn)


def _disturbed(gap: Gap, dof: int) -> tuple[str, ...]:
    """A table cell with the disturbance of a degree of freedom; no cell if no disturbance is reported at all."""
    if not gap.disturbance:
        return ()
    matches = [entry for entry in gap.disturbance if entry.dof == DOFS[dof]]
    return (
        (f"{gap_words.force_words(matches[0])}, {cause_words.percent_bounded(matches[0].share)}",)
        if matches
        else (MISSING,)
    )


def _before_after(d: Diagnosis, k: int, dof: int) -> Cell:
    drifts = (d.gap.drifts[k], *(d.gap.after[k : k + 1] if d.verdict != "no_gap" else ()))
    if not np.isfinite(drifts[0].floor[dof]):
        return MISSING
    rates = [_rate(float(drift.rms[dof]), DOFS[dof]) for drift in drifts]
    return rates[0] if len(rates) == 1 else cells.joined(Form.CHANGE, *rates)


def _what(d: Diagnosis) -> Section:
    lines = []
    for finding in d.findings:
        lines += [
            cause_words.cause_sentence(finding),
            *([cause_words.alike_sentence(finding)] if finding.is_ambiguous else []),
        ]
    lines += [LIKENESS] if any(cause.also for cause in d.findings) else []
    lines += wording.character_lines(d)
    if not lines:
        lines = ["No candidate of the library explains anything that noise would not."]
    columns = ("Cause", "Parameter", "Value", "95 % interval", "Unit")
    tables = (Table(columns, _parameters(d)),) if d.findings else ()
    return Section("2. What causes it", "\n\n".join(lines), tables)


def _parameters(d: Diagnosis) -> tuple[tuple[Cell, ...], ...]:
    rows: list[tuple[Cell, ...]] = []
    for finding in d.findings:
        cause = cause_words.effect_words(finding.cause.effect)
        values = cause_words.shown_parameters(finding)
        rows += [(cause, name, *_cells(value)) for name, value in values.items()] or [
            (cause, MISSING, MISSING, MISSING, MISSING)
        ]
    return tuple(rows)


def _cells(value: Value) -> tuple[Cell, Cell, str]:
    """Number, interval and unit."""
    number, interval = cells.with_interval(value.value, value.low95, value.high95)
    return number, interval, unit(value.unit) if value.unit != "1" else MISSING


def _candidates(d: Diagnosis) -> Section | None:
    if not d.tried:
        return None
    text, drawn, weaker = figures.candidates(d.tried, d.findings, d.verdict != "no_gap")
    return Section("2.1 All candidates", f"{NATS}{_by_other_tests(d)}{text}", weaker, drawn)


def _by_other_tests(d: Diagnosis) -> str:
    """Evidence for causes that the nats don't cover."""
    return "".join(
        f" Not so the {cause_words.effect_words(cause.cause.effect)}: {cause.cause.effect.evidence}."
        for cause in d.findings
        if cause.cause.effect.evidence
    )


def _how_far(d: Diagnosis) -> Section:
    shrinks = (("predicted: pieces held out", d.heldout), ("measured: the check dive", d.check))
    by_axis = [
        Table(AXIS_COLUMNS, _axis_rows(shrink), f"{capital(where)}. {BY_AXIS} {NOISE}")
        for where, shrink in (("the check dive", d.check), ("pieces held out", d.heldout))
        if shrink is not None and shrink.by_axis
    ][:1]
    rows = tuple(
        (where, *_shrunk(shrink))
        for where, shrink in shrinks
        if shrink is not None and math.isfinite(shrink.value)
    )
    caption = f"All together: how much of the {drift_words.DRIFT_S:g} s drift beyond noise the causes close."
    tables = [*by_axis, *([Table(("Where", "Closes", "95 % interval"), rows, caption)] if rows else [])]
    gains = tuple(_gained(shrink) for shrink in d.findings)
    if gains:
        caption = (
            "What the feed-forward alone would gain: root mean square error of the velocity, without and with what "
            "makes up for the cause on board."
        )
        tables.append(Table(("Cause", "Before", "After", "Made up for by"), gains, caption))
    text = _apart(d.heldout, d.check) if tables else "Nothing was found that could shrink it."
    return Section("3. How far it shrinks", text, tuple(tables))


AXIS_COLUMNS = (
    "Degree of freedom",
    "Before",
    "After",
    "Noise alone",
    "Closes",
    "NRMSE",
    "Least squares",
)


def _rate(value: float, dof: str) -> Cell:
    return cells.speed(value, "rad/s" if dof in drift_words.TURNING else "m/s")


MOST_NRMSE = 10
"""A simulation that is off by more runs away, and how far says nothing."""


def _axis_rows(shrink: Shrink) -> tuple[tuple[Cell, ...], ...]:
    return tuple(
        (
            axis.dof,
            *(_rate(value, axis.dof) for value in (axis.before, axis.after, axis.floor)),
            cells.percent(axis.value),
            cells.joined(Form.CHANGE, cells.fixed(axis.nrmse_before, 2), cells.fixed(axis.nrmse_after, 2)),
            f"over {MOST_NRMSE}" if axis.nrmse_baseline > MOST_NRMSE else cells.fixed(axis.nrmse_baseline, 2),
        )
        for axis in shrink.by_axis
    )


def _over_time(d: Diagnosis) -> Section | None:
    """Measured against simulated velocities on the check dive, or on held-out pieces without a check dive."""
    flown = d.prediction or d.held
    if flown is None or not len(flown.time_s):
        return None
    where = f"On the check dive, {flown.dive}" if d.prediction else "On pieces held out of the fit"
    text = f"{where}. Where the simulated curves lie on the measured one, the model moves as the vehicle did."
    return Section("3.1 Measured and simulated", text, traces=(figures.velocities(flown),))


def _shrunk(shrink: Shrink) -> tuple[Cell, Cell]:
    low, high = cells.percent(shrink.low95), cells.percent(shrink.high95)
    return cells.percent(shrink.value), MISSING if str(low) == str(high) else cells.joined(
        Form.RANGE, low, high
    )


def _gained(finding: Finding) -> tuple[Cell, ...]:
    cause, by = cause_words.effect_words(finding.cause.effect), finding.cause.effect.feedforward
    made_up = COMPENSATED_BY[by] if by else "nothing: the feed-forward can't"
    if finding.feedforward is None:
        return cause, MISSING, MISSING, made_up
    return (
        cause,
        cells.speed(finding.feedforward.before_m_s, "m/s"),
        cells.speed(finding.feedforward.after_m_s, "m/s"),
        made_up,
    )


def _apart(predicted: Shrink | None, measured: Shrink | None) -> str:
    if predicted is None or measured is None or not math.isfinite(predicted.value - measured.value):
        return ""
    points = fixed(100 * abs(predicted.value - measured.value), 0)
    return f"What was predicted and what was measured are {points} point{'' if points == '1' else 's'} apart."


HOW = (
    "Both recordings are diagnosed alike, each by its own commands. The gap is that of the simulator's own model, "
    "masses, dampings and effects, along the real dive: before is the simulator as it is, after the simulator with all "
    "that is named here. A number of the simulator that its own recording does not tell is taken as near to the "
    "vehicle's as that recording allows."
)


def against_report(comparison: Against) -> Report:
    return Report(
        f"{comparison.vehicle.vehicle}: {comparison.vehicle.dive} against the simulator's {comparison.simulator.dive}",
        subtitle(comparison.vehicle),
        " ".join((*thrust_sentences(comparison), verdict_sentence(comparison))),
        (
            _change(comparison),
            *sections(replace(comparison.vehicle, verdict=comparison.verdict)),
            _of_simulator(comparison),
        ),
    )


def _change(comparison: Against) -> Section:
    rows = [
        *_thrust_rows(comparison.thrust),
        *_lacking_rows(comparison),
        *(_row(difference) for difference in comparison.off),
    ]
    columns = ("What", "Simulator has", "Vehicle has", "95 % interval", "Unit", "Off by")
    table = (
        (Table(columns, tuple(rows), "What to set in the simulator, all of it together."),) if rows else ()
    )
    possible = tuple(each for each in comparison.differences if each not in comparison.off)
    text = [HOW, *lines(replace(comparison, differences=possible))]
    return Section("What to change in the simulator", "\n\n".join(text), table)


def _thrust_rows(thrust: ThrustRatio) -> list[tuple[Cell, ...]]:
    """The ratio of the thrusts by degree of freedom, where it differs."""
    if not thrust.differs:
        return []
    return [
        (
            f"thrust in {dof}, ratio",
            cells.fixed(1.0, 0),
            *_cells(value),
            _signed_percent(1.0 / value.value - 1.0),
        )
        for dof, value in thrust.by_axis.items()
    ]


def _lacking_rows(comparison: Against) -> list[tuple[Cell, ...]]:
    rows: list[tuple[Cell, ...]] = []
    for lacking in wording.sorted_by_likelihood(comparison.lacks)[0]:
        cause = cause_words.effect_words(lacking.cause.effect)
        values = cause_words.shown_parameters(lacking)
        rows += [(f"{cause}, {name}", "none", *_cells(value), MISSING) for name, value in values.items()] or [
            (cause, "none", MISSING, MISSING, MISSING, MISSING)
        ]
    return rows


def _row(difference: Difference) -> tuple[Cell, ...]:
    name = difference.name
    if difference.of:
        name = f"{cause_words.words(difference.of)}, {cause_words.parameter(name)}"
    if difference.thrust != 1.0:
        name = f"{name}, at the simulator's thrust"
    share = _signed_percent(difference.share)
    return name, _cells(difference.simulator)[0], *_cells(difference.vehicle), share


def _signed_percent(share: float) -> Cell:
    return cells.fixed(100 * share, 0, "%", cells.Style.SIGNED)


def _of_simulator(comparison: Against) -> Section:
    return Section(
        "What the simulator has",
        "\n\n".join(
            (wording.verdict_sentence(comparison.simulator), *wording.cause_lines(comparison.simulator))
        ),
    )
