"""The diagnosis of a dive: location of its gap, its causes, how far it shrinks. No I/O."""

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS, OF_HULL, AcceptedEffect
from bridge.vehicle.config import Configuration, Prior, VehicleFile
from identify.checks.actuation.motors import miswired_doubts
from identify.checks.actuation.thrust_response import mounted_otherwise
from identify.diagnose.accepted import hull_with_all_causes, known_with_causes, likely_accepted
from identify.diagnose.accepted_before import accepted_causes, library_with_changes
from identify.diagnose.causes.onset import with_beginnings
from identify.diagnose.causes.search import Explanation
from identify.diagnose.causes.shafts import UNKNOWN_BETWEEN, Search, of_likelier_lag, of_shafts, shafts_note
from identify.diagnose.changed import changes_of, shift_of
from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.findings import FEEDBACK_DOFS, findings_of, strongest_first, trials_of
from identify.diagnose.gap.drift import Drift, drifts, floors_of, ran_away
from identify.diagnose.gap.missing import (
    PUSHED,
    Missing,
    beyond_refit,
    character_of,
    depends_on,
    disturbance_of,
    hull_of,
    missing_of,
    phases_of,
    power_of_drift,
    power_of_generic,
    power_of_remainder,
    shares_of,
    slices_of,
    with_unexplained,
)
from identify.diagnose.gap.simulation import (
    EACH,
    Simulation,
    beyond_motion_of,
    missing_wrench_of,
    simulation_of,
    slope_of,
    specific_force_of,
    velocity_error_of,
)
from identify.diagnose.lateness import lateness_of, slow_loop, with_holding_unknown, with_known_holding
from identify.diagnose.recording import (
    LEAST_CHECK_S,
    LEAST_S,
    MANY,
    Spikes,
    fitted_nominal,
    lacking,
    mass_hints,
    recording_notes,
    refuse_short,
    refuse_short_runs,
    short_check_note,
    short_dive_note,
    spikes_sentence,
    unjudged_causes,
    unjudged_notes,
    without_spikes,
    without_still_velocity,
)
from identify.diagnose.remainder.unexplained import Unexplained, unexplained_of
from identify.diagnose.result import Diagnosis, Finding, Gap, Prediction, Share, Value
from identify.diagnose.shrink.check_dive import checked, predict
from identify.diagnose.shrink.contradiction import contradiction_note
from identify.diagnose.shrink.held_out import held_out_shrink
from identify.diagnose.shrink.shrink import overstated_note
from identify.diagnose.shrink.shrunk import LIKELY, Shrink
from identify.diagnose.simulators.simulator import Simulator
from identify.diagnose.verdict import (
    above_noise,
    beside_accepted,
    next_for_disturbance,
    next_for_unexplained,
    next_of,
    share_left,
    stand_in,
    swallowing,
    unexplained_forces,
    unexplained_nats,
    verdict_of,
)
from identify.diagnose.words.diagnosis import shown_note
from identify.dive import Dive
from identify.effects.effect import OWN_VELOCITY, Effect
from identify.effects.library import library
from identify.estimators.likelihood.axis import MASS
from identify.estimators.missing_forces.screening import LEAST_FORCE
from identify.ingest.commands import unknown_between
from identify.threads import both

Progress = Callable[[float, str], None]

SEED = 0
"""Seed of the noise draws for the floors: a dive always has the same answer."""

ONE_S, FIVE_S = 0, 1
"""Indices of the horizons used for the unexplained remainder and for `gap.before`."""


