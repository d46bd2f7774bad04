"""Tracking errors of dives whose error is known, and their curves."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.vehicle.references import DoubleS
from identify.dive import Dive, Signal
from identify.validation.tracking import PHASES, compare, phases, tracking_errors, with_reference_rates
from identify.validation.tracking_curves import Followed, followed

RATE_HZ = 20.0
RISE_S, HOLD_S = 5.0, 15.0


def surge_reference():
    """Rest, up to 0.4 m/s in 5 s, hold, down again, rest: times, velocity, derivative."""
    up, down = DoubleS(0.0, 0.4, RISE_S), DoubleS(0.4, 0.0, RISE_S)
    time_s = np.arange(int(40 * RATE_HZ)) / RATE_HZ
    start, stop = 5.0, 5.0 + RISE_S + HOLD_S
    rows = [
        (0.0, 0.0) if t < start else up.at(t - start)[:2] if t < stop else down.at(t - stop)[:2]
        for t in time_s.tolist()
    ]
    velocity, slope = np.array(rows).T
    return time_s, velocity, slope


def dive(offset_m_s=0.0, lag_s=0.0):
    """Surge follows `lag_s` late and `offset_m_s` too fast; the PID pushes 5 N, the feed-forward 3 N."""
    time_s, velocity, slope = surge_reference()
    reference = np.zeros((len(time_s), 14))
    reference[:, 0], reference[:, 6] = velocity, slope
    measured = np.zeros((len(time_s), 3))
    measured[:, 0] = np.interp(time_s - lag_s, time_s, velocity) + offset_m_s
    pid, ff = np.zeros((len(time_s), 6)), np.zeros((len(time_s), 6))
    pid[:, 0], ff[:, 0] = -5.0, 3.0
    return Dive(
        "d", Path("d.tlog"), "0",
        velocity=Signal(time_s, measured), nu_ref=Signal(time_s, reference),
        gyro=Signal(time_s, np.zeros_like(measured)),
        tau_pid=Signal(time_s, pid), tau_ff=Signal(time_s, ff),
    )  # fmt: skip


def test_a_constant_error_is_found_in_every_phase_and_where_bottom_lock_is_lost():
    surge = tracking_errors(dive(offset_m_s=-0.02)).axis("surge")
    assert [surge.phase(name) for name in PHASES] == pytest.approx([0.02] * 4)
    assert surge.unit == "m/s"
    assert (surge.pid_effort, surge.pid_magnitude, surge.pid_minus_ff) == pytest.approx((-5.0, 5.0, 8.0))
    whole = dive(offset_m_s=0.02)
    value = whole.velocity.value.copy()
    value[::3] = np.nan
    without_lock = replace(whole, velocity=Signal(whole.velocity.time_s, value))
    assert tracking_errors(without_lock).axis("surge").overall == pytest.approx(0.02)


def test_readings_whose_times_come_twice_have_the_errors_of_those_that_come_once():
    once = dive(offset_m_s=0.02)
    twice = {
        name: Signal(np.repeat(signal.time_s, 2), np.repeat(signal.value, 2, axis=0))
        for name, signal in once.signals().items()
    }
    (surge,), (of_twice,) = (tracking_errors(each).axes for each in (once, replace(once, **twice)))
    assert of_twice.phase("Overall") == pytest.approx(surge.phase("Overall"))
    assert of_twice.noise == pytest.approx(surge.noise, abs=1e-9)


@pytest.mark.parametrize("unknown", [1, 2])
def test_a_rate_of_turn_that_was_never_read_is_taken_for_none_at_the_dvl(unknown):
    whole = dive(offset_m_s=0.02)
    rates = whole.gyro.value.copy()
    rates[:, unknown] = np.nan
    yawing = replace(whole, gyro=Signal(whole.gyro.time_s, rates))
    assert tracking_errors(yawing, (0.1, 0.2, 0.3)).axis("surge").overall == pytest.approx(0.02)


def test_of_a_reference_that_states_no_derivative_the_phases_are_those_of_its_differences():
    whole = dive()
    value = whole.nu_ref.value.copy()
    value[:, 6] = np.nan
    stated, by_differences = (
        phases(each.nu_ref.value[:, 0], each.nu_ref.value[:, 6])
        for each in (whole, with_reference_rates(replace(whole, nu_ref=Signal(whole.nu_ref.time_s, value))))
    )
    for name in ("acceleration", "steady", "deceleration"):
        assert np.count_nonzero(getattr(stated, name) ^ getattr(by_differences, name)) <= 4
    assert with_reference_rates(whole) is whole


def test_phases_follow_the_reference_derivative():
    time_s, velocity, slope = surge_reference()
    of = phases(velocity, slope)
    # The derivative lies below a twentieth of its peak in the first and last twentieth of each ramp of 1.25 s.
    edge_s = 0.05 * 0.25 * RISE_S
    assert time_s[of.acceleration][[0, -1]] == pytest.approx([5 + edge_s, 10 - edge_s], abs=0.06)
    assert time_s[of.deceleration][[0, -1]] == pytest.approx([25 + edge_s, 30 - edge_s], abs=0.06)
    assert not of.any[time_s < 5.0].any()
    assert not (of.acceleration & of.steady).any()
    backward = phases(-velocity, -slope)
    assert np.array_equal(of.acceleration, backward.acceleration)
    assert np.array_equal(of.deceleration, backward.deceleration)


@pytest.mark.parametrize("lag_s", [0.0, 1.0])
def test_a_late_response_shows_its_delay_and_errors_only_while_the_speed_changes(lag_s):
    surge = tracking_errors(dive(lag_s=lag_s)).axis("surge")
    assert surge.delay_s == pytest.approx(lag_s, abs=0.01)
    # While speeding up the mean error is the reference's rise over the delay.
    assert surge.acceleration == pytest.approx(0.4 / RISE_S * lag_s, rel=0.15, abs=1e-9)
    assert surge.acceleration_less_delay < 1e-3


def test_a_dive_that_ends_at_the_speed_of_its_first_seconds_tells_no_delay():
    """No later motion tells by how much the response is late, and at rest any delay fits as well as another."""
    whole = dive()
    begins_at_speed = tracking_errors(whole.between(6.0, 24.0)).axis("surge")
    assert math.isnan(begins_at_speed.delay_s)
    assert math.isnan(begins_at_speed.acceleration_less_delay)
    assert begins_at_speed.acceleration == pytest.approx(0.0, abs=1e-3)


def test_a_single_reading_beside_the_reference_is_no_response_to_it():
    whole = dive()
    lost = whole.velocity.value.copy()
    lost[(whole.velocity.time_s > 4.0) & (whole.velocity.time_s != 20.0)] = np.nan
    late = replace(
        whole,
        nu_ref=whole.nu_ref.between(5.0, 40.0),
        velocity=Signal(whole.velocity.time_s, lost),
    )
    assert tracking_errors(late).axes == ()


def noisy(sigma_m_s, seed, **how):
    whole = dive(**how)
    noise = sigma_m_s * np.random.default_rng(seed).standard_normal(whole.velocity.value.shape)
    return replace(whole, velocity=Signal(whole.velocity.time_s, whole.velocity.value + noise))


def test_a_sensor_s_noise_is_no_error_of_tracking():
    errors = [tracking_errors(noisy(0.004, seed)).axis("surge") for seed in range(40)]
    # A filter of gain 1/2 at 0.5 Hz lets through 0.0449 of the power of white noise up to 10 Hz.
    left = 0.004 * math.sqrt(0.0449)
    assert np.mean([surge.noise for surge in errors if surge is not None]) == pytest.approx(left, rel=0.02)
    overall = [surge.overall for surge in errors if surge is not None]
    assert np.mean(overall) == pytest.approx(math.sqrt(2 / math.pi) * left, rel=0.05)


def test_an_error_beside_noise_is_found_as_it_is():
    offset_m_s = 0.005
    errors = [tracking_errors(noisy(0.004, seed, offset_m_s=offset_m_s)).axis("surge") for seed in range(20)]
    for phase in PHASES:
        mean = np.mean([surge.phase(phase) for surge in errors if surge is not None])
        assert mean == pytest.approx(offset_m_s, rel=0.05)


def test_the_error_of_the_mean_speed_is_told_by_speed_and_positive_where_it_goes_too_fast_either_way():
    ahead, astern = dive(offset_m_s=0.01), dive(offset_m_s=0.03)
    time_s = np.concatenate([ahead.nu_ref.time_s, 40.0 + astern.nu_ref.time_s])
    reference = np.concatenate([ahead.nu_ref.value, -astern.nu_ref.value])
    velocity = np.concatenate([ahead.velocity.value, -astern.velocity.value])
    both = Dive("d", Path("d"), "0", velocity=Signal(time_s, velocity), nu_ref=Signal(time_s, reference))
    surge = tracking_errors(both).axis("surge")
    (at,) = surge.speeds
    assert (at.speed, at.runs) == (pytest.approx(0.4), 2)
    assert (at.error, at.standard_error) == pytest.approx((0.02, 0.01), abs=1e-6)


def test_a_speed_held_for_less_than_two_seconds_is_no_speed_held():
    short = tracking_errors(dive(offset_m_s=0.01).between(0.0, 11.5)).axis("surge")
    assert short.steady_state == pytest.approx(0.01)
    assert short.speeds == ()


def turning(rate_rad_s):
    """The paper's yaw reference: the rate jumps to its value, and its derivative is never told."""
    time_s = np.arange(800) / RATE_HZ
    reference = np.zeros((800, 14))
    reference[200:600, 5] = rate_rad_s
    gyro = np.zeros((800, 3))
    gyro[:, 2] = reference[:, 5] + 0.01
    return Dive("d", Path("d"), "0", nu_ref=Signal(time_s, reference), gyro=Signal(time_s, gyro))


