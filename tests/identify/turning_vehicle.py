"""A vehicle that moves by a formula, and its readings without noise: whatever is asked of them has an exact answer."""

import numpy as np

from identify.ingest.files.streams import Stream
from identify.ingest.rotation import euler_angles, quaternions_from_euler, to_body, to_body_turn, to_earth

GRAVITY_M_S2 = 9.80665
STEP_S = 0.02


def readings(duration_s: float = 40.0, size: float = 1.0) -> dict[str, np.ndarray]:
    """Readings by name: body axes forward, right, down; SI; the pulses of four thrusters in us. size: of all angles."""
    t = np.arange(0.0, duration_s, STEP_S)
    roll, pitch = 0.15 * size * np.sin(1.1 * t), 0.2 * size * np.sin(0.7 * t + 0.4)
    yaw = size * (1.2 * np.sin(0.3 * t) + 0.02 * t)
    q = quaternions_from_euler(roll, pitch, yaw)
    turn = to_body_turn(q[:-1], q[1:]) / STEP_S
    rates = np.vstack([turn[:1], 0.5 * (turn[1:] + turn[:-1]), turn[-1:]])
    velocity = np.column_stack([0.4 + 0.3 * np.sin(0.5 * t), 0.15 * np.sin(0.9 * t), 0.2 * np.sin(0.6 * t)])
    down = to_earth(q, velocity)[:, 2]
    depth = 5.0 + np.concatenate([[0.0], np.cumsum(0.5 * (down[1:] + down[:-1]) * STEP_S)])
    gravity = to_body(q, np.tile((0.0, 0.0, GRAVITY_M_S2), (len(t), 1)))
    force = np.gradient(velocity, STEP_S, axis=0) + np.cross(rates, velocity) - gravity
    pulses = 1500.0 + 200.0 * np.sin(np.outer(t, [0.5, 0.6, 0.7, 0.8]))
    roll, pitch, yaw = euler_angles(q)
    return {
        "t": t, "attitude": q, "euler": np.column_stack([roll, pitch, yaw]), "gyro": rates, "velocity": velocity,
        "depth": depth, "pressure": 101325.0 + 9900.0 * depth, "force": force, "pulses": pulses,
    }  # fmt: skip


def table(columns: dict[str, np.ndarray]) -> tuple[Stream, ...]:
    """A file with one table."""
    return (Stream("", columns, {}),)


def usual(read: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The columns of a table with the names that most people give."""
    columns = {"t": read["t"]}
    for names, key in (("uvw", "velocity"), ("pqr", "gyro"), (("roll", "pitch", "yaw"), "euler")):
        columns |= dict(zip(names, read[key].T, strict=True))
    columns |= dict(zip(("ax", "ay", "az"), read["force"].T, strict=True))
    columns |= {"depth": read["depth"], "pressure": read["pressure"]}
    return columns | {f"T{k + 1}": pulse for k, pulse in enumerate(read["pulses"].T)}
