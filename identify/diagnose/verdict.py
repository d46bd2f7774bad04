"""The causes of a dive with their probabilities and parameters, the verdict, and the next dive.

Held-out nats would be log odds for a library that holds the truth and noise like the dive's. Neither is exact, and a
margin is worth less: the curve was calibrated on drawn dives with known causes. `make bench` shows its calibration on
others.
"""

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.candidates import Cause, natural_scale
from identify.diagnose.confidence import ambiguity_of, margin_by_filters
from identify.diagnose.gap import Missing
from identify.diagnose.nominal import Nominal
from identify.diagnose.regression import LEVELLED
from identify.diagnose.result import Disturbance, Finding, Gain, Next, Tried, Value, Verdict
from identify.diagnose.rhythms import period_interval
from identify.diagnose.search import (
    LEAST_GAIN,
    LEAST_SIGMA,
    MOST_CAUSES,
    Explanation,
    ranked_candidates,
    required_gain,
)
from identify.diagnose.shrunk import LIKELY, Shrink
from identify.diagnose.simulation import EACH, missing_wrench_of, slope_of
from identify.diagnose.unexplained import (
    UNKNOWN_NATS,
    GenericForce,
    Unexplained,
    Variable,
    beyond_chance,
)
from identify.diagnose.weighing import Fitted, FormRemainder
from identify.effects.course import Course
from identify.effects.effect import Effect
from identify.effects.sensors import WRONG_FEEDBACK_LOG
from identify.estimators.likelihood_axis import DISTURBANCE, TIME_CONSTANT
from identify.side_by_side import side_by_side
from identify.statistics import Z95, left_of

FORM_SHARE = 0.02
"""Share of the causes' nats that a form's remainder may reach: a form right to a seventh of its force leaves as
much."""

LEAST_CLOSED = 1 / 3
"""Share of the closable gap, held out, that the causes must close for a verdict despite an unexplained remainder."""

MOST_DISTURBED = 1 / 3
"""Share of the thrusters' variance up to which a model need not explain the disturbance."""


MOST = 2
"""Number of manoeuvres to ask for: a crew dives one and looks again."""

RUNS = (
    "steady runs ahead and astern at three speeds",
    "steady runs to port and to starboard at three speeds",
    "steady runs up and down at three speeds",
    "rolling to both sides, quickly and slowly",
    "pitching up and down, quickly and slowly",
    "steady turns both ways at three rates",
)
"""Manoeuvres by the degree of freedom of the speed that a force depends on."""

STARTS = (
    "starts and stops ahead and astern, quick and slow",
    "starts and stops to port and to starboard, quick and slow",
    "starts and stops up and down, quick and slow",
    "rolling to both sides, quickly and slowly",
    "pitching up and down, quickly and slowly",
    "turns begun and ended both ways, quickly and slowly",
)

QUIET = 0.25
"""Drift above the floor, in floors, that counts as noise: a force that causes so little was found, but is no gap."""

BATTERY = "the same leg with a fresh and with an empty battery"
THRUSTERS = "one pair of thrusters at a time, from rest"

SPOT = "five minutes on one spot, and five more with the thrusters off"
SEA = "waves, current and tether as the crew sees them, and every thruster's shaft speed"

OTHERS: dict[Variable, str] = {
    "heading": "the same leg on opposite headings",
    "position": "the same leg out and back, near where it began and far from there",
    "depth": "the same run at two depths",
    "altitude": "the same run at two heights above the bottom",
    "time": BATTERY,
    "voltage": BATTERY,
    "thrust": THRUSTERS,
    "thrust_sign": THRUSTERS,
}