@pytest.mark.parametrize("rate_rad_s", [0.05, 0.1, math.radians(5.0), math.radians(10.0), math.radians(45.0)])
def test_a_rate_of_turn_that_is_held_is_told_within_half_a_percent(rate_rad_s):
    (at,) = tracking_errors(turning(rate_rad_s)).axis("yaw").speeds
    assert (at.speed, at.error) == (pytest.approx(rate_rad_s, rel=0.005), pytest.approx(0.01))


def test_a_linear_heading_reference_has_only_a_steady_state():
    yaw = tracking_errors(turning(0.1)).axis("yaw")
    assert yaw.steady_state == pytest.approx(0.01)
    assert math.isnan(yaw.acceleration)
    assert math.isnan(yaw.pid_effort)


def test_the_table_compares_modes_row_by_row():
    runs = {"PID": dive(0.03), "feed-forward": dive(0.02), "both": dive(0.01)}
    rows = compare({name: tracking_errors(run) for name, run in runs.items()})
    assert [row.phase for row in rows] == list(PHASES)
    assert {row.axis for row in rows} == {"surge"}
    assert rows[1].values == pytest.approx((0.03, 0.02, 0.01))


def test_curves_are_means_of_what_was_recorded():
    (surge,) = followed(dive(offset_m_s=-0.02), points=100)
    assert (surge.axis, surge.unit, surge.wrench_unit) == ("surge", "m/s", "N")
    assert len(surge.time_s) in (99, 100)
    assert surge.measured - surge.reference == pytest.approx(np.full(len(surge.time_s), -0.02), abs=1e-12)
    assert surge.tau_pid == pytest.approx(np.full(len(surge.time_s), -5.0))
    assert surge.tau_ff == pytest.approx(np.full(len(surge.time_s), 3.0))
    assert np.diff(surge.time_s) == pytest.approx(np.full(len(surge.time_s) - 1, 40 / 100), rel=0.01)


