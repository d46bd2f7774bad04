"""Courses to try effects on: still but for what a test says."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bridge.vehicle.config import Configuration, load_vehicle
from identify.effects.course import Course

STEP_S, COUNT = 0.05, 400
LAG_S = 0.05
HOVERING = load_vehicle("ruvifist:hovering").vehicle.configurations["hovering"]
Made = Callable[..., Course]


def whole(value: Any, shape: tuple[int, ...]) -> np.ndarray:
    return np.array(np.broadcast_to(np.asarray(value, dtype=float), shape))


def made(
    nu: Any = 0.0,
    nu_dot: Any = 0.0,
    euler: Any = 0.0,
    asked_n: Any = 0.0,
    depth_m: Any = np.nan,
    altitude_m: Any = np.nan,
    voltage_v: Any = np.nan,
    position_m: Any = 0.0,
    configuration: Configuration = HOVERING,
    lag_s: float = LAG_S,
    count: int = COUNT,
) -> Course:
    k = len(configuration.thrusters)
    return Course(
        configuration,
        100.0 + STEP_S * np.arange(count),
        whole(nu, (count, 6)),
        whole(nu_dot, (count, 6)),
        whole(euler, (count, 3)),
        whole(depth_m, (count,)),
        whole(altitude_m, (count,)),
        whole(position_m, (count, 2)),
        whole(asked_n, (count, k)),
        np.full((count, k), np.nan),
        whole(voltage_v, (count,)),
        lag_s,
        np.array([110.0, 130.0, 140.0, 5.0, 15.0, 16.0]),
        np.array([50.0, 60.0, 90.0, 18.0, 26.0, 25.0]),
    )


def rich() -> Course:
    """Everything moves, everything is recorded."""
    rng = np.random.default_rng(100001)
    time = np.arange(COUNT)[:, None]
    waving = np.sin(time * rng.uniform(0.01, 0.05, (1, 6)) + rng.uniform(0, 6, (1, 6)))
    course = made(
        nu=0.4 * waving,
        nu_dot=0.2 * np.roll(waving, 1, axis=1),
        euler=np.column_stack([0.2 * waving[:, :2], 0.02 * time]),
        asked_n=20.0 * np.sin(time * rng.uniform(0.01, 0.2, (1, 8))),
        depth_m=2.0 + waving[:, 0],
        altitude_m=3.0 + waving[:, 1],
        voltage_v=16.4 - 0.003 * time[:, 0],
        position_m=np.cumsum(waving[:, :2], axis=0) * 0.02,
    )
    return replace(course, quadratic=np.array([40.0, 60.0, 80.0, 3.0, 4.0, 5.0]))


@pytest.fixture
def course() -> Made:
    return made


@pytest.fixture
def rich_course() -> Course:
    return rich()