def above_noise(
    left: Unexplained, held: Shrink, filtered: Collection[int], known_to: Array | None = None
) -> Unexplained:
    """The unexplained remainder, without degrees of freedom in which the model drifts no more than noise.

    It applies if the causes close enough of the gap on held-out pieces; without a gap there only where even the nominal
    model is less exact: behind an autopilot's filter, which `filtered` has the degrees of freedom of, beside accepted
    effects, which make up forces to `known_to` (6,), N and N m, and in roll and pitch, whose angles are an autopilot's
    estimate and whose motion is mostly its levelling. Slow or rare forces are kept where they are larger than that,
    because a disturbance absorbs them without a drift, and so are reading errors.
    """
    no_gap = math.isnan(held.value)
    if not (held.value >= LEAST_CLOSED or no_gap):
        return left
    judged = range(6) if filtered or known_to is not None or not no_gap else LEVELLED
    least = np.zeros(6) if known_to is None else known_to
    quiet = {
        axis.dof
        for axis in held.by_axis
        if DOFS.index(axis.dof) in judged and axis.after < (1.0 + QUIET) * axis.floor
    }
    kept = [
        k
        for k, (shape, force) in enumerate(zip(left.shapes, left.forces, strict=True))
        if DOFS[shape.dof] not in quiet
        or force <= 0
        or (shape.timing not in (None, "transient") and force >= least[shape.dof])
    ]
    return replace(
        left,
        shapes=tuple(left.shapes[k] for k in kept),
        gains=tuple(left.gains[k] for k in kept),
        forces=tuple(left.forces[k] for k in kept),
    )


def unexplained_forces(left: Unexplained) -> tuple[GenericForce, ...]:
    """The generic forces beyond chance and beyond the causes' form remainder, strongest first."""
    least = FORM_SHARE * left.explained
    return tuple(
        shape
        for shape, gain in zip(left.shapes, left.gains, strict=True)
        if beyond_chance(shape, gain) and gain > least
    )


def unexplained_nats(left: Unexplained) -> float:
    """Nats of the significant generic forces together."""
    significant = {id(shape) for shape in unexplained_forces(left)}
    return sum(gain for shape, gain in zip(left.shapes, left.gains, strict=True) if id(shape) in significant)


def swallowing(disturbance: Sequence[Disturbance]) -> tuple[Disturbance, ...]:
    """Disturbances of driven degrees of freedom that leave a model too little to explain."""
    return tuple(each for each in disturbance if each.driven and each.share > MOST_DISTURBED)


def stand_in(instead_nats: float, saved_nats: float) -> bool:
    """Whether causes only stand in for something that no candidate explains.

    A true cause holds the thrust's delays, several degrees of freedom, or the wrong readings together, in one or two
    numbers. Forces of no particular cause need more of them for less of it, and pay for each on pieces held out. If
    they save more in place of the causes than these do, beyond chance and beyond the remainder of a cause's form, the
    causes are none.
    """
    beyond = instead_nats - saved_nats
    return beyond > UNKNOWN_NATS and beyond > FORM_SHARE * saved_nats


def is_unknown(findings: Sequence[Finding], left: Unexplained, saved_nats: float, closes: float) -> bool:
    """Whether the larger part of a gap is unexplained.

    It is if the causes only stand in for it. Where something is left, it is if the nats left exceed those that the
    causes save, if no cause is accepted, or if the causes certainly close too little of the gap on held-out pieces
    (`closes`: at most so much, NaN if unknown).
    """
    if stand_in(left.instead, saved_nats):
        return True
    left_nats = unexplained_nats(left)
    if left_nats <= 0:
        return False
    accepted = any(cause.probability >= LIKELY for cause in findings)
    return not accepted or left_nats > saved_nats or (math.isfinite(closes) and closes < LEAST_CLOSED)


def verdict_of(
    findings: Sequence[Finding],
    left: Unexplained,
    saved_nats: float,
    closes: float,
    disturbance: Sequence[Disturbance],
) -> Verdict:
    """The verdict on a dive. A model that leaves the motion to the disturbance is not without a gap.

    saved_nats: by the causes together; closes: share of the gap that they close on held-out pieces at most, NaN if
    unknown; disturbance: of every degree of freedom.
    """
    if is_unknown(findings, left, saved_nats, closes):
        return "unknown"
    if unexplained_nats(left) > 0:
        return "partly"
    if not findings:
        return "unknown" if swallowing(disturbance) else "no_gap"
    accepted = [cause for cause in findings if cause.probability >= LIKELY]
    return "ambiguous" if any(cause.also for cause in accepted or findings) else "explained"


def share_left(verdict: Verdict, closes: float) -> float:
    """Share of the closable gap that the causes leave: 0 if everything is explained, NaN if unknown."""
    return 1.0 - float(np.clip(closes, 0.0, 1.0)) if verdict in ("partly", "unknown") else 0.0


