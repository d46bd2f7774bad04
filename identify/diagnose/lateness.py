"""How late the thrust of a dive acts, beyond the vehicle file: by its causes and by the fit's residual lateness.

Each axis tests its own thrust for lateness (`misfit.doubts_of`). The axes are averaged by their precision; where they
disagree beyond their errors, the error of the mean grows by as much (Birge 1932).
"""

from collections.abc import Sequence

import numpy as np

from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.result import Finding, Value
from identify.estimators.missing_forces.drag_and_timing import doubts_of
from identify.statistics import Z95, birge_mean


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
            value = finding.parameters.get(parameter.name)
            late += (float(finding.cause.values[0]) if value is None else value.value) - parameter.none
            if value is not None:
                variance += float(np.nan_to_num((value.high95 - value.low95) / (2 * Z95))) ** 2
    reach = Z95 * float(np.sqrt(variance))
    return Value(late, "s", late - reach, late + reach)
