"""The diagnosis of a dive: location of its gap, its causes, how far it shrinks. No I/O."""

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from bridge.vehicle.coefficients import OF_HULL, AcceptedEffect
from bridge.vehicle.config import Configuration, Prior, VehicleFile
from identify.checks.actuation.motors import miswired_doubts
from identify.checks.actuation.thrust_response import mounted_otherwise
from identify.diagnose.accepted import hull_with_all_causes, known_with_causes, likely_accepted
from identify.diagnose.accepted_before import accepted_causes, library_with_changes
from identify.diagnose.causes.onset import unsought, with_beginnings
from identify.diagnose.causes.shafts import UNKNOWN_BETWEEN, Search, of_likelier_lag, of_shafts
from identify.diagnose.changed import changes_of, shift_of
from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.findings import beside_thrust_gain, findings_of, strongest_first, trials_of
from identify.diagnose.gap.drift import ran_away
from identify.diagnose.gap.measured import gap_of, measured_of
from identify.diagnose.gap.missing import (
    character_of,
    hull_of,
)
from identify.diagnose.lateness import (
    beyond_step,
    lateness_of,
    not_quicker,
    slow_loop,
    with_holding_unknown,
    with_known_holding,
    within_step_note,
)
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
    unjudged_by_check,
    unjudged_causes,
    unjudged_notes,
    without_spikes,
    without_still_velocity,
)
from identify.diagnose.result import Diagnosis, Finding, Value
from identify.diagnose.shrink.check_dive import checked, predict
from identify.diagnose.shrink.contradiction import contradiction_note
from identify.diagnose.shrink.shrink import overstated_note
from identify.diagnose.simulators.simulator import Simulator
from identify.diagnose.verdict import (
    beside_accepted,
    next_for_disturbance,
    next_for_unexplained,
    next_of,
    share_left,
    swallowing,
    unexplained_forces,
    unexplained_nats,
    verdict_of,
)
from identify.diagnose.words.diagnosis import shown_note
from identify.dive import Dive
from identify.effects.effect import OWN_DESCENT, OWN_VELOCITY, Effect
from identify.effects.library import accepted_library, library
from identify.estimators.likelihood.axis import MASS
from identify.estimators.missing_forces.screening import LEAST_FORCE
from identify.ingest.commands import unknown_between
from identify.threads import both
from identify.thrust.shafts import shafts_note

Progress = Callable[[float, str], None]

SEED = 0
"""Seed of the noise draws for the floors: a dive always has the same answer."""


