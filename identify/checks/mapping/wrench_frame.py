"""Whether a recorded wrench is in axes forward, left, up: the motion goes against it where that turns round."""

import numpy as np

from identify.checks.mapping.mend import FLU, Mend, scaled
from identify.checks.sensors.correlation import CLEAR, EDGE_S, WINDOW_S, readings, window_edges
from identify.checks.sensors.scales import edge_means, integral
from identify.dive import Dive, Signal

MIRRORED, KEPT = (1, 2, 4, 5), (0, 3)
"""Sway, heave, pitch and yaw, which turn round between forward, left, up and forward, right, down; and the others."""

NAMES = "X", "Y", "Z", "K", "M", "N"


def wrench_mends(dive: Dive) -> tuple[Mend, ...]:
    """A wrench in axes forward, left, up: against the motion where that turns round, and nowhere else."""
    wrench = readings(dive.tau_cmd)
    if wrench is None:
        return ()
    follows: dict[int, float] = {}
    for first, moved in ((0, readings(dive.velocity)), (3, readings(dive.gyro))):
        if moved is not None:
            follows |= {first + k: _follows(wrench, moved, first + k, k) for k in range(3)}
    against = {dof: by for dof, by in follows.items() if by < -CLEAR}
    if not against or set(against) & {*KEPT} or any(follows.get(dof, 0.0) > CLEAR for dof in MIRRORED):
        return ()
    evidence = ", ".join(f"{NAMES[dof]} {by:.2f}" for dof, by in against.items())
    problem = (
        "The wrench is in axes forward, left, up (FLU, as in ROS), not FRD: the motion goes against it (correlation of "
        f"{evidence})"
    )
    return (scaled("tau_cmd", FLU * 2, problem),)


def _follows(wrench: Signal, moved: Signal, dof: int, axis: int) -> float:
    """Correlation of a force, means over windows, with its least-squares fit by inertia, drag and a steady part;
    negative if both oppose it, 0 if unclear."""
    edges_s = window_edges((wrench, moved))
    if edges_s is None:
        return 0.0
    force = np.diff(integral(wrench.time_s, wrench.value[:, dof], edges_s)) / WINDOW_S
    speed = edge_means(moved.time_s, moved.value, edges_s, EDGE_S)[:, axis]
    parts = np.column_stack([np.diff(speed), 0.5 * (speed[1:] + speed[:-1]), np.ones(len(force))])
    known = np.isfinite(parts).all(axis=1) & np.isfinite(force)
    parts, force = parts[known], force[known]
    if len(force) < parts.shape[1] or not (force.std() and parts[:, 0].std()):
        return 0.0
    size = np.linalg.lstsq(parts, force, rcond=None)[0]
    if size[0] * size[1] < 0:
        return 0.0
    return float(np.sign(size[0]) * np.corrcoef(parts @ size, force)[0, 1])