def next_of(findings: Sequence[Finding], library: Sequence[Effect]) -> Next | None:
    """Manoeuvres and sensors that separate the ambiguous causes; None without ambiguity."""
    doubtful = [cause for cause in findings if cause.also]
    if not doubtful:
        return None
    by_name = {effect.name: effect for effect in reversed(library)}
    names = [name for cause in doubtful for name in (cause.name, *cause.also)]
    separations = [by_name[name].separation for name in names if name in by_name]
    return Next(
        _each_once(way for separation in separations for way in separation.manoeuvres),
        _each_once(sensor for separation in separations for sensor in separation.sensors),
        _each_once(names),
    )


def next_for_unexplained(left: Sequence[GenericForce], course: Course, more: Next | None) -> Next:
    """Manoeuvres that isolate the unexplained forces, strongest first, followed by those of `more`."""
    asked = [_manoeuvre(shape, course) for shape in left]
    strongest = _each_once(asked)[:MOST]
    more = more or Next()
    return replace(more, manoeuvres=_each_once((*strongest, *more.manoeuvres)))


def next_for_disturbance(more: Next | None) -> Next:
    """Manoeuvre and readings that separate a sea from a force that the model or the recording lacks, before those of
    `more`."""
    more = more or Next()
    return replace(more, manoeuvres=(SPOT, *more.manoeuvres), sensors=more.sensors or (SEA,))


def _each_once(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))


def _manoeuvre(shape: GenericForce, course: Course) -> str:
    if shape.variable == "acceleration":
        return STARTS[_moved(shape.force, course.nu_dot)]
    if shape.variable in ("speed", "yaw_rate"):
        return RUNS[_moved(shape.force, course.nu)]
    if shape.variable == "time" and shape.timing is not None:
        return SPOT
    return OTHERS[shape.variable]


def _moved(force: Array, motion: Array) -> int:
    """The degree of freedom whose motion (n, 6) has a magnitude most correlated with that of a force (n,)."""
    size = np.abs(np.column_stack([force, motion]))
    size -= size.mean(axis=0)
    along = size[:, 1:].T @ size[:, 0] / np.maximum(np.linalg.norm(size[:, 1:], axis=0), 1e-300)
    return int(np.argmax(along))


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


LEVEL = (0, 1)
"""Surge and sway: the feed-forward axes whose error is a speed."""

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


def feedforward_gain(
    cause: Cause, others: Sequence[Cause], missing: Missing, now: Nominal, braking: Array
) -> Gain | None:
    """The feed-forward's gain by a cause, with the masses and dampings fitted together with all causes, as `--accept`
    sends them.

    None if the feed-forward can't compensate the cause. The other causes remain, less their part in masses and
    dampings.
    """
    if not cause.effect.feedforward or cause.act(now.course).wrench is None:
        return None
    wrench = missing_wrench_of(others, now.course)
    left = np.column_stack([_beyond_refit(wrench[:, dof], now.course, dof) for dof in range(6)])
    return feedforward_gain_by(left[::EACH], missing, now, braking)


def feedforward_gain_by(left: Array, missing: Missing, now: Nominal, braking: Array) -> Gain:
    """Velocity errors of the feed-forward alone, by m e' + B e = f.

    f is the disturbance with the missing force before, and with its remainder `left` (n, 6) after, at the times of
    `missing`; B as in `braking_of`.
    """
    before = after = 0.0
    for dof in LEVEL:
        mass, braking_axis = float(now.course.mass[dof]), braking[:, dof]
        noise = _driven(now, dof, float(np.mean(braking_axis)))
        step_s = now.course.step_s * EACH
        before += float(np.mean(_error(missing.wrench[:, dof], mass, braking_axis, step_s) ** 2)) + noise
        after += float(np.mean(_error(left[:, dof], mass, braking_axis, step_s) ** 2)) + noise
    return Gain(float(np.sqrt(before)), float(np.sqrt(after)))


def braking_of(causes: Sequence[Cause], now: Nominal) -> Array:
    """Damping (n, 6) of a velocity error along the dive, N s/m and N m s/rad: the linear damping and the slope of
    causes such as quadratic drag."""
    slope = slope_of([*now.accepted, *causes], now.course)[::EACH]
    return np.asarray(np.maximum(now.course.damping - np.diagonal(slope, axis1=1, axis2=2), 0.0))


def _beyond_refit(force: Array, course: Course, dof: int) -> Array:
    return left_of(np.column_stack([course.nu[:, dof], course.nu_dot[:, dof]]), force)


