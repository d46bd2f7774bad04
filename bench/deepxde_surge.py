"""DeepXDE's inverse problem (Lu, Meng, Mao and Karniadakis 2021, section 2.4) on surge alone, PyTorch back end.

A network of time alone gives the surge velocity u(t). Its residual M u_dot + D u - X(t) is taken at collocation
points, the DVL's readings are point data, M and D are external trainable variables. X(t) is the thrusters' force less
restoring and Coriolis force; the latter is computed with the true masses of the other axes. Needs the extra `bench`.
"""

import contextlib
import math
import os
import time
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from bench.missions import Mission
from bench.missions.mission import draw_one
from bench.prediction import whole_truth
from bench.remembered import Data, Remembered
from bench.stamp import LEARNT, MISSIONS, stamp
from bench.words import paragraph, table
from bridge.vehicle.coefficients import MASSES
from bridge.vehicle.dynamics import coriolis, restoring
from identify.align import aligned
from identify.estimators.table import estimator

Array = NDArray[np.float64]

SOURCES = (*MISSIONS, *LEARNT, "bench/deepxde_surge.py")
RATE_HZ = 10.0
LAYERS = (64, 64, 64)
HIGHEST_HZ = 0.3
LEARNING_RATE = 5e-3
DATA_WEIGHT = 10.0
MINUTES = 2.5
MOST_STEPS = 200_000
SEED = 0


@dataclass(frozen=True)
class Surge:
    """Surge of a dive at even steps: time from the start (n,), measured velocity m/s, force N."""

    time_s: Array
    velocity: Array
    force: Array


def page(cache: Path, seeds: tuple[int, ...]) -> str:
    """The section of docs/benchmarks.md; earlier results are read from `cache`."""
    if find_spec("deepxde") is None:
        return "## DeepXDE's inverse problem\n\nDeepXDE is not installed here (`pip install -e .[bench]`).\n"
    kept = Remembered(cache / f"deepxde-{stamp(*SOURCES)}.jsonl")
    results = kept.fill({str(seed): partial(inverse_problem, seed, MINUTES) for seed in seeds}, "DeepXDE")
    lines = [
        "## DeepXDE's inverse problem",
        "",
        *paragraph(
            f"Surge alone, PyTorch back end: network of time {' x '.join(map(str, LAYERS))}, tanh, behind sines and",
            f"cosines up to {HIGHEST_HZ:g} Hz (without them it never learns a dive's many starts and stops); Adam at",
            f"{LEARNING_RATE:g}; point data at {RATE_HZ:g} Hz, collocation at the same times; both residuals scaled",
            f"by their own rms, data weighted {DATA_WEIGHT:g} to 1; M and D as logarithms, from dry mass and from",
            f"rms force over rms velocity; stopped by the clock after {60 * MINUTES:.0f} s on one core. It is given",
            "the true masses of the other axes for the Coriolis force. Error against the truth, beside that of",
            "`likelihood`, which is given none.",
        ),
        "",
    ]
    rows = []
    for seed, data in results.items():
        errors = [
            f"{100 * (data[kind][name] / data['truth'][name] - 1):+.1f} %" if name in data[kind] else "-"
            for kind in ("deepxde", "likelihood")
            for name in ("M_u", "D_u")
        ]
        ours_s, likelihood_s = data["seconds"]
        ours = *errors[:2], data["steps"], f"{ours_s:.0f}"
        rows.append((f"{seed}, {data['kind']}", *ours, *errors[2:], f"{likelihood_s:.1f}"))
    head = ("mission", "M_u", "D_u", "steps", "seconds", "likelihood M_u", "likelihood D_u", "seconds")
    return "\n".join([*lines, *table(head, rows), ""])


