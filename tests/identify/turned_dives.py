"""A dive that only turns, its attitude and gyro exact, for the tests of what holds one against the other."""

from pathlib import Path

import numpy as np

from identify.dive import Dive, Signal
from identify.ingest.rotation import quaternions_from_euler


def turned(time_s, roll, pitch, yaw):
    """A dive of these Euler angles (n,) in rad, zyx; body rates by their kinematics (Fossen 2011, eq. 2.28)."""
    p_dot, q_dot, r_dot = np.gradient(np.stack([roll, pitch, yaw]), time_s, axis=1)
    rates = [
        p_dot - r_dot * np.sin(pitch),
        q_dot * np.cos(roll) + r_dot * np.sin(roll) * np.cos(pitch),
        r_dot * np.cos(roll) * np.cos(pitch) - q_dot * np.sin(roll),
    ]
    return Dive(
        "turned",
        Path("turned.tlog"),
        "0" * 64,
        attitude=Signal(time_s, quaternions_from_euler(roll, pitch, yaw)),
        gyro=Signal(time_s, np.column_stack(rates)),
    )