def _error(force: Array, mass: float, braking: Array, step_s: float) -> Array:
    """Solve m e' + B e = f from rest, with f and B (n,) constant over each step."""
    keep = np.exp(-braking / mass * step_s)
    push = np.where(braking > 0, (1.0 - keep) / np.where(braking > 0, braking, 1.0), step_s / mass)
    out, e = np.empty(len(force)), 0.0
    for i, (decay, gained) in enumerate(zip(keep.tolist(), (push * force).tolist(), strict=True)):
        e = decay * e + gained
        out[i] = e
    return out


def _driven(now: Nominal, dof: int, braking: float) -> float:
    """Variance of the velocity under the disturbance alone.

    The integral of its spectrum for a braked body (a = braking over mass) and a disturbance of second order.
    """
    for problem, of_axis in zip(now.joint.problems, now.joint.slices, strict=True):
        if problem.axis.dof == dof and braking > 0:
            theta_axis = now.theta[of_axis]
            a = braking / float(now.course.mass[dof])
            memory_s, rise_s = float(np.exp(theta_axis[TIME_CONSTANT])), problem.rise_s(theta_axis)
            driven = (
                memory_s * (1.0 + a * rise_s) / (a * ((1.0 + a * rise_s) * (1.0 + a * memory_s) - a * rise_s))
            )
            return float(np.exp(theta_axis[DISTURBANCE]) / now.course.mass[dof]) ** 2 * driven
    return 0.0


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
        probable = probability(group.margin_nats, unexplained_nats)
        if probable < LIKELY:
            margin_nats = margin_by_filters(explanation, k, nominal, library)
            probable = max(probable, probability(margin_nats, unexplained_nats))
        out.append(
            Finding(
                cause,
                group.names,
                group.likeness,
                probable,
                _with_period_interval(cause, parameters_of(fit, k), explanation),
                explanation.fit.gain - others.gain,
                feedforward_gain(cause, _others(explanation, k), missing, explanation.now, braking),
            )
        )
    if FEEDBACK_DOFS & set(explanation.now.feedback_unrecorded):
        out.append(Finding(Cause(WRONG_FEEDBACK_LOG, np.zeros(0)), (), {}, WRONG_LOG_PROBABILITY, {}, 0.0))
    return strongest_first(out)


def strongest_first(causes: Sequence[Finding]) -> tuple[Finding, ...]:
    """Likely causes before possible causes, then by probability in whole per cent, then by nats: some causes rest on
    another test and save none."""

    def rank(finding: Finding) -> tuple[bool, int, float]:
        return finding.probability < LIKELY, -round(100 * finding.probability), -finding.gain_nats

    return tuple(sorted(causes, key=rank))


def trials_of(explanation: Explanation, causes: tuple[Finding, ...]) -> tuple[Tried, ...]:
    """Every candidate, by nats saved; a candidate without a noticeable size saves none, but has its size told."""
    weighing, fit = explanation.weighing, explanation.fit
    equations = weighing.candidates_beyond_forms(fit)
    rejected = [
        _rejected(explanation, *ranked_candidate)
        for ranked_candidate in ranked_candidates(equations, fit, len(equations.settings))
    ]
    accepted = [Tried(cause.cause.effect, cause.gain_nats, True) for cause in causes]
    taken, labels = {cause.key for cause in fit.causes}, {item.label for item in rejected}
    mute = [
        Tried(effect, 0.0, False)
        for effect in weighing.library
        if effect.label not in labels and (effect.name, effect.number) not in taken
    ]
    sizes = _sizes_with_causes(explanation)
    absent = [replace(item, sizes=sizes.get(item.label, {})) for item in (*rejected, *mute)]
    return tuple(sorted((*accepted, *absent), key=lambda each: -each.gain_nats))


def _sizes_with_causes(explanation: Explanation) -> dict[str, dict[str, Value]]:
    """The parameters of each linear effect that is no cause, fitted beside the causes, by label.

    Parameters on which the dive holds nothing are left out, and effects that are told by other parameters.
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
        return f"too little here: {asked:.0f} are asked for"
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
    for name, (value, unit) in cause.effect.told(cause.values).items():
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
    high, low = cause.effect.told(up), cause.effect.told(down)
    return {name: (high[name][0] - low[name][0]) / (2 * h) for name in high}


def _others(explanation: Explanation, k: int) -> tuple[Cause, ...]:
    return (*explanation.causes[:k], *explanation.causes[k + 1 :])
