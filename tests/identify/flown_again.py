"""A dive of the simulated vehicle without bytes, with all that its recording would hold."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from bridge.simulator.direct import Noise, simulate_truth
from bridge.simulator.missions import rest, run, turn
from bridge.simulator.truth import Truth, load_truth
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.legs import Mission
from bridge.vehicle.mode import Mode
from identify.diagnose.result import Accepted, Hull, Value
from identify.dive import Dive, Signal

FILE = load_vehicle("ruvifist:hovering")
TRUTH = load_truth(FILE, "hovering")
HULL = ("M_u", "M_v", "I_r", "D_u", "D_v", "D_r")
FED = {name: TRUTH.model[name] for name in HULL}
BEGAN_S = 1_790_000_000.0

SHORT = Mission(
    "short",
    tuple(
        rest("start", 6.0)
        + run("ahead", 0.4, 0.0, 3.2)
        + rest("between", 3.0)
        + run("aside", 0.0, 0.3, 2.4)
        + rest("before the turn", 3.0)
        + turn("turn", 1.2, 0.2, "smooth")
        + rest("end", 6.0)
    ),
)


def weak(gain: float) -> Truth:
    """The vehicle with a first thruster that gives so much of its curve."""
    return replace(TRUTH, effects={"T1_gain": gain})


def dived(
    truth: Truth,
    fed: Mapping[str, float],
    mode: Mode,
    seed: int,
    file: VehicleFile = FILE,
    began_s: float = BEGAN_S,
) -> Dive:
    flown = simulate_truth(file, "hovering", SHORT, seed=seed, parameters=fed, mode=mode, truth=truth)
    time_s, each, read = flown.time_s, Noise().velocity_ticks, flown.column("nu_fb")
    asked = [actuation.reference for actuation in flown.actuations]
    reference = [(*r.nu, *r.nu_dot, r.heading_rad, r.depth_m) for r in asked]
    signals = {name: Signal(time_s, flown.column(name)) for name in ("tau_pid", "tau_ff", "tau_cmd")}
    flat = {name: np.full((len(time_s), 1), value) for name, value in (("mode", float(mode)), ("cfg", 1.0))}
    return Dive(
        f"{mode.word}-{seed}",
        Path("d.tlog"),
        f"{seed}",
        velocity=Signal(time_s[::each], read[::each, :3]),
        gyro=Signal(time_s, read[:, 3:]),
        attitude=Signal(time_s, flown.state[:, 3:7]),
        nu_ref=Signal(time_s, np.array(reference)),
        pwm=Signal(time_s, flown.column("pwm_us")),
        ff_mode=Signal(time_s, flat["mode"]),
        veh_cfg=Signal(time_s, flat["cfg"]),
        unix_at_boot_s=began_s,
        **signals,
    )


def accepted(values: Mapping[str, float]) -> Accepted:
    return Accepted({name: Value(value, "", value, value) for name, value in values.items()}, (), ())


def fitted(truth: Truth = TRUTH) -> Hull:
    """The fit of a diagnosis that found all of it exactly."""
    force, moment = truth.disturbance_n, truth.disturbance_nm
    return Hull(truth.mass, truth.damping, (force,) * 3 + (moment,) * 3, truth.disturbance_time_s)
