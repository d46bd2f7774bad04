"""Runs of simulated missions: drawn by seed, flown forward by commands."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.accuracy.prediction import Starts, moved, run_forward, starts, whole_truth
from bench.missions.manoeuvres import MANOEUVRES, Leg, sampled
from bench.missions.mission import draw_one
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.dynamics import acceleration, restoring
from identify.checks.actuation.controller import feedback_doubts
from identify.dive import Dive, Signal
from identify.thrust.wrench import wrench

SEEDS = range(100_000, 100_024)


@pytest.fixture(scope="module")
def missions():
    return [draw_one(seed) for seed in SEEDS]


def test_a_seed_gives_the_same_mission_alone_and_among_others(missions):
    alone = draw_one(SEEDS[3])
    assert alone.dive.sha256 == missions[3].dive.sha256
    assert alone.file.sha256 == missions[3].file.sha256
    assert alone.truth == missions[3].truth


def test_another_repeat_changes_the_water_and_nothing_else():
    first, second = draw_one(SEEDS[0]), draw_one(SEEDS[0], repeat=1)
    assert first.file == second.file
    assert np.array_equal(first.dive.nu_ref.value, second.dive.nu_ref.value)
    assert not np.array_equal(first.nu, second.nu)


def test_vehicles_and_sensors_lie_within_what_the_page_says(missions):
    for mission in missions:
        shape = mission.drawn.configuration
        assert 11.0 <= shape.dry_mass_kg <= 120.0
        assert 0.05 <= mission.file.vehicle.thrust_curve.lag_s <= 0.25
        assert 4.0 - 1e-6 <= mission.dive.velocity.rate_hz <= 10.0 + 1e-6
        assert 0.002 <= mission.sensors.dvl_m_s <= 0.006
        assert 59.0 <= mission.dive.duration_s <= 300.0
        assert set(mission.truth) <= set(BY_NAME)
        assert (mission.dive.fog is not None) == (mission.file.vehicle.sensors.fog is not None)


def test_vehicles_stay_upright_under_water_and_follow_what_is_asked(missions):
    for mission in missions:
        _, x, y, _ = mission.attitude.T
        assert np.min(1 - 2 * (x * x + y * y)) > np.cos(np.radians(60.0))
        assert np.min(mission.position[:, 2]) > 1.0
        assert np.max(np.abs(mission.position[:, 2] - mission.dive.nu_ref.value[:, 13])) < 1.5
        assert np.max(np.abs(mission.nu[:, :3])) < 2.0


def test_the_true_motion_obeys_the_models_equations():
    mission = draw_one(100_002)
    drawn, dive = mission.drawn, mission.dive
    forces = wrench(dive, mission.file, mission.configuration)
    inner = slice(20, -20)
    nu = 0.5 * (mission.nu[1:] + mission.nu[:-1])
    attitude = 0.5 * (mission.attitude[1:] + mission.attitude[:-1])
    push = 0.5 * (mission.disturbance[1:] + mission.disturbance[:-1]) + drawn.trim
    tau = forces.mean_between(mission.time_s[:-1], mission.time_s[1:]) + push
    expected = np.column_stack(
        acceleration(drawn.mass, drawn.damping, nu.T, tau.T, restoring(drawn.configuration, attitude.T))
    )
    nu_dot = np.diff(mission.nu, axis=0) / np.diff(mission.time_s)[:, None]
    for dof in range(6):
        left = np.std((nu_dot - expected)[inner, dof])
        assert left < 0.15 * np.std(nu_dot[inner, dof]), f"axis {dof}"


def test_readings_are_the_truth_and_their_own_noise(missions):
    for mission in missions[:8]:
        dive, sensors = mission.dive, mission.sensors
        arm = np.array(mission.file.vehicle.sensors.dvl.mounting.position_m)
        nu = np.column_stack(
            [np.interp(dive.velocity.time_s, mission.time_s, mission.nu[:, i]) for i in range(6)]
        )
        error = np.diff(dive.velocity.value - nu[:, :3] - np.cross(nu[:, 3:], arm), axis=0) / np.sqrt(2)
        assert np.nanstd(error) == pytest.approx(sensors.dvl_m_s, rel=0.25)
        ticks = np.searchsorted(dive.gyro.time_s, mission.time_s - 1e-6)
        assert np.std(dive.gyro.value[ticks] - mission.nu[:, 3:]) == pytest.approx(
            sensors.gyro_rad_s, rel=0.1
        )


def test_a_fog_reading_is_the_mean_over_the_interval_around_its_date(missions):
    mission = next(m for m in missions if m.dive.fog is not None)
    fog = mission.dive.fog
    expected = np.interp(fog.time_s, mission.time_s, mission.nu[:, 5])
    late = np.interp(fog.time_s - 0.05, mission.time_s, mission.nu[:, 5])
    error = np.std(fog.value[:, 0] - expected)
    assert error < 0.05 * np.std(expected)
    assert error < np.std(fog.value[:, 0] - late)


@pytest.mark.soak
def test_the_controller_used_what_is_recorded(missions):
    for mission in missions:
        assert feedback_doubts(mission.dive, mission.file.vehicle.water) == ()


def test_the_disturbance_is_as_large_and_as_slow_as_it_says():
    mission = draw_one(100_001, seconds=2000.0)
    push = mission.disturbance / mission.drawn.disturbance_std
    step = round(1.0 / mission.dive.pwm.rate_hz / (mission.time_s[1] - mission.time_s[0]))
    keep = np.exp(-step * (mission.time_s[1] - mission.time_s[0]) / mission.drawn.disturbance_time_s)
    correlation = [np.corrcoef(push[step:, i], push[:-step, i])[0, 1] for i in range(6)]
    assert np.std(push) == pytest.approx(1.0, abs=0.1)
    assert correlation == pytest.approx(keep, abs=0.03)


@pytest.mark.soak
def test_every_manoeuvre_is_drawn():
    assert {draw_one(seed).kind for seed in range(100_100, 100_160)} == set(MANOEUVRES)


def test_a_ramp_goes_from_speed_to_speed_with_an_acceleration_that_is_its_slope():
    time_s = 0.01 * np.arange(1000)
    wanted = sampled([Leg(6.0, (0.5, 0.0, 0.0, 0.2), ramp_s=2.0)], time_s, depth_m=3.0)
    slope = np.gradient(wanted[:, 0], time_s)
    assert wanted[150, 0] == 0.0
    assert wanted[450, 0] == pytest.approx(0.5)
    assert np.max(np.abs(slope[5:700] - wanted[5:700, 6])) < 0.02
    assert wanted[700, 12] == pytest.approx(0.2 * (5.0 - 1.0), abs=0.01)


def _weightless():
    file = load_vehicle("ruvifist:survey")
    shape = replace(file.vehicle.configurations["survey"], net_buoyancy_n=0.0)
    return replace(file, vehicle=replace(file.vehicle, configurations={"survey": shape}))


FILE = _weightless()
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
MODEL = {
    "M_u": 100.0, "M_v": 140.0, "M_w": 150.0, "I_p": 4.0, "I_q": 20.0, "I_r": 20.0,
    "D_u": 50.0, "D_v": 90.0, "D_w": 110.0, "D_p": 14.0, "D_q": 34.0, "D_r": 20.0,
}  # fmt: skip


def _idle(seconds=30.0):
    thrusters = len(FILE.vehicle.configurations["survey"].thrusters)
    time_s = np.arange(0.0, seconds, 0.05)
    return Dive("idle", Path("idle.tlog"), "0", pwm=Signal(time_s, np.full((len(time_s), thrusters), 1500.0)))


def _start(velocity):
    return Starts(np.array([1.0]), LEVEL[None], np.array([velocity]))


def test_a_vehicle_that_coasts_covers_mass_times_speed_over_damping():
    gone = run_forward(_start([0.5, 0, 0, 0, 0, 0]), _idle(), FILE, "survey", MODEL, np.zeros(6))
    whole = 0.5 * MODEL["M_u"] / MODEL["D_u"] * (1 - np.exp(-10.0 * MODEL["D_u"] / MODEL["M_u"]))
    assert gone[0, :2] == pytest.approx([whole, 0.0], abs=1e-6)


def test_a_steady_force_alone_moves_it_at_force_over_damping_after_the_transient():
    trim = np.array([5.0, 0, 0, 0, 0, 0])
    gone = run_forward(_start([0.0] * 6), _idle(), FILE, "survey", MODEL, trim)
    lag_s = MODEL["M_u"] / MODEL["D_u"]
    whole = 5.0 / MODEL["D_u"] * (10.0 - lag_s * (1 - np.exp(-10.0 / lag_s)))
    assert gone[0, 0] == pytest.approx(whole, abs=1e-6)


def test_a_model_that_runs_away_is_lost_and_the_others_are_not():
    begin = Starts(np.array([1.0, 1.0]), np.tile(LEVEL, (2, 1)), np.array([[0.5, 0, 0, 0, 0, 0], [0.0] * 6]))
    gone = run_forward(begin, _idle(), FILE, "survey", {**MODEL, "D_u": -500.0}, np.zeros(6))
    assert np.isnan(gone[0]).all()
    assert gone[1] == pytest.approx([0.0] * 3, abs=1e-9)


def test_true_parameters_follow_a_calm_dive_closer_than_wrong_ones():
    mission = draw_one(100_003)
    begin = starts(mission.dive, mission.file)
    true = moved(mission.time_s, mission.position, begin.time_s)
    model = whole_truth(mission)
    wrong = {**model, "D_u": 1.5 * model["D_u"], "D_v": 1.5 * model["D_v"]}
    off = [
        np.linalg.norm(
            run_forward(begin, mission.dive, mission.file, mission.configuration, m, mission.drawn.trim)
            - true,
            axis=1,
        )
        for m in (model, wrong)
    ]
    assert np.sqrt(np.mean(off[0] ** 2)) < 0.7 * np.sqrt(np.mean(off[1] ** 2))


def test_windows_start_at_readings_and_end_within_the_dive():
    mission = draw_one(100_003)
    begin = starts(mission.dive, mission.file)
    assert len(begin) > 3
    assert np.isin(begin.time_s, mission.dive.velocity.time_s).all()
    assert (np.diff(begin.time_s) > 0.9 * 10.0).all()
    assert begin.time_s[-1] + 10.0 <= mission.dive.velocity.time_s[-1]


def test_after_a_gap_in_the_velocity_no_reading_begins_two_windows():
    mission = draw_one(100_003)
    velocity = mission.dive.velocity
    lost = (velocity.time_s > 20.0) & (velocity.time_s < 55.0)
    value = np.where(lost[:, None], np.nan, velocity.value)
    begin = starts(replace(mission.dive, velocity=Signal(velocity.time_s, value)), mission.file)
    assert (np.diff(begin.time_s) > 0.0).all()
    assert len(begin) > 1
