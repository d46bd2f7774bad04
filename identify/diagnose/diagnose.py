"""The diagnosis of a dive: where its gap lies, what causes it, how far it shrinks. No I/O."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bridge.effects.accepted import AcceptedEffect
from bridge.effects.effect import Effect
from bridge.effects.library import library
from bridge.errors import FitError
from bridge.vehicle.coefficients import BY_NAME, DOFS
from bridge.vehicle.config import Prior, VehicleFile
from identify.diagnose import borne_out, likely
from identify.diagnose.accept import beside_all, log_stds
from identify.diagnose.candidates import HEARD, found_of, strongest_first, tried_of
from identify.diagnose.changed import changed, shift_of
from identify.diagnose.character import character_of
from identify.diagnose.depends import depends_on
from identify.diagnose.diagnosis import Diagnosis, Found, Gap, Share, Value
from identify.diagnose.drift import Drift, drifts, floors_of, ran_away
from identify.diagnose.evidence import FOLDS
from identify.diagnose.flown import EACH, Flown, felt_by, flown, slope_of, spoilt_by, wrench_of
from identify.diagnose.further import further
from identify.diagnose.generic import Left, left_over
from identify.diagnose.known import held, holding, known_of, since
from identify.diagnose.mirrored import mounted_otherwise
from identify.diagnose.missing import Missing, beyond_refit, missing_of, with_left
from identify.diagnose.nominal import Nominal, nominal_of
from identify.diagnose.predict import predict, windows_of
from identify.diagnose.probability import BESIDE_UNKNOWN, LIKELY
from identify.diagnose.pushed import refuse_unpushed
from identify.diagnose.search import Explanation, explain
from identify.diagnose.shrink import held_out, overstated
from identify.diagnose.simulator import Simulator
from identify.diagnose.spikes import MANY, Spikes, spikes_said, without_spikes
from identify.diagnose.strangers import mass_hints
from identify.diagnose.sure import sure
from identify.diagnose.verdict import is_unknown, next_of, unexplained, verdict_of
from identify.diagnose.where import (
    PUSHED,
    phases_of,
    power_of_drift,
    power_of_left,
    power_of_rest,
    shares_of,
    slices_of,
)
from identify.diagnose.whitened import PIECE_S
from identify.dive import Dive

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

LEAST_S, LEAST_CHECK_S = 60.0, 20.0
TELLING_S = 2 * FOLDS * PIECE_S
"""A shorter dive is diagnosed, but each fold then holds out a piece or none."""

TELLING_CHECK_S = 60.0
"""A check dive that is shorter is flown, but a dozen windows of 5 s tell little."""

MOST_STILL = 0.5
"""Share of a dive over which the velocity may stand still at one value: what is left is not most of the dive."""

SEED = 0
"""Of the noise that floors are drawn with: one dive has one answer."""

ONE_S, FIVE_S = 0, 1
"""Which of the horizons what nothing explains, and `gap.before`, are told of."""


def diagnose(
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    *,
    check: Dive | None = None,
    effects: Sequence[Effect] | None = None,
    simulator: Simulator | None = None,
    accepted: Mapping[str, Prior] | None = None,
    effects_accepted: Sequence[AcceptedEffect] = (),
    progress: Progress,
) -> Diagnosis:
    """The diagnosis of a dive, with `check` on another one of that vehicle; `effects`: the library, all where None.

    With a `simulator` the gap before is that of its model, not of the nominal one that fits this dive best; with values
    `accepted` earlier it is that of the nominal model with these, and what has changed since is among the causes. With
    `effects_accepted` that model holds these effects, too.
    Raises FitError where the recording can't be diagnosed: no velocity, no pulses, no push, too short, another's.
    """
    began_s = time.perf_counter()
    rng = np.random.default_rng(SEED)
    _able(dive, LEAST_S)
    dive, spiky = without_spikes(dive)
    other_spiky: tuple[Spikes, ...] = ()
    if check is not None:
        _able(check, LEAST_CHECK_S)
        check, other_spiky = without_spikes(check)
    progress(0.0, "fitting the nominal model")
    shape = file.vehicle.configurations[configuration]
    whole = library(shape, file.vehicle.thrust_curve.lag_s)
    holds, not_held = known_of(effects_accepted, whole)
    nominal = holding(_nominal(dive, file, configuration), holds)
    other = None if check is None else holding(_nominal(check, file, configuration), holds)
    tried = since(effects or whole, holds)
    found = explain(nominal, tried, lambda share, words: progress(0.1 + 0.6 * share, words))
    found, covariance = sure(found, nominal, tried)
    progress(0.7, "looking at what is left")
    left = left_over(found.ground, found.fit)
    progress(0.8, "measuring the gap")
    before_it = simulator or Simulator(_values(accepted or {}), ())
    plain = before_it.beside(nominal) if simulator or accepted else nominal
    models = beside(found, plain)
    wrong, felt = (of(found.causes, found.now.course)[::EACH] for of in (spoilt_by, felt_by))
    missing = missing_of(*models, wrong, felt, found.now)
    if plain is nominal:
        missing = beyond_refit(missing, wrench_of(found.causes, found.now.course), found.now, EACH)
    floors = floors_of(found.now, models[1], rng)
    before, after = (drifts(model, floors) for model in models)
    causes = found_of(found, covariance, missing)
    gap = _gap(found, missing, left, before, after, causes)
    if is_unknown(left):
        causes = tuple(replace(one, probability=BESIDE_UNKNOWN * one.probability) for one in causes)
    trials = tried_of(found, causes)
    if accepted:
        shift = shift_of(found, accepted, tried)
        new, more = changed(shift, found, missing)
        causes = strongest_first((*causes, *new))
        trials = (*trials, *more)
    heldout = held_out(found, plain, floors[FIVE_S], rng)
    prediction = None
    if check is not None and other is not None:
        progress(0.9, "flying the check dive")
        prediction = predict(found, plain, other, check.name, rng)
    dive_next = next_of(causes, tried)
    if is_unknown(left):
        dive_next = further(unexplained(left), found.now.course, dive_next)
    many = any(one.share >= MANY for one in spiky)
    measured = None if prediction is None else windows_of(prediction).shrink(rng)
    progress(1.0, "done")
    return Diagnosis(
        dive.name,
        file.vehicle.name,
        configuration,
        verdict_of(causes, left),
        gap,
        causes,
        trials,
        character_of(left) if is_unknown(left) else None,
        heldout,
        measured,
        dive_next,
        (
            *mass_hints(found.now, [mass for mass, _ in log_stds(found.causes, found.now)], shape),
            *held(holds),
            *not_held,
            *ran_away(before, after),
            *overstated(heldout),
            *_short_dive(dive),
            *_short(check),
            *(borne_out.note(heldout, measured) if causes else ()),
            *((spikes_said(spiky),) if spiky and not many else ()),
            *((spikes_said(other_spiky, check.name),) if check is not None and other_spiky else ()),
            *_notes(dive, nominal),
        ),
        time.perf_counter() - began_s,
        prediction,
        likely.accepted(causes, found, nominal, tried, holds, shape),
        beside_all(found, shape),
        (
            *_unjudged(nominal),
            *((spikes_said(spiky),) if many else ()),
        ),
        mounted_otherwise(nominal.mirrored, nominal.swapped),
    )


def beside(found: Explanation, nominal: Nominal) -> tuple[Flown, Flown]:
    """The nominal model and the one with the causes in, along one recorded motion: the first against the readings as
    they are, the second against what they would be without the causes."""
    now, causes = found.now, found.causes
    nu, wrong = now.motion.nu, spoilt_by(causes, now.course)
    after = flown(now, now.theta, nu, slope=slope_of(causes, now.course))
    return flown(nominal, nominal.theta, nu + wrong), after


def _gap(
    found: Explanation,
    missing: Missing,
    left: Left,
    before: tuple[Drift, ...],
    after: tuple[Drift, ...],
    causes: Sequence[Found],
) -> Gap:
    now, misheard = found.now, HEARD & set(found.now.doubted)
    # Where a wrong log is all that is accepted, the gap lies where it is, not where what is only possible would act.
    likely = any(one.probability >= LIKELY and one.cause.effect.place != "log" for one in causes)
    told_by_causes = missing.power.any() and (likely or is_unknown(left))
    power, phases = missing.power, phases_of(now.course, EACH)
    unexplained: tuple[Share, ...] = ()
    if is_unknown(left):
        explained = missing.power
        missing = with_left(missing, left, now, EACH)
        sound = [dof for dof in PUSHED if dof not in now.doubted]
        power = missing.power + power_of_rest(after[ONE_S], missing.time_s, sound)
        unexplained = shares_of(power - explained, phases)
    if misheard and not told_by_causes:
        power = power_of_drift(before[FIVE_S], missing.time_s, sorted(misheard))
    elif not power.any():
        # Nothing is sure; it lies where most speaks for it. What is left says nothing of doubted degrees of freedom.
        power = power_of_left(left, EACH)
        if now.doubted or not len(power):
            power = power_of_drift(before[FIVE_S], missing.time_s, PUSHED)
    fitted = [problem.axis.dof for problem in now.joint.problems]
    return Gap(
        before[FIVE_S].total,
        before,
        after,
        {DOFS[dof]: float(missing.force()[dof]) if dof in fitted else np.nan for dof in range(6)},
        shares_of(power, phases),
        slices_of(power, now.course, EACH),
        depends_on(missing, now.course, EACH),
        unexplained,
        shares_of(power_of_drift(before[FIVE_S], missing.time_s, range(6)), phases),
    )


def _values(accepted: Mapping[str, Prior]) -> dict[str, Value]:
    """As they were accepted, whatever their widths: the gap is that of the very model that the crew has."""
    return {
        name: Value(one.value, BY_NAME[name].unit, one.value, one.value) for name, one in accepted.items()
    }


def _able(dive: Dive, least_s: float) -> None:
    """Raises FitError where a recording holds too little to be diagnosed."""
    if dive.velocity is None or not np.isfinite(dive.velocity.value).any():
        raise FitError(
            f"{dive.source}: no velocity was recorded, so there is nothing to compare a model with; record the DVL"
        )
    still_s = sum(end_s - start_s for start_s, end_s in dive.frozen.get("velocity", ()))
    if still_s > MOST_STILL * dive.duration_s:
        raise FitError(
            f"{dive.source}: the velocity repeats one value for {still_s:.0f} s of {dive.duration_s:.0f} s while the "
            "vehicle goes on: a diagnosis would tell of the sensor, not of the vehicle; check the DVL, and what passes "
            "its readings on, and dive again"
        )
    if dive.duration_s < least_s:
        cut = "ends in the middle of a record, and what comes before " if dive.counts.get("cut") else ""
        mend = "copy the whole file, or " if cut else ""
        raise FitError(
            f"{dive.source}: {cut}lasts {math.floor(dive.duration_s)} s, too short to tell one cause from another; "
            f"{mend}record {least_s:.0f} s or more, with starts, stops and turns"
        )


def _nominal(dive: Dive, file: VehicleFile, configuration: str) -> Nominal:
    """The nominal fit of a dive of that vehicle. Raises FitError where it is another's, or none pushed."""
    try:
        refuse_unpushed(dive, file, configuration)
        nominal = nominal_of(dive, file, configuration)
    except FitError as error:
        # Two recordings of one name are told apart by where they lie.
        said = str(error).removeprefix(f"{dive.source}: ").removeprefix(f"{dive.name}: ")
        raise FitError(f"{dive.source}: {said}") from None
    if nominal.built.strange:
        raise FitError(
            f"{dive.source}: {nominal.built.strange}; give the vehicle file and the configuration that it was dived "
            "with"
        )
    return nominal


