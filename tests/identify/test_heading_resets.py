"""A heading that an autopilot sets anew on arming is one heading again, and turns stay turns."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.dive import Dive, Signal
from identify.ingest.mavlink.heading_resets import without_heading_resets
from identify.ingest.rotation import euler_angles, quaternions_from_euler

TIME_S = np.arange(0.0, 30.0, 0.1)
GYRO_S = np.arange(0.0, 30.0, 0.04)
ROLL, PITCH = 0.2, -0.1


def heading(time_s):
    return 0.3 * np.sin(0.5 * time_s)


def dive(steps=()):
    """A vehicle that turns slowly, rolled and pitched; `steps`: time and size of each reset, s and rad."""
    rng = np.random.default_rng(4)
    psi = heading(TIME_S) + 1e-4 * rng.normal(size=len(TIME_S))
    for at_s, by in steps:
        psi = psi + by * (at_s <= TIME_S)
    held = np.full(len(TIME_S), 1.0)
    # Body rates of a turn about the world's down axis (Fossen 2011, eq. 2.28).
    turning = 0.15 * np.cos(0.5 * GYRO_S)
    down = np.array([-np.sin(PITCH), np.sin(ROLL) * np.cos(PITCH), np.cos(ROLL) * np.cos(PITCH)])
    return Dive(
        "turns",
        Path("turns.BIN"),
        "1" * 64,
        attitude=Signal(TIME_S, quaternions_from_euler(ROLL * held, PITCH * held, psi)),
        gyro=Signal(GYRO_S, turning[:, None] * down),
    )


def test_a_dive_whose_heading_only_turns_is_left_as_it_is():
    turning = dive()
    assert without_heading_resets(turning) is turning


def test_headings_before_a_reset_are_turned_by_it_and_roll_and_pitch_stay():
    mended = without_heading_resets(dive([(10.0, -0.02), (20.0, 0.05)]))
    roll, pitch, psi = euler_angles(mended.attitude.value)
    np.testing.assert_allclose(psi, heading(TIME_S) + 0.03, atol=1.5e-3)
    np.testing.assert_allclose(roll, ROLL, atol=1e-9)
    np.testing.assert_allclose(pitch, PITCH, atol=1e-9)
    (note,) = mended.notes
    assert "-1.1 deg at 10 s" in note
    assert "+2.9 deg at 20 s" in note


def turned_at(at_s, rate_rad_s, gyro_every, reset=0.0):
    """Turns at a rate between times, with the attitude at 10 Hz and a gyro every so many ms; `reset` at 15 s."""
    fine_s = np.arange(0.0, 30.0, 0.001)
    rate = np.interp(fine_s, at_s, rate_rad_s)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * 0.001)])
    turned += reset * (fine_s >= 15.0)
    read, gyro = np.arange(0, len(fine_s), 100), np.arange(0, len(fine_s), gyro_every)
    level, none = np.zeros(len(read)), np.zeros(len(gyro))
    return Dive(
        "hard", Path("hard.tlog"), "1" * 64,
        attitude=Signal(fine_s[read], quaternions_from_euler(level, level, turned[read])),
        gyro=Signal(fine_s[gyro], np.column_stack((none, none, rate[gyro]))),
    )  # fmt: skip


def test_a_turn_that_begins_hard_between_two_slow_samples_is_no_reset():
    """Half a turn a second, begun within a tenth of a second in the middle between readings at 10 Hz."""
    hard = turned_at([0.0, 20.02, 20.09, 23.0, 23.1, 30.0], [0.0, 0.0, 2.8, 2.8, 0.0, 0.0], gyro_every=100)
    assert without_heading_resets(hard) is hard


def test_a_twitch_between_two_attitudes_that_a_fast_gyro_saw_is_no_reset_and_hides_none():
    """0.08 s at 1 rad/s."""
    twitch = ([0.0, 20.01, 20.02, 20.08, 20.09, 30.0], [0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    turned = turned_at(*twitch, gyro_every=10)
    assert without_heading_resets(turned) is turned
    beside = turned_at([0.0, 14.91, 14.92, 14.98, 14.99, 30.0], twitch[1], gyro_every=10, reset=0.05)
    (note,) = without_heading_resets(beside).notes
    assert "by +2.9 deg at 15 s" in note


@pytest.mark.parametrize("lacking", ["gyro", "attitude"])
def test_without_a_gyro_or_an_attitude_nothing_is_said_of_resets(lacking):
    bare = replace(dive([(10.0, 0.05)]), **{lacking: None})
    assert without_heading_resets(bare) is bare


def test_a_gap_between_two_headings_is_no_reset():
    whole = dive([(12.0, 0.5)])
    kept = (TIME_S < 10.0) | (TIME_S > 14.0)
    gap = replace(whole, attitude=Signal(TIME_S[kept], whole.attitude.value[kept]))
    assert without_heading_resets(gap) is gap


def test_a_heading_that_passes_from_pi_to_minus_pi_is_no_reset():
    past = replace(
        dive(),
        attitude=Signal(TIME_S, quaternions_from_euler(0 * TIME_S, 0 * TIME_S, np.pi - 0.1 + 0.1 * TIME_S)),
    )
    turning = replace(past, gyro=Signal(GYRO_S, np.column_stack([0 * GYRO_S, 0 * GYRO_S, 0.1 + 0 * GYRO_S])))
    assert without_heading_resets(turning) is turning


def test_a_stamp_that_stumbles_in_a_fast_turn_is_no_reset():
    """As in a bag without header times, whose log gets a reading some milliseconds sooner or later than usual."""
    time_s = np.arange(0.0, 30.0, 0.02)
    read_s = time_s.copy()
    read_s[[310, 620, 941]] += 0.012
    psi = np.sin(2.0 * read_s) + 1e-5 * np.random.default_rng(5).normal(size=len(time_s))
    turning = np.column_stack([0.0 * GYRO_S, 0.0 * GYRO_S, 2.0 * np.cos(2.0 * GYRO_S)])
    level = 0.0 * time_s
    attitude = Signal(time_s, quaternions_from_euler(level, level, psi))
    fast = Dive("turns", Path("turns.bag"), "1" * 64, attitude=attitude, gyro=Signal(GYRO_S, turning))
    assert without_heading_resets(fast) is fast
