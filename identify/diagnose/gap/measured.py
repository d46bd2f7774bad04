"""The gap as measured with an explanation, and as an answer has it: its size, its place and its remainder."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.causes.search import Explanation
from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.findings import FEEDBACK_DOFS
from identify.diagnose.gap.drift import Drift, drifts, floors_of
from identify.diagnose.gap.missing import (
    PUSHED,
    Missing,
    beyond_refit,
    depends_on,
    disturbance_of,
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
from identify.diagnose.remainder.unexplained import Unexplained, unexplained_of
from identify.diagnose.result import Finding, Gap, Prediction, Share
from identify.diagnose.shrink.held_out import held_out_shrink
from identify.diagnose.shrink.shrunk import LIKELY, Shrink
from identify.diagnose.verdict import above_noise, unexplained_forces
from identify.threads import both

ONE_S, FIVE_S = 0, 1
"""Indices of the horizons used for the unexplained remainder and for `gap.before`."""


@dataclass(frozen=True)
class Measured:
    """The gap as measured with an explanation: the missing forces, what no cause explains, the drifts of the models
    before and after, and the shrink on held-out pieces with the velocities `held`."""

    missing: Missing
    left: Unexplained
    drift_before: tuple[Drift, ...]
    drift_after: tuple[Drift, ...]
    heldout: Shrink
    held: Prediction


def measured_of(
    explanation: Explanation,
    nominal: Nominal,
    plain: Nominal,
    known_to: Array | None,
    rng: np.random.Generator,
) -> Measured:
    """Measure the gap of the model `plain`; known_to (6,): forces to which accepted effects are known, N and N m."""
    models = _both_simulations(explanation, plain)
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
    return Measured(missing, left, drift_before, drift_after, heldout, held)


def _both_simulations(explanation: Explanation, nominal: Nominal) -> tuple[Simulation, Simulation]:
    """Simulations of the nominal model and of the model with the causes, along one recorded motion.

    The first runs against the readings as recorded, the second against readings corrected for the causes.
    """
    now, causes = explanation.now, explanation.causes
    nu, wrong = now.motion.nu, beyond_motion_of(causes, now.course)
    return both(
        lambda: simulation_of(nominal, nominal.theta, nu + wrong),
        lambda: simulation_of(now, now.theta, nu, slope=slope_of(causes, now.course)),
    )


def gap_of(explanation: Explanation, measured: Measured, causes: Sequence[Finding]) -> Gap:
    """The gap as an answer has it, with the causes as found."""
    missing, left = measured.missing, measured.left
    drift_before, drift_after = measured.drift_before, measured.drift_after
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
        depends_on(missing, now, EACH),
        unexplained,
        shares_of(power_of_drift(drift_before[FIVE_S], missing.time_s, range(6)), phases),
        disturbance_of(now),
    )
