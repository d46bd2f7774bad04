"""A vehicle that tumbles: its righting arm is weak, its thrusters turn it over in roll, in pitch too if asked to."""

from pathlib import Path

import numpy as np

from bridge.vehicle.config import Configuration, ThrustCurve, Vehicle, VehicleFile
from bridge.vehicle.dynamics import acceleration, restoring
from identify.dive import Dive, Signal

MASS = (34.0, 40.0, 46.0, 0.9, 1.1, 1.3)
DAMPING = (20.0, 30.0, 35.0, 0.8, 1.0, 1.2)
SHAPE = Configuration(
    dry_mass_kg=24.0,
    inertia_kgm2=(0.6, 0.7, 0.9),
    thrusters=(),
    centre_of_gravity_below_buoyancy_m=0.008,
    thruster_limit_n=20.0,
)
FILE = VehicleFile(
    Path("tumbling.yaml"),
    Vehicle("tumbling", {"only": SHAPE}, thrust_curve=ThrustCurve(lag_s=0.0)),
    None,
    "0" * 64,
)
STEP_S, EVERY = 0.01, 5
RATE_NOISE, TILT_NOISE, VELOCITY_NOISE = 0.004, 0.001, 0.005


def dive(over: float, seconds: float = 150.0, seed: int = 3, pitching: float = 0.4, **kept: bool) -> Dive:
    """Pulses of `over` N m in roll and `pitching` N m in pitch, pushes of 10 N ahead, rates of turn and attitude at
    20 Hz, the velocity too; a small disturbance. kept: of `gyro` and `velocity`, False for what is not recorded."""
    rng = np.random.default_rng(seed)
    n = int(seconds / STEP_S)
    tau = np.zeros((n, 6))
    for dof, size in ((0, 10.0), (1, 6.0), (2, 6.0), (3, over), (4, pitching), (5, 1.0)):
        at = 0
        while at < n:
            last = at + int(rng.uniform(1.0, 4.0) / STEP_S)
            tau[at:last, dof] = size * rng.uniform(-1.0, 1.0)
            at = last
    push = tau + _coloured(rng, n) * np.array([0.2, 0.2, 0.2, 0.01, 0.01, 0.01])
    nu, attitude = _flown(push)
    time_s = STEP_S * np.arange(n)
    read = slice(None, None, EVERY)
    rows = len(time_s[read])
    quiet = attitude[read] + 0.5 * TILT_NOISE * rng.normal(size=(rows, 4))
    rates = nu[read, 3:] + RATE_NOISE * rng.normal(size=(rows, 3))
    velocity = nu[read, :3] + VELOCITY_NOISE * rng.normal(size=(rows, 3))
    return Dive(
        "tumbling",
        Path("tumbling.csv"),
        "1" * 64,
        tau_cmd=Signal(time_s, tau),
        attitude=Signal(time_s[read], quiet / np.linalg.norm(quiet, axis=1, keepdims=True)),
        gyro=Signal(time_s[read], rates) if kept.get("gyro", True) else None,
        velocity=Signal(time_s[read], velocity) if kept.get("velocity", True) else None,
    )


def _coloured(rng: np.random.Generator, n: int) -> np.ndarray:
    """(n, 6) of standard deviation 1 and a memory of 2 s."""
    keep = np.exp(-STEP_S / 2.0)
    out = np.zeros((n, 6))
    for k in range(1, n):
        out[k] = keep * out[k - 1] + np.sqrt(1 - keep**2) * rng.normal(size=6)
    return out


def _flown(push: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocities (n, 6) and attitudes (n, 4) under a wrench (n, 6), held over each step; by the midpoint rule."""
    nu, q = np.zeros(6), np.array([1.0, 0.0, 0.0, 0.0])
    told, turned = np.zeros((len(push), 6)), np.zeros((len(push), 4))
    for k, tau in enumerate(push):
        told[k], turned[k] = nu, q
        middle_nu, middle_q = nu + 0.5 * STEP_S * _faster(nu, q, tau), q + 0.5 * STEP_S * _turning(nu, q)
        nu, q = nu + STEP_S * _faster(middle_nu, middle_q, tau), q + STEP_S * _turning(middle_nu, middle_q)
        q = q / np.linalg.norm(q)
    return told, turned


def _faster(nu: np.ndarray, q: np.ndarray, tau: np.ndarray) -> np.ndarray:
    g = restoring(SHAPE, tuple(q.tolist()))
    return np.array(acceleration(MASS, DAMPING, tuple(nu.tolist()), tuple(tau.tolist()), g))


def _turning(nu: np.ndarray, q: np.ndarray) -> np.ndarray:
    w, x, y, z = q.tolist()
    p, r_, r = nu[3:].tolist()
    return 0.5 * np.array(
        [-x * p - y * r_ - z * r, w * p + y * r - z * r_, w * r_ + z * p - x * r, w * r + x * r_ - y * p]
    )
