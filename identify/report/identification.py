"""Page of `seatrial identify`, and its sections: the answer to each dive, its comparison with a second method, the
training, the innovations and the dive itself.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import BY_NAME, MASSES, OF_HULL, ROLL
from bridge.vehicle.config import Configuration, Water
from bridge.vehicle.mode import word_of
from bridge.vehicle.thrusters import NEUTRAL_US
from identify.dive import Dive, Signal
from identify.doubt import Outcome
from identify.estimators.comparison import Comparison, further_remarks
from identify.gnss_fixes import check_fixes
from identify.identification import (
    LARGEST_RELATIVE_STD,
    Estimate,
    Identification,
    added_mass,
    estimate,
)
from identify.report import cells, figures, tables
from identify.report.cells import Cell
from identify.report.page import Report, Section, Table
from identify.run.identify import Identified
from identify.words import MISSING, capital, count, fixed, listed, seconds, significant, unit

OUTCOME_MEANS = {
    Outcome.AT_BOUND: (
        "The search ended where it may not go on, not at a best fit: don't rely on the values named below."
    ),
    Outcome.NOT_IDENTIFIABLE: "This dive says too little of every parameter: there is no value to use.",
    Outcome.DISAGREES: (
        "The recording holds what the model can't explain: use these values only as the notes below allow."
    ),
}
PARTLY = "Warning: some of these values are in doubt"


def identification_report(answers: Sequence[Identified], curves: Mapping[str, Mapping[str, Array]]) -> Report:
    """Return the page with the results of each dive and the dives themselves; `curves`: of a network's training, by
    the dive's SHA-256 and the parameter, (passes,)."""
    sections = []
    for each in answers:
        sections.append(identification_section(each.answer))
        for comparison in each.comparisons:
            sections += [comparison_section(comparison), identification_section(comparison.second)]
        if trained := curves.get(each.dive.sha256):
            sections.append(Section("Training", figures=(figures.training(trained),)))
        if each.answer.innovations:
            sections.append(innovations_section(each.answer.innovations, each.dive.name))
        sections.append(
            dive_section(each.dive, each.file.vehicle.water, each.file.vehicle.thrust_curve.neutral_us)
        )
    methods = [answers[0].answer.method, *(comparison.second.method for comparison in answers[0].comparisons)]
    verdict = "; ".join(
        f"{each.dive.name} ({each.answer.configuration}), {each.answer.outcome.value}: {len(each.answer.values())} of "
        f"{sum(parameter.name in OF_HULL for parameter in each.answer.parameters)} coefficients identified"
        f"{_accuracy(each.answer)}"
        for each in answers
    )
    file = answers[-1].file
    return Report(
        f"{file.vehicle.name}: {', '.join(each.dive.name for each in answers)}",
        f"vehicle file {file.path.name}, method {' beside '.join(methods)}",
        f"{verdict}.",
        tuple(sections),
    )


def _accuracy(answer: Identification) -> str:
    """How well masses and drag are known: `, masses to 3.1 % and dampings to 1.2 % or better given the thrust`.

    Roll and pitch, which few vehicles push, would hide how well the rest is known: what turns counts by itself. An
    axis with linear and quadratic damping counts by the drag of both at the dive's speed, for each of them alone may
    be nearly free.
    """
    paired = {name for force in answer.drag_forces for name in (force.linear, force.quadratic)}
    known = [e for e in answer.parameters if e.identifiable and e.value and e.name in BY_NAME]

    def of(kind: str, *, turning: bool) -> list[float]:
        return [
            (e.high95 - e.low95) / 2 / abs(e.value)
            for e in known
            if (c := BY_NAME[e.name]).kind == kind and (c.dof >= ROLL) == turning and e.name not in paired
        ]

    known_forces = (f for f in answer.drag_forces if f.relative_std <= LARGEST_RELATIVE_STD)
    forces = [(f.high95 - f.low95) / 2 / f.force for f in known_forces]
    shares = {
        "masses": of("mass", turning=False),
        "inertias": of("mass", turning=True),
        "dampings": of("damping", turning=False),
        "rotational dampings": of("damping", turning=True),
        "drag at the dive's speeds": forces,
    }
    said = [
        f"{words} to {significant(100 * max(each), 2)} %"
        for words, each in shares.items()
        if each and np.isfinite(each).all()
    ]
    return f", {listed(said)} or better given the thrust" if said else ""


def identification_section(
    identification: Identification,
    truth: Mapping[str, float] | None = None,
    configuration: Configuration | None = None,
) -> Section:
    """Result of an estimator: parameters in a table and a figure, other fitted quantities, notes.

    `truth` holds total masses and damping by name; with `configuration` the true added masses follow from it. Notes
    are part of the warning if the outcome is not converged; doubts always are.
    """
    i = identification
    words = [
        f"Method {i.method}: {i.outcome.value}. Vehicle {i.vehicle}, configuration {i.configuration}. "
        f"Recording {i.dive}: {seconds(i.duration_s)}, {count(i.samples)} samples used. "
        f"Identified in {seconds(i.wall_s)}."
    ]
    known = [e for e in i.parameters if truth is not None and e.identifiable and e.name in truth]
    if truth is not None and known:
        inside = sum(e.low95 <= truth[e.name] <= e.high95 for e in known)
        words.append(f"{inside} of {len(known)} known truths lie inside their 95 % intervals.")
    known_truth = _with_added_masses(truth, configuration) if truth and configuration else truth
    drawn = figures.intervals(f"{i.dive} {i.method}", i.parameters, known_truth)
    good = i.outcome is Outcome.CONVERGED
    doubts = tuple(dict.fromkeys(doubt.sentence for doubt in i.doubts))
    plain = [sentence for sentence in i.sentences if sentence not in doubts]
    table = (tables.parameters(i.parameters, known_truth),) if i.parameters else ()
    return Section(
        f"Identified parameters: {i.dive}, {i.configuration}, {i.method}",
        "\n\n".join((*words, *plain) if good else words),
        (*table, *tables.nuisance_tables(i.nuisance, i.settings)),
        (drawn,) if drawn else (),
        "\n\n".join(((PARTLY, *doubts) if doubts else ()) if good else _doubt(i)),
    )


