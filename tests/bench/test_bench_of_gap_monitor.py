"""The benchmark of the live gap monitor: its onsets, its dives and its table."""

import numpy as np

from bench.gap_monitor import ONSETS, _lines, onset_dive
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle


def test_every_onset_can_be_simulated_and_has_a_cause_to_be_named():
    truth = load_truth(load_vehicle("ruvifist:survey"), "survey")
    for onset in ONSETS.values():
        effects = onset.draw(np.random.default_rng(1))
        assert type(truth)(truth.model, 0.0, 0.0, onset=effects).onset == effects
        assert onset.named(effects)


def test_a_current_that_sets_in_is_found_and_named():
    data = onset_dive("current", "hovering", 8301)
    assert data["early"] == 0
    assert 15.0 < data["after_s"] < 60.0
    assert data["named"]


def test_the_table_counts_what_was_found_in_time_and_every_false_alarm():
    dive = {"effects": {}, "after_s": 30.0, "early": 0, "named": True}
    results = {f"{name} {n}": dive for name in ONSETS for n in range(3)}
    results |= {
        "tether 0": dive | {"after_s": 70.0, "named": False},
        "tether 1": dive | {"after_s": None, "named": False, "early": 1},
        "calm 0": {"hours": 0.5, "alarms": [100.0]},
        "calm 1": {"hours": 0.25, "alarms": []},
    }
    page = "\n".join(_lines(results))
    assert "| a tether snags, 0.5 to 3 N/m | 3 | 33% | 67% | 50 s | 50% |" in page
    assert "| a current of 0.05 to 0.2 m/s | 3 | 100% | 100% | 30 s | 100% |" in page
    flat = " ".join(page.split())
    assert "False alarms: 1 in 0.8 h of 2 whole missions without any effect, and 1 in the 45 minutes" in flat
