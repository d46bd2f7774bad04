"""The causes of a dive as an answer holds them: probability, parameters with intervals, and what each candidate that
is no cause would save.

Held-out nats would be log odds for a library that holds the truth and noise like the dive's. Neither is exact, and a
margin is worth less: the curve was calibrated on drawn dives with known causes. `make bench` shows its calibration on
others.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import Configuration
from identify.diagnose.causes.ambiguity import absorbed_instead, ambiguity_of, margin_by_filters
from identify.diagnose.causes.candidates import Cause, natural_scale
from identify.diagnose.causes.form_remainder import FormRemainder
from identify.diagnose.causes.ranking import ranked_candidates
from identify.diagnose.causes.requirement import LEAST_GAIN, LEAST_SIGMA, required_gain, sought_nats
from identify.diagnose.causes.search import Explanation
from identify.diagnose.causes.seas import period_interval
from identify.diagnose.causes.selection import MOST_CAUSES
from identify.diagnose.causes.weighing import Fitted
from identify.diagnose.feedforward_gain import braking_of, feedforward_gain
from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.gap.missing import Missing
from identify.diagnose.result import Finding, Tried, Value
from identify.diagnose.shrink.shrunk import LIKELY
from identify.effects.actuators import THRUST_GAIN
from identify.effects.effect import Effect
from identify.effects.sensors import WRONG_FEEDBACK_LOG
from identify.statistics import Z95
from identify.threads import side_by_side

MOST_PROBABLE, HALF_NATS = 0.98, 6.0
"""Probability at infinite margin, and the margin for half of it."""

TAKEN_UP = 0.25
"""Share of the nats of unexplained forces that a cause may have taken up by its wrong form."""


def probability(margin_nats: float, unexplained_nats: float = 0.0) -> float:
    """Probability that a cause, or a member of its ambiguity group, is present, given unexplained forces of so many
    nats.

    The margin counts by its share of the margin and the nats that the cause may have taken up from these forces: next
    to a large unknown force a small margin means little, while a large margin keeps its value.
    """
    margin = min(max(margin_nats, 0.0), 1e6)
    margin *= margin / max(margin + TAKEN_UP * unexplained_nats, 1e-9)
    return MOST_PROBABLE * margin / (margin + HALF_NATS)


WRONG_LOG_PROBABILITY = 0.9
"""Probability that a recording lacks the controller's input, if its wrench follows from no recorded reading.

