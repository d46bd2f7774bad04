"""The diagnosis of a dive: location of its gap, its causes, how far it shrinks. No I/O."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import OF_HULL, AcceptedEffect
from bridge.vehicle.config import Prior, VehicleFile
from identify.checks.actuation.motors import miswired_doubts
from identify.checks.actuation.thrust_response import mounted_otherwise
from identify.diagnose.accepted import hull_with_all_causes, known_with_causes, likely_accepted
from identify.diagnose.causes.onset import unsought, with_beginnings
from identify.diagnose.causes.shafts import UNKNOWN_BETWEEN, Search, of_likelier_lag, of_shafts
from identify.diagnose.changed import beyond_the_curve, changes_of, shift_of
from identify.diagnose.cleaned import cleaned
from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.findings import beside_thrust_gain, findings_of, strongest_first, trials_of
from identify.diagnose.gap.drift import ran_away
from identify.diagnose.gap.measured import gap_of, measured_of
from identify.diagnose.gap.missing import (
    character_of,
    hull_of,
)
from identify.diagnose.holding import within_step_note
from identify.diagnose.lateness import lateness_of
from identify.diagnose.notes import mass_hints, recording_notes, short_check_note, short_dive_note
from identify.diagnose.prepared import Prepared, prepared
from identify.diagnose.result import Diagnosis, Value
from identify.diagnose.shrink.check_dive import checked, predict
from identify.diagnose.shrink.contradiction import contradiction_note
from identify.diagnose.shrink.shrink import overstated_note
from identify.diagnose.simulators.simulator import Simulator
from identify.diagnose.unjudged import OF_FILTER, unjudged_by_check, unjudged_causes, unjudged_notes
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
from identify.effects.effect import Effect
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
    of_dive, of_check = cleaned(dive), None if check is None else cleaned(check, check.name)
    progress(0.0, "fitting the nominal model")
    ready = prepared(of_dive, of_check, file, configuration_name, effects, effects_accepted)
    configuration, dive, check = ready.configuration, ready.dive, ready.check
    search, other = both(
        lambda: _searched(ready, progress),
        lambda: ready.nominal_of_check(check_file or file, configuration_name),
    )
    nominal, explanation = search.nominal, search.explanation
    if other is not None and nominal.course.by_shaft:
        other = of_shafts(other)
    progress(0.7, "measuring the gap, and looking at what is left")
    plain = nominal
    if simulator or accepted:
        plain = ready.able(simulator or Simulator(_values(accepted or {}), ())).filters_of(nominal)
    forces_known = known_to(nominal) if ready.held else None
    tried = (*ready.tried, *search.beginnings)
    measured = measured_of(explanation, nominal, plain, forces_known, rng)
    missing, left, heldout = measured.missing, measured.left, measured.heldout
    forces = unexplained_forces(left)
    covariance = ready.loop.known(search.covariance, explanation.causes)
    causes = findings_of(explanation, covariance, missing, unexplained_nats(left), nominal, tried)
    causes = beside_thrust_gain(causes, configuration, file.vehicle.thrust_curve.scale_std)
    causes, within_step = ready.loop.beyond(causes)
    causes, shown = beside_accepted(causes, heldout) if ready.held else (causes, ())
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
        new, slight = beyond_the_curve(new, explanation.now.course)
        causes, shown = strongest_first((*causes, *new)), (*shown, *slight)
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
            *ready.accepted.sentences(ready.held),
            *shown_note(shown),
            *within_step_note(within_step, ready.loop.as_recorded),
            *ran_away(measured.drift_before, measured.drift_after),
            *overstated_note(heldout),
            *short_dive_note(dive),
            *short_check_note(check),
            *(of_check.still if of_check else ()),
            *(contradiction_note(heldout, shrunk) if causes else ()),
            *(() if of_dive.is_spiky else of_dive.sentences),
            *(of_check.sentences if of_check else ()),
            *((shafts_note(nominal.course.lag_s),) if nominal.course.by_shaft else ()),
            *recording_notes(dive, nominal),
            *unjudged_causes(ready.lacks_itself & OF_FILTER),
        ),
        seconds=time.perf_counter() - began_s,
        prediction=prediction,
        accepted=likely_accepted(causes, explanation, known, nominal, tried, ready.held, configuration),
        numbers=hull_with_all_causes(known, configuration),
        provisos=(
            *unjudged_notes(nominal),
            *unjudged_causes(ready.lacks_itself - OF_FILTER),
            *unjudged_by_check(ready.lacks - ready.lacks_itself),
            *(unsought(nominal.course, tried) if verdict != "no_gap" else ()),
            *of_dive.still,
            *(of_dive.sentences if of_dive.is_spiky else ()),
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


def known_to(nominal: Nominal) -> Array:
    """Forces (6,) to which accepted effects are known, N and N m; inf where an estimated angle is among the readings,
    for it wanders by more than such effects."""
    forces = LEAST_FORCE * nominal.course.wrench_of(nominal.course.thrust_n).std(axis=0)
    forces[[*nominal.by_estimated_angle]] = np.inf
    return np.asarray(forces)


def _searched(ready: Prepared, progress: Progress) -> Search:
    """The causes of a dive's gap, those that begin within the dive among them."""
    commands = ready.dive.thruster_commands
    unknown = commands is not None and unknown_between(ready.dive, commands)
    whole = of_likelier_lag(
        ready.nominal,
        ready.tried,
        UNKNOWN_BETWEEN if unknown else 0.0,
        lambda share, words: progress(0.1 + 0.55 * share, words),
    )
    progress(0.66, "looking for causes that begin within the dive")
    return with_beginnings(whole, ready.tried, ready.dive.span_s[0])


def is_earlier(check: Dive, dive: Dive) -> bool:
    """Whether the check was dived before the dive, for all that their clocks say."""
    check_s, dive_s = (each.unix_at_boot_s for each in (check, dive))
    return check_s is not None and dive_s is not None and check_s + check.span_s[0] < dive_s + dive.span_s[0]


def _values(accepted: Mapping[str, Prior]) -> dict[str, Value]:
    """Accepted values without their widths: the gap is that of the crew's own model."""
    return {
        name: Value(prior.value, OF_HULL[name].unit, prior.value, prior.value)
        for name, prior in accepted.items()
    }
