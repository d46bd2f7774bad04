"""A gyro that was smoothed before it was logged is left out where the attitude shows what it lacks; others stay."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.checks.readings.smoothed_gyro import without_smoothed_gyro
from identify.dive import Dive, Signal
from identify.ingest.rotation import quaternions_from_euler

STEP_S = 0.1
SEED = 8


def random_rates(count, random):
    """Rates (n,) of a yaw that a push of 0.3 rad/s2 changes at any moment, against a damping of a second."""
    rates, pushes = np.zeros(count), random.normal(0.0, 0.3, count)
    for at in range(1, count):
        rates[at] = rates[at - 1] + STEP_S * (pushes[at] / STEP_S**0.5 - rates[at - 1])
    return rates


def dive_of(duration_s, *, heading_noise_rad=0.0, gyro=lambda rates: rates, every=1, seed=SEED):
    """A vehicle that turns about z, its heading, and what `gyro` makes of its rates, each so many rows."""
    time_s = np.arange(0.0, duration_s, STEP_S)
    random = np.random.default_rng(seed)
    rates = random_rates(len(time_s), random)
    heading = np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * STEP_S)])
    heading += random.normal(0.0, 1.0, len(heading)) * heading_noise_rad
    level = np.zeros(len(time_s))
    read = np.column_stack([np.full((len(time_s), 2), np.nan), gyro(rates)])
    return Dive(
        "turning", Path("turning.csv"), "0" * 64,
        attitude=Signal(time_s, quaternions_from_euler(level, level, heading)),
        gyro=Signal(time_s[::every], read[::every]),
    )  # fmt: skip


def mean_over(seconds):
    count = round(seconds / STEP_S)
    return lambda rates: np.convolve(rates, np.ones(count) / count, "same")


@pytest.mark.parametrize("seconds", [0.7, 1.1, 1.5])
def test_a_gyro_that_was_smoothed_over_about_a_second_is_left_out_and_told(seconds):
    left = without_smoothed_gyro(dive_of(120.0, gyro=mean_over(seconds), heading_noise_rad=2e-3))
    assert left.gyro is None
    (note,) = left.notes
    assert note.startswith("The gyro's rates were smoothed before they were logged: of turns at ")
    assert "they are left out, and the attitude tells how the vehicle turns" in note


def test_the_rate_that_is_told_is_at_most_two_steps_above_that_at_which_half_is_lost():
    (note,) = without_smoothed_gyro(dive_of(300.0, gyro=mean_over(1.1))).notes
    told_hz = float(note.split("of turns at ")[1].split(" Hz")[0])
    # Of a mean over T, half is left at 0.6 / T; pieces of 5 s tell rates 0.2 Hz apart.
    assert 0.0 <= told_hz - 0.6 / 1.1 <= 0.4


@pytest.mark.parametrize("noise_rad", [0.0, 2e-3, 0.05])
def test_a_gyro_as_it_reads_stays_whatever_the_headings_noise(noise_rad):
    dive = dive_of(120.0, heading_noise_rad=noise_rad)
    assert without_smoothed_gyro(dive) is dive


def test_of_sixty_short_dives_with_a_noisy_heading_chance_takes_no_gyro():
    for seed in range(60):
        dive = dive_of(52.0, heading_noise_rad=0.02, seed=seed)
        assert without_smoothed_gyro(dive) is dive


def test_a_gyro_stays_that_shows_a_third_of_one_step_by_which_an_estimator_aligns():
    time_s = np.arange(0.0, 120.0, STEP_S)
    slow = mean_over(2.0)(random_rates(len(time_s), np.random.default_rng(SEED)))
    step = np.where(time_s >= 2.0, 0.6, 0.0)
    heading = np.cumsum(slow) * STEP_S + step
    level = np.zeros(len(time_s))
    shown = slow + np.where(np.arange(len(time_s)) == 20, 0.2 / STEP_S, 0.0)
    dive = dive_of(120.0)
    aligned = replace(
        dive,
        attitude=Signal(time_s, quaternions_from_euler(level, level, heading)),
        gyro=Signal(time_s, np.column_stack([np.full((len(time_s), 2), np.nan), shown])),
    )
    assert without_smoothed_gyro(aligned) is aligned


NOISE = np.random.default_rng(9).normal(0.0, 0.05, 1200)


@pytest.mark.parametrize(
    ("seconds", "made"),
    [
        pytest.param(120.0, {"gyro": lambda rates: rates + NOISE}, id="a noisy gyro"),
        pytest.param(2400.0, {"every": 5}, id="a gyro that is read at 2 Hz"),
        pytest.param(120.0, {"gyro": lambda rates: 0.3 * rates}, id="a gyro of a wrong scale"),
        pytest.param(
            120.0, {"gyro": mean_over(0.7), "heading_noise_rad": 0.3}, id="noise hides the fast turns"
        ),
        pytest.param(30.0, {"gyro": mean_over(1.1)}, id="a dive too short to tell"),
    ],
)
def test_a_gyro_that_is_not_known_to_be_smoothed_stays(seconds, made):
    dive = dive_of(seconds, **made)
    assert without_smoothed_gyro(dive) is dive


def test_a_pause_of_the_gyro_is_no_smoothing():
    dive = dive_of(200.0)
    for every_s, pause_s in ((20.0, 4.0), (5.0, 1.0), (3.0, 2.0)):
        kept = (dive.gyro.time_s % every_s) >= pause_s
        paused = replace(dive, gyro=Signal(dive.gyro.time_s[kept], dive.gyro.value[kept]))
        assert without_smoothed_gyro(paused) is paused
