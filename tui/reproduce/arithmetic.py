"""Consequences of the paper's own numbers: pure functions, without a simulation."""

import math
from collections.abc import Sequence

from bridge.vehicle.references import DoubleS

STEP_S = 0.01
FRESH_WATER_KG_M3 = 998.2


def longest_distance(samples: float, rate_hz: float, speeds_m_s: Sequence[float]) -> float:
    """Longest total distance, m, of equal laps, one per speed, within that many samples if none is dropped."""
    return len(speeds_m_s) * samples / rate_hz / sum(1 / speed for speed in speeds_m_s)


def acceleration_error(
    missing_kg: float, used_kg: float, damping: float, speed_m_s: float, transient_s: float
) -> float:
    """Mean |v_d - v| in m/s during a double-S acceleration when the feed-forward lacks part of the mass.

    M e_dot + D e = (M - X) v_d_dot for tau = X v_d_dot + D v_d, M = X + missing; the desired acceleration is held
    over steps of 10 ms.
    """
    total = used_kg + missing_kg
    profile = DoubleS(0.0, speed_m_s, transient_s)
    keep = math.exp(-damping / total * STEP_S)
    steps = round(transient_s / STEP_S)
    error = total_error = 0.0
    for k in range(steps):
        slope = profile.at((k + 0.5) * STEP_S)[1]
        before, error = error, keep * error + (1 - keep) * missing_kg * slope / damping
        total_error += 0.5 * (before + error)
    return total_error / steps


def mass_left_out(
    mean_error_m_s: float, used_kg: float, damping: float, speed_m_s: float, transient_s: float
) -> float:
    """Mass, kg, missing from the feed-forward that explains the given mean error while speeding up (by bisection)."""
    low, high = 0.0, 1e3
    for _ in range(60):
        middle = 0.5 * (low + high)
        if acceleration_error(middle, used_kg, damping, speed_m_s, transient_s) < mean_error_m_s:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def hotel_over_thrusters(power_ratio: float, thruster_ratio: float) -> float:
    """Constant load that reduces the thrusters' power ratio to a total of `power_ratio`.

    It is relative to the thrusters' power before the rise: (hotel + thruster_ratio) / (hotel + 1) = power_ratio.
    """
    return (thruster_ratio - power_ratio) / (power_ratio - 1)


def propeller_power(thrust_n: float, inflow_m_s: float, disc_m2: float) -> float:
    """Ideal power, W, of a propeller in water that flows in at `inflow_m_s`: momentum theory (Rankine 1865)."""
    half = 0.5 * inflow_m_s
    return thrust_n * (half + math.sqrt(half**2 + thrust_n / (2 * FRESH_WATER_KG_M3 * disc_m2)))


def steady_share(acceleration: float, steady: float, deceleration: float, overall: float) -> float:
    """Share of steady time that yields `overall` from the three, for equally long acceleration and deceleration."""
    moving = (overall - steady) / (acceleration + deceleration - 2 * steady)
    return 1 - 2 * moving


def lstm_weights(inputs: int, hidden: int, depth: int, head: int, outputs: int) -> int:
    """Number of trainable weights of an LSTM of `depth` layers (PyTorch's: two biases a gate) and two linear layers."""
    first = 4 * hidden * (inputs + hidden + 2)
    further = (depth - 1) * 4 * hidden * (2 * hidden + 2)
    return first + further + (hidden + 1) * head + (head + 1) * outputs
