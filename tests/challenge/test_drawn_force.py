"""Each letter of a drawn force, on courses that are made up, and the force in a dive."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.challenge.case import draw_case
from identify.challenge.drawn_force import (
    ACCELERATION,
    ATTITUDE,
    DELAY,
    DEPTH,
    LAG,
    LEAK,
    PLAY,
    PULSE,
    THRUST,
    VELOCITY,
    DrawnForce,
    no_force,
    past_of,
    remembered,
    shape_of,
    signal_of,
)
from identify.challenge.nearest import missing_wrench
from identify.challenge.site import Planted, Site
from identify.challenge.world import STATES

Array = NDArray[np.float64]
STEP_S = 0.01


def state(u: float = 0.0, depth: float = 0.0, heading: float = 0.0) -> Array:
    out = np.zeros(STATES)
    out[2], out[3], out[6], out[7] = depth, math.cos(0.5 * heading), math.sin(0.5 * heading), u
    return out


def by(*signal: int, even: tuple[int, int] = (0, 0), power: tuple[float, float] = (1.0, 1.0)) -> DrawnForce:
    both = np.full(2, -1)
    both[: len(signal)] = signal
    return no_force()._replace(signal=both, even=np.array(even), power=np.array(power))


def shape(force: DrawnForce, u: float, depth: float = 0.0) -> float:
    return shape_of(force, state(u, depth), np.zeros(6), np.zeros(6), np.zeros(2))


def course(force: DrawnForce, product: Array) -> Array:
    past = past_of(force, STEP_S)
    return np.array([remembered(force, x, i, STEP_S, past) for i, x in enumerate(product.tolist())])


def test_a_signal_is_what_its_place_says() -> None:
    now = state(0.3, 2.5, 0.5)
    rate, thrust, pulse = np.arange(6.0), 10 + np.arange(6.0), 20 + np.arange(3.0)
    seen = [
        signal_of(place, now, rate, thrust, pulse)
        for place in (VELOCITY, ACCELERATION + 5, THRUST + 1, ATTITUDE + 2, DEPTH, PULSE + 2)
    ]
    assert seen == pytest.approx([0.3, 5.0, 11.0, math.sin(0.5), 2.5, 22.0])


def test_an_odd_factor_turns_with_its_signal_and_an_even_one_does_not() -> None:
    assert [shape(by(VELOCITY, power=(2.0, 1.0)), u) for u in (-0.5, 0.5)] == pytest.approx([-0.25, 0.25])
    even = by(VELOCITY, even=(1, 0), power=(2.0, 1.0))
    assert [shape(even, u) for u in (-0.5, 0.5)] == pytest.approx([0.25, 0.25])


def test_a_signal_counts_from_its_middle_in_its_typical_size() -> None:
    force = by(DEPTH)._replace(middle=np.array([2.0, 0.0]), scale=np.array([0.5, 1.0]))
    assert shape(force, 0.0, depth=3.0) == pytest.approx(2.0)


def test_two_factors_are_multiplied_and_none_are_one() -> None:
    assert shape(by(VELOCITY, DEPTH), 0.5, depth=4.0) == pytest.approx(2.0)
    assert shape(by(), 0.5) == 1.0


def test_a_lag_follows_a_step_exponentially() -> None:
    force = no_force()._replace(memory=LAG, memory_s=0.7)
    seen = course(force, np.ones(200))
    assert seen == pytest.approx(1.0 - np.exp(-STEP_S * np.arange(1, 201) / 0.7))


def test_a_delay_tells_what_was_so_long_ago() -> None:
    force = no_force()._replace(memory=DELAY, memory_s=0.25)
    product = np.random.default_rng(1).standard_normal(100)
    seen = course(force, product)
    assert not seen[:25].any()
    assert seen[25:].tolist() == product[:-25].tolist()


def test_a_leaky_integral_comes_to_its_memory_times_what_it_is_of() -> None:
    seen = course(no_force()._replace(memory=LEAK, memory_s=5.0), np.full(10_000, 0.3))
    assert seen[0] == pytest.approx(0.3 * STEP_S)
    assert seen[-1] == pytest.approx(1.5, rel=1e-6)


def test_hysteresis_stands_still_until_its_play_is_used_up() -> None:
    force = no_force()._replace(memory=PLAY, play=0.5)
    seen = course(force, np.array([0.4, 1.0, 2.0, 1.5, 1.0, 0.5, -1.0]))
    assert seen == pytest.approx([0.0, 0.5, 1.5, 1.5, 1.5, 1.0, -0.5])


def test_a_dive_feels_the_drawn_force_and_nothing_else_that_is_missing() -> None:
    case = draw_case(391_001, kind="none", seconds=60.0)

    def apply(site: Site, _: np.random.Generator) -> None:
        gone = (site.time_s > 30.0).astype(np.float64)
        size = np.array([0.0, 3.0, 0.0, 0.0, 0.0, 0.0])
        site.drawn = by(VELOCITY, even=(1, 0))._replace(size=size, when=gone)

    site, simulated = replace(case, planted=(Planted("drawn_force", {}, apply, 1.0),)).simulated(0)
    missing, ticks = missing_wrench(site, simulated), simulated.ticks
    assert simulated.dive.pwm is not None
    there = simulated.dive.pwm.time_s > 30.0
    wanted = np.zeros_like(missing)
    wanted[there, 1] = 3.0 * np.abs(ticks.state[there, 7])
    assert np.abs(wanted).max() > 0.5
    site, simulated = case.simulated(0)
    rounding = np.abs(missing_wrench(site, simulated)).max()
    assert np.abs(missing - wanted).max() < 2.0 * rounding + 1e-9
