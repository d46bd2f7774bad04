"""Readings far off what a fit expects: a sensor's spikes are left out, a motion that the model lacks is kept."""

from dataclasses import replace

import closed_loop
import network_tasks
import numpy as np
import pytest

from identify.dive import Signal
from identify.estimators.axes.build import build_axes
from identify.estimators.likelihood.fit import fit_axes

FILE = closed_loop.vehicle_file()
BUMPS_S = (62.0, 121.0, 203.0)


def left_out(dive):
    """Times of the readings that the fit of a dive leaves out."""
    built = build_axes(dive, FILE, "only")
    (problem,) = fit_axes(built, FILE.vehicle.configurations["only"], network_tasks.quiet).joint.problems
    dropped = np.isfinite(problem.axis.reading) & ~np.isfinite(problem.reading)
    return problem.axis.time_s[dropped]


def pushed(push_n, seconds):
    """A dive of a hull that something pushes three times."""

    def push(time_s, _thrust_n):
        return push_n * any(at_s <= time_s < at_s + seconds for at_s in BUMPS_S)

    return closed_loop.dive(np.random.default_rng(7), push=push)


def with_spikes(dive, every, size, row=1):
    """The dive with spikes of `row` readings in a row in its velocity, and the times of these readings."""
    read = dive.velocity
    value, at = read.value.copy(), np.arange(every // 2, len(read), every)
    at = (at[:, None] + np.arange(row)).ravel()
    value[at, 0] += size
    return replace(dive, velocity=Signal(read.time_s, value)), read.time_s[at]


@pytest.mark.parametrize("row", [1, 3])
@pytest.mark.parametrize("size", [0.1, 0.5])
def test_spikes_of_a_sensor_are_left_out_of_one_reading_or_of_three_in_a_row(row, size):
    dive, spikes_s = with_spikes(closed_loop.dive(np.random.default_rng(7)), 250, size, row)
    np.testing.assert_allclose(left_out(dive), spikes_s)


def test_a_spike_at_the_very_end_is_left_out():
    dive = closed_loop.dive(np.random.default_rng(7))
    value = dive.velocity.value.copy()
    value[-1, 0] += 0.5
    spiky = replace(dive, velocity=Signal(dive.velocity.time_s, value))
    np.testing.assert_allclose(left_out(spiky), dive.velocity.time_s[-1:])


@pytest.mark.parametrize(("push_n", "seconds"), [(60.0, 1.0), (60.0, 0.3), (400.0, 0.1), (1000.0, 0.1)])
def test_a_motion_that_the_model_lacks_is_kept_however_short(push_n, seconds):
    assert len(left_out(pushed(push_n, seconds))) == 0


def test_spikes_in_a_dive_with_such_a_motion_are_left_out_all_the_same():
    spiky, spikes_s = with_spikes(pushed(60.0, 1.0), 500, 1.0)
    np.testing.assert_allclose(left_out(spiky), spikes_s)


def test_where_more_readings_are_wild_than_a_sensor_has_spikes_all_are_kept():
    dive, _ = with_spikes(closed_loop.dive(np.random.default_rng(7)), 25, 0.5)
    assert len(left_out(dive)) == 0
