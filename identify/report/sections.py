"""Sections of a report, each built from the result of a step of the chain."""

from collections.abc import Mapping

import numpy as np

from bridge.vehicle.coefficients import BY_NAME, MASSES
from bridge.vehicle.config import Configuration, Water
from identify.dive import Array, Dive, Signal
from identify.fixes import check_fixes
from identify.identification import Identification, Outcome, added_mass, estimate
from identify.report import figures, tables, tracking
from identify.report.page import Figure, Section
from identify.report.plot import stack
from identify.report.tables import nuisance_tables
from identify.report.tracking import Reference
from identify.validate import TrackingErrors
from identify.words import capital, count, fixed, seconds, significant

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
FF_MODE_WORDS = ("off", "shadow", "feed-forward only", "feed-forward and PID")


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
        (*table, *nuisance_tables(i.nuisance, i.settings)),
        (drawn,) if drawn else (),
        "\n\n".join(_warnings(doubts) if good else _doubt(i)),
    )


def _warnings(doubts: tuple[str, ...]) -> tuple[str, ...]:
    """Warning about doubted parts of an otherwise usable answer."""
    return (PARTLY, *doubts) if doubts else ()


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


def dive_section(dive: Dive, water: Water | None = None) -> Section:
    """Content of a recording: path, speeds, depth, thruster commands, rates and gaps, notes."""
    start_s = dive.span_s[0]
    drawn = [path] if (path := figures.track(dive)) else []
    if speeds := figures.speeds(dive):
        drawn.append(speeds)
    if depth := figures.depth(dive, water or Water()):
        signal, caption = depth
        drawn.append(Figure(f"depth {dive.name}", caption, stack([figures.depth_panel(signal, dive)])))
    if dive.pwm is not None and len(dive.pwm):
        drawn.append(figures.thrusters(dive.pwm, dive))
    words = [
        f"Read from {dive.source.name} (SHA-256 {dive.sha256[:16]}): {seconds(dive.duration_s)}. "
        f"Plots start at boot time {fixed(start_s, 1)} s.",
        *dive.notes,
    ]
    if check := check_fixes(dive):
        words.append(check.sentence)
    if modes := _modes(dive):
        words.insert(1, f"Feed-forward: {modes}.")
    if dive.counts:
        words.append(
            "Counted in the recording: " + ", ".join(f"{k} {count(n)}" for k, n in dive.counts.items()) + "."
        )
    table = (tables.signals(dive),) if dive.signals() else ()
    return Section(f"Recording: {dive.name}", "\n\n".join(words), table, tuple(drawn))


def _modes(dive: Dive) -> str:
    if dive.ff_mode is None or not len(dive.ff_mode):
        return ""
    seen = sorted({int(v) for v in dive.ff_mode.value[:, 0] if np.isfinite(v)})
    return ", ".join(FF_MODE_WORDS[m] if 0 <= m < len(FF_MODE_WORDS) else f"unknown mode {m}" for m in seen)


def tracking_section(
    errors: Mapping[str, TrackingErrors], dives: Mapping[str, Dive], paper: Reference | None = None
) -> Section:
    """How runs in different modes followed their references; both mappings are by the mode in words, in order.

    `paper`: published errors, as a further column.
    """
    drawn = tuple(figure for mode, dive in dives.items() for figure in tracking.curves(mode, dive).values())
    words = (
        "The phases follow the reference: speeding up, steady, slowing down. Delay is how much later the measured "
        "speed looks most like the reference."
    )
    error_tables = tracking.error_tables(errors, paper)
    return Section("Tracking", words if error_tables else "", error_tables, drawn)


def training_section(
    curves: Mapping[str, Array], units: Mapping[str, str] | None = None, dive: str = ""
) -> Section:
    """Training curves by parameter, (epochs,) each; `units` of names that are not coefficients; `dive`: its name."""
    drawn = {name: values for name, values in curves.items() if len(values)}
    known = {
        name: (units or {}).get(name) or (BY_NAME[name].unit if name in BY_NAME else "1") for name in drawn
    }
    heading = f"Training: {dive}" if dive else "Training"
    return Section(heading, figures=(figures.training(dive, drawn, known),) if drawn else ())


def innovations_section(normalised: Mapping[str, Signal], dive: str = "") -> Section:
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
    return Section(
        f"Innovations: {dive}" if dive else "Innovations", "\n\n".join(sentences), figures=tuple(parts)
    )