def diagnose(
    dive: Dive,
    file: VehicleFile,
    configuration_name: str,
    *,
    check: Dive | None = None,
    effects: Sequence[Effect] | None = None,
    simulator: Simulator | None = None,
    accepted: Mapping[str, Prior] | None = None,
    effects_accepted: Sequence[AcceptedEffect] = (),
    progress: Progress,
) -> Diagnosis:
    """Diagnose a dive, and check on another dive of the same vehicle if `check` is given.

    file, configuration_name: the vehicle file, and which of its configurations was dived. effects: those to try, None
    for the whole library. The gap is that of the nominal model fitted to this dive; with a `simulator`, of that
    simulator's model; with values `accepted` earlier, of the nominal model at these values, and changes since then are
    among the causes. With `effects_accepted` the model also holds these effects, those of water and tether where the
    dive bears them out.

    progress: called with the share of the work that is done, 0 to 1, and the next step.

    Raises FitError for a recording that can't be diagnosed: nothing was pushed, or read, it is too short, or of
    another vehicle. Degrees of freedom and effects on which it holds no information are left out, and named in the
    answer.
    """
    began_s = time.perf_counter()
    rng = np.random.default_rng(SEED)
    dive, still, spiky = _cleaned(dive, LEAST_S)
    other_spiky: tuple[Spikes, ...] = ()
    if check is not None:
        check, _, other_spiky = _cleaned(check, LEAST_CHECK_S)
    progress(0.0, "fitting the nominal model")
    configuration = file.vehicle.configurations[configuration_name]
    lacks = lacking(dive, check, configuration)
    full_library = _able(library(configuration, file.vehicle.thrust_curve.lag_s), lacks, configuration)
    accepted_effects = accepted_causes(effects_accepted, full_library)
    fitted = fitted_nominal(dive, file, configuration_name)
    as_recorded = dive
    if (known_dive := with_known_holding(dive, fitted)) is not dive:
        dive = known_dive
        check = check and replace(check, commands_hold=dive.commands_hold)
        fitted = fitted_nominal(dive, file, configuration_name)
    if (slow := slow_loop(dive, fitted, file, configuration_name)) is not None:
        dive, fitted = slow.dive, slow.nominal
        check = check and replace(check, commands_hold=dive.commands_hold)
    nominal = accepted_effects.in_force(fitted)
    holds = nominal.accepted
    asked = full_library if effects is None else _able(effects, lacks, configuration)
    tried = library_with_changes(asked, holds)

    def searched() -> Search:
        commands = dive.thruster_commands
        uncertain = UNKNOWN_BETWEEN if commands is not None and unknown_between(dive, commands) else 0.0
        return of_likelier_lag(
            nominal, tried, uncertain, lambda share, words: progress(0.1 + 0.6 * share, words)
        )

    def other_filters() -> Nominal | None:
        if check is None:
            return None
        return accepted_effects.in_force(fitted_nominal(check, file, configuration_name, fitted))

    search, other = both(searched, other_filters)
    nominal = search.nominal
    if other is not None and nominal.course.by_shaft:
        other = of_shafts(other)
    progress(0.7, "measuring the gap, and looking at what is left")
    reference_model = simulator or Simulator(_values(accepted or {}), ())
    reference_model = replace(
        reference_model,
        causes=tuple(item for item in reference_model.causes if not lacks & {*item.effect.needs}),
    )
    plain = reference_model.filters_of(nominal) if simulator or accepted else nominal
    known_to = LEAST_FORCE * nominal.course.wrench_of(nominal.course.thrust_n).std(axis=0) if holds else None
    measured = _measured(search.explanation, nominal, plain, known_to, rng)
    saved_nats = search.explanation.fit.gain
    if unexplained_forces(measured.left) or stand_in(measured.left.instead, saved_nats):
        progress(0.75, "looking for causes that begin within the dive")
        begun = with_beginnings(search, tried, dive.span_s[0])
        if begun is not search:
            search, tried = begun, (*tried, *begun.beginnings)
            measured = _measured(search.explanation, nominal, plain, known_to, rng)
    explanation, covariance = search.explanation, search.covariance
    if slow is None:
        covariance = with_holding_unknown(covariance, explanation.causes, as_recorded)
    missing, left, heldout = measured.missing, measured.left, measured.heldout
    forces = unexplained_forces(left)
    causes = findings_of(explanation, covariance, missing, unexplained_nats(left), nominal, tried)
    causes = causes if slow is None else slow.without_step(causes)
    causes, shown = beside_accepted(causes, heldout) if holds else (causes, ())
    left = replace(left, instead=0.0) if shown else left
    gap, (trials, known) = both(
        lambda: _gap(explanation, missing, left, measured.drift_before, measured.drift_after, causes),
        lambda: (trials_of(explanation, causes), known_with_causes(explanation.causes, explanation.now)),
    )
    if accepted:
        shift = shift_of(explanation, accepted, tried)
        new, more = changes_of(shift, explanation, missing)
        causes = strongest_first((*causes, *new))
        trials = (*trials, *more)
    verdict = verdict_of(causes, left, explanation.fit.gain, heldout.at_most, gap.disturbance)
    gap = replace(gap, unexplained=share_left(verdict, heldout.value))
    prediction = None
    if check is not None and other is not None:
        progress(0.9, "flying the check dive")
        prediction = predict(explanation, plain, other, check.name, rng)
    dive_next = next_of(causes, tried)
    if forces:
        dive_next = next_for_unexplained(forces, explanation.now.course, dive_next)
    elif verdict == "unknown" or swallowing(gap.disturbance):
        dive_next = next_for_disturbance(dive_next)
    many = any(item.share >= MANY for item in spiky)
    shrunk = None if prediction is None else checked(prediction, rng)
    progress(1.0, "done")
    return Diagnosis(
        dive=dive.name,
        vehicle=file.vehicle.name,
        configuration=configuration_name,
        verdict=verdict,
        gap=gap,
        findings=causes,
        tried=trials,
        character=character_of(left) if forces else None,
        heldout=heldout,
        check=shrunk,
        next=dive_next,
        notes=(
            *mass_hints(explanation.now, [std[MASS] for std in known.stds()], configuration),
            *accepted_effects.sentences(holds),
            *shown_note(shown),
            *ran_away(measured.drift_before, measured.drift_after),
            *overstated_note(heldout),
            *short_dive_note(dive),
            *short_check_note(check),
            *(contradiction_note(heldout, shrunk) if causes else ()),
            *((spikes_sentence(spiky),) if spiky and not many else ()),
            *((spikes_sentence(other_spiky, check.name),) if check is not None and other_spiky else ()),
            *shafts_note(nominal),
            *recording_notes(dive, nominal),
            *unjudged_causes(lacks & {OWN_VELOCITY}),
        ),
        seconds=time.perf_counter() - began_s,
        prediction=prediction,
        accepted=likely_accepted(causes, explanation, known, nominal, tried, holds, configuration),
        numbers=hull_with_all_causes(known, configuration),
        provisos=(
            *unjudged_notes(nominal),
            *unjudged_causes(lacks - {OWN_VELOCITY}),
            *still,
            *((spikes_sentence(spiky),) if many else ()),
        ),
        first=mounted_otherwise(
            nominal.mirrored,
            nominal.swapped,
            [doubt.sentence for doubt in miswired_doubts(dive, file, configuration_name)],
        ),
        held=measured.held,
        correlation=known.correlations(),
        late=lateness_of(causes, explanation.now),
        hull=hull_of(explanation.now),
    )


