"""The accuracy section of docs/benchmarks.md: each method's errors over the Cramer-Rao bound, and its intervals."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.accuracy.tally import TELLING, Case, Tally, inside95, median_ratio, root_mean_square, tally
from bench.accuracy.trials import ORDER, SEEDS_AT_MOST, Bound, Stated, Trial, available, measured, rows_of
from bench.remembered import Remembered, pack
from bench.stamp import VEHICLES, reached
from bench.words import blocks, in_a_word, paragraph, table
from bridge.vehicle.coefficients import COEFFICIENTS
from identify.estimators.comparison import LEAST_DIFFERENCE
from identify.estimators.comparison import apart as beyond_intervals
from identify.estimators.table import METHODS, SIDE_BY_SIDE

SOURCES = (reached("bench/accuracy/section.py"), *VEHICLES)
JUDGED = tuple(METHODS)
RATIO_GOAL = 1.15
COVERAGE_GOAL = (0.93, 0.97)
BEYOND_3_GOAL = 0.006


def verdicts(result: Tally) -> list[tuple[str, bool]]:
    """Each goal's figure in words and whether it meets the goal, in the order of `goals`.

    Errors beyond 3 or 5 standard errors are counted among the cases that state a standard error.
    """
    ratio = root_mean_square(result.cases)
    share, low, high = inside95(result.cases)
    z = [abs(case.z) for case in result.cases if math.isfinite(case.z)]
    beyond_3 = float(np.mean([size > 3 for size in z])) if z else math.nan
    silent = sum(abs(case.z) > 5 and not case.warned for case in result.cases)
    least, most = COVERAGE_GOAL
    return [
        (f"{ratio:.3f}", ratio <= RATIO_GOAL),
        (f"{100 * share:.1f} % ({100 * low:.1f} to {100 * high:.1f})", least <= share <= most),
        (f"{100 * beyond_3:.2f} % of {len(z)}", beyond_3 <= BEYOND_3_GOAL),
        (str(silent), bool(z) and silent == 0),
    ]


def goals(tallies: Sequence[Tally]) -> str:
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
    return blocks(
        "Goals:",
        table(("goal", *JUDGED), rows),
        paragraph(
            "Every figure of an error is of stated coefficients alone: one that a method refuses though its bound is",
            f"below 30 % has no value and so no error, and is in none of them. So refused: {refused or 'none'}.",
            "A coverage's interval allows for the correlation of a mission's coefficients (ratio estimator over",
            "missions, Cochran 1977, section 3.12; Wilson 1927 at the effective count); the goal is judged by the",
            "share itself.",
        ),
    )


def distances(trials: Sequence[Trial]) -> dict[int, list[float]]:
    """Distance of the two methods' estimates, over the larger standard error, of each coefficient that both state; by
    seed of the missions that both answered."""
    return {seed: [_distance(*pair) for pair in pairs] for seed, pairs in _pairs(trials).items()}


def _pairs(trials: Sequence[Trial]) -> dict[int, list[tuple[Stated, Stated]]]:
    first, second = ({t.seed: t for t in trials if t.method == method} for method in SIDE_BY_SIDE)
    return {
        seed: [
            (coefficient, second[seed].stated[name])
            for name, coefficient in first[seed].stated.items()
            if name in second[seed].stated
        ]
        for seed in first
        if seed in second
    }


def _distance(first: Stated, second: Stated) -> float:
    return abs(math.log(second.value / first.value)) / max(first.std, second.std)


def apart_words(trials: Sequence[Trial]) -> str:
    """The paragraph of the page; empty if one of the two methods was not run."""
    by_seed = distances(trials)
    sizes = [size for of_seed in by_seed.values() for size in of_seed if math.isfinite(size)]
    if not sizes:
        return ""
    beyond = sum(any(beyond_intervals(*pair) for pair in pairs) for pairs in _pairs(trials).values())
    return paragraph(
        f"The two methods of `identify` are {np.median(sizes):.2f} standard errors apart in the median, "
        f"{np.percentile(sizes, 99):.2f} in the 99th percentile and {max(sizes):.1f} at most, of {len(sizes)}",
        f"coefficients that both state. {beyond} of {len(by_seed)} missions hold one beyond both intervals and by",
        f"{100 * LEAST_DIFFERENCE:g} % or more, which `identify` calls a disagreement.",
    )


OVERALL = (
    "method", "missions", "stated", "refused below the bound of 30 %", "refused above it", "stated above it",
    "share refused", "rms error / bound", "median error / bound", "mean z", "mean relative error",
    "inside 95 % (bounds)", "beyond 3 sigma", "beyond 5 sigma", "of these without a warning", "median s",
)  # fmt: skip
BY_COEFFICIENT = (
    "coefficient", "median bound", "stated", "rms (median) error / bound", "mean z", "spread of z", "inside 95 %",
)  # fmt: skip
GROUPS = {
    "mass in surge, sway, yaw": ("M_u", "M_v", "I_r"),
    "damping in surge, sway, yaw": ("D_u", "D_v", "D_r"),
    "mass in heave, roll, pitch": ("M_w", "I_p", "I_q"),
    "damping in heave, roll, pitch": ("D_w", "D_p", "D_q"),
}


def section(seeds: Sequence[int], cache: Path, results: Path) -> str:
    """The section, from the results in `cache`; runs the missing trials and writes all results to the file
    `results`."""
    bounds, trials = measured(seeds, Remembered(cache / "accuracy.jsonl"))
    pack(rows_of(bounds, trials), results)
    return page(bounds, trials, tuple(method for method in ORDER if method not in available()))


def page(bounds: list[Bound], trials: list[Trial], absent: tuple[str, ...] = ()) -> str:
    """The section; `absent` names methods that this build lacks."""
    methods = list(dict.fromkeys(trial.method for trial in trials))
    tallies = [tally(method, bounds, trials) for method in methods]
    shown = [
        tallied
        for tallied in tallies
        if any(math.isfinite(case.z) for case in tallied.cases) and tallied.method != "least squares"
    ]
    return blocks(
        "## Accuracy against the Cramer-Rao bound",
        _introduction(bounds),
        *(f"`{method}` is not installed here and is left out." for method in absent),
        _overall(tallies),
        goals(tallies),
        apart_words(trials),
        _by_group(tallies),
        *(_by_coefficient(tallied, bounds) for tallied in shown),
        _by_manoeuvre(tallies),
        _reading(),
    )


def _introduction(bounds: list[Bound]) -> str:
    count = sum(len(bound.truth) for bound in bounds)
    telling = sum(least < TELLING for bound in bounds for least in bound.least.values())
    seeds = sorted(bound.seed for bound in bounds)
    minutes = sum(bound.duration_s for bound in bounds) / 60
    return blocks(
        paragraph(
            f"{len(bounds)} simulated missions (seeds {seeds[0]} to {seeds[-1]}, {minutes:.0f} min of diving): each",
            "draws a vehicle of 11 to 120 kg, thrusters with 0.05 to 0.25 s of lag, sensors, a coloured disturbance of",
            "0.3 to 3 % of full thrust with time constants of 0.5 to 10 s on every axis, a manoeuvre of 60 to 300 s",
            "and a controller that acts on the noisy readings. The simulated vehicle obeys the model that is fitted",
            "(diagonal mass, linear damping, full Coriolis, restoring): this measures how well methods use what a dive",
            "tells, not how well the model fits a real vehicle. Nothing was tuned on these missions, but two of them",
            "were seen: 33 and 56 had failed, and were looked at while the ends of intervals of what is known loosely",
            "were mended.",
        ),
        paragraph(
            f"The bound is computed for each mission and coefficient (`bench/bound`). {telling} of the {count}",
            f"coefficients have a bound below {100 * TELLING:.0f} %; the tables are of these, the others counted",
            "apart.",
        ),
    )


def _overall(tallies: list[Tally]) -> str:
    rows = []
    for tallied in tallies:
        cases = tallied.cases
        z = np.array([case.z for case in cases])
        relative = np.array([case.relative for case in cases])
        counts = (
            tallied.missions,
            len(cases),
            tallied.refused,
            tallied.refused_rightly,
            tallied.stated_rashly,
        )
        cells = [
            tallied.method,
            *map(str, counts),
            f"{100 * tallied.refused_share:.1f} %",
            f"{root_mean_square(cases):.2f}",
            f"{median_ratio(cases):.2f}",
        ]
        if np.isfinite(z).any():
            wild = [case for case in cases if abs(case.z) > 5]
            share, low, high = inside95(cases)
            cells += [
                f"{np.nanmean(z):+.2f}",
                f"{100 * relative.mean():+.2f} %",
                f"{100 * share:.1f} % ({100 * low:.1f} to {100 * high:.1f})",
                f"{100 * np.mean(np.abs(z[np.isfinite(z)]) > 3):.2f} %",
                str(len(wild)),
                str(sum(not case.warned for case in wild)),
            ]
        else:
            cells += ["-", f"{100 * relative.mean():+.2f} %", *["no interval"], "-", "-", "-"]
        rows.append([*cells, f"{tallied.seconds:.2f}"])
    return table(OVERALL, rows)


def _by_group(tallies: list[Tally]) -> str:
    rows = [
        (t.method, *(_ratios([case for case in t.cases if case.name in names]) for names in GROUPS.values()))
        for t in tallies
    ]
    return blocks("Error over the bound by group, rms and (median):", table(("method", *GROUPS), rows))


def _by_coefficient(result: Tally, bounds: list[Bound]) -> str:
    rows = []
    for coefficient in COEFFICIENTS:
        cases = [case for case in result.cases if case.name == coefficient.name]
        bound_of = [bound.least.get(coefficient.name, math.inf) for bound in bounds]
        if not cases:
            continue
        z = np.array([case.z for case in cases])
        inside = f"{100 * np.mean([case.inside for case in cases]):.1f} %"
        bound = f"{100 * np.median([least for least in bound_of if least < TELLING]):.2f} %"
        spread = f"{np.nanmean(z):+.2f}", f"{np.nanstd(z):.2f}"
        rows.append((coefficient.name, bound, len(cases), _ratios(cases), *spread, inside))
    return blocks(f"`{result.method}` by coefficient:", table(BY_COEFFICIENT, rows))


def _by_manoeuvre(tallies: list[Tally]) -> str:
    kinds = sorted({case.kind for tallied in tallies for case in tallied.cases})
    rows = [
        (t.method, *(_ratios([case for case in t.cases if case.kind == k]) for k in kinds)) for t in tallies
    ]
    return blocks("Error over the bound by manoeuvre, rms and (median):", table(("method", *kinds), rows))


def _ratios(cases: list[Case]) -> str:
    return f"{root_mean_square(cases):.2f} ({median_ratio(cases):.2f})" if cases else "-"


def _reading() -> str:
    weak = SEEDS_AT_MOST["PySINDy weak"]
    return blocks(
        paragraph(
            "How to read it. An error is that of the logarithm; over the bound it is 1 in rms for a method that does",
            "all that can be done; the median is scaled to be 1, too, and does not see a few wild answers. z is the",
            "error in the standard errors that the method itself states. A coefficient is refused where a method",
            "calls it not identifiable; a warning is an outcome other than `converged`, or a doubt about that",
            "coefficient. The bound is the inverse of the Fisher information that the dive's own readings hold at the",
            "true parameters, by one Kalman filter over all six degrees of freedom and its sensitivities, so that",
            "what one axis tells of another counts. Unknown beside the coefficients, and so in the bound: trim",
            "forces, spread and time constant of each disturbance, the noise of each sensor. Known: thruster curve",
            "and lag, restoring, buoyancy, geometry. Over 40 repeats of one mission, one scoring step from the truth",
            "errs as much as the bound says (a test).",
        ),
        paragraph(
            "Settings. Closed form: the paper's loss at its optimum (surge, sway and yaw alone), 10 Hz, 1 Hz",
            "low-pass. Least squares: 20 Hz, zero-phase 0.5 Hz low-pass, central differences, each axis's force",
            "regressed on its true terms, the best cut-off and form on other missions; intervals are the textbook's,",
            "for white residuals. PySINDy: 20 Hz, the library of the true terms of each axis, no threshold,",
            "SmoothedFiniteDifference as it is; its weak form, bumps of 2 s, two a second, takes some 3 s a mission",
            f"and is run on the first {weak} alone.",
        ),
    )
