"""The source paper's network, small (LSTM 1 x 16), compared with the closed form of its loss, on a few missions."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np

from bench.baselines import closed_form
from bench.missions.mission import draw_one
from bench.remembered import Data, Remembered
from bench.reproduce.paper import SMALL, TrainingCurves, estimate_with_curves
from bench.stamp import BASELINES, MISSIONS, stamp
from bench.words import table
from bridge.errors import FitError

SOURCES = (
    *MISSIONS,
    *BASELINES,
    "bench/paper_small.py",
)
SETTLED, LOSS_SETTLED = 0.01, 0.05
HEAD = (
    "mission", "errors, network / closed form", "furthest apart", "settled at epoch", "trained in", "closed form in",
)  # fmt: skip


def page(cache: Path, seeds: tuple[int, ...]) -> str:
    """The section of docs/benchmarks.md; earlier results are read from `cache`."""
    kept = Remembered(cache / f"paper_small-{stamp(*SOURCES)}.jsonl")
    results = kept.fill({str(seed): partial(trained, seed) for seed in seeds}, "the paper's network, small")
    lines = [
        "## The paper's network, small",
        "",
        f"Algorithm 1 of the paper with an LSTM of {SMALL.depth} x {SMALL.hidden}, {SMALL.epochs} epochs of batches of",
        f"{SMALL.batch}, Adam, learning rates falling to a thousandth, a zero-phase filter at {SMALL.cutoff_hz:g} Hz",
        "before it. Error against the truth in per cent; behind the stroke that of the closed form of the same loss.",
        "The loss holds no term in which network and parameters meet, so training is a slow way to the closed form.",
        "",
        *table(HEAD, [_row(key, data) for key, data in results.items()]),
        "",
    ]
    return "\n".join(lines)


def trained(seed: int) -> Data:
    """Truth, network's and closed form's value of each coefficient that the paper's method learns from a mission."""
    mission = draw_one(seed)
    begun = (mission.dive, mission.file, mission.configuration, lambda *_report: None)
    try:
        network, curves = estimate_with_curves(*begun)
        closed = closed_form.estimate(*begun)
    except FitError as error:
        return {"kind": mission.kind, "refusal": str(error)}
    return {
        "kind": mission.kind,
        "refusal": "",
        "truth": {name: mission.truth[name] for name in network.values() if name in mission.truth},
        "network": dict(network.values()),
        "closed": dict(closed.values()),
        "settled": settled_at(curves),
        "seconds": [network.wall_s, closed.wall_s],
    }


def settled_at(curves: TrainingCurves, within: float = SETTLED) -> int:
    """The first epoch from which every parameter stays within a share of its final value."""
    far = np.abs(curves.values / curves.values[-1] - 1.0).max(axis=1) > within
    return int(np.flatnonzero(far)[-1]) + 1 if far.any() else 0


def loss_settled_at(curves: TrainingCurves, within: float = LOSS_SETTLED) -> int:
    """The first epoch from which the network's own loss stays within a share of its final value."""
    far = np.abs(curves.data_loss[1:] / curves.data_loss[-1] - 1.0) > within
    return int(np.flatnonzero(far)[-1]) + 2 if far.any() else 1


def relative_errors(values: Mapping[str, float], truth: Mapping[str, float]) -> dict[str, float]:
    """Errors in per cent, of the coefficients whose truth is known."""
    return {name: 100.0 * (values[name] / truth[name] - 1.0) for name in truth}


def _row(key: str, data: Data) -> tuple[str, ...]:
    if data["refusal"]:
        return f"{key}, {data['kind']}", f"refused: {data['refusal']}", "", "", "", ""
    network, closed = (relative_errors(data[kind], data["truth"]) for kind in ("network", "closed"))
    errors = ", ".join(f"{name} {network[name]:+.1f} / {closed[name]:+.1f}" for name in network)
    apart = max(abs(network[name] - closed[name]) for name in network)
    trained_s, solved_s = data["seconds"]
    took = f"{data['settled']}", f"{trained_s:.0f} s", f"{solved_s:.2g} s"
    return f"{key}, {data['kind']}", errors, f"{apart:.2g}", *took
