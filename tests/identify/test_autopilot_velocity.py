"""What an autopilot's own filter does to a velocity, undone; and the rounding of its pulses."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.field.draw import NONE, draw
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.dive import Dive, Signal
from identify.estimators.timing.autopilot_velocity import (
    SURGE,
    SWAY,
    _fitted,
    _is_past,
    _rough_lag,
    dated,
    dated_back,
)
from identify.estimators.timing.lateness import FilteredForce, behind_filter, means_behind_filter, timing_of
from identify.ingest.open import read_dive
from identify.ingest.rotation import quaternions_from_euler, to_body
from identify.thrust.pwm_rounding import unrounded, unrounded_thrusts
from identify.thrust.wrench import wrench

STEP_S = 0.01
TIME_S = STEP_S * np.arange(2000)


def test_a_ramp_behind_a_filter_is_late_by_its_time_constant():
    ramp = 3.0 * TIME_S[:, None]
    filtered = behind_filter(ramp, STEP_S, 0.1)
    assert filtered[200:] == pytest.approx(ramp[200:] - 3.0 * 0.1, abs=1e-8)


def test_values_that_hold_for_a_step_have_the_mean_of_their_own_decay():
    step_s = np.array([0.1, 0.0, 0.3, 0.2])
    means = means_behind_filter(np.array([1.0, 5.0, 2.0, 2.0]), step_s, 0.25)
    decay = np.exp(-np.array([0.3, 0.5]) / 0.25)
    assert means == pytest.approx(
        [1.0, 0.0, 2.0 - (1.0 - decay[0]) * 0.25 / 0.3, 2.0 - (decay[0] - decay[1]) * 0.25 / 0.2]
    )


def test_no_filter_knows_what_comes():
    step = np.where(TIME_S >= 10.0, 1.0, 0.0)[:, None]
    filtered = behind_filter(step, STEP_S, 0.2)[:, 0]
    assert not filtered[:1000].any()
    # The values rise over the step that ends at 10 s.
    rise = 0.2 / STEP_S * (np.exp(STEP_S / 0.2) - 1.0)
    assert filtered[1000 + 20] == pytest.approx(1 - rise * np.exp(-1.05))


@pytest.mark.parametrize("smoothing_s", [0.2, 0.0])
def test_each_column_goes_through_a_filter_as_if_it_were_alone(smoothing_s):
    columns = np.random.default_rng(9).standard_normal((200, 9))
    alone = np.column_stack([behind_filter(column[:, None], STEP_S, smoothing_s) for column in columns.T])
    assert behind_filter(columns, STEP_S, smoothing_s) == pytest.approx(alone, rel=1e-12)
    assert smoothing_s or np.array_equal(alone, columns)


def test_a_second_of_lateness_takes_a_second_of_a_ramps_rise_away_and_smoothing_instead_nothing_more():
    force = FilteredForce(TIME_S, 2.0 * TIME_S)
    start, end = TIME_S[300:1700], TIME_S[301:1701]
    late, smooth = timing_of(force, 0.1, start, end)
    assert late.force == pytest.approx(np.full(1400, -2.0), abs=1e-9)
    assert smooth.force == pytest.approx(np.zeros(1400), abs=2e-3)


def test_a_velocity_that_was_told_late_is_turned_by_the_attitude_of_its_own_time():
    late_s, rate = 0.3, 0.5
    time_s = 0.05 * np.arange(400)
    yaw = rate * time_s
    attitude = Signal(time_s, quaternions_from_euler(0 * yaw, 0 * yaw, yaw))
    north_east_down = np.column_stack([0.4 * np.ones_like(yaw), 0.1 * np.sin(time_s), 0 * yaw])
    in_body = to_body(attitude.value, np.roll(north_east_down, round(late_s / 0.05), axis=0))
    dive = Dive(
        "turned", Path("turned"), "", Signal(time_s, in_body), attitude=attitude, velocity_is_filtered=True
    )
    dated_velocity = dated_back(dive, late_s, 0.0).velocity
    assert dated_velocity.time_s == pytest.approx(time_s - late_s)
    truth = to_body(attitude.value, north_east_down)
    inside = slice(20, -20)
    assert dated_velocity.value[inside] == pytest.approx(truth[14:-26], abs=1e-3)


def recorded(case, folder):
    vehicle, log = folder / "vehicle.yaml", folder / "dive.tlog"
    vehicle.write_text(case.vehicle.text, encoding="utf-8")
    log.write_bytes(case.recording(0))
    file = load_vehicle(str(vehicle))
    (name,) = file.vehicle.configurations
    return read_dive(log, None, file), file, name


def calm(seed, number, late_s, smooth_s, seconds=160.0):
    """An empty field dive in still water, whose autopilot's velocity is late and smooth but hardly noisy."""
    case = draw(seed, number, NONE, seconds=seconds)
    still = replace(case.sea, std=0.01 * case.sea.std)
    return replace(
        case, sea=still, filter=replace(case.filter, late_s=late_s, smooth_s=smooth_s, noise_m_s=1e-4)
    )


def test_lateness_and_smoothing_of_a_drawn_field_dive_are_found(tmp_path):
    answer = dated(*recorded(calm(11, 4, 0.08, 0.15), tmp_path))
    assert answer.velocity_late_s == pytest.approx(0.08, abs=0.008)
    assert answer.velocity_smoothing_s == pytest.approx(0.15, abs=0.008)
    assert answer.thrust_delay_s == pytest.approx(0.0, abs=0.003)


