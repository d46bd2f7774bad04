"""How late the thrust of a dive acts, beyond the vehicle file: by its causes and by the fit's residual lateness.

Each axis tests its own thrust for lateness (`drag_and_timing.doubts_of`).
"""

from collections.abc import Sequence

import numpy as np

from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.result import Finding, Value
from identify.estimators.missing_forces.drag_and_timing import Doubts, doubts_of
from identify.estimators.timing.sampled_commands import mean_lateness_s
from identify.statistics import Z95


def tests_of(now: Nominal) -> tuple[Doubts, ...]:
    """The tests of each axis whose controller used recorded readings."""
    tests = doubts_of(now.joint, now.theta)
    return tuple(test for dof, test in tests.items() if dof not in now.feedback_unrecorded)


def lateness_of(findings: Sequence[Finding], now: Nominal) -> Value | None:
    """Lateness in s, with its 95 % interval; None if no axis shows it, for example because commands come too seldom.

    `now`: the filters fitted together with the causes found.
    """
    mean = mean_lateness_s(tests_of(now))
    if mean is None:
        return None
    late, variance = mean[0], mean[1] ** 2
    for finding in findings:
        effect = finding.cause.effect
        if effect.timing:
            (parameter,) = effect.parameters
            value = finding.parameters.get(parameter.name)
            late += (float(finding.cause.values[0]) if value is None else value.value) - parameter.none
            if value is not None:
                variance += float(np.nan_to_num((value.high95 - value.low95) / (2 * Z95))) ** 2
    reach = Z95 * float(np.sqrt(variance))
    return Value(late, "s", late - reach, late + reach)
