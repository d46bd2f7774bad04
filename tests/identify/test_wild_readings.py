"""Readings far off what a fit expects: a sensor's spikes are left out, a motion that the model lacks is kept."""

from dataclasses import replace

import closed_loop
import network_tasks
import numpy as np

from identify.dive import Signal
from identify.estimators.axes.build import build_axes
from identify.estimators.likelihood.axis import MOST_WILD
from identify.estimators.likelihood.fit import fit_axes

FILE = closed_loop.vehicle_file()
BUMPS_S, PUSH_N = (62.0, 121.0, 203.0), 60.0


def left_out(dive):
    """Times of the readings that the fit of a dive leaves out."""
    built = build_axes(dive, FILE, "only")
    (problem,) = fit_axes(built, FILE.vehicle.configurations["only"], network_tasks.quiet).joint.problems
    dropped = np.isfinite(problem.axis.reading) & ~np.isfinite(problem.reading)
    return problem.axis.time_s[dropped]


def bump(time_s, _thrust_n):
    """A hull that something pushes three times for a second, as hard as its thruster can."""
    return PUSH_N * any(at_s <= time_s < at_s + 1.0 for at_s in BUMPS_S)


def with_spikes(dive, every, size):
    read = dive.velocity
    value = read.value.copy()
    value[every // 2 :: every, 0] += size
    return replace(dive, velocity=Signal(read.time_s, value)), read.time_s[every // 2 :: every]


def test_spikes_of_a_sensor_are_left_out_each_alone():
    dive, spikes_s = with_spikes(closed_loop.dive(np.random.default_rng(7)), 250, 0.5)
    np.testing.assert_allclose(left_out(dive), spikes_s)


def test_a_motion_that_the_model_lacks_is_kept_and_spikes_elsewhere_are_not():
    hit = closed_loop.dive(np.random.default_rng(7), push=bump)
    assert len(left_out(hit)) == 0
    spiky, spikes_s = with_spikes(hit, 500, 1.0)
    np.testing.assert_allclose(left_out(spiky), spikes_s)


def test_where_more_readings_are_wild_than_a_sensor_has_spikes_all_are_kept():
    dive, _ = with_spikes(closed_loop.dive(np.random.default_rng(7)), round(0.5 / MOST_WILD), 0.5)
    assert len(left_out(dive)) == 0
