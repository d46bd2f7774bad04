"""How late the thrust of a dive acts, beyond the vehicle file: by its causes and by the fit's residual lateness.

Each axis tests its own thrust for lateness (`misfit.doubts_of`). The axes are averaged by their precision; where they
disagree beyond their errors, the error of the mean grows by as much (Birge 1932).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.diagnose.candidates import Cause
from identify.diagnose.nominal import MOST_LATE, Nominal
from identify.diagnose.result import Finding, Value
from identify.dive import Array, Dive
from identify.estimators.misfit import doubts_of
from identify.ingest.commands import loop_is_recorded, sampled_seldom, sampled_slowly
from identify.statistics import Z95, birge_mean

EARLY, HELD = -0.1, 0.3
"""Shares of the step between two commands: thrust that acts earlier than by the first is no thrust of commands that
hold, and thrust that acts later than by the second none of a faster loop."""


def with_known_holding(dive: Dive, now: Nominal) -> Dive:
    """The dive with commands that hold, or are samples of a faster loop, where its thrust shows other than their rate.

    Thrust of a loop that is much faster than the recording acts half a step earlier than thrust that holds. A delay of
    the thrusters hides the first, and can look like the second. Where the controller logs its wrench the loop is known.
    """
    commands = dive.thruster_commands if dive.thruster_commands is not None else dive.tau_cmd
    known = loop_is_recorded(dive) or dive.commands_hold is not None or dive.reckoned is not None
    if commands is None or known or sampled_seldom(commands):
        return dive
    step_s = 1.0 / commands.rate_hz
    if sampled_slowly(commands):
        held = HELD * step_s < now.late_samples_s < MOST_LATE * step_s
        return replace(dive, commands_hold=True) if held else dive
    late = lateness_of((), now)
    early = late is not None and late.high95 < 0.0 and -step_s < late.value < EARLY * step_s
    return replace(dive, commands_hold=False) if early else dive


def with_holding_unknown(covariance: Array, causes: Sequence[Cause], dive: Dive) -> Array:
    """The covariance (k, k) of causes' present parameters, where that of a late thrust is as uncertain as whether each
    command holds until the next.

    Commands of a faster loop act half a step earlier than the same commands that hold, and a delay takes that up.
    """
    commands = dive.thruster_commands if dive.thruster_commands is not None else dive.tau_cmd
    if (
        commands is None
        or loop_is_recorded(dive)
        or dive.commands_hold is not None
        or dive.reckoned is not None
    ):
        return covariance
    late = [bool(cause.effect.timing) for cause in causes for present in cause.present if present]
    return covariance + np.diag(np.array(late, np.float64) / (12.0 * commands.rate_hz**2))


def lateness_of(findings: Sequence[Finding], now: Nominal) -> Value | None:
    """Lateness in s, with its 95 % interval; None where no axis tells it, as with commands that come too seldom.

    `now`: the filters fitted together with the causes found.
    """
    tests = [
        test.late
        for dof, test in doubts_of(now.joint, now.theta).items()
        if dof not in now.feedback_unrecorded
    ]
    tests = [test for test in tests if test.score and test.size]
    if not tests:
        return None
    left = np.array([test.size for test in tests])
    mean, std = birge_mean(left, np.diag([(test.size / test.score) ** 2 for test in tests]))
    late, variance = mean, std**2
    for finding in findings:
        effect = finding.cause.effect
        if effect.timing:
            (parameter,) = effect.parameters
            late += float(finding.cause.values[0]) - parameter.none
            if parameter.name in finding.parameters:
                value = finding.parameters[parameter.name]
                variance += float(np.nan_to_num((value.high95 - value.low95) / (2 * Z95))) ** 2
    reach = Z95 * float(np.sqrt(variance))
    return Value(late, "s", late - reach, late + reach)
