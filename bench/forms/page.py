"""Write docs/network_forms.md, on how far each form of the network errs and why, and its part of docs/benchmarks.md."""

from collections.abc import Sequence
from pathlib import Path

from bench.accuracy_trials import Bound, Trial
from bench.forms.judge import FORMS, SECONDS, Judged, judged, leaning, relative
from bench.forms.left_out import of_mission
from bench.forms.reasons import LeftOut, settings, standing, why
from bench.missions.mission import draw_one
from bench.tally import median_ratio, root_mean_square, tally
from bench.words import paragraph


def page(cache: Path, target: Path, seeds: Sequence[int]) -> str:
    """Return the section of docs/benchmarks.md, and write the record itself to `target`."""
    bounds, trials, forms = judged(seeds, cache)
    left_out = {seed: of_mission(draw_one(seed)) for seed in seeds}
    target.write_text(record(bounds, trials, forms, left_out), encoding="utf-8")
    lines = [
        "## The network's other forms",
        "",
        *paragraph(
            f"Each form of a physics-informed network on missions {seeds[0]} to {seeds[-1]}, error over the bound in",
            f"rms (median): {'; '.join(f'{form.method} {_ratios(form)}' for form in forms)}.",
            f"[What each does, and where it errs]({target.name}).",
        ),
        "",
    ]
    return "\n".join(lines)


def record(bounds: list[Bound], trials: list[Trial], found: list[Judged], left_out: LeftOut) -> str:
    """The text of docs/network_forms.md."""
    seeds = sorted(bound.seed for bound in bounds)
    count = max(len(form.tally.cases) + form.tally.refused for form in found)
    lines = [
        "# The network's forms, judged",
        "",
        "Written by `python -m bench forms`; every figure of the tables comes from it. Whether its code has changed",
        "since then stands in [benchmarks.md](benchmarks.md).",
        "",
        *paragraph(
            "A physics-informed network can be posed in many ways. The product has the weak form on the network's own",
            "state, its weights integrated out and not merely fitted (`identify/estimators/pinn`). Others were built,",
            "too, each as well as we could. They stand in `bench/forms` and run on the same missions:",
            f"{len(bounds)} of the benchmark's (seeds {seeds[0]} to {seeds[-1]}), {count} masses and dampings in",
            "surge, sway, heave and yaw whose Cramer-Rao bound is below 30 %. Nothing was tuned on these missions.",
        ),
        "",
        *standing(found),
        "",
        *paragraph(
            "What favours these forms: all of them are GIVEN the true noise level of every sensor and the true",
            "spread and time constant of every disturbance, which `pinn` and `likelihood` have to find, and a dive's",
            f"readings without any other filter. Each had {SECONDS:.0f} s of one core a mission, and stopped earlier",
            "where its loss no longer fell. None of them can state an interval.",
        ),
        "",
        *_overall(found),
        "",
        *paragraph(
            "An error is that of the logarithm; over the bound it is 1 in rms for a method that does all that can be",
            "done, and the median is scaled to be 1, too. `leans`: the mean of the signed errors over the bound, which",
            "would be 0 but for chance. Seconds: the median of one core's, of the product's methods by the clock.",
        ),
        "",
        *_by_mission(found, bounds, trials),
        "",
        "## What they do",
        "",
        *why(found, left_out),
        *_left_out(left_out),
        "## Settings, and what else was tried",
        "",
        *settings(),
    ]
    return "\n".join(lines)


def _overall(found: list[Judged]) -> list[str]:
    rows = [
        "| form | refused | rms (median) error / bound | masses, rms | masses lean | dampings, rms | dampings lean "
        "| median relative error, masses | dampings | settled | seconds |",
        "|---" * 11 + "|",
    ]
    for form in found:
        settled = "-" if form.settled is None else f"{form.settled} of {form.tally.missions}"
        cells = [
            f"`{form.method}`" if form.method not in FORMS else form.method,
            str(form.tally.refused),
            _ratios(form),
            f"{root_mean_square(form.masses):.2f}",
            f"{leaning(form.masses):+.2f}",
            f"{root_mean_square(form.dampings):.2f}",
            f"{leaning(form.dampings):+.2f}",
            f"{100 * relative(form.masses):.1f} %",
            f"{100 * relative(form.dampings):.1f} %",
            settled,
            f"{form.tally.seconds:.1f}",
        ]
        rows.append("| " + " | ".join(cells) + " |")
    return rows


def _by_mission(found: list[Judged], bounds: list[Bound], trials: list[Trial]) -> list[str]:
    rows = [
        "Rms error over the bound by mission:",
        "",
        f"| mission | {' | '.join(form.method for form in found)} |",
        "|---" * (len(found) + 1) + "|",
    ]
    for bound in sorted(bounds, key=lambda bound: bound.seed):
        mission_trials = [trial for trial in trials if trial.seed == bound.seed]
        cells = [
            f"{root_mean_square(tally(form.method, [bound], mission_trials).cases):.2f}" for form in found
        ]
        rows.append(f"| {bound.seed}, {bound.kind}, {bound.duration_s:.0f} s | {' | '.join(cells)} |")
    return rows


def _left_out(found: LeftOut) -> list[str]:
    axes = list(dict.fromkeys(axis for row in found.values() for axis in row))
    rows = [
        *paragraph(
            "The bias alone, exactly: one axis, all else at the truth, so that the problem is linear and a Kalman",
            "filter solves it. The mass over the true one at which the loss is least, with the disturbance fitted and",
            "(after the arrow) with it integrated out; yaw as the gyro read it.",
        ),
        "",
        f"| mission | {' | '.join(axes)} |",
        "|---" * (len(axes) + 1) + "|",
    ]
    for seed, row in found.items():
        cells = [f"{row[axis][0]:.2f} -> {row[axis][1]:.2f}" if axis in row else "-" for axis in axes]
        rows.append(f"| {seed} | {' | '.join(cells)} |")
    return [*rows, ""]


def _ratios(one: Judged) -> str:
    return f"{root_mean_square(one.tally.cases):.2f} ({median_ratio(one.tally.cases):.2f})"
