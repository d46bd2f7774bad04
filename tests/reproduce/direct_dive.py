"""Dives for tests of the reproduction: the real controller on the simulated body, without bytes."""

from pathlib import Path

import numpy as np

from bridge.simulator.direct import simulate_truth
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.legs import Mission
from bridge.vehicle.mode import Mode
from identify.dive import Dive, Signal


def dive(
    file: VehicleFile, configuration, mission: Mission, mode: Mode, coefficients=None, seed=100_001
) -> Dive:
    """A dive with the signals of a recording; velocity with a little noise, the rest exact."""
    run = simulate_truth(file, configuration, mission, seed=seed, parameters=coefficients, mode=mode)
    rng = np.random.default_rng(seed)
    time_s, n = run.time_s, len(run.time_s)

    def of(value) -> Signal:
        return Signal(time_s, np.asarray(value, dtype=float).reshape(n, -1))

    reference = [
        (*a.reference.nu, *a.reference.nu_dot, a.reference.heading_rad, a.reference.depth_m)
        for a in run.actuations
    ]
    return Dive(
        mission.name,
        Path(f"{mission.name}.tlog"),
        "2" * 64,
        velocity=of(run.nu[:, :3] + 0.003 * rng.standard_normal((n, 3))),
        gyro=of(run.nu[:, 3:]),
        attitude=of(run.state[:, 3:7]),
        pwm=of(run.column("pwm_us")),
        tau_pid=of(run.column("tau_pid")),
        tau_ff=of(run.column("tau_ff")),
        tau_cmd=of(run.column("tau_cmd")),
        nu_ref=of(reference),
        ff_mode=of(np.full(n, float(mode))),
    )
