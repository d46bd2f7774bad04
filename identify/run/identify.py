"""Identify a dive, by one method or by two side by side.

identified = identify(dive, file, file.configuration_of(dive.configuration_index()))
identified.answer.values()
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from bridge.errors import FitError
from bridge.vehicle.coefficients import COEFFICIENTS, MASSES, OF_HULL
from bridge.vehicle.config import VehicleFile
from identify.checks.actuation.motors import miswired_doubts
from identify.dive import Dive
from identify.doubt import Outcome
from identify.estimators.comparison import Comparison, compare, doubted
from identify.estimators.table import OF_QUADRATIC, SIDE_BY_SIDE, Estimator, estimator
from identify.identification import Identification, added_mass, estimate
from identify.progress import NO_VALUES, Step, Steps, Values, ignore_step
from identify.threads import side_by_side
from identify.words import capital

ANSWERED = "answered"
"""Words of the last step of a method, with its values."""

FITTED, JUDGED = 0.99, "weighing what speaks against its values"
"""Progress once all is fitted: the doubts about the values are still being assessed, which takes a while."""


@dataclass(frozen=True)
class Identified:
    """The answer to a dive: the first method's, with a doubt where another contradicts it, and its comparison with each
    other method."""

    dive: Dive
    file: VehicleFile
    answer: Identification
    comparisons: tuple[Comparison, ...]

    def to_json(self) -> dict[str, Any]:
        compared = {"comparison": self.comparisons[0].to_json()} if self.comparisons else {}
        return self.answer.to_json() | runs_as_json(self.dive) | compared


def identify(
    dive: Dive,
    file: VehicleFile,
    configuration_name: str,
    methods: Mapping[str, Estimator] | None = None,
    progress: Steps = ignore_step,
) -> Identified:
    """Identify a dive by all methods at the same time; `methods`: estimators by name, the first of them gives the
    answer; those that suit the vehicle if None.

    A dive with too little information gives an answer that says so. Steps are reported from several threads.
    """
    chosen = methods or {name: estimator(name) for name in usual_methods(file, [configuration_name])}
    works = [
        partial(_answer, dive, file, configuration_name, name, estimate_by, progress)
        for name, estimate_by in chosen.items()
    ]
    first, *others = side_by_side(lambda work: work(), works)
    priors = file.vehicle.configurations[configuration_name].priors
    comparisons = tuple(compare(first, other, priors) for other in others)
    return Identified(dive, file, doubted(comparisons[0]) if comparisons else first, comparisons)


def runs_as_json(dive: Dive) -> dict[str, Any]:
    """The runs of a dive made of several, and why others were left out, as plain data; nothing for a single one."""
    if not dive.runs:
        return {}
    used = [
        {"name": run.name, "sha256": run.sha256, "start_s": run.start_s, "duration_s": run.duration_s}
        for run in dive.runs
    ]
    return {"runs": {"used": used, "left_out": dict(dive.left_out)}}


def compiles_first() -> bool:
    """Whether the kernels are yet to be compiled: the first run after installation does, for up to a minute."""
    from identify.estimators.filter.information import gradient_and_information as kernel

    return not any(Path(kernel.stats.cache_path).glob(f"{kernel.py_func.__module__.split('.')[-1]}.*.nbi"))


def usual_methods(file: VehicleFile, configurations: Sequence[str]) -> tuple[str, ...]:
    """The default methods: two side by side for linear damping of all these hulls, else those for quadratic."""
    linear = all(file.vehicle.configurations[name].damping == "linear" for name in configurations)
    return SIDE_BY_SIDE if linear else OF_QUADRATIC


def _answer(
    dive: Dive,
    file: VehicleFile,
    configuration_name: str,
    method: str,
    estimate_by: Estimator,
    progress: Steps,
) -> Identification:
    """The answer of one method; its last words, if any, say how it ended and are kept as a note."""
    ended = ""

    def passed_on(share: float, words: str, values: Values = NO_VALUES, /) -> None:
        nonlocal ended
        if share >= 1.0:
            ended = words
            share, words, values = FITTED, JUDGED, NO_VALUES
        progress(Step(method, share, words, values, False))

    try:
        answer = estimate_by(dive, file, configuration_name, passed_on)
    except FitError as error:
        answer = nothing(dive, file, configuration_name, method, error.reason)
        answer = replace(answer, doubts=miswired_doubts(dive, file, configuration_name))
    progress(Step(method, 1.0, ANSWERED, _values_of(answer), True))
    return replace(answer, notes=(*answer.notes, *((f"{capital(ended)}.",) if ended else ())))


def _values_of(answer: Identification) -> Values:
    """The identifiable parameters of a finished method with half of their 95 % intervals, in SI units."""
    return {
        parameter.name: (parameter.value, (parameter.high95 - parameter.low95) / 2)
        for parameter in answer.parameters
        if parameter.identifiable and parameter.name in OF_HULL
    }


def nothing(
    dive: Dive, file: VehicleFile, configuration_name: str, method: str, reason: str
) -> Identification:
    """An answer in which no parameter could be fitted, all for the same reason."""
    nan = math.nan
    totals = tuple(estimate(coefficient.name, nan, nan, nan, nan, reason) for coefficient in COEFFICIENTS)
    configuration = file.vehicle.configurations[configuration_name]
    return Identification(
        method,
        Outcome.NOT_IDENTIFIABLE,
        (*totals, *(added_mass(total, configuration) for total in totals[: len(MASSES)])),
        configuration_name,
        dive.name,
        dive.sha256,
        file.vehicle.name,
        file.sha256,
        dive.duration_s,
        0,
    )
