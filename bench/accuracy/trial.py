"""One trial of the accuracy benchmark, as JSON: a method's answer to a mission, or the mission's bound."""

import time
from importlib import import_module
from typing import cast

from bench.bound import cramer_rao
from bench.missions.mission import draw_one
from bench.remembered import Data, finite
from bridge.errors import FitError
from identify.estimators.table import Estimator, estimator

BOUND = "bound"
OWN = {
    "closed form": "bench.baselines.closed_form",
    "least squares": "bench.baselines.least_squares",
    "PySINDy": "bench.baselines.sindy",
    "PySINDy weak": "bench.baselines.sindy_weak",
}


def bound_job(seed: int) -> Data:
    """The bound of a seed's mission, as JSON."""
    mission = draw_one(seed)
    return {
        "seed": seed, "kind": mission.kind, "duration_s": mission.dive.duration_s,
        "truth": mission.truth, "least": cramer_rao(mission),
    }  # fmt: skip


def method_job(method: str, seed: int) -> Data:
    """A method's answer to a seed's mission, as JSON; only coefficients whose truth the mission holds."""
    mission = draw_one(seed)
    estimate = cast(Estimator, import_module(OWN[method]).estimate) if method in OWN else estimator(method)
    started = time.perf_counter()
    stated: dict[str, list[float | bool | None]] = {}
    outcome = "refused"
    try:
        identified = estimate(mission.dive, mission.file, mission.configuration, lambda *_report: None)
    except FitError:
        return {
            "seed": seed, "method": method, "stated": stated, "refused": list(mission.truth), "outcome": outcome,
            "seconds": time.perf_counter() - started,
        }  # fmt: skip
    seconds = time.perf_counter() - started
    doubted = {name for doubt in identified.doubts for name in doubt.about}
    for name in mission.truth:
        p = identified[name]
        if p.identifiable:
            stated[name] = [finite(p.value), finite(p.low95), finite(p.high95), name in doubted]
    return {
        "seed": seed, "method": method, "stated": stated, "refused": [n for n in mission.truth if n not in stated],
        "outcome": identified.outcome.value, "seconds": seconds,
    }  # fmt: skip
