"""A plan that is dived and identified keeps what it promised."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from soak import rows_rest_in_soak

from bridge.parameters import parameters_of
from bridge.simulator.missions import load_mission
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle
from gcs_plugin.simulated import record_dive
from identify.estimators.likelihood import estimate
from identify.identification import Outcome
from identify.ingest.open import read_dive
from identify.planning.knowledge import NAMES, before_any_dive
from identify.planning.limits import Limits, Tank
from identify.planning.propose import propose
from identify.planning.writing import mission_text

# Of 8 true 95 % intervals, 6 or more hold the truth in 99.4 % of all cases; of 16, 13 or more in 99.3 %.
ONE_DIVE, TWO_DIVES = ((100_000,), 6), ((100_000, 100_001), 13)


@pytest.mark.slow
@pytest.mark.parametrize(("seeds", "least"), rows_rest_in_soak([ONE_DIVE, TWO_DIVES]))
def test_the_intervals_after_a_planned_dive_are_those_promised_with_the_truth_inside(
    tmp_path: Path, seeds: tuple[int, ...], least: int
) -> None:
    file = load_vehicle("ruvifist:hovering")
    truth = load_truth(file, "hovering")
    known = replace(before_any_dive(file, "hovering"), values=dict(truth.model))
    plan = propose(file, "hovering", known, Limits(), 100.0)
    path = tmp_path / "plan.yaml"
    path.write_text(mission_text(plan, "a plan", "simulate", Tank(file, "hovering", known)), encoding="utf-8")
    mission = load_mission(path)
    errors, ratios = [], []
    for seed in seeds:
        folder = record_dive(
            file, "hovering", mission, tmp_path, seed=seed, unix_s=1.79e9 + seed, parameters=parameters_of(file, None),
            mode=None, progress=lambda _: None,
        )  # fmt: skip
        found = estimate(read_dive(folder.path, None, file), file, "hovering", lambda *_: None)
        assert found.outcome is Outcome.CONVERGED
        for name, promised in zip(NAMES, plan.after, strict=True):
            if np.isfinite(promised):
                one = found[name]
                ratios.append(one.std / one.value / promised)
                errors.append((one.value - truth.model[name]) / one.std)
    assert len(ratios) == 8 * len(seeds)
    assert np.max(ratios) < 1.3
    # The masses also show in each other's Coriolis forces, which no promise counts on.
    assert np.min(ratios) > 0.5
    assert np.count_nonzero(np.abs(errors) < 1.96) >= least
    assert np.max(np.abs(errors)) < 4.0