def test_the_dvl_is_carried_to_the_origin():
    whole = dive()
    turning = whole.gyro.value + np.array([0.0, 0.0, 0.1])
    (surge,) = followed(replace(whole, gyro=Signal(whole.gyro.time_s, turning)), (0.0, 0.5, 0.0))
    # A transducer half a metre to starboard runs 0.05 m/s slower than a body that turns to starboard.
    assert surge.measured - surge.reference == pytest.approx(np.full(len(surge.time_s), 0.05), abs=1e-9)


def test_a_dvl_without_bottom_lock_throughout_has_a_curve_without_values():
    whole = dive()
    lost = Signal(whole.velocity.time_s, np.full_like(whole.velocity.value, np.nan))
    (surge,) = followed(replace(whole, velocity=lost))
    assert np.isnan(surge.measured).all()
    assert np.nanmax(surge.reference) == pytest.approx(0.4)


def test_a_gap_stays_a_gap_and_a_slow_signal_is_held():
    whole = dive()
    value = whole.velocity.value.copy()
    out = (whole.velocity.time_s > 12.0) & (whole.velocity.time_s < 16.0)
    value[out] = np.nan
    (surge,) = followed(replace(whole, velocity=Signal(whole.velocity.time_s, value)), points=400)
    assert np.isnan(surge.measured[(surge.time_s > 12.2) & (surge.time_s < 15.8)]).all()
    slow = Signal(whole.velocity.time_s[::10], whole.velocity.value[::10])
    (held,) = followed(replace(whole, velocity=slow), points=400)
    assert np.isfinite(held.measured).all()


def test_what_was_not_recorded_is_unknown_and_a_dive_without_reference_has_neither_curves_nor_errors():
    (surge,) = followed(replace(dive(), tau_ff=None))
    assert np.isnan(surge.tau_ff).all()
    assert set(surge.to_json()["tau_ff"]) == {None}
    assert followed(replace(dive(), nu_ref=None)) == ()
    assert tracking_errors(replace(dive(), nu_ref=None)).axes == ()


def test_what_was_written_is_read_back_and_a_gap_stays_one():
    whole = dive(offset_m_s=1 / 3)
    value = whole.velocity.value.copy()
    value[len(value) // 2 :] = np.nan
    (surge,) = followed(replace(whole, velocity=Signal(whole.velocity.time_s, value)), points=50)
    assert surge.to_json()["measured"][0] == 0.3333
    again = Followed.from_json(json.loads(json.dumps(surge.to_json())))
    assert (again.axis, again.unit, again.wrench_unit) == ("surge", "m/s", "N")
    assert again.time_s == pytest.approx(surge.time_s)
    assert again.tau_pid == pytest.approx(surge.tau_pid)
    assert again.measured == pytest.approx(surge.measured, abs=1e-3, nan_ok=True)
    assert np.isnan(again.measured).any()
