"""Fast readings are thinned, and those that are left are readings of what they say they are."""

from pathlib import Path

import numpy as np

from identify.diagnose.nominal import thinned
from identify.dive import Dive, Signal


def dive_with(**signals):
    return Dive("made", Path("made.tlog"), "0" * 64, **signals)


def test_a_fast_gyro_keeps_every_so_many_readings_as_they_were():
    time_s = np.arange(0.0, 10.0, 0.01)
    gyro = Signal(time_s, np.column_stack([np.sin(20 * time_s)] * 3))
    left = thinned(dive_with(gyro=gyro)).gyro
    assert 200 < len(left) < 300
    np.testing.assert_array_equal(left.value[:, 0], np.sin(20 * left.time_s))


def test_means_over_intervals_become_means_over_longer_ones_and_turn_as_far():
    step_s = 0.005
    time_s = step_s * (np.arange(600) + 0.5)
    fog = Signal(time_s, np.cos(time_s)[:, None])
    left = thinned(dive_with(fog=fog)).fog
    k = round(len(fog) / len(left))
    assert k > 1
    np.testing.assert_allclose(left.time_s[0], time_s[:k].mean())
    np.testing.assert_allclose(left.value.sum() * k * step_s, fog.value.sum() * step_s)


def test_no_mean_is_made_over_a_gap():
    time_s = np.concatenate([np.arange(0.0, 5.0, 0.01), np.arange(8.01, 12.0, 0.01)])
    left = thinned(dive_with(fog=Signal(time_s, np.ones((len(time_s), 1))))).fog
    assert not np.any((left.time_s > 5.0) & (left.time_s < 8.0))


def test_slow_readings_stay_as_they_are():
    slow = Signal(np.arange(0.0, 10.0, 0.2), np.zeros((50, 1)))
    left = thinned(dive_with(depth=slow, fog=slow))
    assert left.depth is not None
    assert len(left.depth) == 50
    assert left.fog is slow