def _cleaned(dive: Dive, least_s: float) -> tuple[Dive, tuple[str, ...], tuple[Spikes, ...]]:
    """The dive without readings that are wrong for certain, a sentence on a velocity left out whole, and the spikes.

    Raises FitError for a dive shorter than `least_s`, or of short runs alone.
    """
    refuse_short(dive, least_s)
    refuse_short_runs(dive)
    dive, still = without_still_velocity(dive)
    dive, spiky = without_spikes(dive)
    return dive, still, spiky


def _able(
    effects: Sequence[Effect], lacks: Collection[str], configuration: Configuration
) -> tuple[Effect, ...]:
    """The effects whose needs (`Effect.needs`) the recording holds, without those that the hull's model already has."""
    in_model = {"quadratic"} if configuration.damping != "linear" else set()
    return tuple(
        effect for effect in effects if not {*lacks} & {*effect.needs} and effect.model_part not in in_model
    )


@dataclass(frozen=True)
class _Measured:
    """The gap as measured with an explanation: the missing forces, what no cause explains, the drifts of the models
    before and after, and the shrink on held-out pieces with the velocities `held`."""

    missing: Missing
    left: Unexplained
    drift_before: tuple[Drift, ...]
    drift_after: tuple[Drift, ...]
    heldout: Shrink
    held: Prediction


