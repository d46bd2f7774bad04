"""The model run forward by commands alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.forward import WINDOW_S, Starts, earth, moved, run_forward, starts, turning
from bench.missions.mission import draw_one
from bench.prediction import whole_truth
from bridge.vehicle.config import VehicleFile, load_vehicle
from identify.dive import Dive, Signal


def _weightless() -> VehicleFile:
    file = load_vehicle("ruvifist:survey")
    shape = replace(file.vehicle.configurations["survey"], net_buoyancy_n=0.0)
    return replace(file, vehicle=replace(file.vehicle, configurations={"survey": shape}))


FILE = _weightless()
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
MODEL = {
    "M_u": 100.0, "M_v": 140.0, "M_w": 150.0, "I_p": 4.0, "I_q": 20.0, "I_r": 20.0,
    "D_u": 50.0, "D_v": 90.0, "D_w": 110.0, "D_p": 14.0, "D_q": 34.0, "D_r": 20.0,
}  # fmt: skip


def _idle(seconds: float = 30.0) -> Dive:
    thrusters = len(FILE.vehicle.configurations["survey"].thrusters)
    time_s = np.arange(0.0, seconds, 0.05)
    return Dive("idle", Path("idle.tlog"), "0", pwm=Signal(time_s, np.full((len(time_s), thrusters), 1500.0)))


def _start(velocity: list[float]) -> Starts:
    return Starts(np.array([1.0]), LEVEL[None], np.array([velocity]))


def test_a_vehicle_that_coasts_covers_mass_times_speed_over_damping() -> None:
    gone = run_forward(_start([0.5, 0, 0, 0, 0, 0]), _idle(), FILE, "survey", MODEL, np.zeros(6))
    whole = 0.5 * MODEL["M_u"] / MODEL["D_u"] * (1 - np.exp(-WINDOW_S * MODEL["D_u"] / MODEL["M_u"]))
    assert gone[0, :2] == pytest.approx([whole, 0.0], abs=1e-6)


def test_a_steady_force_alone_moves_it_at_force_over_damping_after_the_transient() -> None:
    trim = np.array([5.0, 0, 0, 0, 0, 0])
    gone = run_forward(_start([0.0] * 6), _idle(), FILE, "survey", MODEL, trim)
    lag_s = MODEL["M_u"] / MODEL["D_u"]
    whole = 5.0 / MODEL["D_u"] * (WINDOW_S - lag_s * (1 - np.exp(-WINDOW_S / lag_s)))
    assert gone[0, 0] == pytest.approx(whole, abs=1e-6)


def test_a_model_that_runs_away_is_lost_and_the_others_are_not() -> None:
    begin = Starts(np.array([1.0, 1.0]), np.tile(LEVEL, (2, 1)), np.array([[0.5, 0, 0, 0, 0, 0], [0.0] * 6]))
    gone = run_forward(begin, _idle(), FILE, "survey", {**MODEL, "D_u": -500.0}, np.zeros(6))
    assert np.isnan(gone[0]).all()
    assert gone[1] == pytest.approx([0.0] * 3, abs=1e-9)


def test_true_parameters_follow_a_calm_dive_closer_than_wrong_ones() -> None:
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


def test_windows_start_at_readings_and_end_within_the_dive() -> None:
    mission = draw_one(100_003)
    assert mission.dive.velocity is not None
    begin = starts(mission.dive, mission.file)
    assert len(begin) > 3
    assert np.isin(begin.time_s, mission.dive.velocity.time_s).all()
    assert (np.diff(begin.time_s) > 0.9 * WINDOW_S).all()
    assert begin.time_s[-1] + WINDOW_S <= mission.dive.velocity.time_s[-1]


def test_a_quarter_turn_brings_ahead_to_east() -> None:
    half = np.sqrt(0.5)
    east = earth(np.array([[half, 0.0, 0.0, half]]), np.array([[1.0, 0.0, 0.0]]))
    assert east[0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)


def test_a_yaw_rate_turns_the_attitude_by_half_of_itself() -> None:
    assert turning(LEVEL[None], np.array([[0.0, 0.0, 0.2]]))[0] == pytest.approx([0.0, 0.0, 0.0, 0.1])