def _short_dive(dive: Dive) -> tuple[str, ...]:
    """That small causes can't be told from chance in a dive that holds too few pieces to hold out."""
    if dive.duration_s >= TELLING_S:
        return ()
    return (
        f"The dive lasts {math.floor(dive.duration_s)} s: with so few pieces of {PIECE_S:.0f} s to hold out, a small "
        f"cause can hardly be told from chance; dive {TELLING_S:.0f} s or more.",
    )


def _short(check: Dive | None) -> tuple[str, ...]:
    """That a check dive can't tell, where it can't."""
    if check is None or check.duration_s >= TELLING_CHECK_S:
        return ()
    return (
        f"The check dive lasts {math.floor(check.duration_s)} s, too short to tell how far the gap shrinks; dive "
        f"{TELLING_CHECK_S:.0f} s or more to check on.",
    )


def _notes(dive: Dive, nominal: Nominal) -> tuple[str, ...]:
    doubted = [
        f"In {DOFS[dof]} the controller used a reading that was not recorded: what its thrust did there is left out "
        "of the evidence."
        for dof in nominal.doubted
    ]
    return tuple(dict.fromkeys((*doubted, *_wild(nominal), *nominal.built.notes, *dive.notes)))


def _unjudged(nominal: Nominal) -> tuple[str, ...]:
    """Which degrees of freedom that thrust pushes were not looked at, and why: a verdict does not hold there."""
    why = nominal.built.missing
    return tuple(f"{DOFS[dof].capitalize()} was not judged: {why[dof]}." for dof in PUSHED if dof in why)


def _wild(nominal: Nominal) -> tuple[str, ...]:
    """How many readings of each degree of freedom were so far off that they were left out."""
    told = []
    for problem in nominal.joint.problems:
        read = np.isfinite(problem.axis.reading)
        wild = int(np.count_nonzero(read & ~np.isfinite(problem.reading)))
        if wild:
            share = 100.0 * wild / np.count_nonzero(read)
            told.append(f"{wild} in {DOFS[problem.axis.dof]} ({share:.2g} %)")
    if not told:
        return ()
    return (
        f"Readings that are far off from those before and after, spikes, were left out: {', '.join(told)}.",
    )