def _measured(
    explanation: Explanation,
    nominal: Nominal,
    plain: Nominal,
    known_to: Array | None,
    rng: np.random.Generator,
) -> _Measured:
    """Measure the gap of the model `plain`; known_to (6,): forces to which accepted effects are known, N and N m."""
    models = both_simulations(explanation, plain)
    wrong, felt = (
        of(explanation.causes, explanation.now.course)[::EACH]
        for of in (velocity_error_of, specific_force_of)
    )
    missing = missing_of(*models, wrong, felt, explanation.now)
    if plain is nominal:
        missing = beyond_refit(
            missing, missing_wrench_of(explanation.causes, explanation.now.course), explanation.now, EACH
        )

    def drifted() -> tuple[list[tuple[Drift, ...]], tuple[Shrink, Prediction]]:
        floors = floors_of(explanation.now, models[1], rng)
        return [drifts(model, floors) for model in models], held_out_shrink(
            explanation, plain, floors[FIVE_S], rng
        )

    # The folds of `drifted` are shared with the other thread once that is free.
    ((drift_before, drift_after), (heldout, held)), left = both(
        drifted, lambda: unexplained_of(explanation.weighing, explanation.fit)
    )
    left = above_noise(left, heldout, nominal.inexact, known_to)
    return _Measured(missing, left, drift_before, drift_after, heldout, held)


def both_simulations(explanation: Explanation, nominal: Nominal) -> tuple[Simulation, Simulation]:
    """Simulations of the nominal model and of the model with the causes, along one recorded motion.

    The first runs against the readings as recorded, the second against readings corrected for the causes.
    """
    now, causes = explanation.now, explanation.causes
    nu, wrong = now.motion.nu, beyond_motion_of(causes, now.course)
    return both(
        lambda: simulation_of(nominal, nominal.theta, nu + wrong),
        lambda: simulation_of(now, now.theta, nu, slope=slope_of(causes, now.course)),
    )


def _gap(
    explanation: Explanation,
    missing: Missing,
    left: Unexplained,
    drift_before: tuple[Drift, ...],
    drift_after: tuple[Drift, ...],
    causes: Sequence[Finding],
) -> Gap:
    now, misheard = explanation.now, FEEDBACK_DOFS & set(explanation.now.feedback_unrecorded)
    # If a wrong log is the only likely cause, possible causes do not locate the gap.
    likely = any(cause.probability >= LIKELY and cause.cause.effect.acts_on != "log" for cause in causes)
    anything_left = bool(unexplained_forces(left))
    located_by_causes = missing.power.any() and (likely or anything_left)
    power, phases = missing.power, phases_of(now.course, EACH)
    unexplained: tuple[Share, ...] = ()
    if anything_left:
        explained = missing.power
        missing = with_unexplained(missing, left, now, EACH)
        sound = [dof for dof in PUSHED if dof not in now.feedback_unrecorded]
        power = missing.power + power_of_remainder(drift_after[ONE_S], missing.time_s, sound)
        unexplained = shares_of(power - explained, phases)
    if misheard and not located_by_causes:
        power = power_of_drift(drift_before[FIVE_S], missing.time_s, sorted(misheard))
    elif not power.any():
        # Without any cause, the generic forces locate the gap; these leave out those with unrecorded feedback.
        power = power_of_generic(left, EACH)
        if now.feedback_unrecorded or not len(power):
            power = power_of_drift(drift_before[FIVE_S], missing.time_s, PUSHED)
    fitted = [problem.axis.dof for problem in now.joint.problems]
    return Gap(
        drift_before[FIVE_S].total,
        drift_before,
        drift_after,
        {DOFS[dof]: float(missing.force()[dof]) if dof in fitted else np.nan for dof in range(6)},
        shares_of(power, phases),
        slices_of(power, now.course, EACH),
        depends_on(missing, now.course, EACH),
        unexplained,
        shares_of(power_of_drift(drift_before[FIVE_S], missing.time_s, range(6)), phases),
        disturbance_of(now),
    )


def _values(accepted: Mapping[str, Prior]) -> dict[str, Value]:
    """Accepted values without their widths: the gap is that of the crew's own model."""
    return {
        name: Value(prior.value, OF_HULL[name].unit, prior.value, prior.value)
        for name, prior in accepted.items()
    }