Other explanations, such as a changed gain, are indistinguishable here.
"""

FEEDBACK_DOFS = {0, 1, 5}
"""Surge, sway and yaw: in heave a controller may filter depth itself, and its roll and pitch inputs are seldom
recorded."""

PERIOD = "period"

NEAR = 1e-3
"""Relative step of a parameter for derivatives of the answer."""


def findings_of(
    explanation: Explanation,
    covariance: Array,
    missing: Missing,
    unexplained_nats: float,
    nominal: Nominal,
    library: Sequence[Effect],
) -> tuple[Finding, ...]:
    """The causes with parameters and intervals by their covariance (k, k), strongest first.

    unexplained_nats: of the significant generic forces in addition to the causes; nominal: the filters without any
    cause, which are fitted again with rivals of a doubtful one.
    """
    fit = replace(explanation.fit, covariance=covariance)
    out, braking = [], braking_of(explanation.causes, explanation.now)
    # Made before the causes are looked at side by side, so that all take their columns from the same place.
    explanation.weighing.candidates_with_fit(explanation.fit)
    groups = side_by_side(lambda k: ambiguity_of(explanation, k), range(len(explanation.causes)))
    for k, (cause, group) in enumerate(zip(explanation.causes, groups, strict=True)):
        others = explanation.weighing.fitted(_others(explanation, k))
        sought = sought_nats(cause.effect)
        probable = probability(group.margin_nats - sought, unexplained_nats)
        if probable < LIKELY:
            margin_nats = margin_by_filters(explanation, k, nominal, library) - sought
            probable = max(probable, probability(margin_nats, unexplained_nats))
        out.append(
            Finding(
                cause,
                (*group.names, *absorbed_instead(explanation, k, nominal, library)),
                group.likeness,
                probable,
                _with_period_interval(cause, parameters_of(fit, k), explanation),
                explanation.fit.gain - others.gain,
                feedforward_gain(cause, _others(explanation, k), missing, explanation.now, braking),
                group.thrusters,
            )
        )
    if FEEDBACK_DOFS & set(explanation.now.feedback_unrecorded):
        out.append(Finding(Cause(WRONG_FEEDBACK_LOG, np.zeros(0)), (), {}, WRONG_LOG_PROBABILITY, {}, 0.0))
    return strongest_first(out)


def beside_thrust_gain(
    causes: Sequence[Finding], configuration: Configuration, scale_std: float
) -> tuple[Finding, ...]:
    """The causes, with the thrust's gain beside one that differs from the vehicle file (`Effect.in_file`) by no more
    than the thrust may be off by, of relative standard deviation `scale_std`.

    Masses and drags are fitted to the thrust, and take up a gain of it. A buoyancy or righting moment of the file is
    held against the thrust, and seems to differ by that gain.
    """

    def may_be_gain(cause: Cause) -> bool:
        in_file = cause.effect.in_file
        # One that begins within the dive is no error of the thrust, which lasts.
        of_file = 0.0 if in_file is None or cause.effect.since_s else in_file(configuration)
        by_thrust = of_file + float(cause.values[0]) if of_file else 0.0
        return by_thrust != 0.0 and abs(of_file / by_thrust - 1.0) <= Z95 * scale_std

    return tuple(
        replace(each, also=(*each.also, THRUST_GAIN.name)) if may_be_gain(each.cause) else each
        for each in causes
    )


def strongest_first(causes: Sequence[Finding]) -> tuple[Finding, ...]:
    """Likely causes before possible causes, then by probability in whole per cent, then by nats: some causes rest on
    another test and save none."""

    def rank(finding: Finding) -> tuple[bool, int, float]:
        return finding.probability < LIKELY, -round(100 * finding.probability), -finding.gain_nats

    return tuple(sorted(causes, key=rank))


def trials_of(
    explanation: Explanation, causes: tuple[Finding, ...], within_step: tuple[Finding, ...] = ()
) -> tuple[Tried, ...]:
    """Every candidate that acts from the start of the dive, by nats saved; a candidate without a noticeable size saves
    none, but has its size told. within_step: late thrusts that the unknown between two commands may be."""
    weighing, fit = explanation.weighing, explanation.fit
    equations = weighing.candidates_beyond_forms(fit)
    rejected = [
        _rejected(explanation, *ranked_candidate)
        for ranked_candidate in ranked_candidates(equations, fit, len(equations.settings))
        if not ranked_candidate[-1].effect.since_s
    ]
    taken_up = [Tried(cause.cause.effect, cause.gain_nats, True) for cause in causes]
    taken_up += [
        Tried(late.cause.effect, late.gain_nats, False, "as much as is unknown between two commands")
        for late in within_step
    ]
    taken, labels = {cause.key for cause in fit.causes}, {item.label for item in rejected}
    mute = [
        Tried(effect, 0.0, False)
        for effect in weighing.library
        if not effect.since_s and effect.label not in labels and (effect.name, effect.number) not in taken
    ]
    sizes = _sizes_with_causes(explanation)
    absent = [replace(item, sizes=sizes.get(item.label, {})) for item in (*rejected, *mute)]
    return tuple(sorted((*taken_up, *absent), key=lambda each: -each.gain_nats))


def _sizes_with_causes(explanation: Explanation) -> dict[str, dict[str, Value]]:
    """The parameters of each linear effect that is no cause, fitted beside the causes, by label.

    Left out are parameters on which the dive has no information, and effects reported by other parameters.
    """
    candidates = explanation.weighing.candidates_with_fit(explanation.fit)
    taken = {cause.key for cause in explanation.fit.causes}
    out: dict[str, dict[str, Value]] = {}
    for setting in candidates.settings:
        effect = setting.effect
        if not effect.linear or effect.telling is not None or (effect.name, effect.number) in taken:
            continue
        evidence = candidates.equations.evidence(setting.columns)
        values = effect.none() + evidence.size @ setting.steps
        half = Z95 * np.abs(np.diag(setting.steps)) * np.sqrt(np.diag(evidence.covariance))
        out[effect.label] = {
            parameter.name: Value(value, parameter.unit, value - reach, value + reach)
            for parameter, value, reach in zip(effect.parameters, values.tolist(), half.tolist(), strict=True)
            if math.isfinite(reach)
        }
    return out


def _rejected(explanation: Explanation, gain: float, sigma: float, cause: Cause) -> Tried:
    """A rejected candidate, fitted in full with the causes if it seems to save enough."""
    fit, why = explanation.fit, ""
    if gain > LEAST_GAIN:
        with_candidate = explanation.weighing.fitted((*fit.causes, cause))
        shows = len(with_candidate.causes) > len(fit.causes) and with_candidate.causes[-1].shows
        gain = min(gain, with_candidate.gain - fit.gain) if shows else 0.0
    if gain > LEAST_GAIN:
        why = _reason(explanation, gain, sigma, cause)
    return Tried(cause.effect, gain, False, why)


def _reason(explanation: Explanation, gain: float, sigma: float, cause: Cause) -> str:
    if len(explanation.causes) >= MOST_CAUSES:
        return f"no dive tells more than {MOST_CAUSES} causes"
    asked = required_gain(FormRemainder(explanation.weighing, explanation.fit), cause)
    if gain <= asked:
        return f"too little here: {asked:.0f} nats are asked for"
    if sigma <= LEAST_SIGMA:
        return "not in all parts of the dive"
    return "in doubt: it comes and goes with what else is accepted"


def parameters_of(fit: Fitted, k: int) -> dict[str, Value]:
    """A cause's parameters as in the answer, with first-order 95 % intervals within their bounds; undetermined
    parameters are left out."""
    cause = fit.causes[k]
    indices = [i for i, (cause_index, _) in enumerate(fit.at) if cause_index == k]
    moved = [fit.at[i][1] for i in indices]
    covariance = fit.covariance[np.ix_(indices, indices)]
    mute = {
        parameter.name
        for p, parameter in enumerate(cause.effect.parameters)
        if p not in moved and cause.effect.telling is None
    } | _undetermined(cause, moved, np.sqrt(np.diag(covariance)))
    slopes = [_slope(cause, p) for p in moved]
    bounds = (
        {}
        if cause.effect.telling
        else {parameter.name: (parameter.low, parameter.high) for parameter in cause.effect.parameters}
    )
    out = {}
    for name, (value, unit) in cause.effect.answer_parameters(cause.values).items():
        if name in mute:
            continue
        slope = np.array([parameter[name] for parameter in slopes])
        std = float(np.sqrt(max(slope @ covariance @ slope, 0.0)))
        ends = value + Z95 * std * np.array([-1.0, 1.0]) if np.isfinite(std) else np.full(2, np.nan)
        low, high = np.clip(ends, *bounds.get(name, (-np.inf, np.inf))).tolist()
        out[name] = Value(value, unit, low, high)
    return out


def _with_period_interval(
    cause: Cause, values: dict[str, Value], explanation: Explanation
) -> dict[str, Value]:
    """Add an interval for a sea's period, which is read off a spectrum and is no parameter of the fit."""
    if not cause.effect.sea or PERIOD not in values:
        return values
    period, course = values[PERIOD], explanation.weighing.now.course
    low, high = period_interval(period.value, float(course.since_s[-1]))
    return values | {PERIOD: replace(period, low95=low, high95=high)}


def _undetermined(cause: Cause, moved: Sequence[int], std: Array) -> set[str]:
    """Names of parameters, std (k,), with a 95 % interval that spans both absence and a large value.

    For example, a damping in a degree of freedom that hardly moves.
    """
    if cause.effect.telling is not None:
        return set()
    vague = set()
    for p, std_p in zip(moved, std.tolist(), strict=True):
        parameter = cause.effect.parameters[p]
        if std_p > max(natural_scale(parameter), abs(cause.values[p] - parameter.none) / Z95):
            vague.add(parameter.name)
    return vague if len(vague) < len(moved) else set()


def _slope(cause: Cause, p: int) -> dict[str, float]:
    """Derivatives of the answer's parameters by parameter p."""
    h = NEAR * natural_scale(cause.effect.parameters[p])
    up, down = cause.values.copy(), cause.values.copy()
    up[p] += h
    down[p] -= h
    high, low = cause.effect.answer_parameters(up), cause.effect.answer_parameters(down)
    return {name: (high[name][0] - low[name][0]) / (2 * h) for name in high}


def _others(explanation: Explanation, k: int) -> tuple[Cause, ...]:
    return (*explanation.causes[:k], *explanation.causes[k + 1 :])
