"""A depth and a velocity that contradict each other in time are told, with which is late and by how much."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.vehicle.config import Water
from identify.checks.sensors.descent_timing import descent_timing_doubts, late_s
from identify.dive import Dive, Signal
from identify.doubt import Outcome

WATER = Water()
T = np.arange(0.0, 120.0, 0.02)
PACES = np.array([0.3, 0.7, 1.1, 1.6, 2.3])
W = 0.05 * np.sin(np.outer(T, PACES) + PACES).sum(axis=1)
DEPTH = 5.0 - 0.05 * ((np.cos(np.outer(T, PACES) + PACES) - np.cos(PACES)) / PACES).sum(axis=1)
VELOCITY = np.column_stack([0.4 + 0.3 * np.sin(0.5 * T), 0.15 * np.sin(0.9 * T), W])
"""A level vehicle that rises and sinks at several paces."""


def dive(velocity_late_s=0.0, noise=0.0):
    """Readings at 5 and 10 Hz, with noise in m/s and m."""
    rng = np.random.default_rng(7)
    fifth, tenth = slice(0, None, 10), slice(0, None, 5)
    velocity = VELOCITY[fifth] + noise * rng.standard_normal((len(T[fifth]), 3))
    depth = DEPTH[tenth, None] + noise * rng.standard_normal((len(T[tenth]), 1))
    return Dive(
        "sinking",
        Path("sinking.tlog"),
        "0" * 64,
        velocity=Signal(T[fifth] + velocity_late_s, velocity),
        depth=Signal(T[tenth], depth),
        attitude=Signal(T, np.tile([1.0, 0.0, 0.0, 0.0], (len(T), 1))),
    )


@pytest.mark.parametrize("late", [0.25, -0.4])
def test_the_delay_between_velocity_and_depth_is_found_and_doubts_heave(late):
    assert late_s(dive(late, noise=2e-3), WATER) == pytest.approx(late, abs=0.051)
    (doubt,) = descent_timing_doubts(dive(late, noise=2e-3), WATER)
    assert doubt.about == ("M_w", "D_w")
    assert doubt.outcome is Outcome.DISAGREES
    first = "The DVL's velocity is stamped some" if late > 0 else "The depth is stamped some"
    assert doubt.problem.startswith(first)


@pytest.mark.parametrize(("late", "noise"), [(0.0, 2e-3), (0.05, 2e-3), (0.3, 0.5)])
def test_healthy_stamps_and_what_noise_hides_raise_no_doubt(late, noise):
    assert descent_timing_doubts(dive(late, noise), WATER) == ()


def test_without_a_depth_or_an_attitude_nothing_is_told():
    assert late_s(replace(dive(0.3), depth=None), WATER) == 0.0
    assert late_s(replace(dive(0.3), attitude=None), WATER) == 0.0