def test_a_delay_that_yaw_alone_shows_makes_no_velocity_early(tmp_path):
    dive, file, name = recorded(calm(11, 4, 0.08, 0.15, seconds=100.0), tmp_path)
    assert dive.gyro is not None
    assert dive.attitude is not None
    turned = {
        name: Signal(signal.time_s + 0.5, signal.value)
        for name, signal in (("gyro", dive.gyro), ("attitude", dive.attitude))
    }
    answer = dated(replace(dive, **turned), file, name)
    assert answer.thrust_delay_s == 0.0
    assert answer.velocity_late_s == pytest.approx(0.08, abs=0.02)
    assert answer.velocity_smoothing_s == pytest.approx(0.15, abs=0.02)


def test_a_smoothing_as_slow_as_the_hull_leaves_its_mass_true(tmp_path):
    """This hull's quadratic drag stops it within a quarter of a second."""
    case = calm(810000, 1, 0.02, 0.2, seconds=120.0)
    dive, file, name = recorded(case, tmp_path)
    fits = _fitted(dated_back(dive, 0.02, 0.2), 0.0, file, name, (SURGE, SWAY), ())
    masses = [np.exp(fit.theta[0]) / case.vehicle.mass[fit.dof] for fit in fits]
    assert masses == pytest.approx([1.0, 1.0], abs=0.02)


def test_a_fit_from_near_by_that_runs_away_begins_anew(tmp_path):
    dive, file, name = recorded(draw(11, 4, NONE, seconds=120.0), tmp_path)
    (first,) = _fitted(dive, 0.0, file, name, (SURGE,), ())
    (again,) = _fitted(
        dive, 0.0, file, name, (SURGE,), [replace(first, theta=np.full_like(first.theta, np.nan))]
    )
    assert again.log_posterior == first.log_posterior


def test_a_delay_of_the_thrusters_is_no_lag(tmp_path):
    dive, file, name = recorded(draw(11, 4, "command_delay", size=1.0, seconds=120.0), tmp_path)
    assert _rough_lag(dive, 0.15, file, name) == 0.0


def rounded(seed=1):
    """A wrench of a step and of quick jitter, the same as several rounded thrusters tell it, and the variance of what
    rounding adds."""
    rng = np.random.default_rng(seed)
    each, n = 0.03, 4000
    true = np.where(np.arange(n) > n // 2, 0.8, 0.0) + rng.normal(0, 0.01, n)
    return true, true + rng.uniform(-each / 2, each / 2, n), np.full(n, each**2 / 12)


def columns(values):
    return np.column_stack([values, *[np.zeros_like(values)] * 5])


def test_more_of_the_likeliest_wrench_is_true_than_of_the_rounded_one():
    true, coarse, variance = rounded()
    likeliest = unrounded(columns(coarse), columns(variance))[:, 0]
    half = slice(100, 1900)
    of_told, of_found = (
        float(np.polyfit(by[half] - np.mean(by[half]), true[half], 1)[0]) for by in (coarse, likeliest)
    )
    assert of_told == pytest.approx(0.01**2 / (0.01**2 + variance[0]), abs=0.05)
    assert of_told + 0.1 < of_found <= 1.0


def test_a_step_far_larger_than_rounding_is_whole_at_once():
    _, coarse, variance = rounded()
    likeliest = unrounded(columns(coarse), columns(variance))[:, 0]
    at = len(coarse) // 2 + 1
    assert likeliest[at] == coarse[at]


def test_no_command_is_changed_by_a_later_one():
    _, coarse, variance = rounded()
    later = coarse.copy()
    later[1000:] += 5.0
    before = slice(0, 991)
    # The spread of the jitter is the dive's, and steps are no part of it.
    likeliest, other = (unrounded(columns(by), columns(variance))[before, 0] for by in (coarse, later))
    assert likeliest == pytest.approx(other, abs=2e-3)


def test_commands_that_are_not_rounded_stay_as_they_are():
    _, coarse, _ = rounded()
    assert unrounded(columns(coarse), np.zeros((len(coarse), 6))) == pytest.approx(columns(coarse), abs=0.0)


def test_thrusts_make_the_wrench_behind_rounded_pulses(tmp_path):
    case = draw(11, 4, NONE, seconds=60.0)
    dive, file, kind = recorded(case, tmp_path)
    shape = file.vehicle.configurations[kind]
    curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
    asked = Signal(dive.pwm.time_s, curve.thrust(dive.pwm.value[:, : len(shape.thrusters)]))
    thrusts = unrounded_thrusts(asked, dive, file, kind)
    history = wrench(dive, file, kind)
    assert np.allclose(thrusts.value @ allocation_matrix(shape).T, history.asked)
    assert not np.allclose(asked.value @ allocation_matrix(shape).T, history.asked, atol=1e-3)


def test_a_grid_is_gone_on_with_until_two_in_a_row_are_far_below_the_best():
    assert not _is_past([100.0, 10.0])
    assert not _is_past([0.0, 100.0, 10.0])
    assert not _is_past([100.0, 80.0, 10.0])
    assert _is_past([0.0, 100.0, 10.0, 60.0])