def inverse_problem(seed: int, minutes: float) -> Data:
    """M_u and D_u by DeepXDE and by `likelihood`, with the truth."""
    mission = draw_one(seed)
    begun = time.perf_counter()
    values, steps = solved(surge_of(mission), mission.drawn.configuration.dry_mass_kg, minutes)
    middle = time.perf_counter()
    identified = estimator("likelihood")(
        mission.dive, mission.file, mission.configuration, lambda *_report: None
    )
    return {
        "kind": mission.kind,
        "truth": {name: mission.truth[name] for name in ("M_u", "D_u")},
        "deepxde": values,
        "likelihood": {name: v for name, v in identified.values().items() if name in ("M_u", "D_u")},
        "steps": steps,
        "seconds": [middle - begun, time.perf_counter() - middle],
    }


def surge_of(mission: Mission) -> Surge:
    """Surge of a mission without filtering; velocities between readings are interpolated."""
    shape = mission.drawn.configuration
    grid = aligned(mission.dive, mission.file, mission.configuration, RATE_HZ, RATE_HZ / 2)
    truth = whole_truth(mission)
    turning = coriolis([truth[c.name] for c in MASSES], list(grid.nu.T))[0]
    g = restoring(shape, list(grid.attitude.T))[0]
    good = grid.valid
    return Surge((grid.time_s - grid.time_s[0])[good], grid.nu[good, 0], (grid.tau[:, 0] - turning - g)[good])


def solved(surge: Surge, dry_mass_kg: float, minutes: float) -> tuple[dict[str, float], int]:
    """Return M_u and D_u, and the number of steps within the time.

    Sets global state of torch and DeepXDE, so run it in a process of its own.
    """
    os.environ["DDE_BACKEND"] = "pytorch"
    with contextlib.ExitStack() as stack:
        silent = stack.enter_context(Path(os.devnull).open("w", encoding="utf-8"))
        stack.enter_context(contextlib.redirect_stdout(silent))
        stack.enter_context(contextlib.redirect_stderr(silent))
        import deepxde as dde

        return _trained(dde, surge, dry_mass_kg, minutes)


def _trained(dde: Any, surge: Surge, dry_mass_kg: float, minutes: float) -> tuple[dict[str, float], int]:
    dde.config.set_random_seed(SEED)
    speed, push = (float(np.sqrt(np.mean(x**2))) for x in (surge.velocity, surge.force))
    logs = [dde.Variable(math.log(start)) for start in (dry_mass_kg, push / speed)]
    at, end_s = surge.time_s[:, None], float(surge.time_s[-1])
    waves = math.pi / end_s * torch.arange(1, int(2 * HIGHEST_HZ * end_s) + 1)

    def features(t: Tensor) -> Tensor:
        return torch.cat([torch.sin(t * waves), torch.cos(t * waves)], dim=1)

    def residual(t: Tensor, u: Tensor, force: Tensor) -> Tensor:
        mass, damping = (torch.exp(log) for log in logs)
        slope: Tensor = dde.grad.jacobian(u, t)
        return (speed * (mass * slope + damping * u) - force) / push

    def force_at(t: Array) -> Array:
        return np.interp(t[:, 0], surge.time_s, surge.force)[:, None].astype(np.float32)

    data = dde.data.PDE(
        dde.geometry.TimeDomain(0.0, end_s),
        residual,
        [dde.icbc.PointSetBC(at, surge.velocity[:, None] / speed)],
        anchors=at,
        auxiliary_var_function=force_at,
    )
    network = dde.nn.FNN([2 * len(waves), *LAYERS, 1], "tanh", "Glorot uniform")
    network.apply_feature_transform(features)
    model = dde.Model(data, network)
    model.compile(
        "adam", lr=LEARNING_RATE, loss_weights=[1.0, DATA_WEIGHT], external_trainable_variables=logs
    )
    _, state = model.train(
        iterations=MOST_STEPS, display_every=MOST_STEPS, callbacks=[dde.callbacks.Timer(minutes)]
    )
    values = [math.exp(float(log)) for log in logs]
    return dict(zip(("M_u", "D_u"), values, strict=True)), int(state.step)
