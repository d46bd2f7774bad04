"""What is read off a validation dive: lag, overshoot, settled speed, thrust."""

import math
from pathlib import Path

import numpy as np
import pytest

from bench.reproduce.measures import demand, heading, span, steady_speed, turned
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.thrusters import thrust_curve
from identify.dive import Dive, Signal

RATE = math.radians(12)


def turning(lag_s=0.0, past_rad=0.0, way=1.0, offset=0.0) -> Dive:
    """A ramp of 15 s from 7 s on, followed `lag_s` later and past its end at last."""
    time_s = np.arange(0.0, 32.0, 0.05)
    n = len(time_s)
    wanted = way * RATE * np.clip(time_s - 7.0, 0.0, 15.0)
    yaw = way * RATE * np.clip(time_s - 7.0 - lag_s, 0.0, 15.0) + way * past_rad * (time_s > 26.0) + offset
    reference = np.zeros((n, 14))
    reference[:, 5] = way * RATE * ((time_s >= 7.0) & (time_s < 22.0))
    reference[:, 12] = wanted
    attitude = np.column_stack((np.cos(yaw / 2), np.zeros(n), np.zeros(n), np.sin(yaw / 2)))
    return Dive(
        "turn", Path("turn.tlog"), "", attitude=Signal(time_s, attitude), nu_ref=Signal(time_s, reference)
    )


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("offset", [0.0, math.tau])
def test_a_heading_that_trails_a_ramp_lags_by_the_seconds_that_it_trails(way, offset):
    found = turned(turning(lag_s=1.0, way=way, offset=offset))
    assert found.lag_s == pytest.approx(1.0, abs=1e-6)
    assert found.overshoot_deg == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_heading_past_the_end_of_a_turn_overshoots_by_that_angle(way):
    assert turned(turning(past_rad=0.1, way=way)).overshoot_deg == pytest.approx(math.degrees(0.1))


def test_a_heading_over_south_is_no_jump():
    measured, wanted = heading(turning(lag_s=0.5))
    assert np.abs(np.diff(measured.value[:, 0])).max() < 0.02
    assert measured.value[-1, 0] == pytest.approx(wanted.value[-1, 0])


def surging(speed=0.2) -> Dive:
    """20 s at a speed, with 1 s of change before and after; every thruster at 1600 us while steady."""
    time_s = np.arange(0.0, 30.0, 0.05)
    n = len(time_s)
    reference = np.zeros((n, 14))
    reference[:, 0] = np.interp(time_s, [4.0, 5.0, 25.0, 26.0], [0.0, speed, speed, 0.0])
    reference[:, 6] = np.gradient(reference[:, 0], time_s)
    velocity = np.zeros((n, 3))
    velocity[:, 0] = 0.9 * reference[:, 0]
    steady = (time_s > 5.2) & (time_s < 24.8)
    pwm = np.where(steady, 1600.0, 1700.0)[:, None] * np.ones(8)
    return Dive(
        "surge",
        Path("surge.tlog"),
        "",
        velocity=Signal(time_s, velocity),
        nu_ref=Signal(time_s, reference),
        pwm=Signal(time_s[steady], pwm[steady]),
    )


def test_the_settled_speed_is_that_of_the_steady_phase():
    assert steady_speed(surging(), 0) == pytest.approx(0.18)


def test_a_motion_lasts_from_its_first_to_its_last_moment():
    assert span(surging(), 0) == pytest.approx((4.0, 26.0), abs=0.1)


def test_the_demand_is_of_the_four_thrusters_that_push_along():
    file = load_vehicle("ruvifist")
    each = float(thrust_curve(file.vehicle.thrust_curve, file.path.parent).thrust(1600.0))
    found = demand(surging(), file, "survey", 0.2)
    assert found.thrust_n == pytest.approx(4 * each)
    assert found.ideal_power == pytest.approx(4 * each**1.5)