def _doubt(i: Identification) -> tuple[str, ...]:
    """Warning for an outcome other than converged: headline, meaning, and the notes or why nothing is identifiable."""
    reasons: tuple[str, ...] = ()
    if i.outcome is Outcome.NOT_IDENTIFIABLE:
        reasons = tuple(f"{capital(reason)}." for e in i.parameters if (reason := e.reason))
    headline = f"Warning: {i.outcome.value}"
    return tuple(dict.fromkeys((headline, OUTCOME_MEANS[i.outcome], *reasons, *i.sentences)))


def _with_added_masses(truth: Mapping[str, float], configuration: Configuration) -> dict[str, float]:
    totals = [
        estimate(m.name, truth[m.name], 0.0, truth[m.name], truth[m.name]) for m in MASSES if m.name in truth
    ]
    added = [added_mass(total, configuration) for total in totals]
    return {**truth, **{mass.name: mass.value for mass in added}}


def dive_section(dive: Dive, water: Water, rest_us: float = NEUTRAL_US) -> Section:
    """Content of a recording: path, speeds, depth, thruster commands, rates and gaps, notes."""
    start_s = dive.span_s[0]
    drawn = (figures.track(dive), figures.depth(dive, water), figures.thrusters(dive, rest_us))
    in_files = figures.speeds(dive)
    source = f"{len(dive.runs)} recordings, drawn behind one another" if dive.runs else dive.source.name
    words = [
        f"Read from {source} (SHA-256 {dive.sha256[:16]}): {seconds(dive.duration_s)}. "
        f"Plots start at boot time {fixed(start_s, 1)} s.",
        *dive.notes,
    ]
    if check := check_fixes(dive):
        words.append(check.sentence)
    if dive.ff_mode is not None and len(dive.ff_mode):
        modes = sorted({value for value in dive.ff_mode.value[:, 0].tolist() if np.isfinite(value)})
        words.insert(1, f"Feed-forward: {', '.join(map(word_of, modes))}.")
    if dive.counts:
        words.append(
            "Counted in the recording: " + ", ".join(f"{k} {count(n)}" for k, n in dive.counts.items()) + "."
        )
    table = (tables.signals(dive),) if dive.signals() else ()
    return Section(
        f"Recording: {dive.name}",
        "\n\n".join(words),
        table,
        tuple(figure for figure in drawn if figure),
        traces=figures.zoomed_speeds(dive),
        filed=(in_files,) if in_files else (),
    )


def innovations_section(normalised: Mapping[str, Signal], dive: str) -> Section:
    """Whiteness of the residuals of a fit: innovations over their expected standard deviation.

    (n, 1) by degree of freedom; NaN: not used.
    """
    parts, sentences = [], []
    for name, signal in normalised.items():
        value = signal.value[np.isfinite(signal.value[:, 0]), 0]
        if not len(value):
            continue
        beyond = 100 * float((np.abs(value) > 1.96).mean())
        sentences.append(
            f"{name}: root mean square {significant(float(np.sqrt((value**2).mean())))} (1 is expected), "
            f"{significant(beyond, 2)} % beyond the 95 % limits (5 % is expected)."
        )
        parts.append(figures.innovations(dive, name, signal))
    return Section(f"Innovations: {dive}", "\n\n".join(sentences), figures=tuple(parts))


WHY_STANDS = "Why, as far as it can be told, stands in the warning beside the parameters above."


def comparison_section(compared: Comparison) -> Section:
    """Results of both methods for each parameter; a warning names the parameters on which they disagree."""
    first, second = compared.first, compared.second
    columns = ("Parameter", first.method, second.method, "Unit", "Apart, standard errors", "")
    rows = tuple(
        (
            d.first.symbol,
            _with_interval(d.first),
            _with_interval(d.second),
            unit(d.first.unit),
            cells.fixed(d.distance, 2),
            "DISAGREE" if d.disagrees else "",
        )
        for d in compared.differences
        if d.first.identifiable or d.second.identifiable
    )
    heading = f"{first.method} beside {second.method}: {first.dive}"
    caption = (
        "Values with 95 % intervals. Apart: their difference over the larger of the two standard errors."
    )
    apart = ", ".join(d.first.symbol for d in compared.disagreements)
    warning = f"Warning: the methods disagree on {apart}\n\n{WHY_STANDS}" if apart else ""
    return Section(
        capital(heading),
        "\n\n".join((*(() if warning else compared.sentences), *further_remarks(compared))),
        (Table(columns, rows, caption),) if rows else (),
        (),
        warning,
    )


def _with_interval(parameter: Estimate) -> Cell:
    if not parameter.identifiable:
        return MISSING
    value, interval = cells.with_interval(parameter.value, parameter.low95, parameter.high95)
    return value if interval == MISSING else cells.joined(cells.Form.INTERVAL, value, interval)
