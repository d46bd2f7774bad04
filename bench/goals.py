"""The goals of the accuracy benchmark, each with its figure and whether it is met."""

import math
from collections.abc import Sequence

import numpy as np

from bench.tally import Tally, inside95, root_mean_square
from bench.words import in_a_word, paragraph, table

JUDGED = ("likelihood", "pinn")
RATIO_GOAL = 1.15
COVERAGE_GOAL = (0.93, 0.97)
BEYOND_3_GOAL = 0.006


def verdicts(one: Tally) -> list[tuple[str, bool]]:
    """Each goal's figure in words and whether it meets the goal, in the order of `lines`.

    Errors beyond 3 or 5 standard errors are counted among the cases that state a standard error.
    """
    ratio = root_mean_square(one.cases)
    share, low, high = inside95(one.cases)
    z = [abs(case.z) for case in one.cases if math.isfinite(case.z)]
    beyond_3 = float(np.mean([size > 3 for size in z])) if z else math.nan
    silent = sum(abs(case.z) > 5 and not case.warned for case in one.cases)
    least, most = COVERAGE_GOAL
    return [
        (f"{ratio:.3f}", ratio <= RATIO_GOAL),
        (f"{100 * share:.1f} % ({100 * low:.1f} to {100 * high:.1f})", least <= share <= most),
        (f"{100 * beyond_3:.2f} % of {len(z)}", beyond_3 <= BEYOND_3_GOAL),
        (str(silent), bool(z) and silent == 0),
    ]


def lines(tallies: Sequence[Tally]) -> list[str]:
    """The verdicts of the methods that have goals, side by side; a method that was not run or states nothing says
    so."""
    words = [
        f"rms error over the bound, of what is stated: at most {RATIO_GOAL:g}",
        f"pooled coverage of the 95 % intervals: {100 * COVERAGE_GOAL[0]:g} to {100 * COVERAGE_GOAL[1]:g} %",
        f"beyond 3 standard errors: at most {100 * BEYOND_3_GOAL:g} %",
        "beyond 5 standard errors without a warning: none",
    ]
    judged = {tallied.method: tallied for tallied in tallies if tallied.method in JUDGED and tallied.cases}
    results = {method: verdicts(tallied) for method, tallied in judged.items()}
    rows = [
        (
            goal,
            *(
                f"{results[m][i][0]}: {in_a_word(results[m][i][1])}" if m in results else "nothing to judge"
                for m in JUDGED
            ),
        )
        for i, goal in enumerate(words)
    ]
    refused = "; ".join(
        f"`{method}` {tallied.refused} of {tallied.refused + len(tallied.cases)} ({100 * tallied.refused_share:.1f} %)"
        for method, tallied in judged.items()
    )
    return [
        "Goals:",
        "",
        *table(("goal", *JUDGED), rows),
        "",
        *paragraph(
            "Every figure of an error is of stated coefficients alone: one that a method refuses though its bound is",
            f"below 30 % has no value and so no error, and is in none of them. So refused: {refused or 'none'}.",
            "The interval of a coverage takes a mission's coefficients as they hang together (ratio estimator over",
            "missions, Cochran 1977, section 3.12; Wilson 1927 at the effective count); the goal is judged by the",
            "share itself.",
        ),
    ]
