"""What a motion tells of mass and damping, against the exact Gaussian information and the known figures."""

from dataclasses import replace

import numpy as np
import pytest

from bridge.simulator.missions import Leg, survey
from bridge.vehicle.config import load_vehicle
from identify.planning.information import of_axis, of_motion
from identify.planning.knowledge import NAMES, AxisNoise, before_any_dive
from identify.planning.limits import Tank
from identify.planning.manoeuvres import SURGE, Drive, square

STEP_S = 0.05
MASS, DAMPING = 64.0, 42.0
"""Vehicle A: 64 kg in all, 21 N of drag at 0.5 m/s."""


def square_wave(force_n: float, period_s: float, seconds: float) -> np.ndarray:
    """Velocity under a square wave of force between two rests of 8 s."""
    time_s = np.arange(0.0, seconds + 16.0, STEP_S)
    since_s = time_s - 8.0
    force = force_n * np.sign(np.cos(2 * np.pi * (since_s + 0.25 * STEP_S) / period_s))
    force[(since_s < 0) | (since_s >= seconds)] = 0.0
    keep = np.exp(-DAMPING / MASS * STEP_S)
    velocity = np.zeros(len(time_s))
    for i in range(1, len(time_s)):
        velocity[i] = keep * velocity[i - 1] + (1 - keep) * force[i - 1] / DAMPING
    return velocity


def exact_information(velocity: np.ndarray, noise: AxisNoise, every: int) -> np.ndarray:
    """dm' S^-1 dm of readings every so many steps, the trim force projected out; S by brute force."""
    n = len(velocity)
    keep, gain = np.exp(-DAMPING / MASS * STEP_S), (1 - np.exp(-DAMPING / MASS * STEP_S)) / DAMPING
    answer = gain * np.array([[keep ** (i - 1 - j) if j < i else 0.0 for j in range(n)] for i in range(n)])
    lag = np.abs(np.arange(n)[:, None] - np.arange(n)) * STEP_S
    force = noise.disturbance**2 * np.exp(-lag / noise.time_constant_s)
    acceleration = np.gradient(velocity, STEP_S)
    shapes = np.column_stack(
        [answer @ (-MASS * acceleration), answer @ (-DAMPING * velocity), answer @ np.ones(n)]
    )
    read = slice(0, None, every)
    covariance = (answer @ force @ answer.T)[read, read]
    covariance += noise.velocity / (STEP_S * every) * np.eye(len(covariance))
    whole = shapes[read].T @ np.linalg.solve(covariance, shapes[read])
    return np.asarray(whole[:2, :2] - np.outer(whole[:2, 2], whole[2, :2]) / whole[2, 2])


@pytest.mark.parametrize("period_s", [4.0, 8.0, 16.0])
def test_it_is_the_exact_gaussian_information_within_a_few_percent(period_s: float) -> None:
    noise = AxisNoise(1.0, 1.5, 0.004**2 / 10)
    velocity = square_wave(20.0, period_s, 32.0)
    exact = exact_information(velocity, noise, 2)
    found = of_axis(STEP_S, velocity, MASS, DAMPING, noise)
    # The trim force and the ends of the record, which the spectrum leaves out, cost the slow wave most.
    assert np.sqrt(found) == pytest.approx(np.sqrt(np.diag(exact)), rel=0.08)
    assert abs(exact[0, 1]) < 0.1 * np.sqrt(exact[0, 0] * exact[1, 1])


def test_surge_mass_of_vehicle_a_is_known_to_0_28_percent_by_a_square_wave_and_to_2_85_by_the_lap() -> None:
    """60 s at 1 N; the disturbance's time constant (4.5 s) and the DVL (4 mm/s at 8 Hz) are chosen here."""
    file = load_vehicle("ruvifist:survey")
    shape = replace(file.vehicle.configurations["survey"], dry_mass_kg=45.0)
    file = replace(file, vehicle=replace(file.vehicle, configurations={"survey": shape}))
    knowledge = before_any_dive(file, "survey")
    knowledge = replace(knowledge, values={**knowledge.values, "M_u": MASS, "D_u": DAMPING})
    tank, noise = Tank(file, "survey", knowledge), AxisNoise(1.0, 4.5, 0.004**2 / 8)

    def known_to(legs: list[Leg]) -> float:
        mass, _ = of_axis(STEP_S, tank.dive(legs).nu[:, 0], MASS, DAMPING, noise)
        return float(100 / np.sqrt(mass))

    wave = square(4.0, Drive(SURGE, "push_surge_n", 24.0)).at(1.0, 15)
    lap = [leg for leg in survey().legs if leg.name.startswith("lap 0.5 m/s, ")][:8]
    assert wave.duration_s == 60.0
    assert sum(leg.duration_s for leg in lap) == pytest.approx(61.0)
    assert known_to(wave.legs()) == pytest.approx(0.28, rel=0.1)
    assert known_to(lap) == pytest.approx(2.85, rel=0.12)


def test_a_vehicle_at_rest_tells_nothing() -> None:
    knowledge = before_any_dive(load_vehicle("ruvifist:survey"), "survey")
    assert not of_motion(STEP_S, np.zeros((400, 6)), knowledge, (0, 1, 2, 5)).any()


def test_each_axis_tells_of_its_own_mass_and_damping_alone() -> None:
    knowledge = before_any_dive(load_vehicle("ruvifist:survey"), "survey")
    nu = np.zeros((960, 6))
    nu[:, 1] = square_wave(20.0, 8.0, 32.0)
    found = of_motion(STEP_S, nu, knowledge, (0, 1))
    assert [NAMES[i] for i in np.flatnonzero(np.diag(found))] == ["M_v", "D_v"]


def test_reading_the_place_as_well_can_only_help() -> None:
    velocity, blind = square_wave(20.0, 8.0, 32.0), AxisNoise(0.3, 1.5, 0.02**2 / 5)
    without = of_axis(STEP_S, velocity, MASS, DAMPING, blind)
    seeing = of_axis(STEP_S, velocity, MASS, DAMPING, replace(blind, position=0.001**2 / 10))
    assert seeing[0] > without[0]
    assert seeing[1] > without[1]