def diagnose(
    dive: Dive,
    file: VehicleFile,
    configuration_name: str,
    *,
    check: Dive | None = None,
    check_file: VehicleFile | None = None,
    effects: Sequence[Effect] | None = None,
    simulator: Simulator | None = None,
    accepted: Mapping[str, Prior] | None = None,
    effects_accepted: Sequence[AcceptedEffect] = (),
    progress: Progress,
) -> Diagnosis:
    """Diagnose a dive, and check on another dive of the same vehicle if `check` is given.

    file, configuration_name: the vehicle file, and which of its configurations was dived; check_file: the same under
    the conditions of the check dive, None if these are the dive's. effects: those to try, None
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
    other_still, other_spiky = tuple[str, ...](), tuple[Spikes, ...]()
    if check is not None:
        check, other_still, other_spiky = _cleaned(check, LEAST_CHECK_S, check.name)
    progress(0.0, "fitting the nominal model")
    configuration = file.vehicle.configurations[configuration_name]
    water = file.vehicle.water
    lacks, lacks_itself = (
        lacking(dive, check, configuration, water),
        lacking(dive, None, configuration, water),
    )
    lag_s = file.vehicle.thrust_curve.lag_s
    full_library = _able(library(configuration, lag_s), lacks, configuration)
    acceptable = _able(accepted_library(configuration, lag_s), lacks, configuration)
    accepted_effects = accepted_causes(effects_accepted, acceptable)
    fitted = fitted_nominal(dive, file, configuration_name)
    as_recorded = dive
    if (known_dive := with_known_holding(dive, fitted)) is not dive:
        dive = known_dive
        check = check and replace(check, commands_hold=dive.commands_hold)
        fitted = fitted_nominal(dive, file, configuration_name)
        full_library = not_quicker(full_library) if not dive.commands_hold else full_library
    if (slow := slow_loop(dive, fitted, file, configuration_name)) is not None:
        dive, fitted = slow.dive, slow.nominal
        check = check and replace(check, commands_hold=dive.commands_hold)
    nominal = accepted_effects.in_force(fitted)
    holds = nominal.accepted
    of_library = {effect.label for effect in full_library}
    further = (cause.effect for cause in holds if cause.effect.label not in of_library)
    asked = (*full_library, *further) if effects is None else _able(effects, lacks, configuration)
    tried = library_with_changes(asked, holds)

    def searched() -> Search:
        commands = dive.thruster_commands
        uncertain = UNKNOWN_BETWEEN if commands is not None and unknown_between(dive, commands) else 0.0
        whole = of_likelier_lag(
            nominal, tried, uncertain, lambda share, words: progress(0.1 + 0.55 * share, words)
        )
        progress(0.66, "looking for causes that begin within the dive")
        return with_beginnings(whole, tried, dive.span_s[0])

    def other_filters() -> Nominal | None:
        if check is None:
            return None
        return accepted_effects.in_force(
            fitted_nominal(check, check_file or file, configuration_name, fitted)
        )

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
    tried = (*tried, *search.beginnings)
    explanation, covariance = search.explanation, search.covariance
    measured = measured_of(explanation, nominal, plain, known_to, rng)
    if slow is None:
        covariance = with_holding_unknown(covariance, explanation.causes, as_recorded)
    missing, left, heldout = measured.missing, measured.left, measured.heldout
    forces = unexplained_forces(left)
    causes = findings_of(explanation, covariance, missing, unexplained_nats(left), nominal, tried)
    causes = beside_thrust_gain(causes, configuration, file.vehicle.thrust_curve.scale_std)
    within_step = tuple[Finding, ...]()
    if slow is None:
        causes, within_step = beyond_step(causes, as_recorded)
    else:
        causes = slow.without_step(causes)
    causes, shown = beside_accepted(causes, heldout) if holds else (causes, ())
    left = replace(left, instead=0.0) if shown else left
    gap, (trials, known) = both(
        lambda: gap_of(explanation, replace(measured, left=left), causes),
        lambda: (
            trials_of(explanation, causes, within_step),
            known_with_causes(explanation.causes, explanation.now),
        ),
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
        prediction = predict(explanation, plain, other, check.name, rng, is_earlier=is_earlier(check, dive))
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
            *within_step_note(within_step),
            *ran_away(measured.drift_before, measured.drift_after),
            *overstated_note(heldout),
            *short_dive_note(dive),
            *short_check_note(check),
            *other_still,
            *(contradiction_note(heldout, shrunk) if causes else ()),
            *((spikes_sentence(spiky),) if spiky and not many else ()),
            *((spikes_sentence(other_spiky, check.name),) if check is not None and other_spiky else ()),
            *((shafts_note(nominal.course.lag_s),) if nominal.course.by_shaft else ()),
            *recording_notes(dive, nominal),
            *unjudged_causes(lacks_itself & {OWN_VELOCITY, OWN_DESCENT}),
        ),
        seconds=time.perf_counter() - began_s,
        prediction=prediction,
        accepted=likely_accepted(causes, explanation, known, nominal, tried, holds, configuration),
        numbers=hull_with_all_causes(known, configuration),
        provisos=(
            *unjudged_notes(nominal),
            *unjudged_causes(lacks_itself - {OWN_VELOCITY, OWN_DESCENT}),
            *unjudged_by_check(lacks - lacks_itself),
            *(unsought(nominal.course, tried) if verdict != "no_gap" else ()),
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


def is_earlier(check: Dive, dive: Dive) -> bool:
    """Whether the check was dived before the dive, for all that their clocks say."""
    check_s, dive_s = (each.unix_at_boot_s for each in (check, dive))
    return check_s is not None and dive_s is not None and check_s + check.span_s[0] < dive_s + dive.span_s[0]


def _cleaned(dive: Dive, least_s: float, name: str = "") -> tuple[Dive, tuple[str, ...], tuple[Spikes, ...]]:
    """The dive without readings that are wrong for certain, a sentence on a velocity left out whole, and the spikes.
    name: of another dive, in that sentence.

    Raises FitError for a dive shorter than `least_s`, or of short runs alone.
    """
    refuse_short(dive, least_s)
    refuse_short_runs(dive)
    dive, still = without_still_velocity(dive, name)
    dive, spiky = without_spikes(dive)
    if dive.attitude is not None:
        dive = replace(dive, attitude=dive.attitude.finite())
    return dive, still, spiky


def _able(
    effects: Sequence[Effect], lacks: Collection[str], configuration: Configuration
) -> tuple[Effect, ...]:
    """The effects whose needs (`Effect.needs`) the recording holds, without those that the hull's model already has."""
    in_model = {"quadratic"} if configuration.damping != "linear" else set()
    return tuple(
        effect for effect in effects if not {*lacks} & {*effect.needs} and effect.model_part not in in_model
    )


def _values(accepted: Mapping[str, Prior]) -> dict[str, Value]:
    """Accepted values without their widths: the gap is that of the crew's own model."""
    return {
        name: Value(prior.value, OF_HULL[name].unit, prior.value, prior.value)
        for name, prior in accepted.items()
    }
