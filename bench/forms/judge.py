"""Run every form on the missions, with the product's methods and the paper's closed form; keep and tally the trials.

The forms are given the true noise levels and state no interval; the product's methods have to find the levels.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import cast

import numpy as np
import torch

from bench.accuracy_trials import SOURCES, Bound, Trial, known
from bench.forms.task import Task, task_of
from bench.forms.training import Fitted
from bench.missions.mission import draw_one
from bench.remembered import Data, Job, Remembered
from bench.stamp import MISSIONS, stamp
from bench.tally import Case, Tally, tally
from bench.trial import BOUND, OWN, bound_job, method_job
from bridge.vehicle.coefficients import COEFFICIENTS, MASSES
from identify.estimators.table import METHODS as PRODUCT

FORMS = {
    "coupled LSTM": "bench.forms.lstm",
    "neural ODE": "bench.forms.neural_ode",
    "multiple shooting": "bench.forms.shooting",
    "strong form": "bench.forms.strong",
}
BESIDE = ("pinn", "likelihood", "closed form")
SHARED = ("disturbance", "integration", "physics", "task", "training", "waves")
OF_FORMS = (
    *MISSIONS,
    "bench/forms/judge.py",
    *(f"bench/forms/{name}.py" for name in SHARED),
    *(f"{path.replace('.', '/')}.py" for path in FORMS.values()),
    "identify/forces.py",
    "identify/estimators/motion.py",
    "identify/ingest/commands.py",
    "identify/ingest/rotation.py",
)
SECONDS = 60.0
SEED = 0
FITTED = (0, 1, 2, 5)
NAMES = tuple(c.name for c in COEFFICIENTS if c.dof in FITTED)
MASS_NAMES = tuple(MASSES[dof].name for dof in FITTED)


@dataclass(frozen=True)
class Judged:
    """A method's tally: its cases, refused coefficients and median seconds. settled: missions on which a form settled
    before its time was up, None for the other methods."""

    method: str
    tally: Tally
    settled: int | None

    @property
    def masses(self) -> list[Case]:
        return [case for case in self.tally.cases if case.name in MASS_NAMES]

    @property
    def dampings(self) -> list[Case]:
        return [case for case in self.tally.cases if case.name not in MASS_NAMES]


def judged(seeds: Sequence[int], cache: Path) -> tuple[list[Bound], list[Trial], list[Judged]]:
    """Bounds, trials and tallies of all seeds, for the coefficients that the forms fit; runs those missing in
    `cache`."""
    methods = [method for method in BESIDE if method in PRODUCT or method in OWN]
    jobs: dict[str, Job] = {}
    for seed in seeds:
        jobs[f"{seed}:{BOUND}:{stamp(*SOURCES[BOUND])}"] = partial(bound_job, seed)
        for method in methods:
            group = "own" if method in OWN else "product"
            jobs[f"{seed}:{method}:{stamp(*SOURCES[group])}"] = partial(method_job, method, seed)
        for form in FORMS:
            jobs[f"{seed}:{form}:{stamp(*OF_FORMS)}"] = partial(form_job, form, seed, SECONDS)
    results = Remembered(cache / "forms.jsonl").fill(jobs, "forms")
    all_bounds, trials = known(results)
    bounds = [
        replace(b, truth={name: b.truth[name] for name in NAMES if name in b.truth}) for b in all_bounds
    ]
    return bounds, trials, [_judged(method, bounds, trials) for method in (*methods, *FORMS)]


def _judged(method: str, bounds: list[Bound], trials: list[Trial]) -> Judged:
    of_method = [trial for trial in trials if trial.method == method]
    settled = sum(trial.outcome == "settled" for trial in of_method) if method in FORMS else None
    return Judged(method, tally(method, bounds, trials), settled)


def form_job(form: str, seed: int, seconds: float) -> Data:
    """Fit a form to a seed's mission and return the answer as JSON: see `accuracy_trials.Trial`."""
    torch.set_num_threads(1)
    torch.manual_seed(SEED)
    fit = cast(Callable[[Task, float], Fitted], import_module(FORMS[form]).fit)
    mission = draw_one(seed)
    fitted = fit(task_of(mission), seconds)
    stated = {
        name: [float(f"{value:.6g}"), None, None, False]
        for name, value in fitted.values.items()
        if name in mission.truth
    }
    return {
        "seed": seed, "method": form, "stated": stated, "refused": [], "outcome": fitted.reason,
        "seconds": fitted.seconds,
    }  # fmt: skip


def relative(cases: Sequence[Case]) -> float:
    """Median of the absolute relative error; NaN without cases."""
    return (
        float(np.median([abs(np.expm1(case.error * case.least)) for case in cases]))
        if cases
        else float("nan")
    )


def leaning(cases: Sequence[Case]) -> float:
    """Mean signed error over the bound, in which chance averages out; NaN without cases."""
    return float(np.mean([case.error for case in cases])) if cases else float("nan")
