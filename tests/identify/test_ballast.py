"""Ballast that changed between the runs of one dive, by the steady push down that each run needs."""

from pathlib import Path

import numpy as np
import pytest

from bridge.vehicle.config import load_vehicle
from identify.dive import Dive, Signal
from identify.run.joined_runs import ballast_note, joined, together
from identify.run.recordings import Reading

FILE = load_vehicle("bluerov2_heavy")
MASS_KG, DRAG, TURNING_KG = 30.0, 40.0, 20.0


def lap(number, weight_n, seconds=15.0, **without):
    """A lap with steps of depth, pitching on its way, driven by wrenches that know all but the sea's noise."""
    rng = np.random.default_rng(number)
    time_s = np.arange(0.0, seconds, 0.05)
    rate, phase = rng.uniform(0.5, 1.5, 2), rng.uniform(0.0, 6.0, 2)
    w, dw = (0.3 * turned(rate[0] * time_s + phase[0]) for turned in (np.sin, np.cos))
    u, q = 0.5 + 0.2 * np.sin(rate[1] * time_s), 0.2 * np.cos(rate[1] * time_s + phase[1])
    down = MASS_KG * rate[0] * dw + DRAG * np.abs(w) * w - TURNING_KG * u * q - weight_n
    still = np.zeros_like(w)
    velocity = np.column_stack([u, still, w]) + rng.normal(0.0, 0.003, (len(w), 3))
    commanded = np.column_stack([20.0 * np.sin(time_s), still, down, still, still, still])
    signals = {
        "velocity": Signal(time_s, velocity),
        "gyro": Signal(time_s, np.column_stack([still, q, still])),
        "tau_cmd": Signal(time_s, commanded),
    }
    return Dive(f"lap {number}", Path(f"lap{number}.csv"), f"sha of {number}", **(signals | without))


def said_of(laps):
    return ballast_note(joined(laps), FILE, "heavy")


def test_the_runs_that_are_heavier_in_the_water_are_named_with_their_weight():
    laps = [lap(number, weight_n=3.0 if number in (2, 5, 6) else -1.0) for number in range(8)]
    (sentence,) = said_of(laps)
    assert sentence.startswith("In the water, lap 2, lap 5, lap 6 are heavier by 4.0 N than the other runs")
    dive = together([Reading(each, FILE, ()) for each in laps]).dive
    assert sentence in dive.notes


@pytest.mark.parametrize(
    "weights_n",
    [[1.0] * 8, [1.0, 1.2] * 4, [0.0, 0.0, 3.0, 0.0], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]],
    ids=["alike", "less apart than a bubble", "too few", "a little heavier each time"],
)
def test_runs_of_one_kind_are_not_named(weights_n):
    assert said_of([lap(number, weight_n) for number, weight_n in enumerate(weights_n)]) == ()


def test_without_a_velocity_or_a_gyro_nothing_is_said():
    for missing in ("velocity", "gyro"):
        assert said_of([lap(k, 4.0 * (k > 3), **{missing: None}) for k in range(8)]) == ()
